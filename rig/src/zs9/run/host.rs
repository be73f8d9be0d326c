//! The ZS9's tasks on its bench.

use crate::ablation::Ablation;
use crate::bench::Simulated;
use crate::run::{Interrupts, Supervisor, turn};
use crate::zs9::bench::Bench;
use anyhow::Result;
use tractive::control::{ControlLaw, Controller};
use tractive::drive::dual::{ControlTask, PwmTask, Settings, Shared, TRACKING_RAD_S};
use tractive::frames::Abc;
use tractive::machine::{Ratings, Tables};
use tractive::operator::{
    self, DualDemands, DualRequest, DualSlot, DualStatus, Feedback, Line, OperatorPort, slot_s,
};
use tractive::ports::{
    ControlPort, Dual, DualDriveCommand, DualReport, DualSample, PlayedPeriod, PowerSample, PwmPort,
};
use tractive::protection::{MaskedFaults, SafeState, Trip};
use tractive::protocol::Zs9CanEndpoint;
use tractive::recorder::DualRecorder;
use tractive::time::{Clock, Instant};

/// The bench behind a board's ports; the first error ends the run.
struct Port<'a> {
    bench: &'a mut Bench,
    /// The bench's command that came with the newest sample.
    command: DualDriveCommand,
    error: Option<anyhow::Error>,
}

/// The drive's operator, and the source of its requests.
struct Wire<'w> {
    slot: DualSlot,
    operator: operator::Settings<'static>,
    end: End<'w>,
}

/// The source of the operator's requests.
enum End<'w> {
    /// The protocol: the drive's end of it, and the supervisor at the other end.
    Protocol(Box<Zs9CanEndpoint>, &'w mut dyn Supervisor),
    /// Requests passed directly.
    Direct(Commander),
}

/// Source of the request in every slot.
pub type Commander = Box<dyn FnMut() -> DualRequest + Send>;

/// The sample when there is nothing left to sample.
const NOTHING: DualSample = DualSample {
    currents_a: [Abc { a: 0.0, b: 0.0, c: 0.0 }; 2],
    angles: [None; 2],
    capacitor_v: 0.0,
    inductor_a: 0.0,
    source_v: 0.0,
    may_pulse: false,
    hardware: None,
};

impl ControlPort<Dual> for Port<'_> {
    fn sample(&mut self, now: Instant) -> DualSample {
        let (sample, command) = self.bench.control_sample(now).unwrap_or_else(|error| {
            self.error = Some(error.into());
            (NOTHING, DualDriveCommand::NONE)
        });
        self.command = command;
        sample
    }

    /// The scheme is always the bench's.
    fn command(&mut self, _now: Instant, operator: impl FnOnce() -> DualDriveCommand) -> DualDriveCommand {
        if !self.bench.is_operated() {
            return self.command;
        }
        DualDriveCommand { scheme: self.command.scheme, ..operator().with_link(self.command.link_ref_v) }
    }

    fn enter(&mut self, _safe: SafeState, now: Instant) {
        self.bench.gates_off(now);
    }

    fn overrun_ticks(&mut self, _now: Instant, _deadline_ticks: u32) -> u32 {
        self.bench.control_late_ticks()
    }

    fn report(&mut self, now: Instant, report: impl FnOnce() -> DualReport) {
        self.bench.control_report(now, report());
    }
}

impl PwmPort<Dual> for Port<'_> {
    fn sample(&mut self, now: Instant) -> PowerSample {
        self.bench.power_sample(now).unwrap_or_else(|error| {
            self.error = Some(error.into());
            PowerSample::default()
        })
    }

    fn play(&mut self, _now: Instant, next: &PlayedPeriod) {
        self.bench.play(*next);
    }

    fn enter(&mut self, _safe: SafeState, now: Instant) {
        self.bench.gates_off(now);
    }

    fn leave(&mut self, now: Instant) -> bool {
        self.bench.leave(now);
        true
    }
}

/// The operator's port, with the source of its requests apart.
struct Idle<'a, 'b, 'w> {
    port: &'a mut Port<'b>,
    end: &'a mut End<'w>,
}

impl OperatorPort<DualDemands> for Idle<'_, '_, '_> {
    fn ask(&mut self, at: Instant, slots: u32) -> (DualRequest, Feedback) {
        let feedback = self.port.bench.ask(at).unwrap_or_else(|error| {
            self.port.error = Some(error.into());
            Feedback::default()
        });
        let request = match self.end {
            End::Direct(commander) => commander(),
            End::Protocol(station, supervisor) => {
                let frame = turn(*supervisor, self.port.bench, at).unwrap_or_else(|error| {
                    self.port.error = Some(error);
                    None
                });
                station.listen(slots, frame.as_ref())
            }
        };
        (request, feedback)
    }

    fn tell(&mut self, from: Instant, status: &DualStatus, report: Option<&DualReport>) {
        if let Err(error) = self.port.bench.told(from, *status) {
            self.port.error = Some(error.into());
        }
        if let End::Protocol(station, supervisor) = self.end
            && let Some(frame) = station.tell(status, report)
        {
            supervisor.hear(self.port.bench.instant_s(from), &frame);
        }
    }
}

/// Both tasks and the cells that they share.
pub struct Tasks<'a, L = Controller<false>> {
    control: ControlTask<&'static Tables, L>,
    pwm: PwmTask,
    shared: Shared<'a>,
    clock: Clock,
    /// The operator, if there is one.
    wire: Option<Wire<'a>>,
}

impl<'a> Tasks<'a> {
    /// Before their first interrupts.
    pub fn new(tables: &'static Tables, settings: Settings) -> Self {
        Self::beginning_at(Instant(0), tables, settings)
    }

    /// The same for timers that start at another instant.
    pub fn beginning_at(origin: Instant, tables: &'static Tables, settings: Settings) -> Self {
        Self::with_law(Controller::with_tracking(TRACKING_RAD_S), origin, tables, settings)
    }
}

impl<'a, L: ControlLaw + Copy> Tasks<'a, L> {
    /// The same with another control law, at rest, for each motor.
    pub fn with_law(law: L, origin: Instant, tables: &'static Tables, settings: Settings) -> Self {
        Self {
            control: ControlTask::with_laws(tables, settings, law, law).beginning_at(origin),
            pwm: PwmTask::new(tables, settings).beginning_at(origin),
            shared: Shared::new(),
            clock: settings.clock,
            wire: None,
        }
    }

    /// The same commanded over the protocol on this line side, if there is a supervisor.
    pub fn commanded_by(
        mut self,
        supervisor: Option<&'a mut (dyn Supervisor + '_)>,
        ratings: Ratings,
        line: Option<Line>,
    ) -> Self {
        self.wire = supervisor.map(|supervisor| {
            self.wire(ratings, line, |ratings| {
                End::Protocol(Box::new(Zs9CanEndpoint::new(ratings)), supervisor)
            })
        });
        self
    }

    /// The same with an operator on this line side whose requests come from a commander.
    pub fn operated_by(mut self, commander: Commander, ratings: Ratings, line: Option<Line>) -> Self {
        self.wire = Some(self.wire(ratings, line, |_| End::Direct(commander)));
        self
    }

    fn wire(
        &self,
        ratings: Ratings,
        line: Option<Line>,
        end: impl FnOnce(&'static Ratings) -> End<'a>,
    ) -> Wire<'a> {
        // One per run, kept for the program's lifetime like the tables.
        let ratings: &'static Ratings = Box::leak(Box::new(ratings));
        let operator = operator::Settings::rated(ratings, slot_s(&self.clock), line);
        Wire { slot: DualSlot::new(), operator, end: end(ratings) }
    }

    /// The same with a flight recorder.
    pub fn recorded_by(mut self, recorder: &'a DualRecorder) -> Self {
        self.shared = Shared::recorded_by(recorder);
        self
    }

    /// The same with one protection off, or none; the tables and the settings determine its levels.
    pub fn without(self, without: Option<Ablation>) -> Self {
        let masked = without.map_or(MaskedFaults::NONE, Ablation::masked);
        Self { control: self.control.without(masked), pwm: self.pwm.without(masked), ..self }
    }

    /// The latched fault.
    pub fn trip(&self) -> Option<Trip> {
        self.control.trip().or(self.pwm.trip())
    }
}

impl<L: ControlLaw + Copy> Interrupts for Tasks<'_, L> {
    type Bench = Bench;

    /// The two never coincide: control comes at valleys, PWM at peaks.
    fn next_calls(&self) -> [Instant; 2] {
        [self.control.next_call(), self.pwm.next_call()]
    }

    fn pwm(&mut self, bench: &mut Bench) -> Result<()> {
        let mut port = Port { bench, command: DualDriveCommand::NONE, error: None };
        self.pwm.run(&mut port, &self.shared);
        port.error.map_or(Ok(()), Err)
    }

    fn control(&mut self, bench: &mut Bench) -> Result<()> {
        let mut port = Port { bench, command: DualDriveCommand::NONE, error: None };
        self.control.run(&mut port, &self.shared);
        // The idle loop continues after the interrupt.
        if let Some(Wire { slot, operator, end }) = &mut self.wire {
            let settings = match &*end {
                End::Protocol(station, _) => station.settings(operator),
                End::Direct(_) => *operator,
            };
            let mut idle = Idle { port: &mut port, end };
            slot.run(&self.shared.operator, &mut idle, &settings, &self.clock);
        }
        port.error.map_or(Ok(()), Err)
    }
}
