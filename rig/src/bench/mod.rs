//! The bench: machine and inverter in the timers' time, sampled and recorded. It is connected to the other end of a board's ports, whether the drive
//! runs on the host or in QEMU.
//!
//! Time is counted in whole ticks of the firmware's clock, so both sides agree on every instant. The bench never runs ahead of decisions: it advances
//! only as far as it is asked to, and everything it is told takes effect at a fixed delay after its nominal instant, so the order of arrival changes
//! nothing.
#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

mod conversions;
mod dc_side;
mod due;
mod encoder;
mod error;
mod hold;
mod inverter;
mod line;
mod live;
mod observe;
mod record;
mod rows;
mod run;
mod sampling;
mod sensors;
mod settings;
mod simulated;
mod switchgear;
mod time;
mod wiring;

pub use crate::trace::Tick;
pub use conversions::Conversions;
pub use dc_side::{Supply, Terminal};
pub use due::Due;
pub use encoder::{Encoder, Position};
pub use error::BenchError;
pub use inverter::{Inverter, Stuck};
pub use line::{Commander, LinePlan, LineSide};
pub use observe::{Limits, Observed, Peaks, Stored};
pub(crate) use rows::Rows;
pub use sampling::Sampled;
pub use sensors::{Converter, Flaws, Sensors};
pub use settings::{Operator, Settings};
pub use simulated::Simulated;
pub use switchgear::{Held, Switchgear};
pub use time::Timeline;
pub use wiring::Wiring;

use crate::inject::Injection;
use crate::inject::traction::{Kind, Spoiler};
use crate::plant::{Heat, Plant};
use crate::trace::{Extremes, Found, Row, SlotRow, Switch};
use dc_side::DcSide;
use hold::Holds;
use tractive::identification::Observation;
use tractive::modulation::CarrierHalf;
use tractive::operator::{Feedback, Request, Status};
use tractive::ports::Report;
use tractive::protection::SafeState;
use tractive::time::{Clock, Instant};

/// The delay from an interrupt's nominal instant until its order to enter a safe state reaches the gates, in ticks (25 µs): longer than both
/// interrupts together take, as a bound that does not depend on which of them came first.
const SAFE_STATE_DELAY: Tick = 625;

/// Machine, inverter, sensors and recorder.
pub struct Bench {
    plant: Plant,
    inverter: Inverter,
    sensors: Sensors,
    /// Holds of the conversions for control, and of those at the carrier's boundaries.
    holds: [Holds; 2],
    dc: DcSide,
    spoiler: Spoiler,
    /// The effects of a fault.
    pub observed: Observed,
    operator: Box<dyn Operator + Send>,
    clock: Clock,
    time: Timeline,
    end: Tick,
    next: Option<CarrierHalf>,
    /// Orders to enter a safe state, or to leave it (`None`), and the times at which they reach the gates.
    orders: Due<Option<SafeState>>,
    slots: Vec<SlotRow>,
    control: Conversions<Sampled, Report>,
    loads: Due<f64>,
    /// The rows that are judged, and the others, which are written.
    rows: Rows<Row>,
    written: Option<Rows<Row>>,
    /// Extremes since the last row that is judged.
    extremes: Extremes,
    switches: Vec<Switch>,
    observations: Vec<Observation>,
    found: Option<Found>,
}

impl Bench {
    /// A bench at tick 0.
    pub fn new(plant: Plant, operator: Box<dyn Operator + Send>, settings: &Settings) -> Self {
        let time = Timeline::new(settings.clock, 1, settings.lead_s);
        let first = CarrierHalf::off(settings.first_half_ticks);
        let at = |injection: Injection<Kind>| time.steps(settings.lead_s + injection.at_s);
        let from = settings.injection.map_or(Tick::MAX, at);
        Self {
            plant,
            inverter: Inverter::new(settings.dead_time_ticks.into(), first),
            holds: [Holds::new(settings.flaws.adc_skew_s.map(|early_s| time.steps(early_s))); 2],
            sensors: Sensors::new(settings.udc_v, settings.link_steps.clone(), settings.flaws),
            dc: DcSide::new(settings.supply, settings.udc_v),
            spoiler: Spoiler::new(settings.injection),
            observed: Observed::new(from, settings.limits),
            operator,
            clock: settings.clock,
            end: time.lead + time.steps(settings.duration_s),
            next: Some(first),
            orders: Due::default(),
            slots: Vec::new(),
            control: Conversions::new(&time),
            loads: Due::default(),
            rows: Rows::new(settings.trace_step_s, settings.duration_s, &time),
            written: None,
            extremes: Extremes::NONE,
            switches: Vec::new(),
            observations: Vec::new(),
            found: None,
            time,
        }
    }

    /// The same, beginning at another tick than 0 together with the tasks of [`crate::run::traction::Tasks::beginning_at`]: for runs in which instants wrap.
    pub fn beginning_at(mut self, origin: Tick) -> Self {
        self.time = self.time.beginning_at(origin);
        let written = self.written.as_mut().map(|rows| &mut rows.next);
        let regular = [&mut self.end, &mut self.control.next, &mut self.rows.next];
        for tick in regular.into_iter().chain(written) {
            *tick += origin;
        }
        self.observed.from = self.observed.from.saturating_add(origin);
        self.inverter = self.inverter.beginning_at(origin);
        self
    }

    /// The same, without a list of edges: for runs so long that it would fill the memory.
    pub fn without_edges(mut self) -> Self {
        self.inverter = self.inverter.without_edges();
        self
    }

    /// The same, with a trace that is written at its own step, in s, in addition to the one that is judged.
    pub fn writing_every(mut self, step_s: f64) -> Self {
        let duration_s = self.time.seconds(self.end);
        self.written = Some(Rows::new(step_s, duration_s, &self.time));
        self
    }

    /// The same, with a line side, if there is one: the link's voltage is its capacitor's, and the drive has an operator.
    pub fn with_line(mut self, plan: Option<LinePlan>) -> Self {
        if let Some(plan) = plan {
            self.dc = DcSide::Operated(Box::new(LineSide::new(plan, &self.clock)));
        }
        self
    }

    /// The same, with an incremental encoder instead of the absolute one.
    pub fn with_encoder(mut self, encoder: Option<Encoder>) -> Self {
        self.sensors = self.sensors.with_encoder(encoder);
        self
    }

    /// `true` if the drive has an operator.
    pub fn is_operated(&self) -> bool {
        self.dc.operated().is_some()
    }

    /// The request to the operator in the slot that began at `instant`, and the board's feedback.
    pub fn ask(&mut self, instant: Instant) -> Result<(Request, Feedback), BenchError> {
        let tick = self.time.widen(instant);
        self.dc.operated_mut().and_then(|line| line.ask(tick)).ok_or(BenchError::NoSlot(tick))
    }

    /// Takes the operator's status; it holds from `from` on.
    pub fn told(&mut self, from: Instant, status: Status) -> Result<(), BenchError> {
        let tick = self.time.coming(from)?;
        if let Some(line) = self.dc.operated_mut() {
            line.tell(tick, status);
        }
        Ok(())
    }

    /// Temperatures of machine and inverter, if the line side's plan includes them.
    pub fn heat(&self) -> Option<&Heat> {
        self.dc.operated().and_then(LineSide::heat)
    }

    /// The trace so far.
    pub fn rows(&self) -> &[Row] {
        self.rows.as_slice()
    }

    /// The half to play after the one that begins at `instant`.
    pub fn play(&mut self, _instant: Instant, half: CarrierHalf) {
        self.next = Some(half);
    }

    /// An interrupt at `instant` orders the safe state.
    pub fn enter(&mut self, instant: Instant, safe: SafeState) {
        if self.will_be_safe().is_none_or(|before| before == SafeState::GatesOff && safe != before) {
            self.order(instant, Some(safe));
        }
    }

    /// The PWM interrupt at `instant` leaves it.
    pub fn leave(&mut self, instant: Instant) {
        if self.will_be_safe().is_some() {
            self.order(instant, None);
        }
    }

    fn order(&mut self, instant: Instant, order: Option<SafeState>) {
        self.orders.push(self.time.widen(instant) + SAFE_STATE_DELAY, order);
    }

    /// The safe state of the gates once every order has reached them.
    fn will_be_safe(&self) -> Option<SafeState> {
        self.orders.last().copied().unwrap_or(self.inverter.safe())
    }
}
