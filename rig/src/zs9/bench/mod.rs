//! The ZS9's bench: plant, gates and sensors in the timers' time, sampled and recorded.
//!
//! Time is counted in compare steps of the firmware's timers, so both sides agree on every edge. As on the first
//! system's bench, nothing runs ahead of what has been decided, and an interrupt's order takes effect at a fixed delay after
//! its nominal instant.
#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

mod carrier;
mod gates;
mod live;
mod record;
mod run;
mod sampling;
mod settings;
mod spans;
mod watch;

pub use gates::as_diodes_have_it;

pub use crate::bench::BenchError;
pub use settings::{BenchSettings, Course};

use super::line::{LineSide, LineTimes};
use super::operator::{Operator, Orders};
use super::trace::Row;
use crate::bench::{Conversions, Converter, Due, Observed, Tick, Timeline};
use crate::inject::zs9::{Levels, Spoiler};
use crate::plant::zs9::{NetworkState, Zs9Plant};
use crate::plant::{FilteredLink, LineFilter};
use gates::Gates;
use spans::Spans;
use tractive::drive::dual::COMPARE_STEPS;
use tractive::operator::{DualStatus, Feedback};
use tractive::ports::{DualDriveCommand, DualReport, DualSample, GateFeedback, PlayedPeriod};
use tractive::time::Instant;

/// The delay from the control interrupt's nominal instant until its order to turn the gates off reaches the gates, in ticks (75 µs): its
/// latest deadline.
const CONTROL_OFF_TICKS: u32 = 1875;
/// The same for the PWM interrupt (25 µs), as a bound on its length.
const PWM_OFF_TICKS: u32 = 625;

/// Plant, gates, sensors and recorder. Its time counts in compare steps.
pub struct Bench {
    plant: Zs9Plant,
    operator: Box<dyn Operator + Send>,
    settings: BenchSettings,
    converter: Converter,
    spoiler: Spoiler,
    nominal_source_v: f64,
    /// A line filter between the source and its contactor; its capacitor is at the contactor, as is the source's sensor.
    filter: Option<FilteredLink>,
    time: Timeline,
    course: Course,
    /// Beginning of the carrier period being played, and its length.
    begun: Tick,
    period: Tick,
    next: Option<PlayedPeriod>,
    /// Toggles still to come in the running period, the last one first.
    toggles: Vec<(Tick, u8)>,
    gates: Gates,
    off: bool,
    /// The time at which the gates go off (true) or may be played again (false).
    off_at: Option<(Tick, bool)>,
    line: Option<LineSide>,
    loads: Due<[f64; 2]>,
    loads_nm: Option<[f64; 2]>,
    /// The effects of a fault.
    pub observed: Observed,
    feedback: GateFeedback,
    orders: Orders,
    control: Conversions<(DualSample, DualDriveCommand), DualReport>,
    /// The rows that are judged, and those that are written besides.
    rows: Spans,
    written: Option<Spans>,
}

impl Bench {
    /// A bench at its first instant, gates off.
    pub fn new(plant: Zs9Plant, mut operator: Box<dyn Operator + Send>, settings: BenchSettings) -> Self {
        let time = Timeline::new(settings.drive.clock, COMPARE_STEPS, settings.lead_s);
        let speeds = plant.motors.each_ref().map(|motor| motor.speed_rpm());
        let levels = Levels::new(plant.motors[0].largest_a, &settings.drive.limits);
        let fault_s = settings.injection.map(|injection| settings.lead_s + injection.at_s);
        Self {
            orders: operator.orders(-settings.lead_s, speeds),
            nominal_source_v: plant.source_v,
            filter: None,
            plant,
            operator,
            converter: Converter::new(settings.flaws),
            spoiler: Spoiler::new(settings.injection, levels),
            course: Course::default(),
            begun: 0,
            period: time.of_ticks(settings.drive.carrier_ticks),
            next: Some(PlayedPeriod::off(settings.drive.carrier_ticks / 2 * COMPARE_STEPS)),
            toggles: Vec::with_capacity(36),
            gates: Gates::new(time.steps(settings.dead_time_s), settings.edges.then_some(time.lead)),
            off: false,
            off_at: None,
            line: None,
            loads: Due::default(),
            loads_nm: None,
            observed: Observed::new(fault_s.map_or(Tick::MAX, |at_s| time.steps(at_s)), settings.limits),
            feedback: GateFeedback::default(),
            control: Conversions::new(&time),
            rows: Spans::new(settings.trace_step_s, settings.duration_s, &time),
            written: None,
            time,
            settings,
        }
    }

    /// The same with a line side, if there is one: the network is empty, behind open contactors, and the drive has an operator.
    pub fn with_line(mut self, times: Option<LineTimes>) -> Self {
        if let Some(times) = times {
            self.line = Some(LineSide::new(times, &self.settings.drive.clock));
            self.plant.network = NetworkState::even(0.0, LineSide::EMPTY_V);
        }
        self
    }

    /// The same behind a line filter, if there is one.
    pub fn behind(mut self, filter: Option<LineFilter>) -> Self {
        self.filter = filter.map(|filter| FilteredLink::new(filter, self.nominal_source_v));
        self
    }

    /// The same beginning at another tick than 0, like tasks of [`super::run::Tasks::beginning_at`], for runs in which instants wrap.
    pub fn beginning_at(mut self, origin_ticks: u64) -> Self {
        let origin = origin_ticks * Tick::from(COMPARE_STEPS);
        self.time = self.time.beginning_at(origin);
        self.gates = self.gates.beginning_at(origin);
        let written = self.written.as_mut().map(Spans::next_mut);
        let regular = [&mut self.begun, &mut self.control.next, self.rows.next_mut()];
        for step in regular.into_iter().chain(written) {
            *step += origin;
        }
        self.observed.from = self.observed.from.saturating_add(origin);
        self
    }

    /// The same with a trace that is written at its own step, in s, beside the one that is judged.
    pub fn writing_every(mut self, step_s: f64) -> Self {
        self.written = Some(Spans::new(step_s, self.settings.duration_s, &self.time));
        self
    }

    /// The trace so far, at the step at which it is judged.
    pub fn rows(&self) -> &[Row] {
        self.rows.as_slice()
    }

    /// The same with a source and schemes that change.
    pub fn following(mut self, course: Course) -> Self {
        self.course = course;
        self
    }

    /// `true` if the drive has an operator.
    pub fn is_operated(&self) -> bool {
        self.line.is_some()
    }

    /// The board's feedback to the operator in the slot that began at `instant`.
    pub fn ask(&mut self, instant: Instant) -> Result<Feedback, BenchError> {
        let tick = self.time.widen(instant) / Tick::from(COMPARE_STEPS);
        let asked = self.line.as_mut().and_then(|line| line.gear.ask(tick));
        asked.map(|(_, feedback)| feedback).ok_or(BenchError::NoSlot(tick))
    }

    /// Takes the operator's status; it holds from `from` on.
    pub fn told(&mut self, from: Instant, status: DualStatus) -> Result<(), BenchError> {
        let tick = self.time.coming(from)?;
        if let Some(line) = &mut self.line {
            line.gear.tell(tick, status);
        }
        Ok(())
    }

    /// The motors' true speeds, in r/min.
    pub fn speeds_rpm(&self) -> [f64; 2] {
        self.plant.motors.each_ref().map(|motor| motor.speed_rpm())
    }

    /// Length of a compare step, in s.
    pub fn step_s(&self) -> f64 {
        self.time.step_s
    }

    /// The period to play from the next valley on.
    pub fn play(&mut self, next: PlayedPeriod) {
        self.next = Some(next);
    }

    /// An interrupt at `instant` turns all gates off.
    pub fn gates_off(&mut self, instant: Instant) {
        let from = self.time.widen(instant);
        let is_control = (from - self.time.origin).is_multiple_of(self.time.control());
        let delay = if is_control { CONTROL_OFF_TICKS } else { PWM_OFF_TICKS };
        let at = from + self.time.of_ticks(delay);
        self.off_at = match self.off_at {
            Some((earlier, true)) => Some((earlier.min(at), true)),
            _ => Some((at, true)),
        };
    }

    /// The PWM interrupt at `instant` lets the gates be played again.
    pub fn leave(&mut self, instant: Instant) {
        let at = self.time.widen(instant) + self.time.of_ticks(PWM_OFF_TICKS);
        // An order to turn them off that comes meanwhile takes precedence.
        if self.off_at.is_none() {
            self.off_at = Some((at, false));
        }
    }
}
