//! The trace.

use super::{Bench, LineSide, Simulated};
use crate::trace::{Recording, Row, Switch, degrees};
use tractive::modulation::{CarrierPeriod, Mode};
use tractive::recorder::Record;
use tractive::time::Instant;

impl Simulated for Bench {
    type Record = Record;
    type Recording = Recording;

    fn is_done(&self) -> bool {
        self.time.now > self.end
    }

    fn progress(&self) -> f64 {
        self.time.now as f64 / self.end as f64
    }

    fn has_control(&self, instant: Instant) -> bool {
        self.spoiler.injected.has_control(self.instant_s(instant))
    }

    fn instant_s(&self, instant: Instant) -> f64 {
        self.time.seconds(self.time.widen(instant))
    }

    fn loads_from(&mut self, instant: Instant, [load_nm, _]: [f64; 2]) {
        self.loads.push(self.time.widen(instant), load_nm);
    }

    fn end_at(&mut self, instant: Instant) {
        self.end = self.end.min(self.time.widen(instant));
    }

    fn into_recording(self, records: Vec<Record>) -> Recording {
        let recorded = records.into_iter().map(|record| (self.instant_s(record.at), record)).collect();
        let edges = self.inverter.edges().to_vec();
        Recording {
            rows: self.rows,
            switches: self.switches,
            edges,
            recorded,
            slots: self.slots,
            link: self.dc.operated().map(LineSide::balance),
            lead: self.time.lead,
            tick_s: self.time.step_s(),
        }
    }
}

impl Bench {
    pub(super) fn note_switch(&mut self, next: &CarrierPeriod) {
        let from = self.inverter.half().mode;
        if next.mode != from {
            let boundary = if from.carriers() > 0 { self.inverter.half().end_angle() } else { None };
            self.switches.push(Switch {
                t_s: self.time.now_s(),
                from,
                to: next.mode,
                pulse_angle_deg: boundary.map(degrees),
                speed_rpm: self.plant.speed_rpm(),
            });
        }
    }

    pub(super) fn record(&mut self) {
        self.control.show(self.time.now);
        if self.time.now <= self.end {
            let (id, iq) = self.plant.currents_dq();
            let [ia, ib, ic] = self.plant.currents_abc();
            let half = self.inverter.half();
            let report = &self.control.report;
            let mode = if self.inverter.is_safe() { Mode::Off } else { half.mode };
            let t_s = self.rows_done as f64 * self.trace_step_s;
            self.rows.push(Row {
                t_s,
                speed_rpm: self.plant.speed_rpm(),
                te_ref_nm: report.torque_nm.into(),
                te_nm: self.plant.torque_nm(),
                id_ref_a: report.id_a.into(),
                iq_ref_a: report.iq_a.into(),
                id_a: id,
                iq_a: iq,
                ia_a: ia,
                ib_a: ib,
                ic_a: ic,
                u_v: report.voltage_v.into(),
                udc_v: self.udc_v(t_s),
                f1_hz: report.frequency_hz.into(),
                map_error: report.map_error.into(),
                mode,
                trip: report.trip,
                status: self.dc.operated().and_then(LineSide::status),
            });
        }
        self.rows_done += 1;
        let next_s = self.rows_done as f64 * self.trace_step_s;
        self.next_row = self.time.row_end(next_s);
    }
}
