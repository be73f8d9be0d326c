//! The commands that are followed, and the reasons for refusing the others.

use super::{Edges, Operator, Phase};
use crate::operator::line::{Discharge, Precharge};
use crate::operator::{Demands, Input, Levels, Refusal, Settings, Situation, State, demand, health};
use crate::protection::SafeState;

impl<D: Demands> Operator<D> {
    /// Commands: levels that stop first, then edges.
    pub(super) fn obey(
        &mut self,
        Input { request, observed, .. }: &Input<D::Request, D::Report>,
        input: &Situation,
        settings: &Settings,
    ) {
        let levels = D::levels(request);
        let Levels { enable, charge, discharge, acknowledge, calibrate, .. } = levels;
        let now = Edges { enable, charge, discharge, acknowledge, calibrate };
        let last = core::mem::replace(&mut self.last, now);
        self.obey_levels(&levels, D::link_may_rest(&observed.report), input, settings);
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
            let asks_torque = D::asks_torque(request, &observed.report, settings.ratings);
            self.enable(&levels, asks_torque, input, settings);
        }
        if calibrate && !last.calibrate {
            self.calibrate();
        }
    }

    /// Off, stop, coast.
    #[inline(never)]
    fn obey_levels(&mut self, request: &Levels, link_may_rest: bool, input: &Situation, settings: &Settings) {
        let rest = if settings.line.is_some() { Phase::Charged } else { Phase::Ready };
        let resting = self.demands.are_at_rest();
        let may_open = resting && link_may_rest && health::open_is_safe(input, settings);
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
        self.demands.drop();
    }

    fn follow(&mut self, phase: Phase) {
        self.phase = phase;
        // A value that is still wrong stays named.
        self.refusal = self.bad_values;
    }

    fn acknowledge(&mut self, input: &Situation, settings: &Settings) {
        let Phase::Fault { trip, asked: None } = self.phase else {
            let waiting = matches!(self.phase, Phase::Fault { .. });
            return self.refuse(if waiting { Refusal::FaultNotAcknowledged } else { Refusal::NoFault });
        };
        // Gates that were off may have become a short circuit since then.
        let shorted = input.observed.trip.unwrap_or(trip).safe != SafeState::GatesOff;
        let held = if shorted {
            health::shorted_current(input, settings).is_some()
                || !input.observed.speed_known
                || !health::open_is_safe(input, settings)
        } else {
            health::resting_current(input, settings).is_some()
        };
        if held || health::cause(input, false, settings).is_some() {
            return self.refuse(Refusal::CauseStillPresent);
        }
        // Both interrupts begin with zero.
        self.acknowledge = match self.acknowledge.wrapping_add(1) {
            0 => 1,
            number => number,
        };
        self.follow(Phase::Fault { trip, asked: Some(0) });
    }

    fn enable(&mut self, levels: &Levels, asks_torque: bool, input: &Situation, settings: &Settings) {
        match self.why_not_enable(levels, asks_torque, input, settings) {
            Some(reason) => self.refuse(reason),
            None => self.follow(Phase::Pulsing),
        }
    }

    fn why_not_enable(
        &self,
        levels: &Levels,
        asks_torque: bool,
        input: &Situation,
        settings: &Settings,
    ) -> Option<Refusal> {
        let Situation { observed, feedback, .. } = *input;
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
            (levels.off, Refusal::OffRequested),
            (feedback.parameters_open, Refusal::ParametersOpen),
            (!feedback.enable_input, Refusal::EnableInputLow),
            // NaN is not a voltage.
            (
                observed.udc_v.is_nan() || observed.udc_v < settings.ratings.dc_link_min_v,
                Refusal::LinkNotCharged,
            ),
            (
                if feedback.position_known { !observed.speed_known } else { !feedback.position_counted },
                Refusal::PositionUnknown,
            ),
            (self.bad_values == Some(Refusal::RequestNotFinite), Refusal::RequestNotFinite),
            (health::resting_current(input, settings).is_some(), Refusal::CauseStillPresent),
            (asks_torque && !levels.with_torque, Refusal::TorqueNotZero),
        ];
        refusals.into_iter().find_map(|(refused, reason)| refused.then_some(reason))
    }

    /// The zero is calibrated while the level is set and the drive is enabled without torque; here it is only said if it is not at the beginning.
    fn calibrate(&mut self) {
        match self.state() {
            State::Enabled => self.refusal = self.bad_values,
            State::Running => self.refuse(Refusal::TorqueNotZero),
            _ => self.refuse(Refusal::NotEnabled),
        }
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

    fn discharge(&mut self, input: &Situation, settings: &Settings) {
        let reason = match self.phase {
            Phase::Init | Phase::SelfTest { .. } => Refusal::NotReady,
            Phase::Fault { .. } => Refusal::FaultNotAcknowledged,
            Phase::Discharge(_) => Refusal::Discharging,
            Phase::Pulsing | Phase::Coasting { .. } | Phase::Stopping => Refusal::NotStopped,
            Phase::Ready | Phase::Precharge(_) | Phase::Charged => match &settings.line {
                None => Refusal::NoContactors,
                Some(line) if demand::emf_v(input, settings.ratings) > line.empty_v => {
                    Refusal::MachineTurning
                }
                Some(_) => return self.follow(Phase::Discharge(Discharge::new())),
            },
        };
        self.refuse(reason);
    }
}
