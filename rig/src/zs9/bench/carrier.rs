//! The carrier's periods as toggles of the gates.

use super::{Bench, BenchError};
use crate::bench::Tick;
use crate::inject::zs9::Kind;
use crate::zs9::settings::with_dead_time;

impl Bench {
    /// Begins the next period at a valley.
    pub(super) fn begin_period(&mut self) -> Result<(), BenchError> {
        let nothing = BenchError::NothingToPlay { what: "carrier period", at_s: self.time.now_s() };
        let period = self.next.take().ok_or(nothing)?;
        self.toggles.clear();
        if self.off {
            return Ok(());
        }
        if let Some(Kind::Gate(gate, false)) = self.spoiler.injected.kind(self.time.now_s()) {
            let pause = &period.gates[usize::from(gate)];
            let drive = with_dead_time(self.settings.drive, self.settings.dead_time_s);
            // Dead times may swallow a pulse that is shorter.
            if pause.off_to - pause.off_from < drive.longest_pause_steps() {
                self.observed.makes_a_difference(self.time.now);
            }
        }
        let half = self.period / 2;
        let mut ordered = self.gates.ordered;
        for (gate, pause) in (0_u8..).zip(&period.gates) {
            let (from, to) = (Tick::from(pause.off_from), Tick::from(pause.off_to));
            let paused = from < to;
            ordered[usize::from(gate)] = !(paused && from == 0);
            let ends = [(from, paused && from > 0), (to, paused && to < half)];
            for (at, _) in ends.into_iter().filter(|(_, counts)| *counts) {
                self.toggles.push((self.begun + at, gate));
                self.toggles.push((self.begun + self.period - at, gate));
            }
        }
        self.toggles.sort_unstable_by_key(|(at, gate)| (std::cmp::Reverse(*at), *gate));
        self.gates.order(self.time.now, ordered);
        Ok(())
    }

    /// The actual states of the gates: a stuck gate does not follow its order.
    pub(super) fn real_levels(&self) -> [bool; 9] {
        let mut levels = self.gates.levels;
        match self.spoiler.injected.kind(self.time.now_s()) {
            // Once the gates are turned off for good, the drivers are held off, whatever the orders.
            Some(Kind::Gate(gate, on)) if !self.off => levels[usize::from(gate)] = on,
            Some(Kind::ShootThrough(leg)) if !self.off => {
                for gate in [leg, leg + 3, leg + 6] {
                    levels[usize::from(gate)] = true;
                }
            }
            _ => {}
        }
        levels
    }
}
