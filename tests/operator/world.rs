//! A board, a link and a drive that do what they are told, unless a test says otherwise.

use tractive::built_in::traction::BUILT_IN;
use tractive::drive::Observation;
use tractive::frames::Abc;
use tractive::operator::{
    Configuration, Feedback, Input, Line, Operator, Output, Refusal, Request, Settings, State, Switches,
};
use tractive::ports::Report;
use tractive::protection::{Fault, SafeState, Trip};
use tractive::time::Instant;

pub const SLOT_S: f32 = 1e-3;
pub const PRECHARGE_S: f32 = 0.1;
pub const DISCHARGE_S: f32 = 0.1;
/// Slots that a contactor takes.
const CONTACTOR_SLOTS: u32 = 20;

pub struct World {
    pub operator: Operator,
    pub settings: Settings<'static>,
    pub request: Request,
    pub observed: Report,
    /// Beginning of the slot.
    at: Instant,
    pub feedback: Feedback,
    /// Source voltage, in V.
    pub source_v: f32,
    /// Contactors that no longer move.
    pub stuck: bool,
    /// The drive does not carry out acknowledges.
    pub deaf: bool,
    /// A fault that comes back whenever it is acknowledged.
    pub persistent: Option<Trip>,
    pub last: Option<Output>,
    moving: [u32; 2],
    /// The command before: what the drive follows now.
    permitted: Option<Output>,
}

pub fn line() -> Line {
    Line::rated(&BUILT_IN.ratings, PRECHARGE_S, DISCHARGE_S)
}

pub fn trip(fault: Fault) -> Trip {
    Trip { fault, value: 2.0, limit: 1.0, at: Instant(7), safe: SafeState::GatesOff }
}

impl World {
    /// Before its first slot, healthy and at rest.
    pub fn new() -> Self {
        Self {
            operator: Operator::new(),
            settings: Settings::rated(&BUILT_IN.ratings, SLOT_S, Some(line())),
            request: Request::idle(&BUILT_IN.ratings),
            observed: Report { speed_known: true, ..Report::default() },
            at: Instant(0),
            feedback: Feedback {
                driver_ready: true,
                enable_input: true,
                sensor_alive: true,
                position_known: true,
                offsets_a: Abc::default(),
                configuration: Configuration::Good,
                ..Feedback::default()
            },
            source_v: 1_500.0,
            stuck: false,
            deaf: false,
            persistent: None,
            last: None,
            moving: [0; 2],
            permitted: None,
        }
    }

    /// The same without contactors, its link alive by itself.
    pub fn without_line() -> Self {
        let mut world = Self::new();
        world.settings.line = None;
        world.observed.udc_v = world.source_v;
        world
    }

    pub fn state(&self) -> State {
        self.operator.state()
    }

    pub fn output(&self) -> Output {
        self.last.expect("a slot has passed")
    }

    pub fn switches(&self) -> Switches {
        self.output().status.switches
    }

    pub fn refusal(&self) -> Option<Refusal> {
        self.output().status.refusal
    }

    pub fn fault(&self) -> Option<Fault> {
        self.output().status.trip.map(|trip| trip.fault)
    }

    /// One slot.
    pub fn slot(&mut self) -> Output {
        let observed = Observation { at: self.at, report: self.observed };
        let input =
            Input { request: &self.request, observed: &observed, feedback: &self.feedback, fresh: true };
        let output = self.operator.step(&input, &self.settings);
        self.last = Some(output);
        self.react(&output);
        output
    }

    /// Slots that an idle loop has missed: the world has gone on, and the state machine makes up for its own steps.
    pub fn missed(&mut self, count: u32) {
        let before = self.last;
        (0..count).for_each(|_| self.react(&before.expect("a slot has passed")));
        let observed = Observation { at: self.at, report: self.observed };
        for _ in 0..count {
            let input =
                Input { request: &self.request, observed: &observed, feedback: &self.feedback, fresh: false };
            self.operator.step(&input, &self.settings);
        }
    }

    pub fn slots(&mut self, count: u32) {
        for _ in 0..count {
            self.slot();
        }
    }

    /// Slots until a state; panics if it does not come.
    pub fn until(&mut self, state: State) {
        for _ in 0..5_000 {
            if self.slot().status.state == state {
                return;
            }
        }
        panic!("{state:?} does not come: {:?}", self.output());
    }

    /// The world's reaction to an output before the next slot.
    fn react(&mut self, output: &Output) {
        let switches = output.status.switches;
        let [relay, main] = &mut self.moving;
        let contacts = [
            (switches.precharge, &mut self.feedback.precharge_closed, relay),
            (switches.main, &mut self.feedback.main_closed, main),
        ];
        for (told, closed, moving) in contacts {
            *moving = if told == *closed || self.stuck { 0 } else { *moving + 1 };
            if *moving > CONTACTOR_SLOTS {
                (*closed, *moving) = (told, 0);
            }
        }
        if self.settings.line.is_some() {
            let udc_v = &mut self.observed.udc_v;
            if self.feedback.main_closed {
                *udc_v = self.source_v;
            } else if self.feedback.precharge_closed {
                *udc_v += (self.source_v - *udc_v) * SLOT_S / PRECHARGE_S;
            }
            if switches.discharge {
                *udc_v -= *udc_v * SLOT_S / DISCHARGE_S;
            }
        }
        if let Some(permitted) = self.permitted.replace(*output)
            && !self.deaf
            && permitted.command.acknowledge != self.observed.acknowledged
        {
            self.observed.acknowledged = permitted.command.acknowledge;
            self.observed.trip = self.persistent;
        }
        self.at = self.at.after(25_000);
    }

    /// A command's edge: low for a slot, then high.
    pub fn edge(&mut self, set: fn(&mut Request, bool)) -> Output {
        set(&mut self.request, false);
        self.slot();
        set(&mut self.request, true);
        self.slot()
    }

    pub fn ready() -> Self {
        let mut world = Self::new();
        world.until(State::Ready);
        world
    }

    pub fn charged() -> Self {
        let mut world = Self::ready();
        world.edge(|request, level| request.charge = level);
        world.until(State::Charged);
        world
    }

    pub fn enabled() -> Self {
        let mut world = Self::charged();
        world.edge(|request, level| request.enable = level);
        assert_eq!(world.state(), State::Enabled, "{:?}", world.refusal());
        world
    }

    pub fn running() -> Self {
        let mut world = Self::enabled();
        world.request.torque_nm = 400.0;
        world.slots(300);
        assert_eq!(world.state(), State::Running);
        world
    }
}
