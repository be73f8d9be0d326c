//! The files of a run: trace, edges, mode changes. Files are written whole or not at all.

use crate::columns;
use crate::files::{Cell, Columns, bytes_of_rows, write_edges, write_recorder, write_rows};
use crate::plant::LinkEnergies;
use crate::rows::Timed;
use anyhow::Result;
use std::path::Path;
use tractive::frames::Angle;
use tractive::identification::Observation;
use tractive::modulation::Mode;
use tractive::operator::Status;
use tractive::protection::Trip;
use tractive::recorder::Record;

/// Ticks since the run's beginning; on a bench with a finer count, its steps.
pub type Tick = u64;

/// A gate edge: device 0 ..= 5 is uh ul vh vl wh wl.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Edge {
    /// The time.
    pub tick: Tick,
    /// The device, as an index into [`GATES`].
    pub gate: u8,
    /// On or off.
    pub on: bool,
}

/// Names of the gates, in the order of [`Edge::gate`].
pub const GATES: [&str; 6] = ["uh", "ul", "vh", "vl", "wh", "wl"];

/// The operator's status of one slot, for the trace.
#[derive(Clone, Copy, Debug)]
pub struct SlotRow {
    /// The time at which it took effect, in s from the recording's beginning.
    pub t_s: f64,
    /// The status.
    pub status: Status,
}

/// The angle found by the drive after a start without one; or the index, whose error is zero.
#[derive(Clone, Copy, Debug)]
pub struct Found {
    /// The time from the recording's beginning, in s.
    pub t_s: f64,
    /// Lead over the true one, electrical, in degrees, −180 ..= 180.
    pub error_deg: f64,
}

/// One line of trace.csv: the plant's true values, and control's intentions at that instant.
#[derive(Clone, Copy, Debug, Default)]
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
    /// Current out of the line, in A; `None` without a line filter.
    pub line_a: Option<f64>,
    /// Stator frequency as control knows it, in Hz.
    pub f1_hz: f64,
    /// Control's estimate of the excess of the machine's flux linkage over the map's, as a share.
    pub map_error: f64,
    /// The actual torque according to control, smoothed, in N·m.
    pub flowing_nm: f64,
    /// Mode of the running carrier.
    pub mode: Mode,
    /// The latched fault.
    pub trip: Option<Trip>,
    /// The operator's last status, if there is one.
    pub status: Option<Status>,
    /// Extremes since the row before.
    pub extremes: Extremes,
}

/// The extremes of the plant since the last row that is judged: at each gate edge, where phase currents and torque have their corners, and at the
/// row. Between two of these, which are at most a trace step apart, a phase current bends by less than 0.1 %.
#[derive(Clone, Copy, Debug, Default)]
pub struct Extremes {
    /// Largest |phase current|, in A.
    pub current_a: f64,
    /// Smallest air-gap torque, in N·m.
    pub lowest_nm: f64,
    /// Largest one, in N·m.
    pub highest_nm: f64,
    /// Lowest i_d, in A.
    pub lowest_id_a: f64,
}

impl Extremes {
    /// Initial value.
    pub const NONE: Self = Self {
        current_a: 0.0,
        lowest_nm: f64::INFINITY,
        highest_nm: f64::NEG_INFINITY,
        lowest_id_a: f64::INFINITY,
    };

    /// Includes one more instant's phase currents, torque and i_d.
    pub fn with(self, currents_a: [f64; 3], torque_nm: f64, id_a: f64) -> Self {
        Self {
            current_a: currents_a.into_iter().fold(self.current_a, |most, current| most.max(current.abs())),
            lowest_nm: self.lowest_nm.min(torque_nm),
            highest_nm: self.highest_nm.max(torque_nm),
            lowest_id_a: self.lowest_id_a.min(id_a),
        }
    }
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
    /// The time at which the new mode's first half began, in s.
    pub t_s: f64,
    /// The mode that ended.
    pub from: Mode,
    /// The mode that began.
    pub to: Mode,
    /// Pulse angle of the switch, in degrees; `None` if the old carrier was not locked.
    pub pulse_angle_deg: Option<f64>,
    /// Mechanical speed, in r/min.
    pub speed_rpm: f64,
}

impl Switch {
    /// `true` if both modes make pulses, and the change is within the recording.
    pub fn is_between_pulses(&self) -> bool {
        self.t_s > 0.0 && self.from != Mode::Off && self.to != Mode::Off
    }
}

/// The balance of a link's energy.
#[derive(Clone, Copy, Debug)]
pub struct LinkBalance {
    /// Energies by source and sink.
    pub energies: LinkEnergies,
    /// All energy that was moved, of either sign, in J.
    pub moved_j: f64,
    /// Energy that was neither given nor stored: the error of the integration, in J.
    pub missing_j: f64,
}

/// A whole run.
pub struct Recording {
    /// Rows of the trace, at the step at which they are judged.
    pub rows: Vec<Row>,
    /// Rows of trace.csv, if it has another step.
    pub written: Option<Vec<Row>>,
    /// Changes of mode.
    pub switches: Vec<Switch>,
    /// The operator's status, slot by slot; empty without one.
    pub slots: Vec<SlotRow>,
    /// Energies of a link with a capacitor, over the whole run.
    pub link: Option<LinkBalance>,
    /// Gate edges; ticks count from the run's beginning.
    pub edges: Vec<Edge>,
    /// Tick at which the recording begins.
    pub lead: Tick,
    /// Length of a tick, in s.
    pub tick_s: f64,
    /// The records of the drive's flight recorder, with their times in s from the recording's beginning; empty without a fault.
    pub recorded: Vec<(f64, Record)>,
    /// The observations of an identification; empty for any other run.
    pub observations: Vec<Observation>,
    /// The angle found by the drive, if it started without one.
    pub found: Option<Found>,
    /// The recordings of the other drives on the same link.
    pub beside: Vec<Recording>,
}

impl Recording {
    /// The bytes of trace.csv.
    pub fn trace_bytes(&self) -> Result<Vec<u8>> {
        bytes_of_rows(self.written.as_ref().unwrap_or(&self.rows).iter().map(Row::columns))
    }

    /// Time of a tick from the recording's beginning, in s.
    pub fn seconds(&self, tick: Tick) -> f64 {
        (tick as f64 - self.lead as f64) * self.tick_s
    }

    /// Line voltage between phases u and v in V over time in s, from the gates' edges between two times.
    pub fn line_voltage(&self, (from_s, to_s): (f64, f64)) -> Vec<(f64, f64)> {
        let udc_v = self.rows.first().map_or(0.0, |row| row.udc_v);
        let mut on = [false; GATES.len()];
        let (mut points, mut last) = (Vec::new(), 0.0);
        for edge in &self.edges {
            let t_s = self.seconds(edge.tick);
            on[usize::from(edge.gate)] = edge.on;
            let level = udc_v * (f64::from(u8::from(on[0])) - f64::from(u8::from(on[2])));
            if t_s > to_s {
                break;
            }
            if t_s >= from_s {
                let begin = points.is_empty().then_some((from_s, last));
                points.extend(begin.into_iter().chain([(t_s, last), (t_s, level)]));
            }
            last = level;
        }
        points.push((to_s, last));
        points
    }
}

impl Row {
    fn columns(&self) -> Columns<17> {
        columns! {
            t_s: Cell::time(self.t_s), speed_rpm: self.speed_rpm,
            te_ref_nm: self.te_ref_nm, te_nm: self.te_nm,
            id_ref_a: self.id_ref_a, iq_ref_a: self.iq_ref_a, id_a: self.id_a, iq_a: self.iq_a,
            ia_a: self.ia_a, ib_a: self.ib_a, ic_a: self.ic_a,
            u_v: self.u_v, udc_v: self.udc_v, f1_hz: self.f1_hz,
            mode: self.mode.family(), fault: name_of(self.trip), line_a: self.line_a,
        }
    }
}

impl SlotRow {
    fn columns(&self) -> Columns<10> {
        let Self { t_s, status } = self;
        let switches = status.switches;
        columns! {
            t_s: Cell::time(*t_s), state: status.state.name(), fault: name_of(status.trip),
            refusal: status.refusal.map_or("", |refusal| refusal.name()),
            refusals: Cell::Count(status.refusals), torque_nm: status.torque_nm,
            precharge: switches.precharge, main: switches.main,
            discharge: switches.discharge, chopper: switches.chopper,
        }
    }
}

fn recorder_columns((t_s, record): &(f64, Record)) -> Columns<13> {
    let state = record.state;
    columns! {
        t_s: Cell::time(*t_s),
        ia_a: record.currents_a.a, ib_a: record.currents_a.b, ic_a: record.currents_a.c,
        udc_v: record.udc_v, angle_deg: degrees(record.angle),
        id_ref_a: record.id_a, iq_ref_a: record.iq_a, u_v: record.voltage_v,
        mode: state.mode.name(), enabled: state.enabled, pulsing: state.pulsing,
        fault: state.fault.map_or("", |fault| fault.name()),
    }
}

/// A trip's name; empty without one.
pub fn name_of(trip: Option<Trip>) -> &'static str {
    trip.map_or("", |trip| trip.fault.name())
}

/// The recording of a run, of either system.
pub trait Recorded {
    /// The first fault, if the drive tripped.
    fn trip(&self) -> Option<Trip>;
    /// The last row's time, in s.
    fn end_s(&self) -> f64;
    /// The lowest i_d of any motor, in A.
    fn lowest_id_a(&self) -> f64;
    /// Writes trace.csv.
    fn write_trace(&self, path: &Path) -> Result<()>;
    /// Writes recorder.csv, if a fault has frozen the flight recorder; otherwise removes what an earlier run has left.
    fn write_recorder(&self, path: &Path) -> Result<()>;
    /// Writes the remaining files into a folder: edges.csv, operator.csv.
    fn write_events(&self, folder: &Path) -> Result<()>;
}

impl Recorded for Recording {
    fn trip(&self) -> Option<Trip> {
        let own = self.rows.iter().find_map(|row| row.trip);
        own.or_else(|| self.beside.iter().find_map(Self::trip))
    }

    fn end_s(&self) -> f64 {
        self.rows.last().map_or(0.0, |row| row.t_s)
    }

    fn lowest_id_a(&self) -> f64 {
        self.rows.iter().map(|row| row.extremes.lowest_id_a).fold(f64::INFINITY, f64::min)
    }

    fn write_trace(&self, path: &Path) -> Result<()> {
        write_rows(path, self.written.as_ref().unwrap_or(&self.rows).iter().map(Row::columns))
    }

    fn write_recorder(&self, path: &Path) -> Result<()> {
        write_recorder(path, &self.recorded, recorder_columns)
    }

    /// Writes the edges within the recording, and the operator's slots whose status differs from the previous one.
    fn write_events(&self, folder: &Path) -> Result<()> {
        let edges = self.edges.iter().filter(|edge| edge.tick >= self.lead);
        let edge =
            |edge: &Edge| (Cell::time(self.seconds(edge.tick)), GATES[usize::from(edge.gate)], edge.on);
        write_edges(&folder.join("edges.csv"), edges.map(edge))?;
        if self.slots.is_empty() {
            return Ok(());
        }
        let mut last = None;
        let slots = self.slots.iter().filter(|slot| last.replace(slot.status) != Some(slot.status));
        write_rows(&folder.join("operator.csv"), slots.map(SlotRow::columns))
    }
}

/// An angle in degrees, 0 ≤ x < 360.
pub fn degrees(angle: Angle) -> f64 {
    f64::from(angle.0) / 4_294_967_296.0 * 360.0
}
