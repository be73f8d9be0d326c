//! The ZS9's bench: plant, gates and sensors in the timers' time, sampled and recorded.
//!
//! Time is counted in compare steps of the firmware's timers, so both sides agree on every edge. As on the first
//! system's bench nothing runs ahead of what is decided, and what an interrupt orders takes effect at a fixed delay after
//! its nominal instant.

use super::inject::{Injection, Kind, Spoiler};
use super::line::{LineSide, LineTimes};
use super::operator::{Operator, Orders};
use super::sensors::Sensors;
use super::trace::{Edge, MotorRow, Recording, Row};
use crate::bench::{Converter, Flaws, Limits, Observed, Peaks, Stored, Tick};
use crate::benchmark::in_plant;
use crate::plant::zs9::{IllegalState, LegGates, NetworkState, Source, Zs9Plant};
use crate::run::Supervised;
use crate::steps::held;
use std::collections::VecDeque;
use tractive::board::{DualSample, GateFeedback, HardwareBreak, PlayedPeriod, PowerSample};
use tractive::drive::dual::{COMPARE_STEPS, DualReport, Settings};
use tractive::frames::Abc;
use tractive::nine_switch::Scheme;
use tractive::operator::{DualStatus, Feedback};
use tractive::protection::{Fault, SafeState};
use tractive::recorder::DualRecord;
use tractive::time::{Clock, Instant};

/// Compare steps since the run's beginning.
pub type Steps = u64;

/// How long after its nominal instant the control interrupt's order to turn the gates off reaches them, in ticks (75 µs): its
/// latest deadline.
const CONTROL_OFF_TICKS: u32 = 1875;
/// The same for the PWM interrupt (25 µs), as a bound on its length.
const PWM_OFF_TICKS: u32 = 625;

/// How far a current's reading may be off without making a difference that counts, in A: a tenth of a machine's largest current.
const MUCH_A: f32 = 8.49;

/// The capacitor behind the source's contactor, in F: as large as the network's.
const INPUT_F: f64 = 500e-6;
/// Longest step of its voltage, in s.
const LONGEST_LOST_S: f64 = 10e-6;

/// Why the bench cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// A carrier period ended and nothing follows.
    #[error("at {0:.6} s the carrier period ended and no next one had been loaded")]
    NothingToPlay(f64),
    /// A sample was asked for that is not there.
    #[error("the control sample of step {0} was asked for and is not there")]
    NoSample(Steps),
    /// Control fell behind.
    #[error("at {0:.6} s the control interrupt has not reported within its period")]
    ControlLate(f64),
    /// The operator asked for a slot that is not there.
    #[error("the operator's slot of tick {0} was asked for and is not kept")]
    NoSlot(Tick),
    /// The operator fell behind.
    #[error("at {0:.6} s the operator has not finished its slot before the next one")]
    OperatorLate(f64),
    /// The gates asked for what the bridge must not have.
    #[error(transparent)]
    Illegal(#[from] IllegalState),
}

/// Fixed properties of a bench.
#[derive(Clone, Copy, Debug)]
pub struct BenchSettings {
    /// The firmware's clock.
    pub clock: Clock,
    /// Carrier period, in ticks.
    pub carrier_ticks: u32,
    /// Before the recording, in s.
    pub lead_s: f64,
    /// Length of the recording, in s.
    pub duration_s: f64,
    /// Step of the trace, in s.
    pub trace_step_s: f64,
    /// Link voltage wanted, in V.
    pub link_ref_v: f64,
    /// Where the zero vectors lie.
    pub scheme: Scheme,
    /// Imperfections of the sensors and of the source.
    pub flaws: Flaws,
    /// What goes wrong.
    pub injection: Option<Injection>,
    /// Beyond what it is said to make a difference.
    pub limits: Limits,
    /// Whether edges are kept.
    pub edges: bool,
    /// Time for which a gate that turns on where another one of its leg turns off has to wait, in s.
    pub dead_time_s: f64,
}

/// What changes by itself while it drives: times in s from the recording's beginning, each value from its time on.
#[derive(Clone, Debug, Default)]
pub struct Course {
    /// Voltages of the source, in V; the plant's own before the first.
    pub source_v: Vec<(f64, f64)>,
    /// Schemes; the settings' before the first.
    pub schemes: Vec<(f64, Scheme)>,
}

/// What is summed up over a step of the trace, each value times its time, in steps.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    steps: f64,
    torque_refs: [f64; 2],
    loads: [f64; 2],
    source_v: f64,
    shorted: f64,
}

/// Plant, gates, sensors and recorder.
pub struct Bench {
    plant: Zs9Plant,
    operator: Box<dyn Operator + Send>,
    settings: BenchSettings,
    sensors: Sensors,
    spoiler: Spoiler,
    nominal_source_v: f64,
    step_s: f64,
    /// Where the timers started.
    origin: Steps,
    now: Steps,
    lead: Steps,
    course: Course,
    rows_wanted: usize,
    /// Beginning of the carrier period that is played, and its length.
    begun: Steps,
    period: Steps,
    next: Option<PlayedPeriod>,
    /// Toggles of the running period that are still to come, the last one first.
    toggles: Vec<(Steps, u8)>,
    /// What the gates are ordered to be, what they are, and when those that wait for the dead time turn on.
    ordered: [bool; 9],
    levels: [bool; 9],
    turn_on: [Option<Steps>; 9],
    dead_time: Steps,
    off: bool,
    /// When the gates go off (true) or may be played again (false).
    off_at: Option<(Steps, bool)>,
    line: Option<LineSide>,
    /// Loads to come, by their steps.
    loads: VecDeque<(Steps, [f64; 2])>,
    loads_nm: Option<[f64; 2]>,
    observed: Observed,
    feedback: GateFeedback,
    orders: Orders,
    samples: VecDeque<(Steps, DualSample)>,
    next_sample: Steps,
    reports: VecDeque<(Steps, DualReport)>,
    report: DualReport,
    next_row: Steps,
    sums: Sums,
    rows: Vec<Row>,
    edges: Vec<Edge>,
}

impl Bench {
    /// A bench at its first instant, gates off.
    pub fn new(plant: Zs9Plant, mut operator: Box<dyn Operator + Send>, settings: BenchSettings) -> Self {
        let step_s = f64::from(settings.clock.ticks_per_s).recip() / f64::from(COMPARE_STEPS);
        let steps = |seconds: f64| (seconds / step_s).round() as Steps;
        let lead = steps(settings.lead_s);
        let rows_wanted = (settings.duration_s / settings.trace_step_s).round() as usize;
        let speeds = plant.motors().each_ref().map(|motor| motor.speed_rpm());
        let control = Steps::from(settings.clock.control_ticks * COMPARE_STEPS);
        let from = settings.injection.map_or(Steps::MAX, |injection| steps(settings.lead_s + injection.at_s));
        Self {
            orders: operator.orders(-settings.lead_s, speeds),
            nominal_source_v: plant.source_v(),
            plant,
            operator,
            sensors: Sensors::new(Converter::new(settings.flaws)),
            spoiler: Spoiler::new(settings.injection),
            step_s,
            origin: 0,
            now: 0,
            lead,
            course: Course::default(),
            rows_wanted,
            begun: 0,
            period: Steps::from(settings.carrier_ticks * COMPARE_STEPS),
            next: Some(PlayedPeriod::off(settings.carrier_ticks / 2 * COMPARE_STEPS)),
            toggles: Vec::with_capacity(36),
            ordered: [false; 9],
            levels: [false; 9],
            turn_on: [None; 9],
            dead_time: steps(settings.dead_time_s),
            off: false,
            off_at: None,
            line: None,
            loads: VecDeque::new(),
            loads_nm: None,
            observed: Observed::new(from, settings.limits),
            feedback: GateFeedback::default(),
            samples: VecDeque::new(),
            next_sample: control,
            reports: VecDeque::new(),
            report: DualReport::default(),
            next_row: lead,
            sums: Sums::default(),
            rows: Vec::with_capacity(rows_wanted.min(1 << 20)),
            edges: Vec::new(),
            settings,
        }
    }

    /// The same with a line side: the network is empty, behind open contactors, and the drive has an operator.
    pub fn with_line(mut self, times: LineTimes) -> Self {
        self.line = Some(LineSide::new(times, &self.settings.clock));
        self.plant.set_network(NetworkState::even(0.0, LineSide::EMPTY_V));
        self
    }

    /// Whether the drive has an operator.
    pub fn is_operated(&self) -> bool {
        self.line.is_some()
    }

    /// What the board says to the operator in the slot that began at `instant`.
    pub fn ask(&mut self, instant: Instant) -> Result<Feedback, BenchError> {
        let tick = self.widen(instant) / Steps::from(COMPARE_STEPS);
        self.line
            .as_mut()
            .and_then(|line| line.gear.ask(tick))
            .map(|(_, feedback)| feedback)
            .ok_or(BenchError::NoSlot(tick))
    }

    /// What the operator told; it holds from `from` on.
    pub fn told(&mut self, from: Instant, status: DualStatus) -> Result<(), BenchError> {
        let step = self.widen(from);
        if step < self.now {
            return Err(BenchError::OperatorLate(self.seconds(step)));
        }
        if let Some(line) = &mut self.line {
            line.gear.tell(step / Steps::from(COMPARE_STEPS), status);
        }
        Ok(())
    }

    /// What holds the gates off in hardware now.
    fn hardware(&self) -> Option<Fault> {
        self.spoiler.hardware(self.seconds(self.now))
    }

    /// The same beginning at another tick than 0, with tasks of [`super::run::Tasks::beginning_at`] the same: where instants wrap.
    pub fn beginning_at(mut self, origin_ticks: u64) -> Self {
        self.origin = origin_ticks * Steps::from(COMPARE_STEPS);
        for step in
            [&mut self.now, &mut self.lead, &mut self.begun, &mut self.next_sample, &mut self.next_row]
        {
            *step += self.origin;
        }
        self.observed.from = self.observed.from.saturating_add(self.origin);
        self
    }

    /// The same with a source and schemes that change.
    pub fn following(mut self, course: Course) -> Self {
        self.course = course;
        self
    }

    /// The motors' true speeds, in r/min.
    pub fn speeds_rpm(&self) -> [f64; 2] {
        self.plant.motors().each_ref().map(|motor| motor.speed_rpm())
    }

    /// Whether the recording is complete.
    pub fn is_done(&self) -> bool {
        self.rows.len() >= self.rows_wanted
    }

    /// Share of the run that is done, 0 ..= 1.
    pub fn progress(&self) -> f64 {
        let end_s = self.settings.lead_s + self.settings.duration_s;
        ((self.now - self.origin) as f64 * self.step_s / end_s).min(1.0)
    }

    /// What was recorded: what the bench saw, and what the drive's own recorder holds; instants in seconds from its beginning.
    pub fn into_recording(self, records: Vec<DualRecord>) -> Recording {
        let recorded =
            records.into_iter().map(|record| (self.seconds(self.widen(record.at)), record)).collect();
        Recording { rows: self.rows, edges: self.edges, recorded }
    }

    /// The conversions that the control timer triggered at `instant`.
    pub fn control_sample(&mut self, instant: Instant) -> Result<DualSample, BenchError> {
        let at = self.widen(instant);
        self.advance(at)?;
        match self.samples.pop_front() {
            Some((sampled, sample)) if sampled == at => Ok(sample),
            _ => Err(BenchError::NoSample(at)),
        }
    }

    /// The control interrupt's report; it shows in the trace when the command takes effect.
    pub fn control_report(&mut self, instant: Instant, report: DualReport) {
        let control = Steps::from(self.settings.clock.control_ticks * COMPARE_STEPS);
        self.reports.push_back((self.widen(instant) + control, report));
    }

    /// What the PWM interrupt converts at the peak `instant`.
    pub fn power_sample(&mut self, instant: Instant) -> Result<PowerSample, BenchError> {
        let at = self.widen(instant);
        self.advance(at)?;
        let feedback = std::mem::take(&mut self.feedback);
        let mut sample = self.sensors.power(&self.plant, feedback);
        if self.line.is_some() {
            // The source's sensor is in front of the contactors.
            sample.source_v = self.nominal_source_v as f32;
        }
        let true_a = sample.currents_a;
        self.spoiler.power(self.seconds(at), &mut sample);
        self.compare(true_a, sample.currents_a);
        Ok(sample)
    }

    /// Notes readings that are off by more than a little.
    fn compare(&mut self, true_a: [Abc; 2], read_a: [Abc; 2]) {
        let off = |(read, told): (Abc, Abc)| {
            (read.a - told.a).abs().max((read.b - told.b).abs()).max((read.c - told.c).abs())
        };
        let most_a = read_a.into_iter().zip(true_a).map(off).fold(0.0, f32::max);
        if most_a > MUCH_A {
            self.observed.makes_a_difference(self.now);
        }
    }

    /// The period to play from the next valley on.
    pub fn play(&mut self, next: PlayedPeriod) {
        self.next = Some(next);
    }

    /// An interrupt at `instant` turns all gates off.
    pub fn gates_off(&mut self, instant: Instant) {
        let from = self.widen(instant);
        let control = Steps::from(self.settings.clock.control_ticks * COMPARE_STEPS);
        let is_control = (from - self.origin).is_multiple_of(control);
        let delay = if is_control { CONTROL_OFF_TICKS } else { PWM_OFF_TICKS };
        let at = from + Steps::from(delay * COMPARE_STEPS);
        self.off_at = match self.off_at {
            Some((earlier, true)) => Some((earlier.min(at), true)),
            _ => Some((at, true)),
        };
    }

    /// The PWM interrupt at `instant` lets the gates be played again.
    pub fn leave(&mut self, instant: Instant) {
        let at = self.widen(instant) + Steps::from(PWM_OFF_TICKS * COMPARE_STEPS);
        // An order to turn them off that comes meanwhile stands.
        if self.off_at.is_none() {
            self.off_at = Some((at, false));
        }
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

    /// Length of a compare step, in s.
    pub fn step_s(&self) -> f64 {
        self.step_s
    }

    /// The gates as they are: what is stuck does not do what it is told.
    fn real_levels(&self) -> [bool; 9] {
        let mut levels = self.levels;
        match self.spoiler.kind(self.seconds(self.now)) {
            // What turns the gates off for good holds the drivers, whatever they are ordered.
            Some(Kind::Gate(gate, on)) if !self.off => levels[usize::from(gate)] = on,
            Some(Kind::ShootThrough(leg)) if !self.off => {
                for gate in [leg, leg + 3, leg + 6] {
                    levels[usize::from(gate)] = true;
                }
            }
            _ => {}
        }
        levels
    }

    /// What happens to source and network, and what the plant shows.
    fn watch(&mut self) {
        let kind = self.spoiler.kind(self.seconds(self.now));
        match kind {
            Some(Kind::SourceSwitchOpen) => self.plant.set_source(Source::Diode),
            Some(Kind::CapacitorsHalved) if self.now == self.observed.from => {
                let capacitance_f = 0.5 * self.plant.network_parts().capacitance_f;
                self.plant.set_capacitance_f(capacitance_f);
            }
            _ => {}
        }
        let [upper, lower] = self.plant.motors().each_ref().map(|motor| motor.currents_abc());
        let [a, b, c] = upper;
        let [d, e, f] = lower;
        let [v1, v2] = self.plant.network().capacitors_v;
        let peaks = Peaks::at(&[a, b, c, d, e, f], self.plant.link_v(), v1.max(v2));
        let speeds = self.plant.motors().each_ref().map(|motor| motor.speed_rpm().abs());
        self.observed.note(self.now, &peaks, speeds[0].max(speeds[1]));
        // Of a gate that stays off, [`Self::begin_period`] knows which pulses count.
        let disobey = !matches!(kind, Some(Kind::Gate(_, false))) && self.real_levels() != self.levels;
        if disobey || self.plant.source_v() < self.settings.limits.source_v {
            self.observed.makes_a_difference(self.now);
        }
    }

    /// What is stored in network and motors, and how high the capacitors go with the network's own oscillation.
    fn stored(&self) -> Stored {
        let (parts, network) = (self.plant.network_parts(), self.plant.network());
        let (source_v, link_v) = (self.plant.source_v(), self.plant.link_v().max(self.plant.source_v()));
        let surge_v = network.inductor_a() * (parts.inductance_h / parts.capacitance_f).sqrt();
        let motors = self.plant.motors();
        Stored {
            unloaded_v: source_v + (network.capacitor_v() - source_v).hypot(surge_v),
            field_j: motors.iter().map(|motor| motor.field_j()).sum(),
            braked_j: motors.iter().map(|motor| motor.braked_j(link_v)).sum(),
            short_circuit_a: motors.iter().map(|motor| motor.short_circuit_peak_a()).fold(0.0, f64::max),
        }
    }

    /// The step of an instant near to now.
    fn widen(&self, instant: Instant) -> Steps {
        let ticks = self.now / Steps::from(COMPARE_STEPS);
        let ahead = i64::from(instant.since(Instant(ticks as u32)));
        ticks.saturating_add_signed(ahead) * Steps::from(COMPARE_STEPS)
    }

    fn seconds(&self, at: Steps) -> f64 {
        (at as f64 - self.lead as f64) * self.step_s
    }

    /// Runs to `to`, doing on the way all that is due, and at `to` itself too.
    fn advance(&mut self, to: Steps) -> Result<(), BenchError> {
        if self.now == self.origin && self.next.is_some() {
            self.begin_period()?;
        }
        while self.now < to {
            let mut due = to.min(self.begun + self.period).min(self.next_sample).min(self.next_row);
            if self.observed.from > self.now {
                due = due.min(self.observed.from);
            }
            if let Some((toggle, _)) = self.toggles.last() {
                due = due.min(*toggle);
            }
            if let Some((off_at, _)) = self.off_at {
                due = due.min(off_at.max(self.now));
            }
            if let Some(event) = self.line.as_ref().and_then(|line| line.gear.next_event()) {
                due = due.min((event * Steps::from(COMPARE_STEPS)).max(self.now + 1));
            }
            if let Some((at, _)) = self.loads.front() {
                due = due.min((*at).max(self.now + 1));
            }
            if let Some(turn_on) = self.turn_on.iter().flatten().min() {
                due = due.min(*turn_on);
            }
            self.integrate(due)?;
            self.act()?;
        }
        Ok(())
    }

    fn integrate(&mut self, to: Steps) -> Result<(), BenchError> {
        if to <= self.now {
            return Ok(());
        }
        if self.spoiler.kind(self.seconds(self.now)) == Some(Kind::SourceLost) {
            let longest = (LONGEST_LOST_S / self.step_s).round() as Steps;
            while self.now + longest < to {
                self.integrate_lost(self.now + longest)?;
            }
            return self.integrate_lost(to);
        }
        self.integrate_fed(to)
    }

    /// With the source cut off: what its capacitor gives it loses.
    fn integrate_lost(&mut self, to: Steps) -> Result<(), BenchError> {
        let before_j = self.plant.energies().source_j;
        self.integrate_fed(to)?;
        let given_j = self.plant.energies().source_j - before_j;
        let square = self.plant.source_v().powi(2) - 2.0 * given_j / INPUT_F;
        self.plant.set_source_v(square.max(1.0).sqrt());
        Ok(())
    }

    fn integrate_fed(&mut self, to: Steps) -> Result<(), BenchError> {
        let steps = (to - self.now) as f64;
        if let Some(line) = &self.line {
            line.feed(&mut self.plant, self.nominal_source_v, steps * self.step_s);
        }
        let real = self.real_levels();
        let [uh, vh, wh, um, vm, wm, ul, vl, wl] = real;
        let gates = [(uh, um, ul), (vh, vm, vl), (wh, wm, wl)].map(|(high, middle, low)| LegGates {
            high,
            middle,
            low,
        });
        if real == self.levels {
            let gates = self.as_diodes_have_it(gates);
            in_plant(|| self.plant.advance(gates, steps * self.step_s))?;
        } else {
            self.plant.advance_any(gates, steps * self.step_s);
        }
        for (gate, on) in real.into_iter().enumerate() {
            let latch = if on { &mut self.feedback.on } else { &mut self.feedback.off };
            *latch |= 1 << gate;
        }
        let sums = &mut self.sums;
        sums.steps += steps;
        sums.source_v += steps * self.plant.source_v();
        for k in 0..2 {
            sums.torque_refs[k] += steps * f64::from(self.report.torque_nm[k]);
            sums.loads[k] += steps * self.orders.loads_nm[k];
        }
        if gates.contains(&LegGates::SHOOT_THROUGH) {
            sums.shorted += steps;
        }
        self.now = to;
        self.watch();
        Ok(())
    }

    fn act(&mut self) -> Result<(), BenchError> {
        match self.off_at {
            Some((at, true)) if at <= self.now => {
                self.off_at = None;
                self.off = true;
                self.toggles.clear();
                self.order([false; 9]);
                self.observed.enters(self.now, SafeState::GatesOff, self.stored());
            }
            Some((at, false)) if at <= self.now => {
                self.off_at = None;
                self.off = false;
            }
            _ => {}
        }
        if let Some(line) = &mut self.line {
            line.act(self.now / Steps::from(COMPARE_STEPS));
        }
        while let Some((at, loads_nm)) = self.loads.front().copied()
            && at <= self.now
        {
            self.loads.pop_front();
            self.loads_nm = Some(loads_nm);
            for (motor, load_nm) in self.plant.motors_mut().iter_mut().zip(loads_nm) {
                motor.set_load_nm(load_nm);
            }
        }
        let mut ordered = self.ordered;
        while let Some((at, gate)) = self.toggles.last().copied()
            && at <= self.now
        {
            self.toggles.pop();
            ordered[usize::from(gate)] ^= true;
        }
        self.order(ordered);
        for gate in 0..9 {
            if self.turn_on[usize::from(gate)].is_some_and(|at| at <= self.now) {
                self.turn_on[usize::from(gate)] = None;
                self.set(gate, true);
            }
        }
        if self.now == self.begun + self.period {
            self.begun = self.now;
            self.begin_period()?;
        }
        if self.now == self.next_row {
            self.record();
        }
        if self.now == self.next_sample {
            self.take_sample()?;
        }
        Ok(())
    }

    /// The next period takes over at a valley.
    fn begin_period(&mut self) -> Result<(), BenchError> {
        let period = self.next.take().ok_or(BenchError::NothingToPlay(self.seconds(self.now)))?;
        self.toggles.clear();
        if self.off {
            return Ok(());
        }
        if let Some(Kind::Gate(gate, false)) = self.spoiler.kind(self.seconds(self.now)) {
            let pause = &period.gates[usize::from(gate)];
            let drive = Settings::new(self.settings.clock, self.settings.carrier_ticks);
            // Dead times may swallow a shorter pulse.
            if pause.off_to - pause.off_from < drive.longest_pause_steps() {
                self.observed.makes_a_difference(self.now);
            }
        }
        let half = self.period / 2;
        let mut ordered = self.ordered;
        for (gate, pause) in (0_u8..).zip(&period.gates) {
            let (from, to) = (Steps::from(pause.off_from), Steps::from(pause.off_to));
            let paused = from < to;
            ordered[usize::from(gate)] = !(paused && from == 0);
            let ends = [(from, paused && from > 0), (to, paused && to < half)];
            for (at, _) in ends.into_iter().filter(|(_, counts)| *counts) {
                self.toggles.push((self.begun + at, gate));
                self.toggles.push((self.begun + self.period - at, gate));
            }
        }
        self.toggles.sort_unstable_by_key(|(at, gate)| (std::cmp::Reverse(*at), *gate));
        self.order(ordered);
        Ok(())
    }

    /// New orders to the gates. One that turns on where another one of its leg turns off waits for the dead time; one that
    /// turns on alone shorts its leg on purpose, at once.
    fn order(&mut self, ordered: [bool; 9]) {
        if ordered == self.ordered {
            return;
        }
        for leg in 0..3_u8 {
            let gates = [leg, leg + 3, leg + 6];
            let changes = |gate: u8, to: bool| {
                ordered[usize::from(gate)] == to && self.ordered[usize::from(gate)] != to
            };
            let turns_off = gates.map(|gate| changes(gate, false));
            let turns_on = gates.map(|gate| changes(gate, true));
            let waits = self.dead_time > 0 && turns_off.contains(&true);
            for (gate, _) in gates.into_iter().zip(turns_off).filter(|(_, turns)| *turns) {
                self.turn_on[usize::from(gate)] = None;
                self.set(gate, false);
                // Whoever waits already waits for this one too.
                for other in gates.map(usize::from) {
                    self.turn_on[other] = self.turn_on[other].map(|_| self.now + self.dead_time);
                }
            }
            for (gate, _) in gates.into_iter().zip(turns_on).filter(|(_, turns)| *turns) {
                if waits {
                    self.turn_on[usize::from(gate)] = Some(self.now + self.dead_time);
                } else {
                    self.set(gate, true);
                }
            }
        }
        self.ordered = ordered;
    }

    /// The legs with the states that the diodes give those which wait for a gate: the current of a node that is not tied to a rail
    /// chooses it. Out of the node it flows through a diode from below, into it through one from above.
    fn as_diodes_have_it(&self, gates: [LegGates; 3]) -> [LegGates; 3] {
        if self.dead_time == 0 || self.off {
            return gates;
        }
        let [upper, lower] = self.plant.motors().each_ref().map(|motor| motor.currents_abc());
        core::array::from_fn(|leg| {
            let choose =
                |current_a: f64, out: LegGates, into: LegGates| if current_a > 0.0 { out } else { into };
            match (gates[leg].high, gates[leg].middle, gates[leg].low) {
                (false, false, true) => choose(upper[leg], LegGates::ZERO, LegGates::ONE),
                (true, false, false) => choose(lower[leg], LegGates::ONE, LegGates::MINUS_ONE),
                (false, true, false) => choose(upper[leg] + lower[leg], LegGates::ZERO, LegGates::MINUS_ONE),
                // Two exchanges within a dead time: both nodes are free; where their currents pull them together, the sum chooses.
                (false, false, false) if upper[leg] <= 0.0 => {
                    choose(lower[leg], LegGates::ONE, LegGates::MINUS_ONE)
                }
                (false, false, false) => {
                    choose(upper[leg] + lower[leg].min(0.0), LegGates::ZERO, LegGates::MINUS_ONE)
                }
                _ => gates[leg],
            }
        })
    }

    fn set(&mut self, gate: u8, on: bool) {
        let level = &mut self.levels[usize::from(gate)];
        if *level != on {
            *level = on;
            if self.settings.edges && self.now >= self.lead {
                self.edges.push(Edge { t_s: self.seconds(self.now), gate, on });
            }
        }
    }

    fn take_sample(&mut self) -> Result<(), BenchError> {
        if self.samples.len() > 1 {
            if self.has_control(Instant((self.now / Steps::from(COMPARE_STEPS)) as u32)) {
                return Err(BenchError::ControlLate(self.seconds(self.now)));
            }
            self.samples.clear();
        }
        self.next_sample = self.now + Steps::from(self.settings.clock.control_ticks * COMPARE_STEPS);
        let t_s = self.seconds(self.now);
        let speeds = self.plant.motors().each_ref().map(|motor| motor.speed_rpm());
        self.orders = self.operator.orders(t_s, speeds);
        if let Some(loads_nm) = self.loads_nm {
            self.orders.loads_nm = loads_nm;
        }
        for (motor, load_nm) in self.plant.motors_mut().iter_mut().zip(self.orders.loads_nm) {
            motor.set_load_nm(load_nm);
        }
        let healthy_v = held(&self.course.source_v, t_s).unwrap_or(self.nominal_source_v);
        let supply_v = healthy_v + self.sensors.ripple_v(t_s);
        // What is cut off is its capacitor's.
        let source_v = if self.spoiler.kind(t_s) == Some(Kind::SourceLost) {
            self.plant.source_v()
        } else {
            self.spoiler.source_v(t_s, supply_v)
        };
        let hardware = self.hardware();
        match &mut self.line {
            None => self.plant.set_source_v(source_v),
            Some(line) => {
                let tick = self.now / Steps::from(COMPARE_STEPS);
                if line.gear.sampled(tick, hardware, || ()) {
                    return Err(BenchError::OperatorLate(t_s));
                }
            }
        }
        let network = self.plant.network();
        let mut sample = DualSample {
            currents_a: self.sensors.currents(&self.plant),
            angles: self.plant.motors().each_ref().map(|motor| Some(self.sensors.angle(motor))),
            capacitor_v: network.capacitor_v() as f32,
            inductor_a: network.inductor_a() as f32,
            source_v: source_v as f32,
            demands: self.orders.demands,
            link_ref_v: self.settings.link_ref_v as f32,
            scheme: held(&self.course.schemes, t_s).unwrap_or(self.settings.scheme),
            enable: self.orders.enable && hardware.is_none(),
            speed_torque_nm: DualSample::UNLIMITED_NM,
            acknowledge: 0,
            hardware: hardware.map(|fault| HardwareBreak { fault, seen: 1 }),
        };
        let true_a = sample.currents_a;
        self.spoiler.control(t_s, &mut sample);
        self.compare(true_a, sample.currents_a);
        self.samples.push_back((self.now, sample));
        self.show_reports();
        Ok(())
    }

    /// Reports whose commands have taken effect.
    fn show_reports(&mut self) {
        while let Some((effective, report)) = self.reports.front()
            && *effective <= self.now
        {
            self.report = *report;
            self.reports.pop_front();
        }
    }

    /// Ends the row that ends now, if one has begun.
    fn record(&mut self) {
        let sums = std::mem::take(&mut self.sums);
        let means = self.plant.take_means();
        if self.now > self.lead
            && !self.is_done()
            && let Some(means) = means
        {
            let motors = [0, 1].map(|k| {
                let motor = &means.motors[k];
                MotorRow {
                    speed_rpm: motor.speed_rpm,
                    torque_ref_nm: sums.torque_refs[k] / sums.steps,
                    torque_nm: motor.torque_nm,
                    id_a: motor.id_a,
                    iq_a: motor.iq_a,
                    phases_a: motor.phases_a,
                    load_nm: sums.loads[k] / sums.steps,
                    voltage_v: self.report.voltage_v[k].into(),
                    weakening: self.report.weakening[k],
                }
            });
            self.rows.push(Row {
                t_s: self.rows.len() as f64 * self.settings.trace_step_s,
                motors,
                link_v: means.link_v,
                capacitor_v: means.capacitor_v,
                inductor_a: means.inductor_a,
                source_v: sums.source_v / sums.steps,
                duty: sums.shorted / sums.steps,
                scheme: self.report.scheme,
                trip: self.report.trip,
                source_j: self.plant.energies().source_j,
                kinetic_speed_rpm: self.plant.motors().each_ref().map(|motor| motor.speed_rpm()),
                explained_j: self.plant.energies().source_j - self.plant.residual_j(0.0),
            });
        }
        let end_s = (self.rows.len() + 1) as f64 * self.settings.trace_step_s;
        self.next_row = self.lead + ((end_s / self.step_s).round() as Steps).max(self.now + 1 - self.lead);
        self.show_reports();
    }
}

impl Supervised for Bench {
    fn instant_s(&self, instant: Instant) -> f64 {
        self.seconds(self.widen(instant))
    }

    fn loads_from(&mut self, instant: Instant, loads_nm: [f64; 2]) {
        self.loads.push_back((self.widen(instant), loads_nm));
    }

    fn end_at(&mut self, instant: Instant) {
        let end_s = self.seconds(self.widen(instant));
        self.rows_wanted = self.rows_wanted.min((end_s / self.settings.trace_step_s).round() as usize);
    }
}
