//! The state machine, one for every drive: its states, the conditions that end them, automatic transitions, and outputs.

mod commands;

use super::contacts::Contacts;
use super::demand;
use super::line::{Discharge, Outcome, Precharge};
use super::{
    ACKNOWLEDGE_S, Aim, Configuration, Demands, Feedback, Input, Orders, Output, Refusal, SELF_TEST_S, Seen,
    Settings, Situation, State, Status, Switches, health, line,
};
use crate::control::Warmth;
use crate::protection::{FailedCheck, Fault, SafeState, Trip};
use crate::thermal::{Load, Temperatures, ThermalState};

/// The state, with the memory that each state has.
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
        /// Slots since the acknowledge was passed on; `None` before.
        asked: Option<u32>,
    },
}

/// The state machine's state, over the demands of a drive.
#[derive(Clone, Copy, Debug)]
pub struct Operator<D> {
    phase: Phase,
    demands: D,
    /// The last request's levels, for edges.
    last: Edges,
    /// The fault in the values of the request that keeps being repeated.
    bad_values: Option<Refusal>,
    refusal: Option<Refusal>,
    refusals: u32,
    /// Number of the last acknowledge that was passed on.
    acknowledge: u8,
    thermal: ThermalState,
    temperatures: Option<Temperatures>,
    contacts: Contacts,
}

/// Levels whose rising edge is a command.
#[derive(Clone, Copy, Debug)]
struct Edges {
    enable: bool,
    charge: bool,
    discharge: bool,
    acknowledge: bool,
    calibrate: bool,
}

impl<D: Demands> Operator<D> {
    /// The state at power-up.
    pub const fn new() -> Self {
        Self {
            phase: Phase::Init,
            demands: D::AT_REST,
            // A level that is set from the beginning is not an edge.
            last: Edges { enable: true, charge: true, discharge: true, acknowledge: true, calibrate: true },
            bad_values: None,
            refusal: None,
            refusals: 0,
            acknowledge: 0,
            thermal: ThermalState::new(),
            temperatures: None,
            contacts: Contacts::OPEN,
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
            Phase::Pulsing if self.demands.are_at_rest() => State::Enabled,
            Phase::Pulsing => State::Running,
            Phase::Coasting { .. } => State::Coasting,
            Phase::Stopping => State::Stopping,
            Phase::Discharge(_) => State::Discharge,
            Phase::Fault { .. } => State::Fault,
        }
    }

    /// One slot.
    pub fn step(
        &mut self,
        input: &Input<D::Request, D::Report>,
        settings: &Settings,
    ) -> Output<D::DriveCommand, D::Status> {
        let seen = D::seen(input.observed);
        let thermal = self.warm(&seen, input.feedback, settings);
        if input.fresh {
            self.contacts.step(input.feedback, settings.slot_s);
        }
        let feedback = self.contacts.believed(input.feedback);
        let situation = Situation { observed: &seen, feedback: &feedback, thermal, fresh: input.fresh };
        self.look_at_values(input.request, settings);
        self.supervise(&situation, settings);
        self.advance(&situation, settings);
        self.obey(input, &situation, settings);
        self.shape(input, settings);
        let (enable, switches) = self.outputs(&situation, settings);
        self.contacts.order(&switches);
        let calibrate = D::levels(input.request).calibrate && self.state() == State::Enabled;
        let orders = Orders { enable, calibrate, acknowledge: self.acknowledge };
        Output {
            command: self.demands.command(&orders, settings),
            status: Status {
                state: self.state(),
                trip: match self.phase {
                    Phase::Fault { trip, .. } => Some(trip),
                    _ => None,
                },
                refusal: self.refusal,
                refusals: self.refusals,
                torque_nm: self.demands.told(),
                switches,
                temperatures: self.temperatures,
            },
        }
    }

    /// The temperatures' slot; returns the first failed check that persists.
    #[inline(never)]
    fn warm(&mut self, seen: &Seen, feedback: &Feedback, settings: &Settings) -> Option<FailedCheck> {
        let thermal = settings.thermal.filter(|_| D::DERATES)?;
        let Seen { current_a, squares_a2, reference_a, udc_v, map_error, .. } = *seen;
        let max_current_a = settings.ratings.max_current_a;
        let load = Load { current_a, squares_a2, reference_a, udc_v, map_error, max_current_a };
        let (temperatures, failed) =
            self.thermal.step(&load, feedback.temperatures, thermal, settings.slot_s);
        self.temperatures = temperatures;
        let (share, warmth) = temperatures.map_or((1.0, Warmth::NONE), |temperatures| {
            (temperatures.torque_share, thermal.warmth(&temperatures, settings.ratings))
        });
        self.demands.derate(share, warmth);
        failed
    }

    fn refuse(&mut self, reason: Refusal) {
        self.refusal = Some(reason);
        self.refusals = self.refusals.wrapping_add(1);
    }

    /// Adopts the valid limits; a wrong value is refused once, not in every slot in which it is repeated.
    fn look_at_values(&mut self, request: &D::Request, settings: &Settings) {
        let wrong = D::wrong_with(request, settings);
        if wrong != Some(Refusal::RequestNotFinite) {
            self.demands.take_limits(request, settings);
        }
        match wrong {
            Some(reason) if self.bad_values != wrong => self.refuse(reason),
            _ => {}
        }
        self.bad_values = wrong;
    }

    /// The command to the main contactor while the gates pulse: `true` for closed.
    const fn main_closed(settings: &Settings) -> bool {
        settings.line.is_some()
    }

    #[inline(never)]
    fn trip(&mut self, (fault, value, limit): FailedCheck, input: &Situation) {
        let at = input.observed.at;
        self.fail(Trip { fault, value, limit, at, safe: SafeState::GatesOff });
    }

    #[inline(never)]
    fn fail(&mut self, trip: Trip) {
        self.phase = Phase::Fault { trip, asked: None };
        self.demands.drop();
    }

    /// Ends a state regardless of the request: because of the drive's faults, the board's feedback, or the link.
    #[inline(never)]
    fn supervise(&mut self, input: &Situation, settings: &Settings) {
        if matches!(self.phase, Phase::Fault { .. }) {
            return;
        }
        if let Some(trip) = input.observed.trip {
            return self.fail(trip);
        }
        let failed = match self.phase {
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
        if let Some(failed) = failed {
            self.trip(failed, input);
        }
    }

    /// Transitions of the state that happen by themselves.
    fn advance(&mut self, input: &Situation, settings: &Settings) {
        match &mut self.phase {
            Phase::Init => {
                if input.feedback.configuration != Configuration::Unchecked {
                    self.phase = Phase::SelfTest { slots: 0 };
                }
            }
            Phase::SelfTest { slots } => {
                *slots = slots.saturating_add(1);
                if *slots as f32 * settings.slot_s >= SELF_TEST_S {
                    // A position that is not known yet gives no speed; the drive cannot be enabled before it is known.
                    if input.observed.speed_known || !input.feedback.position_known {
                        self.phase = Phase::Ready;
                    } else {
                        self.trip((Fault::PositionSensor, 0.0, 1.0), input);
                    }
                }
            }
            Phase::Precharge(sequence) => {
                let outcome = settings.line.as_ref().map(|line| sequence.step(input, line, settings));
                self.switch(outcome, Phase::Charged, input);
            }
            Phase::Discharge(sequence) => {
                let outcome = settings.line.as_ref().map(|line| sequence.step(input, line, settings));
                self.switch(outcome, Phase::Ready, input);
            }
            Phase::Fault { trip, asked: Some(slots) } => {
                *slots = slots.saturating_add(1);
                let (trip, waited_s) = (*trip, *slots as f32 * settings.slot_s);
                self.await_release(trip, waited_s, input);
            }
            Phase::Ready
            | Phase::Charged
            | Phase::Pulsing
            | Phase::Coasting { .. }
            | Phase::Stopping
            | Phase::Fault { .. } => {}
        }
    }

    /// The state after a step of a sequence on the line's side, which ends in `done`; without a line there is no sequence.
    fn switch(&mut self, outcome: Option<Outcome>, done: Phase, input: &Situation) {
        match outcome {
            Some(Outcome::Going) => {}
            Some(Outcome::Done) => self.phase = done,
            Some(Outcome::Failed(failed)) => self.trip(failed, input),
            None => self.phase = Phase::Ready,
        }
    }

    /// The drive's answer to an acknowledge: the cause is gone, or remains; without an answer the fault remains as well.
    fn await_release(&mut self, trip: Trip, waited_s: f32, input: &Situation) {
        let answered = input.observed.acknowledged == self.acknowledge;
        let again = match input.observed.trip {
            None if answered => return self.phase = Phase::SelfTest { slots: 0 },
            Some(again) if answered => again,
            _ if waited_s > ACKNOWLEDGE_S => {
                Trip { fault: Fault::GatesHeld, value: waited_s, limit: ACKNOWLEDGE_S, ..trip }
            }
            _ => return,
        };
        self.fail(again);
        self.refuse(Refusal::CauseStillPresent);
    }

    /// The demands after limits, slew and jerk.
    fn shape(&mut self, input: &Input<D::Request, D::Report>, settings: &Settings) {
        let aim = match self.phase {
            Phase::Pulsing if self.bad_values != Some(Refusal::RequestNotFinite) => {
                Aim::Request(input.request)
            }
            Phase::Stopping => Aim::Stop,
            Phase::Pulsing | Phase::Coasting { .. } => Aim::Coast,
            _ => {
                let connected = matches!(self.phase, Phase::Charged);
                return self.demands.rest(&input.observed.report, connected);
            }
        };
        self.demands.step(aim, &input.observed.report, settings);
    }

    /// The permission to pulse, and the switches.
    fn outputs(&self, input: &Situation, settings: &Settings) -> (bool, Switches) {
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
