//! The trace.

use super::Bench;
use crate::bench::{Simulated, Tick, Timeline};
use crate::zs9::trace::{Edge, MotorRow, Recording, Row};
use tractive::recorder::DualRecord;
use tractive::time::Instant;

impl Simulated for Bench {
    type Record = DualRecord;
    type Recording = Recording;

    fn time(&self) -> &Timeline {
        &self.time
    }

    fn is_done(&self) -> bool {
        self.rows.len() >= self.rows_wanted
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
        self.rows_wanted = self.rows_wanted.min((end_s / self.settings.trace_step_s).round() as usize);
    }

    fn into_recording(self, records: Vec<DualRecord>) -> Recording {
        let recorded = records
            .into_iter()
            .map(|record| (self.time.seconds(self.time.widen(record.at)), record))
            .collect();
        let edge =
            |(at, gate, on): &(Tick, u8, bool)| Edge { t_s: self.time.seconds(*at), gate: *gate, on: *on };
        let edges = self.gates.edges.iter().map(edge).collect();
        Recording { rows: self.rows, keeps_edges: self.settings.edges, edges, recorded }
    }
}

impl Bench {
    /// Ends the row that ends now, if one has begun.
    pub(super) fn record(&mut self) {
        let sums = std::mem::take(&mut self.sums);
        let means = self.plant.take_means();
        if self.time.now > self.time.lead
            && !self.is_done()
            && let Some(means) = means
        {
            let motors = [0, 1].map(|k| {
                let motor = &means.motors[k];
                MotorRow {
                    speed_rpm: motor.speed_rpm,
                    torque_ref_nm: sums.torque_refs[k] / sums.steps,
                    torque_nm: motor.torque_nm,
                    id_a: motor.id_a,
                    iq_a: motor.iq_a,
                    phases_a: motor.phases_a,
                    load_nm: sums.loads[k] / sums.steps,
                    voltage_v: self.control.report.voltage_v[k].into(),
                    weakening: self.control.report.weakening[k],
                }
            });
            self.rows.push(Row {
                t_s: (self.taken + self.rows.len()) as f64 * self.settings.trace_step_s,
                motors,
                link_v: means.link_v,
                capacitor_v: means.capacitor_v,
                inductor_a: means.inductor_a,
                source_v: sums.source_v / sums.steps,
                duty: sums.shorted / sums.steps,
                scheme: self.control.report.scheme,
                trip: self.control.report.trip,
                source_j: self.plant.energies.source_j,
                kinetic_speed_rpm: self.speeds_rpm(),
                explained_j: self.plant.energies.source_j - self.plant.residual_j(0.0),
            });
        }
        let end_s = (self.taken + self.rows.len() + 1) as f64 * self.settings.trace_step_s;
        self.next_row = self.time.row_end(end_s);
        self.control.show(self.time.now);
    }
}
