//! The trace.

use super::Bench;
use super::spans::{Seen, Spans};
use crate::bench::{Simulated, Tick, Timeline};
use crate::zs9::trace::{Edge, Recording};
use tractive::recorder::DualRecord;
use tractive::time::Instant;

impl Simulated for Bench {
    type Record = DualRecord;
    type Recording = Recording;

    fn time(&self) -> &Timeline {
        &self.time
    }

    fn is_done(&self) -> bool {
        self.rows.are_all() && self.written.as_ref().is_none_or(Spans::are_all)
    }

    fn progress(&self) -> f64 {
        let end_s = self.settings.lead_s + self.settings.duration_s;
        ((self.time.now - self.time.origin) as f64 * self.time.step_s / end_s).min(1.0)
    }

    fn has_control(&self, instant: Instant) -> bool {
        self.spoiler.injected.has_control(self.instant_s(instant))
    }

    fn loads_from(&mut self, instant: Instant, loads_nm: [f64; 2]) {
        self.loads.push(self.time.widen(instant), loads_nm);
    }

    fn end_at(&mut self, instant: Instant) {
        let end_s = self.instant_s(instant);
        for spans in [Some(&mut self.rows), self.written.as_mut()].into_iter().flatten() {
            spans.end_at(end_s);
        }
    }

    fn into_recording(self, records: Vec<DualRecord>) -> Recording {
        let recorded = records
            .into_iter()
            .map(|record| (self.time.seconds(self.time.widen(record.at)), record))
            .collect();
        let edge =
            |(at, gate, on): &(Tick, u8, bool)| Edge { t_s: self.time.seconds(*at), gate: *gate, on: *on };
        let edges = self.gates.edges.iter().map(edge).collect();
        let written = self.written.map(Spans::into_vec);
        Recording { rows: self.rows.into_vec(), written, keeps_edges: self.settings.edges, edges, recorded }
    }
}

impl Bench {
    /// The time at which the next row ends.
    pub(super) fn next_row(&self) -> Tick {
        let written = self.written.as_ref().map_or(Tick::MAX, Spans::next);
        self.rows.next().min(written)
    }

    /// Ends the rows that are due now, if they have begun.
    pub(super) fn record(&mut self) {
        let sums = self.plant.take_sums();
        let seen = Seen {
            source_v: self.plant.source_v,
            line_a: self.filter.map(|filter| filter.choke_a),
            source_j: self.plant.energies.source_j,
            explained_j: self.plant.energies.source_j - self.plant.residual_j(0.0),
            speeds_rpm: self.speeds_rpm(),
            report: self.control.report,
        };
        for spans in [Some(&mut self.rows), self.written.as_mut()].into_iter().flatten() {
            spans.record(&sums, &seen, &self.time);
        }
        self.control.show(self.time.now);
    }
}
