//! What a run of the ZS9 leaves behind. Files are written whole or not at all.

use crate::files::{forget, write_whole};
use crate::rows::Timed;
use crate::trace::degrees;
use anyhow::Result;
use std::path::Path;
use tractive::nine_switch::Scheme;
use tractive::protection::Trip;
use tractive::recorder::DualRecord;

/// Names of the gates in edges.csv, in the order of the modulator's.
const GATES: [&str; 9] = ["uh", "vh", "wh", "um", "vm", "wm", "ul", "vl", "wl"];

/// A gate edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// When, in s from the recording's beginning.
    pub t_s: f64,
    /// Which gate, in the order of [`tractive::nine_switch::GATES`].
    pub gate: u8,
    /// On or off.
    pub on: bool,
}

/// One motor in one line of the trace: mean values over its step.
#[derive(Clone, Copy, Debug)]
pub struct MotorRow {
    /// Mechanical speed, in r/min.
    pub speed_rpm: f64,
    /// Torque that control wants, in N·m.
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
    /// Whether the voltage limit holds the operating point.
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
    /// Source voltage, in V.
    pub source_v: f64,
    /// Share of the step in which a leg shorted the link.
    pub duty: f64,
    /// Where the zero vectors lie.
    pub scheme: Scheme,
    /// The latched fault.
    pub trip: Option<Trip>,
    /// Energy from the source until the step's end, in J.
    pub source_j: f64,
    /// Speeds at the step's end, in r/min.
    pub kinetic_speed_rpm: [f64; 2],
    /// Energy in losses, at the shafts and stored at the step's end, in J: what [`Row::source_j`] should be but for a constant.
    pub explained_j: f64,
}

/// A whole run.
pub struct Recording {
    /// Rows of the trace.
    pub rows: Vec<Row>,
    /// Gate edges, if they were kept.
    pub edges: Vec<Edge>,
    /// What the drive's flight recorder holds, with its times in s from the recording's beginning; empty without a fault.
    pub recorded: Vec<(f64, DualRecord)>,
}

const COLUMNS: [&str; 26] = [
    "t_s",
    "speed1_rpm",
    "speed2_rpm",
    "te1_ref_nm",
    "te2_ref_nm",
    "te1_nm",
    "te2_nm",
    "id1_a",
    "iq1_a",
    "id2_a",
    "iq2_a",
    "ia1_a",
    "ib1_a",
    "ic1_a",
    "ia2_a",
    "ib2_a",
    "ic2_a",
    "uin_v",
    "vc_v",
    "il_a",
    "udc_v",
    "d_sh",
    "scheme",
    "tl1_nm",
    "tl2_nm",
    "fault",
];

/// Columns of recorder.csv.
const RECORDER: [&str; 20] = [
    "t_s",
    "ia1_a",
    "ib1_a",
    "ic1_a",
    "ia2_a",
    "ib2_a",
    "ic2_a",
    "angle1_deg",
    "angle2_deg",
    "uin_v",
    "vc_v",
    "udc_v",
    "il_a",
    "te1_ref_nm",
    "te2_ref_nm",
    "d_sh",
    "scheme",
    "enabled",
    "pulsing",
    "fault",
];

impl Timed for Row {
    fn t_s(&self) -> f64 {
        self.t_s
    }
}

impl Row {
    fn fields(&self) -> [String; 26] {
        let [one, two] = &self.motors;
        let number = |value: f64| (value as f32).to_string();
        let [a1, b1, c1] = one.phases_a.map(number);
        let [a2, b2, c2] = two.phases_a.map(number);
        [
            short(self.t_s, 1e9),
            number(one.speed_rpm),
            number(two.speed_rpm),
            number(one.torque_ref_nm),
            number(two.torque_ref_nm),
            number(one.torque_nm),
            number(two.torque_nm),
            number(one.id_a),
            number(one.iq_a),
            number(two.id_a),
            number(two.iq_a),
            a1,
            b1,
            c1,
            a2,
            b2,
            c2,
            number(self.link_v),
            number(self.capacitor_v),
            number(self.inductor_a),
            number(self.source_v),
            number(self.duty),
            self.scheme.name().to_owned(),
            number(one.load_nm),
            number(two.load_nm),
            self.trip.map_or("", |trip| trip.fault.name()).to_owned(),
        ]
    }
}

/// A number rounded to one of so many parts, so that it prints short.
fn short(value: f64, parts: f64) -> String {
    ((value * parts).round() / parts).to_string()
}

impl Recording {
    /// The first fault, if the drive tripped.
    pub fn trip(&self) -> Option<Trip> {
        self.rows.iter().find_map(|row| row.trip)
    }

    /// Writes trace.csv.
    pub fn write_trace(&self, path: &Path) -> Result<()> {
        write_whole(path, |out| {
            out.write_record(COLUMNS)?;
            for row in &self.rows {
                out.write_record(row.fields())?;
            }
            Ok(())
        })
    }

    /// Writes recorder.csv, if a fault has frozen the flight recorder; else takes away what an earlier run has left.
    pub fn write_recorder(&self, path: &Path) -> Result<()> {
        if self.recorded.is_empty() {
            return forget(path);
        }
        write_whole(path, |out| {
            out.write_record(RECORDER)?;
            for (t_s, record) in &self.recorded {
                let DualRecord { currents_a, angles, torque_nm, state, .. } = record;
                let numbers = currents_a
                    .iter()
                    .flat_map(|currents| [currents.a, currents.b, currents.c])
                    .chain(angles.map(|angle| degrees(angle) as f32))
                    .chain([record.link_v(), record.capacitor_v, record.source_v, record.inductor_a])
                    .chain(*torque_nm)
                    .chain([record.duty]);
                let flags = [state.enabled, state.pulsing].map(|flag| u8::from(flag).to_string());
                out.write_record(
                    [short(*t_s, 1e9)]
                        .into_iter()
                        .chain(numbers.map(|number| number.to_string()))
                        .chain([state.scheme.name().to_owned()])
                        .chain(flags)
                        .chain([state.fault.map_or("", |fault| fault.name()).to_owned()]),
                )?;
            }
            Ok(())
        })
    }

    /// Writes edges.csv. Edges lie on a grid of 1.25 ns, and are written to a hundredth of a nanosecond.
    pub fn write_edges(&self, path: &Path) -> Result<()> {
        write_whole(path, |out| {
            out.write_record(["t_s", "gate", "level"])?;
            for edge in &self.edges {
                let level = if edge.on { "1" } else { "0" };
                out.write_record([&short(edge.t_s, 1e11), GATES[usize::from(edge.gate)], level])?;
            }
            Ok(())
        })
    }
}
