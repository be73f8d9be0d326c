//! The bench: machine and inverter in the timers' time, sampled and recorded. What stands at the other end of a board's
//! ports, whether the drive runs on the host or in QEMU.
//!
//! Time is counted in whole ticks of the firmware's clock, so both sides agree on every instant. The bench never runs
//! ahead of what is decided: it advances only as far as it is asked to, and everything it is told takes effect at a
//! fixed delay after its nominal instant, so that arrival order changes nothing.

pub mod inject;
mod inverter;
mod line;
mod link;
mod observe;
mod sensors;
mod switchgear;

pub use inject::Injection;
pub use inverter::{Edge, GATES, Inverter, Stuck};
pub use line::{Commander, LinePlan, LineSide, SlotRow};
pub use link::{LineFilter, Supply};
pub use observe::{Limits, Observed, Peaks, Stored};
pub use sensors::{Converter, Flaws, Sensors};
pub use switchgear::Switchgear;

use crate::benchmark::in_plant;
use crate::plant::Plant;
use crate::trace::{Recording, Row, Switch};
use inject::{Kind, Spoiler};
use link::Link;
use std::collections::VecDeque;
use tractive::board::Sample;
use tractive::control::{Demand, LinkWindow};
use tractive::drive::Report;
use tractive::frames::{Abc, Angle};
use tractive::modulation::{CarrierPeriod, Mode};
use tractive::operator::{Feedback, Request, Status};
use tractive::protection::{LegFaults, SafeState};
use tractive::recorder::Record;
use tractive::time::{Clock, Instant};

/// Ticks since the run's beginning.
pub type Tick = u64;

/// How long after its nominal instant an interrupt's order to enter a safe state reaches the gates, in ticks (25 µs): longer
/// than both interrupts together take, as a bound that does not depend on which of them came first.
const SAFE_STATE_DELAY: Tick = 625;

/// How far a current's reading may be off without making a difference that counts, in A: a tenth of the machine's largest current,
/// which is what the sum of the phases may be.
const MUCH_A: f32 = 23.3;

/// Rows for which room is made at once.
const MOST_ROWS: usize = 1 << 20;

/// What the operator does, as a function of time.
pub trait Operator {
    /// Demand and enable at `t_s` seconds after the recording begins (negative before).
    fn demand(&self, t_s: f64) -> (Demand, bool);
}

impl<F: Fn(f64) -> (Demand, bool)> Operator for F {
    fn demand(&self, t_s: f64) -> (Demand, bool) {
        self(t_s)
    }
}

/// Why the bench cannot go on: the firmware broke the protocol.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// A half ended and nothing follows.
    #[error("at {0:.6} s the carrier half ended and no next one had been loaded")]
    NothingToPlay(f64),
    /// A sample was asked for that is not there.
    #[error("the control sample of tick {asked} was asked for; the oldest one kept is {oldest:?}")]
    NoSample {
        /// Wanted.
        asked: Tick,
        /// What there is.
        oldest: Option<Tick>,
    },
    /// The operator asked for a slot that is not there.
    #[error("the operator's slot of tick {0} was asked for and is not kept")]
    NoSlot(Tick),
    /// The operator fell behind.
    #[error("at {0:.6} s the operator has not finished its slot before the next one")]
    OperatorLate(f64),
    /// Control fell behind.
    #[error("at {0:.6} s the control interrupt has not reported within its period")]
    ControlLate(f64),
}

/// Fixed properties of a bench.
pub struct Settings {
    /// The firmware's clock.
    pub clock: Clock,
    /// The first half that the PWM timer plays, gates off.
    pub first_half_ticks: u32,
    /// Dead time, in ticks.
    pub dead_time_ticks: u32,
    /// Before the recording: time in which the drive settles, in s.
    pub lead_s: f64,
    /// Length of the recording, in s.
    pub duration_s: f64,
    /// Step of the trace, in s.
    pub trace_step_s: f64,
    /// DC-link voltage, in V.
    pub udc_v: f64,
    /// Other DC-link voltages: (time from the recording's beginning in s, V), each from its time on.
    pub link_steps: Vec<(f64, f64)>,
    /// Imperfections of the sensors.
    pub flaws: Flaws,
    /// What feeds the inverter.
    pub supply: Supply,
    /// What goes wrong.
    pub injection: Option<Injection>,
    /// Beyond what it is said to make a difference.
    pub limits: Limits,
}

/// Machine, inverter, sensors and recorder.
pub struct Bench {
    plant: Plant,
    inverter: Inverter,
    sensors: Sensors,
    link: Option<Link>,
    spoiler: Spoiler,
    observed: Observed,
    operator: Box<dyn Operator + Send>,
    clock: Clock,
    tick_s: f64,
    now: Tick,
    lead: Tick,
    end: Tick,
    next: Option<CarrierPeriod>,
    /// Orders to enter a safe state, or to leave it (`None`), and when they reach the gates.
    orders: VecDeque<(Tick, Option<SafeState>)>,
    line: Option<LineSide>,
    slots: Vec<SlotRow>,
    samples: VecDeque<(Tick, Sample)>,
    next_sample: Tick,
    reports: VecDeque<(Tick, Report)>,
    /// Loads to come, by their ticks.
    loads: VecDeque<(Tick, f64)>,
    report: Report,
    next_row: Tick,
    rows_done: u64,
    trace_step_s: f64,
    rows: Vec<Row>,
    switches: Vec<Switch>,
}

impl Bench {
    /// A bench at tick 0.
    pub fn new(plant: Plant, operator: Box<dyn Operator + Send>, settings: &Settings) -> Self {
        let tick_s = f64::from(settings.clock.ticks_per_s).recip();
        let ticks = |seconds: f64| (seconds / tick_s).round() as Tick;
        let first = CarrierPeriod::off(settings.first_half_ticks);
        let lead = ticks(settings.lead_s);
        let from = settings.injection.map_or(Tick::MAX, |injection| ticks(settings.lead_s + injection.at_s));
        Self {
            plant,
            inverter: Inverter::new(settings.dead_time_ticks.into(), first),
            sensors: Sensors::new(settings.udc_v, settings.link_steps.clone(), settings.flaws),
            link: match settings.supply {
                Supply::Stiff => None,
                Supply::Line(filter) => Some(Link::new(filter, settings.udc_v)),
            },
            spoiler: Spoiler::new(settings.injection),
            observed: Observed::new(from, settings.limits),
            operator,
            clock: settings.clock,
            tick_s,
            now: 0,
            lead,
            end: lead + ticks(settings.duration_s),
            next: Some(first),
            orders: VecDeque::new(),
            line: None,
            slots: Vec::new(),
            samples: VecDeque::new(),
            next_sample: settings.clock.control_ticks.into(),
            reports: VecDeque::new(),
            loads: VecDeque::new(),
            report: Report::default(),
            next_row: lead,
            rows_done: 0,
            trace_step_s: settings.trace_step_s,
            rows: Vec::with_capacity(
                MOST_ROWS.min((settings.duration_s / settings.trace_step_s) as usize + 2),
            ),
            switches: Vec::new(),
        }
    }

    /// The same beginning at another tick than 0, with tasks of [`crate::run::Tasks::beginning_at`] the same: where instants wrap.
    pub fn beginning_at(mut self, origin: Tick) -> Self {
        for tick in [&mut self.now, &mut self.lead, &mut self.end, &mut self.next_sample, &mut self.next_row]
        {
            *tick += origin;
        }
        self.observed.from = self.observed.from.saturating_add(origin);
        self.inverter = self.inverter.beginning_at(origin);
        self
    }

    /// The same without a list of edges: for runs so long that it would fill the memory.
    pub fn without_edges(mut self) -> Self {
        self.inverter = self.inverter.without_edges();
        self
    }

    /// The same with a line side: the link's voltage is its capacitor's, and the drive has an operator.
    pub fn with_line(mut self, plan: LinePlan) -> Self {
        self.line = Some(LineSide::new(plan, &self.clock));
        self
    }

    /// Whether the drive has an operator.
    pub fn is_operated(&self) -> bool {
        self.line.is_some()
    }

    /// What is asked of the operator in the slot that began at `instant`, and what the board says.
    pub fn ask(&mut self, instant: Instant) -> Result<(Request, Feedback), BenchError> {
        let tick = self.widen(instant);
        self.line.as_mut().and_then(|line| line.ask(tick)).ok_or(BenchError::NoSlot(tick))
    }

    /// What the operator told; it holds from `from` on.
    pub fn told(&mut self, from: Instant, status: Status) -> Result<(), BenchError> {
        let tick = self.widen(from);
        if tick < self.now {
            return Err(BenchError::OperatorLate(self.seconds(tick)));
        }
        if let Some(line) = &mut self.line {
            line.tell(tick, status);
        }
        Ok(())
    }

    /// Whether the recording is complete.
    pub fn is_done(&self) -> bool {
        self.now > self.end
    }

    /// Share of the run that is done, 0 ..= 1.
    pub fn progress(&self) -> f64 {
        self.now as f64 / self.end as f64
    }

    /// The recording: what the bench saw, and what the drive's own recorder holds; instants in seconds from its beginning.
    pub fn into_recording(self, records: Vec<Record>) -> Recording {
        let recorded = records.into_iter().map(|record| (self.instant_s(record.at), record)).collect();
        let edges = self.inverter.edges().to_vec();
        Recording {
            rows: self.rows,
            switches: self.switches,
            edges,
            recorded,
            slots: self.slots,
            link: self.line.map(|line| line.balance()),
            lead: self.lead,
            tick_s: self.tick_s,
        }
    }

    /// An instant near to now, in s from the recording's beginning.
    pub fn instant_s(&self, instant: Instant) -> f64 {
        self.seconds(self.widen(instant))
    }

    /// A free rotor's load from `instant` on, in N·m.
    pub fn load_from(&mut self, instant: Instant, load_nm: f64) {
        self.loads.push_back((self.widen(instant), load_nm));
    }

    /// Ends the recording at `instant`.
    pub fn end_at(&mut self, instant: Instant) {
        self.end = self.end.min(self.widen(instant));
    }

    /// The conversions that the control timer triggered at `instant`.
    pub fn control_sample(&mut self, instant: Instant) -> Result<Sample, BenchError> {
        let tick = self.widen(instant);
        self.advance(tick)?;
        while let Some((at, sample)) = self.samples.pop_front() {
            if at == tick {
                return Ok(sample);
            }
        }
        Err(BenchError::NoSample { asked: tick, oldest: self.samples.front().map(|(at, _)| *at) })
    }

    /// The control interrupt's report; it shows in the trace when the command takes effect.
    pub fn control_report(&mut self, instant: Instant, report: Report) {
        let effective = self.widen(instant) + Tick::from(self.clock.control_ticks);
        self.reports.push_back((effective, report));
    }

    /// Phase currents at the carrier boundary `instant`.
    pub fn pwm_sample(&mut self, instant: Instant) -> Result<Abc, BenchError> {
        let tick = self.widen(instant);
        self.advance(tick)?;
        let currents_a = self.sensors.currents(&self.plant);
        Ok(self.read_currents(currents_a))
    }

    /// What drivers and monitors of the legs have found.
    pub fn leg_faults(&self) -> LegFaults {
        let mut found = self.inverter.leg_faults();
        if let Some(Kind::Feedback(leg)) = self.spoiler.kind(self.seconds(self.now)) {
            found.low |= 1 << leg;
        }
        found
    }

    /// By how much the control interrupt is late, in ticks.
    pub fn control_late_ticks(&self) -> u32 {
        match self.spoiler.kind(self.seconds(self.now)) {
            Some(Kind::ControlLate(ticks)) => ticks,
            _ => 0,
        }
    }

    /// Whether the control interrupt comes at this instant at all.
    pub fn has_control(&self, instant: Instant) -> bool {
        self.spoiler.kind(self.seconds(self.widen(instant))) != Some(Kind::ControlStopped)
    }

    /// Time since the recording's beginning, in s.
    pub fn time_s(&self) -> f64 {
        self.seconds(self.now)
    }

    /// The trace so far.
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// What a fault did.
    pub fn observed(&self) -> &Observed {
        &self.observed
    }

    /// What the converters make of the phase currents.
    fn read_currents(&mut self, true_a: Abc) -> Abc {
        let read_a = self.spoiler.currents(self.seconds(self.now), true_a);
        let off = [read_a.a - true_a.a, read_a.b - true_a.b, read_a.c - true_a.c];
        // What is not a number is off as well.
        if off.iter().any(|off| off.is_nan() || off.abs() > MUCH_A) {
            self.observed.makes_a_difference(self.now);
        }
        read_a
    }

    /// The half to play after the one that begins at `instant`.
    pub fn play(&mut self, _instant: Instant, half: CarrierPeriod) {
        self.next = Some(half);
    }

    /// An interrupt at `instant` orders the safe state.
    pub fn enter(&mut self, instant: Instant, safe: SafeState) {
        if !self.will_be_safe() {
            self.order(instant, Some(safe));
        }
    }

    /// The PWM interrupt at `instant` leaves it.
    pub fn leave(&mut self, instant: Instant) {
        if self.will_be_safe() {
            self.order(instant, None);
        }
    }

    fn order(&mut self, instant: Instant, order: Option<SafeState>) {
        let effective = self.widen(instant) + SAFE_STATE_DELAY;
        self.orders.push_back((effective, order));
    }

    /// Whether the gates will be in a safe state once every order has reached them.
    fn will_be_safe(&self) -> bool {
        self.orders.back().map_or(self.inverter.is_safe(), |(_, order)| order.is_some())
    }

    /// The tick of an instant near to now.
    fn widen(&self, instant: Instant) -> Tick {
        let now = Instant(self.now as u32);
        self.now.saturating_add_signed(i64::from(instant.since(now)))
    }

    fn seconds(&self, tick: Tick) -> f64 {
        (tick as f64 - self.lead as f64) * self.tick_s
    }

    /// Runs to `tick`, doing on the way all that is due, and at `tick` itself too.
    fn advance(&mut self, tick: Tick) -> Result<(), BenchError> {
        while self.now < tick {
            let mut due = tick.min(self.inverter.half_end()).min(self.next_sample).min(self.next_row);
            if self.observed.from > self.now {
                due = due.min(self.observed.from);
            }
            if let Some(event) = self.inverter.next_event() {
                due = due.min(event);
            }
            if let Some((at, _)) = self.orders.front() {
                due = due.min(*at);
            }
            if let Some((at, _)) = self.loads.front() {
                due = due.min((*at).max(self.now));
            }
            if let Some(event) = self.line.as_ref().and_then(LineSide::next_event) {
                due = due.min(event);
            }
            self.integrate(due);
            self.act()?;
        }
        Ok(())
    }

    fn integrate(&mut self, tick: Tick) {
        if tick > self.now {
            let t_s = self.seconds(self.now);
            let (udc_v, legs) = (self.udc_v(t_s), self.inverter.legs());
            let dt_s = (tick - self.now) as f64 * self.tick_s;
            let before_j = self.plant.energies().electrical_j;
            if let Some(line) = &mut self.line {
                in_plant(|| self.plant.advance_on(&mut line.link, legs, dt_s));
            } else {
                in_plant(|| self.plant.advance(legs, udc_v, dt_s));
            }
            if let Some(link) = &mut self.link {
                let drawn_j = self.plant.energies().electrical_j - before_j;
                link.advance(drawn_j, dt_s, self.sensors.udc_v(t_s), self.spoiler.supply(t_s));
            }
            self.inverter.monitor(self.plant.currents_abc(), self.now, tick);
            if self.inverter.leg_faults() != LegFaults::default() {
                self.observed.makes_a_difference(self.now);
            }
            self.now = tick;
            let udc_v = self.udc_v(self.seconds(tick));
            let peaks = Peaks::at(&self.plant.currents_abc(), udc_v, 0.0);
            self.observed.note(tick, &peaks, self.plant.speed_rpm());
        }
    }

    /// The link's true voltage, in V.
    fn udc_v(&self, t_s: f64) -> f64 {
        match (&self.line, &self.link) {
            (Some(line), _) => line.link.udc_v(),
            (None, Some(link)) => link.voltage_v(),
            (None, None) => self.sensors.udc_v(t_s),
        }
    }

    /// The highest voltage that the link would have from now on without the inverter, in V.
    fn unloaded_v(&self, now: Tick) -> f64 {
        const STEPS: u32 = 1_000;
        const STEP_S: f64 = 0.1e-3;
        let Some(mut link) = self.link else { return 0.0 };
        (0..STEPS).fold(0.0_f64, |highest_v, k| {
            let t_s = self.seconds(now) + f64::from(k) * STEP_S;
            link.advance(0.0, STEP_S, self.sensors.udc_v(t_s), self.spoiler.supply(t_s));
            highest_v.max(link.voltage_v())
        })
    }

    fn act(&mut self) -> Result<(), BenchError> {
        let now = self.now;
        let t_s = self.seconds(now);
        if let Some(row) = self.line.as_mut().and_then(|line| line.act(now, t_s))
            && now >= self.lead
            && now <= self.end
        {
            self.slots.push(row);
        }
        if now == self.observed.from {
            self.observed.carrier_ticks = 2 * Tick::from(self.inverter.half().period_ticks);
            match self.spoiler.kind(self.seconds(now)) {
                Some(Kind::Gate(gate, on)) => {
                    self.inverter.stick(gate, if on { Stuck::On } else { Stuck::Off })
                }
                Some(Kind::Device(gate)) => self.inverter.stick(gate, Stuck::Shorted),
                _ => {}
            }
        }
        while let Some((at, order)) = self.orders.front().copied()
            && at <= now
        {
            self.orders.pop_front();
            match order {
                Some(safe) => {
                    self.inverter.enter(safe, now);
                    let udc_v = self.udc_v(self.seconds(now));
                    let unloaded_v = self.unloaded_v(now);
                    self.observed.enters(now, safe, Stored::of(&self.plant, udc_v, unloaded_v));
                }
                None => self.inverter.leave(now),
            }
        }
        while let Some((at, load_nm)) = self.loads.front().copied()
            && at <= now
        {
            self.loads.pop_front();
            self.plant.set_load_nm(load_nm);
        }
        self.inverter.act(now);
        if now == self.inverter.half_end() {
            let next = self.next.take().ok_or(BenchError::NothingToPlay(self.seconds(now)))?;
            self.note_switch(&next);
            self.inverter.begin(next, now);
        }
        if now == self.next_sample {
            self.take_sample()?;
        }
        if now == self.next_row {
            self.record();
        }
        Ok(())
    }

    fn take_sample(&mut self) -> Result<(), BenchError> {
        // The report of the period before last must be there: its command takes effect now.
        if self.samples.len() > 1 {
            if self.has_control(Instant(self.now as u32)) {
                return Err(BenchError::ControlLate(self.seconds(self.now)));
            }
            self.samples.clear();
        }
        let t_s = self.seconds(self.now);
        let (demand, enable) = self.operator.demand(t_s);
        let udc_v = self.udc_v(t_s);
        let mut measured = self.sensors.measure(&self.plant, udc_v, t_s);
        measured.currents_a = self.read_currents(measured.currents_a);
        let hardware = self.line.as_ref().and_then(|line| line.hardware(t_s));
        if self.line.as_mut().is_some_and(|line| line.sampled(self.now, t_s)) {
            return Err(BenchError::OperatorLate(t_s));
        }
        let mut sample =
            Sample { measured, demand, enable, window: LinkWindow::OPEN, acknowledge: 0, hardware };
        self.spoiler.control(t_s, &mut sample);
        self.samples.push_back((self.now, sample));
        self.next_sample = self.now + Tick::from(self.clock.control_ticks);
        Ok(())
    }

    fn note_switch(&mut self, next: &CarrierPeriod) {
        let from = self.inverter.half().mode;
        if next.mode != from {
            let boundary = if from.carriers() > 0 { self.inverter.half().end_angle() } else { None };
            self.switches.push(Switch {
                t_s: self.seconds(self.now),
                from,
                to: next.mode,
                pulse_angle_deg: boundary.map(degrees),
                speed_rpm: self.plant.speed_rpm(),
            });
        }
    }

    fn record(&mut self) {
        while let Some((effective, report)) = self.reports.front()
            && *effective <= self.now
        {
            self.report = *report;
            self.reports.pop_front();
        }
        if self.now <= self.end {
            let (id, iq) = self.plant.currents_dq();
            let [ia, ib, ic] = self.plant.currents_abc();
            let half = self.inverter.half();
            let report = &self.report;
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
                status: self.line.as_ref().and_then(LineSide::status),
            });
        }
        self.rows_done += 1;
        let next_s = self.rows_done as f64 * self.trace_step_s;
        self.next_row = self.lead + ((next_s / self.tick_s).round() as Tick).max(self.now + 1 - self.lead);
    }
}

/// An angle in degrees, 0 ≤ x < 360.
pub fn degrees(angle: Angle) -> f64 {
    f64::from(angle.0) / 4_294_967_296.0 * 360.0
}
