//! The PMaSynRM drive's tasks on its bench.

use crate::ablation::Ablation;
use crate::bench::{Bench, Sampled, Simulated};
use crate::run::{Interrupts, Supervisor, turn};
use anyhow::Result;
use tractive::control::{ControlLaw, Controller};
use tractive::drive::traction::{ControlTask, PwmTask, Settings, Shared};
use tractive::experiment::{Memory, Teller};
use tractive::frames::{Abc, Angle};
use tractive::machine::{Ratings, Tables};
use tractive::modulation::{CarrierHalf, Ladder, Schedule};
use tractive::operator::{self, Feedback, Line, OperatorPort, Request, Slot, Status, TrainLimits, slot_s};
use tractive::ports::{ControlPort, DriveCommand, PwmPort, Report, Sample};
use tractive::protection::{LegFaults, MaskedFaults, SafeState, Trip};
use tractive::protocol::CanEndpoint;
use tractive::recorder::Recorder;
use tractive::thermal::Thermal;
use tractive::time::{Clock, Instant};

/// The bench behind a board's ports; the first error ends the run.
struct Port<'a, 'w> {
    bench: &'a mut Bench,
    without: Option<Ablation>,
    /// The bench's command beside the newest sample, and the count of a position sensor without an angle.
    command: DriveCommand,
    counted: Option<Angle>,
    ratings: &'a Ratings,
    wire: Option<&'a mut Wire<'w>>,
    /// The PWM interrupt's task, in control's interrupt.
    pwm: Option<(&'a mut PwmTask, &'a Shared<'w>)>,
    error: Option<anyhow::Error>,
}

/// The drive's end of the protocol, and the supervisor at the other end.
struct Wire<'w> {
    station: CanEndpoint,
    supervisor: &'w mut dyn Supervisor,
    /// The frames of an identification, sent if the drive's own leave room.
    teller: Option<(Teller, &'w Memory)>,
}

impl Port<'_, '_> {
    /// The findings that the legs' drivers and monitors still report.
    fn found(&self) -> LegFaults {
        let found = self.bench.leg_faults();
        self.without.map_or(found, |without| without.leg_faults(found))
    }
}

impl ControlPort for Port<'_, '_> {
    fn begin(&mut self, revises: bool) {
        if let Some((pwm, shared)) = self.pwm.take().filter(|_| revises) {
            pwm.revise(self, shared);
        }
    }

    fn sample(&mut self, now: Instant) -> Sample {
        let Sampled { sample, command, counted } = self.bench.control_sample(now).unwrap_or_else(|error| {
            self.error = Some(error.into());
            let currents_a = Abc::default();
            let sample = Sample { currents_a, udc_v: 0.0, angle: None, may_pulse: false, hardware: None };
            Sampled { sample, command: DriveCommand::NONE, counted: None }
        });
        (self.command, self.counted) = (command, counted);
        sample
    }

    fn command(&mut self, _now: Instant, operator: impl FnOnce() -> DriveCommand) -> DriveCommand {
        if self.bench.is_operated() { operator() } else { self.command }
    }

    fn enter(&mut self, safe: SafeState, now: Instant) {
        self.bench.enter(now, safe);
    }

    fn overrun_ticks(&mut self, _now: Instant, _deadline_ticks: u32) -> u32 {
        self.bench.control_late_ticks()
    }

    fn report(&mut self, now: Instant, report: impl FnOnce() -> Report) {
        self.bench.control_report(now, report());
    }

    fn leg_faults(&mut self) -> LegFaults {
        self.found()
    }

    fn turned(&mut self) -> Option<Angle> {
        self.counted
    }

    fn align(&mut self, _now: Instant, zero: Angle) {
        self.bench.align(zero);
    }
}

impl PwmPort for Port<'_, '_> {
    fn sample(&mut self, now: Instant) -> Abc {
        self.bench.pwm_sample(now).unwrap_or_else(|error| {
            self.error = Some(error.into());
            Abc::default()
        })
    }

    fn play(&mut self, now: Instant, next: &CarrierHalf) {
        self.bench.play(now, *next);
    }

    fn enter(&mut self, safe: SafeState, now: Instant) {
        self.bench.enter(now, safe);
    }

    fn leave(&mut self, now: Instant) -> bool {
        self.bench.leave(now);
        true
    }

    fn leg_faults(&mut self) -> LegFaults {
        self.found()
    }
}

impl OperatorPort for Port<'_, '_> {
    fn ask(&mut self, at: Instant, slots: u32) -> (Request, Feedback) {
        let (request, feedback) = self.bench.ask(at).unwrap_or_else(|error| {
            self.error = Some(error.into());
            (Request::idle(self.ratings), Feedback::default())
        });
        let Some(wire) = &mut self.wire else { return (request, feedback) };
        let frame = turn(wire.supervisor, self.bench, at).unwrap_or_else(|error| {
            self.error = Some(error);
            None
        });
        (wire.station.listen(slots, frame.as_ref()), feedback)
    }

    fn tell(&mut self, from: Instant, status: &Status, report: Option<&Report>) {
        if let Err(error) = self.bench.told(from, *status) {
            self.error = Some(error.into());
        }
        let Some(wire) = &mut self.wire else { return };
        let more = wire.teller.as_mut();
        let own = wire.station.tell(status, report);
        if let Some(frame) = own.or_else(|| more.and_then(|(teller, memory)| teller.tell(memory))) {
            wire.supervisor.hear(self.bench.instant_s(from), &frame);
        }
    }
}

/// Both tasks and the cells between them, with a control law.
pub struct Tasks<'a, L = Controller> {
    control: ControlTask<&'static Tables, L>,
    pwm: PwmTask,
    shared: Shared<'a>,
    slot: Slot,
    operator: operator::Settings<'static>,
    clock: Clock,
    /// Over the protocol, if there is a supervisor.
    wire: Option<Wire<'a>>,
    without: Option<Ablation>,
    after_control: Option<AfterControl<'a, L>>,
}

/// The work that an image does with its law at the end of a control interrupt that began at the instant; `true` if that begins a slot.
type AfterControl<'a, L> = Box<dyn FnMut(&mut L, Instant, bool) + 'a>;

impl Tasks<'_> {
    /// The tasks before their first interrupts.
    pub fn new(tables: &'static Tables, settings: Settings, first_half_ticks: u32) -> Self {
        Self::beginning_at(Instant(0), tables, settings, first_half_ticks)
    }

    /// The same for timers that start at another instant.
    pub fn beginning_at(
        origin: Instant,
        tables: &'static Tables,
        settings: Settings,
        first_half_ticks: u32,
    ) -> Self {
        Self::with_law(Controller::new(), origin, tables, settings, first_half_ticks)
    }
}

impl<'a, L: ControlLaw> Tasks<'a, L> {
    /// The same with another control law, at rest.
    pub fn with_law(
        law: L,
        origin: Instant,
        tables: &'static Tables,
        settings: Settings,
        first_half_ticks: u32,
    ) -> Self {
        let first_control = origin.after(settings.clock.control_ticks);
        let first_pwm = origin.after(first_half_ticks);
        Self {
            control: ControlTask::with_law(tables, settings, first_control, law),
            pwm: PwmTask::new(tables, settings, first_pwm).after_halves_of(first_half_ticks),
            shared: Shared::new(),
            slot: Slot::new(),
            operator: operator::Settings::rated(&tables.ratings, slot_s(&settings.clock), None),
            clock: settings.clock,
            wire: None,
            without: None,
            after_control: None,
        }
    }

    /// The same with an action at the end of each control interrupt.
    pub fn doing(mut self, after_control: impl FnMut(&mut L, Instant, bool) + 'a) -> Self {
        self.after_control = Some(Box::new(after_control));
        self
    }

    /// The same with an operator who switches the line side, if the bench has one to ask.
    pub fn operated_on(mut self, line: Option<Line>) -> Self {
        self.operator.line = line;
        self
    }

    /// The same with an operator that knows temperature sensors, and how the parts that they are on warm up.
    pub fn warmed_by(mut self, thermal: Option<&'static Thermal>) -> Self {
        self.operator.thermal = thermal;
        self
    }

    /// The same with limits of line and acceleration.
    pub fn limited_to(mut self, train: TrainLimits) -> Self {
        self.operator.train = train;
        self
    }

    /// The same commanded over the protocol, if there is a supervisor.
    pub fn commanded_by(mut self, supervisor: Option<&'a mut (dyn Supervisor + '_)>) -> Self {
        let station = CanEndpoint::new(self.operator.ratings);
        self.wire = supervisor.map(|supervisor| Wire { station, supervisor, teller: None });
        self
    }

    /// The same with the frames that carry the contents of an identification's memory.
    pub fn telling(mut self, memory: &'a Memory) -> Self {
        if let Some(wire) = &mut self.wire {
            wire.teller = Some((Teller::new(), memory));
        }
        self
    }

    /// The same with a flight recorder.
    pub fn recorded_by(mut self, recorder: &'a Recorder) -> Self {
        self.shared = Shared::recorded_by(recorder);
        self
    }

    /// The same with the modes of another ladder.
    pub fn on(self, ladder: Ladder) -> Self {
        Self { control: self.control.scheduled(Schedule::on(ladder, &self.clock)), ..self }
    }

    /// The same with a protection switched off, or none; its levels come from the tables.
    pub fn without(self, without: Option<Ablation>) -> Self {
        let masked = without.map_or(MaskedFaults::NONE, Ablation::masked);
        let (control, pwm) = (self.control.without(masked), self.pwm.without(masked));
        Self { control, pwm, without, ..self }
    }

    /// The control law, between two interrupts.
    pub fn law_mut(&mut self) -> &mut L {
        self.control.law_mut()
    }

    /// The latched fault.
    pub fn trip(&self) -> Option<Trip> {
        self.control.trip().or(self.pwm.trip())
    }
}

impl<L: ControlLaw> Interrupts for Tasks<'_, L> {
    type Bench = Bench;

    fn next_calls(&self) -> [Instant; 2] {
        [self.control.next_call(), self.pwm.next_call()]
    }

    fn pwm(&mut self, bench: &mut Bench) -> Result<()> {
        let ratings = self.operator.ratings;
        let (command, without, wire) = (DriveCommand::NONE, self.without, self.wire.as_mut());
        let mut port = Port { bench, command, counted: None, ratings, without, wire, pwm: None, error: None };
        self.pwm.run(&mut port, &self.shared);
        port.error.map_or(Ok(()), Err)
    }

    fn control(&mut self, bench: &mut Bench) -> Result<()> {
        let operator = match &self.wire {
            Some(wire) => wire.station.settings(&self.operator),
            None => self.operator,
        };
        let ratings = self.operator.ratings;
        let (command, without, wire) = (DriveCommand::NONE, self.without, self.wire.as_mut());
        let pwm = Some((&mut self.pwm, &self.shared));
        let mut port = Port { bench, command, counted: None, ratings, without, wire, pwm, error: None };
        let now = self.control.next_call();
        self.control.run(&mut port, &self.shared);
        if let Some(after_control) = &mut self.after_control {
            after_control(self.control.law_mut(), now, self.shared.operator.has_told(now));
        }
        // The idle loop continues when the interrupt ends.
        if port.bench.is_operated() {
            self.slot.run(&self.shared.operator, &mut port, &operator, &self.clock);
        }
        port.error.map_or(Ok(()), Err)
    }
}
