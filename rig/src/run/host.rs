//! The drive on the host: the firmware's own tasks, called in the order in which their interrupts would come.

use super::{Progress, Supervisor, Turn};
use crate::bench::{Bench, BenchError};
use crate::trace::Recording;
use tractive::board::{ControlPort, PwmPort, Sample};
use tractive::control::{Demand, LinkWindow, Measurements};
use tractive::drive::Report;
use tractive::drive::traction::{ControlTask, PwmTask, Settings, Shared};
use tractive::frames::{Abc, Angle};
use tractive::link::{SlotAnswer, SlotRequest};
use tractive::machine::Tables;
use tractive::modulation::CarrierPeriod;
use tractive::operator::{self, Desk, Feedback, Slot, Switches};
use tractive::protection::{LegFaults, SafeState};
use tractive::protocol::{Carrier, Frame, Station};
use tractive::recorder::Recorder;
use tractive::time::{Clock, Instant};

/// The bench behind a board's ports; the first error ends the run.
struct Port<'a> {
    bench: &'a mut Bench,
    desk: Option<&'a Desk>,
    error: Option<BenchError>,
}

impl ControlPort for Port<'_> {
    fn sample(&mut self, now: Instant) -> Sample {
        let sample = self.bench.control_sample(now).unwrap_or_else(|error| {
            self.error = Some(error);
            let measured = Measurements { currents_a: Abc::default(), udc_v: 0.0, angle: Angle::ZERO };
            Sample {
                measured,
                demand: Demand::default(),
                enable: false,
                window: LinkWindow::OPEN,
                acknowledge: 0,
                hardware: None,
            }
        });
        match self.desk {
            Some(desk) => sample.permitted(&desk.permit(now)),
            None => sample,
        }
    }

    fn enter(&mut self, safe: SafeState, now: Instant) {
        self.bench.enter(now, safe);
    }

    fn overrun_ticks(&mut self, _now: Instant) -> u32 {
        self.bench.control_late_ticks()
    }

    fn report(&mut self, now: Instant, report: &Report) {
        self.bench.control_report(now, *report);
        if let Some(desk) = self.desk {
            desk.tell(now, report);
        }
    }

    fn leg_faults(&mut self) -> LegFaults {
        self.bench.leg_faults()
    }
}

impl PwmPort for Port<'_> {
    fn sample(&mut self, now: Instant) -> Abc {
        self.bench.pwm_sample(now).unwrap_or_else(|error| {
            self.error = Some(error);
            Abc::default()
        })
    }

    fn play(&mut self, now: Instant, next: &CarrierPeriod) {
        self.bench.play(now, *next);
    }

    fn enter(&mut self, safe: SafeState, now: Instant) {
        self.bench.enter(now, safe);
    }

    fn leg_faults(&mut self) -> LegFaults {
        self.bench.leg_faults()
    }
}

/// The supervisor at the end of the station's wires.
struct HostLink<'a> {
    supervisor: &'a mut dyn Supervisor,
    outbound: SlotRequest,
    /// When the slot began, in s.
    t_s: f64,
    turn: Option<anyhow::Result<Turn>>,
}

impl Carrier for HostLink<'_> {
    fn receive(&mut self, _at: Instant) -> (Option<Frame>, Feedback) {
        let turn = self.supervisor.slot(self.t_s, &self.outbound);
        let answer = turn.as_ref().map_or_else(|_| SlotAnswer::default(), |turn| turn.answer);
        self.turn = Some(turn);
        (answer.frame, answer.feedback)
    }

    fn send(&mut self, _from: Instant, frame: Option<Frame>, switches: &Switches) {
        self.outbound = SlotRequest { frame, switches: *switches };
    }
}

/// The idle loop: the operator's slots and the protocol.
struct Idle<'a> {
    station: Station<'a, HostLink<'a>>,
    slot: Slot,
    rated: operator::Settings<'static>,
    desk: &'a Desk,
}

impl<'a> Idle<'a> {
    fn new(
        tables: &'static Tables,
        clock: &Clock,
        desk: &'a Desk,
        supervisor: &'a mut dyn Supervisor,
    ) -> Self {
        let link = HostLink { supervisor, outbound: SlotRequest::default(), t_s: 0.0, turn: None };
        let slot_s = operator::SLOT_PERIODS as f32 * clock.control_s();
        Self {
            station: Station::new(&tables.ratings, desk, link),
            slot: Slot::new(),
            rated: operator::Settings::rated(&tables.ratings, slot_s, None),
            desk,
        }
    }

    fn run(&mut self, bench: &mut Bench, clock: &Clock) -> anyhow::Result<()> {
        let Some(observed) = self.desk.observed() else { return Ok(()) };
        self.station.carrier.t_s = bench.instant_s(observed.at);
        let settings = self.station.settings(&self.rated);
        self.slot.run(self.desk, &mut self.station, &settings, clock);
        match self.station.carrier.turn.take() {
            Some(turn) => super::follow(bench, observed.at, &turn?),
            None => {}
        }
        Ok(())
    }
}

/// Runs until the recording is complete; commanded by the bench's samples, or over the protocol by a supervisor.
pub fn run_on_host(
    name: &str,
    mut bench: Bench,
    tables: &'static Tables,
    settings: Settings,
    first_half_ticks: u32,
    supervisor: Option<&mut dyn Supervisor>,
) -> anyhow::Result<Recording> {
    let (recorder, desk, clock) = (Recorder::new(), Desk::new(), settings.clock);
    let mut idle = supervisor.map(|supervisor| Idle::new(tables, &clock, &desk, supervisor));
    let mut progress = Progress::new(name);
    let mut tasks = Tasks::new(tables, settings, first_half_ticks).recorded_by(&recorder);
    tasks.desk = idle.as_ref().map(|_| &desk);
    let mut outcome = Ok(());
    tasks.drive(&mut bench, |bench| {
        if let Some(idle) = &mut idle {
            outcome = idle.run(bench, &clock);
        }
        progress.show(bench.progress());
        outcome.is_ok()
    })?;
    outcome?;
    let records = (0..).map_while(|index| recorder.read(index)).collect();
    Ok(super::record(bench, records))
}

/// Both tasks and the cells between them.
pub struct Tasks<'a> {
    control: ControlTask,
    pwm: PwmTask,
    shared: Shared<'a>,
    /// Where the operator's permits come from; `None`: the bench's samples.
    desk: Option<&'a Desk>,
}

impl<'a> Tasks<'a> {
    /// Before their first interrupts.
    pub fn new(tables: &'static Tables, settings: Settings, first_half_ticks: u32) -> Self {
        let first_control = Instant(settings.clock.control_ticks);
        Self {
            control: ControlTask::new(tables, settings, first_control),
            pwm: PwmTask::new(tables, settings, Instant(first_half_ticks)).after_halves_of(first_half_ticks),
            shared: Shared::new(),
            desk: None,
        }
    }

    /// The same with a flight recorder.
    pub fn recorded_by(mut self, recorder: &'a Recorder) -> Self {
        self.shared = Shared::recorded_by(recorder);
        self
    }

    /// Until the bench's recording is complete, or nobody wants to see more of it.
    pub fn drive(
        mut self,
        bench: &mut Bench,
        mut goes_on: impl FnMut(&mut Bench) -> bool,
    ) -> Result<(), BenchError> {
        while !bench.is_done() {
            let (control_at, pwm_at) = (self.control.next_call(), self.pwm.next_call());
            let has_control = bench.has_control(control_at);
            let mut port = Port { bench, desk: self.desk, error: None };
            // At equal instants the PWM interrupt comes first: it has the higher priority.
            if control_at.reached(pwm_at) || !has_control {
                self.pwm.run(&mut port, &self.shared);
            } else {
                if self.control.wants_revision() {
                    self.pwm.revise(&mut port, &self.shared);
                }
                self.control.run(&mut port, &self.shared);
            }
            if let Some(error) = port.error {
                return Err(error);
            }
            if !goes_on(bench) {
                break;
            }
        }
        Ok(())
    }
}
