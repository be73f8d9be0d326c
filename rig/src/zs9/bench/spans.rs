//! The rows of the trace at one step, and the sums over the current row.

use crate::bench::{Rows, Tick, Timeline};
use crate::plant::zs9::{Adder, MotorMeans};
use crate::zs9::trace::{MotorRow, Row};
use tractive::ports::DualReport;

/// The sums over a row, each value times its time, in steps.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    steps: f64,
    torque_refs: [f64; 2],
    loads: [f64; 2],
    source_v: f64,
    shorted: f64,
}

/// The plant at the instant at which a row ends, and control's report until then.
pub struct Seen {
    pub source_v: f64,
    pub line_a: Option<f64>,
    pub source_j: f64,
    pub explained_j: f64,
    pub speeds_rpm: [f64; 2],
    pub report: DualReport,
}

/// The rows at one step.
pub struct Spans {
    rows: Rows<Row>,
    /// Rows until the end.
    wanted: u64,
    sums: Sums,
    plant: Adder,
}

impl Spans {
    /// No rows yet, from the recording's beginning on, for a duration in s.
    pub fn new(step_s: f64, duration_s: f64, time: &Timeline) -> Self {
        let rows = Rows::new(step_s, duration_s, time);
        Self { wanted: rows.until(duration_s), rows, sums: Sums::default(), plant: Adder::default() }
    }

    /// The time at which the next row ends.
    pub const fn next(&self) -> Tick {
        self.rows.next
    }

    /// The same, to be changed.
    pub const fn next_mut(&mut self) -> &mut Tick {
        &mut self.rows.next
    }

    /// Ends the recording at a time, in s, unless it ends before.
    pub fn end_at(&mut self, end_s: f64) {
        self.wanted = self.wanted.min(self.rows.until(end_s));
    }

    /// Makes the recording endless.
    pub const fn end_never(&mut self) {
        self.wanted = u64::MAX;
    }

    /// `true` if the last row has ended.
    pub fn are_all(&self) -> bool {
        self.rows.has(self.wanted)
    }

    /// Lets this many steps pass with this source, these torque references and loads, and a link that is shorted or not.
    pub fn pass(
        &mut self,
        steps: f64,
        source_v: f64,
        (refs_nm, loads_nm): ([f32; 2], [f64; 2]),
        shorted: bool,
    ) {
        let sums = &mut self.sums;
        sums.steps += steps;
        sums.source_v += steps * source_v;
        for k in 0..2 {
            sums.torque_refs[k] += steps * f64::from(refs_nm[k]);
            sums.loads[k] += steps * loads_nm[k];
        }
        if shorted {
            sums.shorted += steps;
        }
    }

    /// Takes the plant's sums since the last row of any step; keeps the row that ends now, if it has begun.
    pub fn record(&mut self, plant: &Adder, seen: &Seen, time: &Timeline) {
        self.plant.append(plant);
        if self.next() != time.now {
            return;
        }
        let (sums, plant) = (std::mem::take(&mut self.sums), std::mem::take(&mut self.plant));
        let wanted = time.now > time.lead && !self.are_all();
        // A line filter's voltage moves within the step.
        let source_v = seen.line_a.map_or(seen.source_v, |_| sums.source_v / sums.steps);
        let means = plant.means(source_v).filter(|_| wanted);
        let motor = |k: usize, means: &MotorMeans| MotorRow {
            speed_rpm: means.speed_rpm,
            torque_ref_nm: sums.torque_refs[k] / sums.steps,
            torque_nm: means.torque_nm,
            id_a: means.id_a,
            iq_a: means.iq_a,
            phases_a: means.phases_a,
            load_nm: sums.loads[k] / sums.steps,
            voltage_v: seen.report.voltage_v[k].into(),
            weakening: seen.report.weakening[k],
        };
        let row = means.map(|means| Row {
            t_s: self.rows.begun_s(),
            motors: [0, 1].map(|k| motor(k, &means.motors[k])),
            link_v: means.link_v,
            capacitor_v: means.capacitor_v,
            inductor_a: means.inductor_a,
            source_v: sums.source_v / sums.steps,
            line_a: seen.line_a,
            duty: sums.shorted / sums.steps,
            scheme: seen.report.scheme,
            trip: seen.report.trip,
            source_j: seen.source_j,
            kinetic_speed_rpm: seen.speeds_rpm,
            explained_j: seen.explained_j,
        });
        self.rows.push(row, time);
    }

    /// Takes the rows so far.
    pub fn take(&mut self) -> Vec<Row> {
        self.rows.take()
    }

    /// The rows so far.
    pub fn as_slice(&self) -> &[Row] {
        self.rows.as_slice()
    }

    /// All rows.
    pub fn into_vec(self) -> Vec<Row> {
        self.rows.into_vec()
    }
}
