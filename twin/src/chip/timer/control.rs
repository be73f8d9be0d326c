//! The ways to start and move a timer from outside: its control register, events by software, an encoder's tracks.

use super::{ARR, BIF, CEN, CMS, CR1, DIR, ECR, IDXIF, SR, Timer, Tracks};
use crate::finding::Findings;
use crate::time::Time;

impl Timer {
    /// Counts the edges of an encoder's tracks.
    pub fn follow(&mut self, tracks: Tracks) {
        let Some(counts) = tracks.counts else { return };
        let before = self.followed.replace(counts).unwrap_or(counts);
        if !self.is_encoder() || self.word(CR1) & CEN == 0 || before == counts {
            return;
        }
        let turn = i64::from(self.word(ARR)) + 1;
        let moved = (i64::from(self.base.0) + counts - before).rem_euclid(turn);
        let passes = counts.div_euclid(tracks.turn) != before.div_euclid(tracks.turn);
        self.base.0 = moved as u32;
        if passes && tracks.has_index && self.word(ECR) & 1 != 0 {
            self.base.0 = counts.rem_euclid(tracks.turn).min(turn - 1) as u32;
            self.words[SR / 4] |= IDXIF;
        }
    }

    pub(super) fn control(&mut self, value: u32, now: Time, cycle: Time, findings: &mut Findings) {
        let name = self.name;
        // Counting up and down, the direction is only read.
        let up = value & DIR == 0 || value & CMS != 0;
        findings.expect(up && value & 0b10 == 0 && value & CMS <= 1 << 5, || {
            format!("{name}.CR1: {value:#x}: only counting up, and up and down in mode 1, is modelled")
        });
        let before = self.word(CR1);
        findings.expect(before & CEN == 0 || (before ^ value) & CMS == 0, || {
            format!("{name}.CR1.CMS is changed while the counter runs")
        });
        let started = value & CEN != 0 && before & CEN == 0;
        self.base = (self.position(now, cycle), if started { now } else { self.base.1 });
        self.words[0] = value;
    }

    pub(super) fn generate(&mut self, value: u32, now: Time, findings: &mut Findings) {
        findings.expect(value & !0x81 == 0, || format!("{}.EGR: {value:#x} is not modelled", self.name));
        if value & 1 != 0 {
            self.update(0, now, true);
        }
        if value & 1 << 7 != 0 {
            self.break_now(BIF);
        }
    }
}
