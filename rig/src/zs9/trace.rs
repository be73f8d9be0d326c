//! The files that a run of the ZS9 leaves behind. They are written whole or not at all.

use crate::columns;
use crate::files::{Cell, Columns, bytes_of_rows, write_edges, write_recorder, write_rows};
use crate::rows::Timed;
use crate::trace::{Recorded, degrees, name_of};
use anyhow::Result;
use std::path::Path;
use tractive::nine_switch::Scheme;
use tractive::protection::Trip;
use tractive::recorder::DualRecord;

/// Names of the gates in edges.csv, in the modulator's order.
const GATES: [&str; 9] = ["uh", "vh", "wh", "um", "vm", "wm", "ul", "vl", "wl"];

/// A gate edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// The time, in s from the recording's beginning.
    pub t_s: f64,
    /// The gate, in the order of [`tractive::nine_switch::GATES`].
    pub gate: u8,
    /// On or off.
    pub on: bool,
}

/// One motor in one line of the trace: mean values over its step.
#[derive(Clone, Copy, Debug)]
pub struct MotorRow {
    /// Mechanical speed, in r/min.
    pub speed_rpm: f64,
    /// Torque that control demands, in N·m.
    pub torque_ref_nm: f64,
    /// Air-gap torque, in N·m.
    pub torque_nm: f64,
    /// d current, in A.
    pub id_a: f64,
    /// q current, in A.
    pub iq_a: f64,
    /// Phase currents, in A.
    pub phases_a: [f64; 3],
    /// Load, in N·m.
    pub load_nm: f64,
    /// Commanded peak phase voltage, in V, at the step's end.
    pub voltage_v: f64,
    /// `true` if the voltage limit determines the operating point.
    pub weakening: bool,
}

/// One line of trace.csv, and the energies at its end.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// Beginning of the step, in s from the recording's beginning.
    pub t_s: f64,
    /// Upper motor, lower motor.
    pub motors: [MotorRow; 2],
    /// Link voltage outside shoot-through, v1 + v2 − U_dc, in V.
    pub link_v: f64,
    /// Capacitor voltage, mean of both, in V.
    pub capacitor_v: f64,
    /// Inductor current, mean of both, in A.
    pub inductor_a: f64,
    /// Source voltage at the network, in V: behind a line filter that of its capacitor, and while the contactors are open that of the network's own.
    pub source_v: f64,
    /// Current out of the line at the step's end, in A; `None` without a line filter.
    pub line_a: Option<f64>,
    /// Share of the step in which a leg shorted the link.
    pub duty: f64,
    /// The place of the zero vectors.
    pub scheme: Scheme,
    /// The latched fault.
    pub trip: Option<Trip>,
    /// Energy from the source until the step's end, in J.
    pub source_j: f64,
    /// Speeds at the step's end, in r/min.
    pub kinetic_speed_rpm: [f64; 2],
    /// Energy in losses, at the shafts and stored at the step's end, in J: [`Row::source_j`] should equal it except for a constant.
    pub explained_j: f64,
}

/// A whole run.
pub struct Recording {
    /// Rows of the trace, at the step at which they are judged.
    pub rows: Vec<Row>,
    /// Rows of trace.csv, if it has another step.
    pub written: Option<Vec<Row>>,
    /// `true` if edges were kept.
    pub keeps_edges: bool,
    /// Those edges.
    pub edges: Vec<Edge>,
    /// The records of the drive's flight recorder, with their times in s from the recording's beginning; empty without a fault.
    pub recorded: Vec<(f64, DualRecord)>,
}

impl Timed for Row {
    fn t_s(&self) -> f64 {
        self.t_s
    }
}

impl Row {
    fn columns(&self) -> Columns<27> {
        let [one, two] = &self.motors;
        let number = |value: f64| Cell::plain(value as f32);
        let [a1, b1, c1] = one.phases_a.map(number);
        let [a2, b2, c2] = two.phases_a.map(number);
        columns! {
            t_s: Cell::short(self.t_s, 1e9),
            speed1_rpm: number(one.speed_rpm), speed2_rpm: number(two.speed_rpm),
            te1_ref_nm: number(one.torque_ref_nm), te2_ref_nm: number(two.torque_ref_nm),
            te1_nm: number(one.torque_nm), te2_nm: number(two.torque_nm),
            id1_a: number(one.id_a), iq1_a: number(one.iq_a),
            id2_a: number(two.id_a), iq2_a: number(two.iq_a),
            ia1_a: a1, ib1_a: b1, ic1_a: c1, ia2_a: a2, ib2_a: b2, ic2_a: c2,
            uin_v: number(self.link_v), vc_v: number(self.capacitor_v),
            il_a: number(self.inductor_a), udc_v: number(self.source_v),
            d_sh: number(self.duty), scheme: self.scheme.name(),
            tl1_nm: number(one.load_nm), tl2_nm: number(two.load_nm), fault: name_of(self.trip),
            line_a: self.line_a.map_or(Cell::Missing, number),
        }
    }
}

fn recorder_columns((t_s, record): &(f64, DualRecord)) -> Columns<20> {
    let DualRecord { currents_a: [one, two], angles: [angle1, angle2], torque_nm, state, .. } = record;
    let [angle1, angle2] = [angle1, angle2].map(|angle| Cell::plain(degrees(*angle) as f32));
    columns! {
        t_s: Cell::short(*t_s, 1e9),
        ia1_a: Cell::plain(one.a), ib1_a: Cell::plain(one.b), ic1_a: Cell::plain(one.c),
        ia2_a: Cell::plain(two.a), ib2_a: Cell::plain(two.b), ic2_a: Cell::plain(two.c),
        angle1_deg: angle1, angle2_deg: angle2,
        uin_v: Cell::plain(record.link_v()), vc_v: Cell::plain(record.capacitor_v),
        udc_v: Cell::plain(record.source_v), il_a: Cell::plain(record.inductor_a),
        te1_ref_nm: Cell::plain(torque_nm[0]), te2_ref_nm: Cell::plain(torque_nm[1]),
        d_sh: Cell::plain(record.duty), scheme: state.scheme.name(),
        enabled: state.enabled, pulsing: state.pulsing,
        fault: state.fault.map_or("", |fault| fault.name()),
    }
}

impl Recording {
    /// Rows of trace.csv.
    pub fn written(&self) -> &[Row] {
        self.written.as_ref().unwrap_or(&self.rows)
    }

    /// The bytes of trace.csv.
    pub fn trace_bytes(&self) -> Result<Vec<u8>> {
        bytes_of_rows(self.written().iter().map(Row::columns))
    }
}

impl Recorded for Recording {
    fn lowest_id_a(&self) -> f64 {
        let motors = self.rows.iter().flat_map(|row| &row.motors);
        motors.map(|motor| motor.id_a).fold(f64::INFINITY, f64::min)
    }

    fn trip(&self) -> Option<Trip> {
        self.rows.iter().find_map(|row| row.trip)
    }

    fn end_s(&self) -> f64 {
        self.rows.last().map_or(0.0, |row| row.t_s)
    }

    fn write_trace(&self, path: &Path) -> Result<()> {
        write_rows(path, self.written().iter().map(Row::columns))
    }

    fn write_recorder(&self, path: &Path) -> Result<()> {
        write_recorder(path, &self.recorded, recorder_columns)
    }

    /// Edges lie on a grid of 1.25 ns, and are written to a hundredth of a nanosecond.
    fn write_events(&self, folder: &Path) -> Result<()> {
        let edge = |edge: &Edge| (Cell::short(edge.t_s, 1e11), GATES[usize::from(edge.gate)], edge.on);
        if !self.keeps_edges {
            return Ok(());
        }
        write_edges(&folder.join("edges.csv"), self.edges.iter().map(edge))
    }
}
