//! The trace.

use super::rows::Rows;
use super::{Bench, LineSide, Simulated, Timeline};
use crate::trace::{Extremes, Recording, Row, Switch, Tick, degrees};
use tractive::modulation::{CarrierHalf, Mode};
use tractive::recorder::Record;
use tractive::time::Instant;

impl Simulated for Bench {
    type Record = Record;
    type Recording = Recording;

    fn time(&self) -> &Timeline {
        &self.time
    }

    fn is_done(&self) -> bool {
        self.time.now > self.end
    }

    fn progress(&self) -> f64 {
        self.time.now as f64 / self.end as f64
    }

    fn has_control(&self, instant: Instant) -> bool {
        self.spoiler.injected.has_control(self.instant_s(instant))
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
            rows: self.rows.into_vec(),
            written: self.written.map(Rows::into_vec),
            switches: self.switches,
            edges,
            recorded,
            slots: self.slots,
            link: self.dc.operated().map(LineSide::balance),
            lead: self.time.lead,
            tick_s: self.time.step_s,
            observations: self.observations,
            found: self.found,
            beside: Vec::new(),
        }
    }
}

impl Bench {
    pub(super) fn note_switch(&mut self, next: &CarrierHalf) {
        let from = self.inverter.half().mode;
        if next.mode != from {
            let boundary = if from.carriers() > 0 { self.inverter.half().end_angle() } else { None };
            self.switches.push(Switch {
                t_s: self.time.now_s(),
                from,
                to: next.mode,
                pulse_angle_deg: boundary.map(degrees),
                speed_rpm: self.plant.motor.speed_rpm(),
            });
        }
    }

    /// The time at which the next row is due.
    pub(super) fn next_row(&self) -> Tick {
        let written = self.written.as_ref().map_or(Tick::MAX, |rows| rows.next);
        self.rows.next.min(written)
    }

    pub(super) fn record(&mut self) {
        self.control.show(self.time.now);
        let row = |rows: &Rows<Row>| (self.time.now <= self.end).then(|| self.row(rows.next_s()));
        let due = |rows: &Rows<Row>| rows.next == self.time.now;
        let judged = due(&self.rows).then(|| row(&self.rows));
        let written = self.written.as_ref().filter(|rows| due(rows)).map(row);
        if let Some(row) = judged {
            self.rows.push(row, &self.time);
            self.extremes = Extremes::NONE;
        }
        if let (Some(rows), Some(row)) = (&mut self.written, written) {
            rows.push(row, &self.time);
        }
    }

    fn row(&self, t_s: f64) -> Row {
        let (id_a, iq_a) = self.plant.motor.currents_dq();
        let [ia_a, ib_a, ic_a] = self.plant.motor.currents_abc();
        let te_nm = self.plant.motor.torque_nm();
        let report = &self.control.report;
        Row {
            t_s,
            speed_rpm: self.plant.motor.speed_rpm(),
            te_ref_nm: report.torque_nm.into(),
            te_nm,
            id_ref_a: report.id_a.into(),
            iq_ref_a: report.iq_a.into(),
            id_a,
            iq_a,
            ia_a,
            ib_a,
            ic_a,
            u_v: report.voltage_v.into(),
            udc_v: self.udc_v(t_s),
            line_a: self.dc.line_a(),
            f1_hz: (report.omega / std::f32::consts::TAU).into(),
            map_error: report.map_error.into(),
            flowing_nm: report.flowing_nm.into(),
            mode: if self.inverter.safe().is_some() { Mode::Off } else { self.inverter.half().mode },
            trip: report.trip,
            status: self.dc.operated().and_then(|line| line.status),
            extremes: self.extremes.with([ia_a, ib_a, ic_a], te_nm, id_a),
        }
    }
}
