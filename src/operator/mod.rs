//! WHETHER the drive may: the state machine between those who command and the drive.
//!
//! init → self-test → ready → precharge → charged → enabled → running, with coasting, stopping, discharge and fault. Gates
//! come on by an explicit edge only; a fault is left by an acknowledge and with a healthy cause only; a command that is not followed
//! has a reason.
//!
//! One pure step per slot of [`SLOT_PERIODS`] control periods, in the idle loop: what it looks at is the drive's word of the slot's
//! beginning, what it decides holds from the next slot's beginning on ([`Desk`]). So when the idle loop really ran changes nothing.
//!
//! The drive's own protection does not wait for any of this: it trips in its interrupts, and tells.

#![forbid(unsafe_code)]

mod cells;
mod demand;
mod health;
mod line;
mod ramp;
mod request;
mod settings;
mod slot;
mod status;

pub use cells::Desk;
pub use ramp::{Ramp, Rates};
pub use request::{Configuration, Feedback, Limits, Observation, Request};
pub use settings::{Line, Settings};
pub use slot::{OperatorPort, Slot};
pub use status::{Refusal, State, Status, Switches};

use crate::board::Sample;
use crate::control::{Demand, LinkWindow};
use crate::protection::{Fault, SafeState, Trip, Violation};
use crate::time::Clock;
use line::{Discharge, Outcome, Precharge};

/// Control periods in a slot.
pub const SLOT_PERIODS: u32 = 10;

/// Length of a slot, in s.
pub fn slot_s(clock: &Clock) -> f32 {
    SLOT_PERIODS as f32 * clock.control_s()
}

/// Time for which everything must be in order in the self-test, in s.
const SELF_TEST_S: f32 = 0.05;
/// Longest time in which both interrupts carry out an acknowledge, in s.
const ACKNOWLEDGE_S: f32 = 0.05;

/// What a step looks at.
#[derive(Clone, Copy, Debug)]
pub struct Input<'a> {
    /// What is asked.
    pub request: &'a Request,
    /// What the drive says.
    pub observed: &'a Observation,
    /// What the board says.
    pub feedback: &'a Feedback,
}

/// What the drive may do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Permit {
    /// Gates may pulse.
    pub enable: bool,
    /// Torque.
    pub demand: Demand,
    /// Where the link ends it.
    pub window: LinkWindow,
    /// Number of the last acknowledge: a new number, with the gates off, makes both interrupts forget their fault.
    pub acknowledge: u8,
}

impl Permit {
    /// What the drive gets: the board may hold the gates off, never more than that.
    #[inline]
    pub fn applied_to(self, sample: Sample) -> Sample {
        let Self { enable, demand, window, acknowledge } = self;
        Sample { enable: enable && sample.enable, demand, window, acknowledge, ..sample }
    }

    /// Nothing.
    pub const NONE: Self = Self {
        enable: false,
        demand: Demand { torque_nm: 0.0, slew_limited: true },
        window: LinkWindow::OPEN,
        acknowledge: 0,
    };
}

/// A step's result.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Output {
    /// For the drive.
    pub permit: Permit,
    /// What is told; its [`Switches`] are for the board.
    pub status: Status,
}

/// Where the machine stands, with what each state has to remember.
#[derive(Clone, Copy, Debug)]
enum Phase {
    Init,
    SelfTest {
        slots: u32,
    },
    Ready,
    Precharge(Precharge),
    Charged,
    /// Enabled or running.
    Pulsing,
    /// `off` once torque is gone and open gates are safe.
    Coasting {
        off: bool,
    },
    Stopping,
    Discharge(Discharge),
    Fault {
        trip: Trip,
        /// Slots since the acknowledge was handed on; `None` before.
        asked: Option<u32>,
    },
}

/// The state machine's state.
#[derive(Clone, Copy, Debug)]
pub struct Operator {
    phase: Phase,
    ramp: Ramp,
    /// The last request's levels, for edges.
    last: Levels,
    /// The limits that hold; `None`: as rated.
    limits: Option<Limits>,
    /// What is wrong with the values of the request that is repeated.
    bad_values: Option<Refusal>,
    refusal: Option<Refusal>,
    refusals: u32,
    /// Number of the last acknowledge that was handed on.
    acknowledge: u8,
}

#[derive(Clone, Copy, Debug)]
struct Levels {
    enable: bool,
    charge: bool,
    discharge: bool,
    acknowledge: bool,
}

impl Operator {
    /// At power-up.
    pub const fn new() -> Self {
        Self {
            phase: Phase::Init,
            ramp: Ramp::new(),
            // A level that stands from the beginning is no edge.
            last: Levels { enable: true, charge: true, discharge: true, acknowledge: true },
            limits: None,
            bad_values: None,
            refusal: None,
            refusals: 0,
            acknowledge: 0,
        }
    }

    /// The state.
    pub fn state(&self) -> State {
        match self.phase {
            Phase::Init => State::Init,
            Phase::SelfTest { .. } => State::SelfTest,
            Phase::Ready => State::Ready,
            Phase::Precharge(_) => State::Precharge,
            Phase::Charged => State::Charged,
            Phase::Pulsing if self.ramp.torque_nm() == 0.0 => State::Enabled,
            Phase::Pulsing => State::Running,
            Phase::Coasting { .. } => State::Coasting,
            Phase::Stopping => State::Stopping,
            Phase::Discharge(_) => State::Discharge,
            Phase::Fault { .. } => State::Fault,
        }
    }

    /// One slot.
    pub fn step(&mut self, input: &Input, settings: &Settings) -> Output {
        self.look_at_values(input.request, settings);
        self.supervise(input, settings);
        self.advance(input, settings);
        self.obey(input, settings);
        let torque_nm = self.shape(input, settings);
        let (enable, switches) = self.outputs(input, settings);
        let limits = self.limits.unwrap_or(Limits::rated(settings.ratings));
        Output {
            permit: Permit {
                enable,
                demand: Demand { torque_nm, slew_limited: true },
                window: demand::window(&limits, settings.ratings),
                acknowledge: self.acknowledge,
            },
            status: Status {
                state: self.state(),
                trip: match self.phase {
                    Phase::Fault { trip, .. } => Some(trip),
                    _ => None,
                },
                refusal: self.refusal,
                refusals: self.refusals,
                torque_nm,
                switches,
            },
        }
    }

    fn refuse(&mut self, reason: Refusal) {
        self.refusal = Some(reason);
        self.refusals = self.refusals.wrapping_add(1);
    }

    /// Takes over limits that are good; what is wrong is refused once, not in every slot in which it is repeated.
    fn look_at_values(&mut self, request: &Request, settings: &Settings) {
        let wrong = demand::wrong_with(request, settings.ratings);
        match wrong {
            None => self.limits = Some(request.limits),
            Some(reason) if self.bad_values != Some(reason) => self.refuse(reason),
            Some(_) => {}
        }
        self.bad_values = wrong;
    }

    /// Whether the main contactor is told to be closed while the gates pulse.
    const fn main_closed(settings: &Settings) -> bool {
        settings.line.is_some()
    }

    fn trip(&mut self, (fault, value, limit): Violation, input: &Input) {
        let at = input.observed.at;
        self.fail(Trip { fault, value, limit, at, safe: SafeState::GatesOff });
    }

    fn fail(&mut self, trip: Trip) {
        self.phase = Phase::Fault { trip, asked: None };
        self.ramp = Ramp::new();
    }

    /// What ends a state whatever is asked: the drive's faults, and what the board and the link say.
    fn supervise(&mut self, input: &Input, settings: &Settings) {
        if matches!(self.phase, Phase::Fault { .. }) {
            return;
        }
        if let Some(trip) = input.observed.trip {
            return self.fail(trip);
        }
        let violation = match self.phase {
            Phase::Init | Phase::Fault { .. } => None,
            Phase::SelfTest { .. } => {
                health::cause(input, false, settings).or_else(|| health::resting_current(input, settings))
            }
            Phase::Ready => health::cause(input, false, settings),
            Phase::Precharge(_) | Phase::Discharge(_) => health::hardware(input),
            Phase::Charged => health::cause(input, Self::main_closed(settings), settings)
                .or_else(|| demand::link_lost(input, settings)),
            Phase::Pulsing | Phase::Coasting { .. } | Phase::Stopping => {
                health::while_pulsing(input, Self::main_closed(settings))
                    .or_else(|| demand::link_lost(input, settings))
            }
        };
        if let Some(violation) = violation {
            self.trip(violation, input);
        }
    }

    /// What goes on by itself.
    fn advance(&mut self, input: &Input, settings: &Settings) {
        match &mut self.phase {
            Phase::Init => {
                if input.feedback.configuration != Configuration::Unchecked {
                    self.phase = Phase::SelfTest { slots: 0 };
                }
            }
            Phase::SelfTest { slots } => {
                *slots = slots.saturating_add(1);
                if *slots as f32 * settings.slot_s >= SELF_TEST_S {
                    if input.observed.speed_known {
                        self.phase = Phase::Ready;
                    } else {
                        self.trip((Fault::PositionSensor, 0.0, 1.0), input);
                    }
                }
            }
            Phase::Precharge(sequence) => {
                let Some(line) = &settings.line else {
                    self.phase = Phase::Ready;
                    return;
                };
                match sequence.step(input, line, settings) {
                    Outcome::Going => {}
                    Outcome::Done => self.phase = Phase::Charged,
                    Outcome::Failed(violation) => self.trip(violation, input),
                }
            }
            Phase::Discharge(sequence) => {
                let Some(line) = &settings.line else {
                    self.phase = Phase::Ready;
                    return;
                };
                match sequence.step(input, line, settings) {
                    Outcome::Going => {}
                    Outcome::Done => self.phase = Phase::Ready,
                    Outcome::Failed(violation) => self.trip(violation, input),
                }
            }
            Phase::Fault { trip, asked: Some(slots) } => {
                *slots = slots.saturating_add(1);
                let waited_s = *slots as f32 * settings.slot_s;
                if input.observed.acknowledged == self.acknowledge {
                    match input.observed.trip {
                        None => self.phase = Phase::SelfTest { slots: 0 },
                        Some(again) => {
                            self.fail(again);
                            self.refuse(Refusal::CauseStillPresent);
                        }
                    }
                } else if waited_s > ACKNOWLEDGE_S {
                    let trip =
                        Trip { fault: Fault::GatesHeld, value: waited_s, limit: ACKNOWLEDGE_S, ..*trip };
                    self.fail(trip);
                    self.refuse(Refusal::CauseStillPresent);
                }
            }
            Phase::Ready
            | Phase::Charged
            | Phase::Pulsing
            | Phase::Coasting { .. }
            | Phase::Stopping
            | Phase::Fault { .. } => {}
        }
    }

    /// Commands: levels that stop first, then edges.
    fn obey(&mut self, input: &Input, settings: &Settings) {
        let request = input.request;
        let Request { enable, charge, discharge, acknowledge, .. } = *request;
        let last = core::mem::replace(&mut self.last, Levels { enable, charge, discharge, acknowledge });
        self.obey_levels(input, settings);
        if acknowledge && !last.acknowledge {
            self.acknowledge(input, settings);
        }
        if discharge && !last.discharge {
            self.discharge(input, settings);
        }
        if charge && !last.charge {
            self.charge(settings);
        }
        if enable && !last.enable {
            self.enable(input, settings);
        }
    }

    /// Off, stop, coast.
    fn obey_levels(&mut self, input: &Input, settings: &Settings) {
        let rest = if settings.line.is_some() { Phase::Charged } else { Phase::Ready };
        let request = input.request;
        let resting = self.ramp.torque_nm() == 0.0;
        let may_open = resting && health::open_is_safe(input, settings);
        let off = request.off || !input.feedback.enable_input;
        match self.phase {
            Phase::Pulsing | Phase::Coasting { .. } | Phase::Stopping if off => self.rest(rest),
            Phase::Stopping if may_open => self.rest(rest),
            Phase::Coasting { off: true } if !request.enable => self.rest(rest),
            Phase::Pulsing | Phase::Coasting { .. } if !request.enable => self.phase = Phase::Stopping,
            Phase::Pulsing if request.coast => self.phase = Phase::Coasting { off: false },
            Phase::Coasting { .. } if !request.coast => self.phase = Phase::Pulsing,
            Phase::Coasting { off: false } if may_open => self.phase = Phase::Coasting { off: true },
            _ => {}
        }
    }

    fn rest(&mut self, phase: Phase) {
        self.phase = phase;
        self.ramp = Ramp::new();
    }

    fn follow(&mut self, phase: Phase) {
        self.phase = phase;
        self.refusal = None;
    }

    fn acknowledge(&mut self, input: &Input, settings: &Settings) {
        let Phase::Fault { trip, asked: None } = self.phase else {
            let waiting = matches!(self.phase, Phase::Fault { .. });
            return self.refuse(if waiting { Refusal::FaultNotAcknowledged } else { Refusal::NoFault });
        };
        let shorted = trip.safe == SafeState::ShortCircuit;
        let held = shorted && !health::open_is_safe(input, settings);
        let cause =
            health::cause(input, false, settings).or_else(|| health::resting_current(input, settings));
        if held || cause.is_some() {
            return self.refuse(Refusal::CauseStillPresent);
        }
        // Zero is what both interrupts begin with.
        self.acknowledge = match self.acknowledge.wrapping_add(1) {
            0 => 1,
            number => number,
        };
        self.follow(Phase::Fault { trip, asked: Some(0) });
    }

    fn enable(&mut self, input: &Input, settings: &Settings) {
        match self.why_not_enable(input, settings) {
            Some(reason) => self.refuse(reason),
            None => self.follow(Phase::Pulsing),
        }
    }

    fn why_not_enable(&self, input: &Input, settings: &Settings) -> Option<Refusal> {
        let Input { request, observed, feedback } = *input;
        match self.phase {
            Phase::Init | Phase::SelfTest { .. } => return Some(Refusal::NotReady),
            Phase::Fault { .. } => return Some(Refusal::FaultNotAcknowledged),
            Phase::Precharge(_) => return Some(Refusal::LinkNotCharged),
            Phase::Discharge(_) => return Some(Refusal::Discharging),
            Phase::Pulsing | Phase::Coasting { .. } | Phase::Stopping => return Some(Refusal::NotStopped),
            Phase::Ready if settings.line.is_some() => return Some(Refusal::LinkNotCharged),
            Phase::Ready | Phase::Charged => {}
        }
        let refusals = [
            (request.off, Refusal::OffRequested),
            (feedback.parameters_open, Refusal::ParametersOpen),
            (!feedback.enable_input, Refusal::EnableInputLow),
            // Not a number is no voltage.
            (
                observed.udc_v.is_nan() || observed.udc_v < settings.ratings.dc_link_min_v,
                Refusal::LinkNotCharged,
            ),
            (!feedback.position_known || !observed.speed_known, Refusal::PositionUnknown),
            (self.bad_values == Some(Refusal::RequestNotFinite), Refusal::RequestNotFinite),
            (health::resting_current(input, settings).is_some(), Refusal::CauseStillPresent),
            (request.torque_nm != 0.0 && !request.with_torque, Refusal::TorqueNotZero),
        ];
        refusals.into_iter().find_map(|(refused, reason)| refused.then_some(reason))
    }

    fn charge(&mut self, settings: &Settings) {
        let reason = match self.phase {
            Phase::Ready if settings.line.is_some() => {
                return self.follow(Phase::Precharge(Precharge::new()));
            }
            Phase::Ready => Refusal::NoContactors,
            Phase::Init | Phase::SelfTest { .. } => Refusal::NotReady,
            Phase::Fault { .. } => Refusal::FaultNotAcknowledged,
            Phase::Discharge(_) => Refusal::Discharging,
            Phase::Precharge(_)
            | Phase::Charged
            | Phase::Pulsing
            | Phase::Coasting { .. }
            | Phase::Stopping => Refusal::AlreadyCharged,
        };
        self.refuse(reason);
    }

    fn discharge(&mut self, input: &Input, settings: &Settings) {
        let reason = match self.phase {
            Phase::Init | Phase::SelfTest { .. } => Refusal::NotReady,
            Phase::Fault { .. } => Refusal::FaultNotAcknowledged,
            Phase::Discharge(_) => Refusal::Discharging,
            Phase::Pulsing | Phase::Coasting { .. } | Phase::Stopping => Refusal::NotStopped,
            Phase::Ready | Phase::Precharge(_) | Phase::Charged if settings.line.is_none() => {
                Refusal::NoContactors
            }
            Phase::Ready | Phase::Precharge(_) | Phase::Charged
                if demand::emf_v(input, settings.ratings) > line::EMPTY_V =>
            {
                Refusal::MachineTurning
            }
            Phase::Ready | Phase::Precharge(_) | Phase::Charged => {
                return self.follow(Phase::Discharge(Discharge::new()));
            }
        };
        self.refuse(reason);
    }

    /// The torque demand after limits, slew and jerk, in N·m.
    fn shape(&mut self, input: &Input, settings: &Settings) -> f32 {
        let target_nm = match self.phase {
            Phase::Pulsing if self.bad_values != Some(Refusal::RequestNotFinite) => {
                let limits = self.limits.unwrap_or(Limits::rated(settings.ratings));
                demand::wanted_nm(input, &limits, settings.ratings)
            }
            Phase::Pulsing | Phase::Coasting { .. } | Phase::Stopping => 0.0,
            _ => {
                self.ramp = Ramp::new();
                return 0.0;
            }
        };
        let Settings { slot_s, slew_nm_s, jerk_nm_s2, .. } = *settings;
        self.ramp.step(target_nm, &Rates { step_s: slot_s, slew_nm_s, jerk_nm_s2 })
    }

    /// Whether the gates may pulse, and the switches.
    fn outputs(&self, input: &Input, settings: &Settings) -> (bool, Switches) {
        let enable = matches!(self.phase, Phase::Pulsing | Phase::Stopping | Phase::Coasting { off: false });
        let Some(line) = &settings.line else {
            return (enable, Switches::default());
        };
        let switches = match &self.phase {
            Phase::Precharge(sequence) => sequence.switches(),
            Phase::Discharge(sequence) => sequence.switches(),
            Phase::Charged | Phase::Pulsing | Phase::Coasting { .. } | Phase::Stopping => {
                Switches { main: true, ..Switches::default() }
            }
            Phase::Init | Phase::SelfTest { .. } | Phase::Ready | Phase::Fault { .. } => Switches::default(),
        };
        (enable, Switches { chopper: line::chopper(input.observed.udc_v, line), ..switches })
    }
}

impl Default for Operator {
    fn default() -> Self {
        Self::new()
    }
}
