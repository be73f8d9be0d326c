//! The bench: machine and inverter in the timers' time, sampled and recorded. What stands at the other end of a board's
//! ports, whether the drive runs on the host or in QEMU.
//!
//! Time is counted in whole ticks of the firmware's clock, so both sides agree on every instant. The bench never runs
//! ahead of what is decided: it advances only as far as it is asked to, and everything it is told takes effect at a
//! fixed delay after its nominal instant, so that arrival order changes nothing.

mod inverter;
mod sensors;

pub use inverter::{Edge, GATES, Inverter};
pub use sensors::{Converter, Flaws, Sensors};

use crate::plant::Plant;
use crate::trace::{Row, Switch};
use std::collections::VecDeque;
use tractive::board::Sample;
use tractive::control::{Demand, LinkWindow};
use tractive::drive::Report;
use tractive::frames::{Abc, Angle};
use tractive::modulation::{CarrierPeriod, Mode};
use tractive::protection::SafeState;
use tractive::time::{Clock, Instant};

/// Ticks since the run's beginning.
pub type Tick = u64;

/// How long after its nominal instant an interrupt's order to enter a safe state reaches the gates, in ticks (25 µs): longer
/// than both interrupts together take, as a bound that does not depend on which of them came first.
const SAFE_STATE_DELAY: Tick = 625;

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
}

/// Machine, inverter, sensors and recorder.
pub struct Bench {
    plant: Plant,
    inverter: Inverter,
    sensors: Sensors,
    operator: Box<dyn Operator + Send>,
    clock: Clock,
    tick_s: f64,
    now: Tick,
    lead: Tick,
    end: Tick,
    next: Option<CarrierPeriod>,
    safe: Option<(Tick, SafeState)>,
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
        Self {
            plant,
            inverter: Inverter::new(settings.dead_time_ticks.into(), first),
            sensors: Sensors::new(settings.udc_v, settings.link_steps.clone(), settings.flaws),
            operator,
            clock: settings.clock,
            tick_s,
            now: 0,
            lead,
            end: lead + ticks(settings.duration_s),
            next: Some(first),
            safe: None,
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

    /// Whether the recording is complete.
    pub fn is_done(&self) -> bool {
        self.now > self.end
    }

    /// Share of the run that is done, 0 ..= 1.
    pub fn progress(&self) -> f64 {
        self.now as f64 / self.end as f64
    }

    /// The recording: trace, switches of mode, edges; instants in seconds from its beginning.
    pub fn into_recording(self) -> (Vec<Row>, Vec<Switch>, Vec<Edge>, Tick, f64) {
        let edges = self.inverter.edges().to_vec();
        (self.rows, self.switches, edges, self.lead, self.tick_s)
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
        Ok(self.sensors.currents(&self.plant))
    }

    /// The half to play after the one that begins at `instant`.
    pub fn play(&mut self, _instant: Instant, half: CarrierPeriod) {
        self.next = Some(half);
    }

    /// An interrupt at `instant` orders the safe state.
    pub fn enter(&mut self, instant: Instant, safe: SafeState) {
        let effective = self.widen(instant) + SAFE_STATE_DELAY;
        if self.safe.is_none() && !self.inverter.is_safe() {
            self.safe = Some((effective, safe));
        }
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
            if let Some(event) = self.inverter.next_event() {
                due = due.min(event);
            }
            if let Some((at, _)) = self.safe {
                due = due.min(at);
            }
            if let Some((at, _)) = self.loads.front() {
                due = due.min((*at).max(self.now));
            }
            self.integrate(due);
            self.act()?;
        }
        Ok(())
    }

    fn integrate(&mut self, tick: Tick) {
        if tick > self.now {
            let udc_v = self.sensors.udc_v(self.seconds(self.now));
            self.plant.advance(self.inverter.legs(), udc_v, (tick - self.now) as f64 * self.tick_s);
            self.now = tick;
        }
    }

    fn act(&mut self) -> Result<(), BenchError> {
        let now = self.now;
        if let Some((at, safe)) = self.safe
            && at <= now
        {
            self.safe = None;
            self.inverter.enter(safe, now);
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
            return Err(BenchError::ControlLate(self.seconds(self.now)));
        }
        let t_s = self.seconds(self.now);
        let (demand, enable) = self.operator.demand(t_s);
        let measured = self.sensors.measure(&self.plant, t_s);
        let sample =
            Sample { measured, demand, enable, window: LinkWindow::OPEN, acknowledge: 0, hardware: None };
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
                udc_v: self.sensors.udc_v(t_s),
                f1_hz: report.frequency_hz.into(),
                map_error: report.map_error.into(),
                mode,
                trip: report.trip,
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
