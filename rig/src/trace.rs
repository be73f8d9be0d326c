//! What a run leaves behind: trace, edges, switches of mode. Files are written whole or not at all.

use crate::files::{forget, short_time, write_whole};
use crate::plant::LinkEnergies;
use crate::rows::Timed;
use anyhow::Result;
use std::path::Path;
use tractive::frames::Angle;
use tractive::modulation::Mode;
use tractive::operator::Status;
use tractive::protection::Trip;
use tractive::recorder::Record;

/// Ticks since the run's beginning; on a bench that counts finer, its steps.
pub type Tick = u64;

/// A gate edge: device 0 ..= 5 is uh ul vh vl wh wl.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Edge {
    /// When.
    pub tick: Tick,
    /// Which device, as an index into [`GATES`].
    pub gate: u8,
    /// On or off.
    pub on: bool,
}

/// Names of the gates, in the order of [`Edge::gate`].
pub const GATES: [&str; 6] = ["uh", "ul", "vh", "vl", "wh", "wl"];

/// What the operator did in one slot, for the trace.
#[derive(Clone, Copy, Debug)]
pub struct SlotRow {
    /// When it took effect, in s from the recording's beginning.
    pub t_s: f64,
    /// What it told.
    pub status: Status,
}

/// One line of trace.csv: the plant's true values, and control's intentions at that instant.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// Time from the recording's beginning, in s.
    pub t_s: f64,
    /// Mechanical speed, in r/min.
    pub speed_rpm: f64,
    /// Torque demand after envelope, slew and limits, in N·m.
    pub te_ref_nm: f64,
    /// Air-gap torque, in N·m.
    pub te_nm: f64,
    /// Current reference, d, in A.
    pub id_ref_a: f64,
    /// Current reference, q, in A.
    pub iq_ref_a: f64,
    /// Current, d, in A.
    pub id_a: f64,
    /// Current, q, in A.
    pub iq_a: f64,
    /// Phase current a, in A.
    pub ia_a: f64,
    /// Phase current b, in A.
    pub ib_a: f64,
    /// Phase current c, in A.
    pub ic_a: f64,
    /// Commanded fundamental, peak phase, in V.
    pub u_v: f64,
    /// DC-link voltage, in V.
    pub udc_v: f64,
    /// Stator frequency as control knows it, in Hz.
    pub f1_hz: f64,
    /// Control's estimate of how much the machine's flux linkage exceeds the map's, as a share.
    pub map_error: f64,
    /// Mode of the running carrier.
    pub mode: Mode,
    /// The latched fault.
    pub trip: Option<Trip>,
    /// The operator's last word, if there is one.
    pub status: Option<Status>,
}

impl Timed for Row {
    fn t_s(&self) -> f64 {
        self.t_s
    }
}

impl Row {
    /// Largest magnitude of the three phase currents, in A.
    pub fn peak_current_a(&self) -> f64 {
        self.ia_a.abs().max(self.ib_a.abs()).max(self.ic_a.abs())
    }
}

/// A change of mode.
#[derive(Clone, Copy, Debug)]
pub struct Switch {
    /// When the new mode's first half began, in s.
    pub t_s: f64,
    /// The mode that ended.
    pub from: Mode,
    /// The mode that began.
    pub to: Mode,
    /// Pulse angle of the switch, in degrees; `None` where the old carrier was not locked.
    pub pulse_angle_deg: Option<f64>,
    /// Mechanical speed, in r/min.
    pub speed_rpm: f64,
}

impl Switch {
    /// Whether both modes make pulses, and it is within the recording.
    pub fn is_between_pulses(&self) -> bool {
        self.t_s > 0.0 && self.from != Mode::Off && self.to != Mode::Off
    }
}

/// Where a link's energy went.
#[derive(Clone, Copy, Debug)]
pub struct LinkBalance {
    /// By who gave or took it.
    pub energies: LinkEnergies,
    /// All that was moved, of either sign, in J.
    pub moved_j: f64,
    /// Neither given nor kept: what integration has lost, in J.
    pub missing_j: f64,
}

/// A whole run.
pub struct Recording {
    /// Rows of the trace.
    pub rows: Vec<Row>,
    /// Changes of mode.
    pub switches: Vec<Switch>,
    /// What the operator told, slot by slot; empty without one.
    pub slots: Vec<SlotRow>,
    /// Energies of a link with a capacitor, over the whole run.
    pub link: Option<LinkBalance>,
    /// Gate edges; ticks count from the run's beginning.
    pub edges: Vec<Edge>,
    /// Tick at which the recording begins.
    pub lead: Tick,
    /// Length of a tick, in s.
    pub tick_s: f64,
    /// What the drive's flight recorder holds, with its times in s from the recording's beginning; empty without a fault.
    pub recorded: Vec<(f64, Record)>,
}

impl Recording {
    /// Time of a tick from the recording's beginning, in s.
    pub fn seconds(&self, tick: Tick) -> f64 {
        (tick as f64 - self.lead as f64) * self.tick_s
    }

    /// The first fault, if the drive tripped.
    pub fn trip(&self) -> Option<Trip> {
        self.rows.iter().find_map(|row| row.trip)
    }

    /// Writes trace.csv.
    pub fn write_trace(&self, path: &Path) -> Result<()> {
        write_whole(path, |out| {
            out.write_record([
                "t_s",
                "speed_rpm",
                "te_ref_nm",
                "te_nm",
                "id_ref_a",
                "iq_ref_a",
                "id_a",
                "iq_a",
                "ia_a",
                "ib_a",
                "ic_a",
                "u_v",
                "udc_v",
                "f1_hz",
                "mode",
                "fault",
            ])?;
            for row in &self.rows {
                out.serialize((
                    (
                        short_time(row.t_s),
                        row.speed_rpm as f32,
                        row.te_ref_nm as f32,
                        row.te_nm as f32,
                        row.id_ref_a as f32,
                        row.iq_ref_a as f32,
                        row.id_a as f32,
                        row.iq_a as f32,
                    ),
                    (
                        row.ia_a as f32,
                        row.ib_a as f32,
                        row.ic_a as f32,
                        row.u_v as f32,
                        row.udc_v as f32,
                        row.f1_hz as f32,
                        row.mode.name(),
                        row.trip.map_or("", |trip| trip.fault.name()),
                    ),
                ))?;
            }
            Ok(())
        })
    }

    /// Writes operator.csv: a line for every slot from whose beginning on the operator's words differ from those before.
    pub fn write_slots(&self, path: &Path) -> Result<()> {
        write_whole(path, |out| {
            out.write_record([
                "t_s",
                "state",
                "fault",
                "refusal",
                "refusals",
                "torque_nm",
                "precharge",
                "main",
                "discharge",
                "chopper",
            ])?;
            let mut last = None;
            for SlotRow { t_s, status } in &self.slots {
                if last == Some(*status) {
                    continue;
                }
                last = Some(*status);
                out.serialize((
                    short_time(*t_s),
                    status.state.name(),
                    status.trip.map_or("", |trip| trip.fault.name()),
                    status.refusal.map_or("", |refusal| refusal.name()),
                    status.refusals,
                    status.torque_nm,
                    u8::from(status.switches.precharge),
                    u8::from(status.switches.main),
                    u8::from(status.switches.discharge),
                    status.switches.chopper,
                ))?;
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
            out.write_record([
                "t_s",
                "ia_a",
                "ib_a",
                "ic_a",
                "udc_v",
                "angle_deg",
                "id_ref_a",
                "iq_ref_a",
                "u_v",
                "mode",
                "enabled",
                "pulsing",
                "fault",
            ])?;
            for (t_s, record) in &self.recorded {
                let state = record.state;
                out.serialize((
                    short_time(*t_s),
                    record.currents_a.a,
                    record.currents_a.b,
                    record.currents_a.c,
                    record.udc_v,
                    degrees(record.angle) as f32,
                    record.id_a,
                    record.iq_a,
                    record.voltage_v,
                    state.mode.name(),
                    u8::from(state.enabled),
                    u8::from(state.pulsing),
                    state.fault.map_or("", |fault| fault.name()),
                ))?;
            }
            Ok(())
        })
    }

    /// Writes edges.csv: edges within the recording.
    pub fn write_edges(&self, path: &Path) -> Result<()> {
        write_whole(path, |out| {
            out.write_record(["t_s", "gate", "level"])?;
            for edge in &self.edges {
                if edge.tick >= self.lead {
                    out.serialize((
                        short_time(self.seconds(edge.tick)),
                        GATES[usize::from(edge.gate)],
                        u8::from(edge.on),
                    ))?;
                }
            }
            Ok(())
        })
    }
}

/// An angle in degrees, 0 ≤ x < 360.
pub fn degrees(angle: Angle) -> f64 {
    f64::from(angle.0) / 4_294_967_296.0 * 360.0
}
