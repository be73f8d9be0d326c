//! The two interrupts' sides of the board.

use super::bridge::{Beat, Bridge};
use super::control_timer::ControlTimer;
use super::feedback::Feedback;
use super::operator::Operator;
use super::period::PeriodCompares;
use super::sampling::{Samplers, Zeros};
use super::start::{bridge, feedback};
use super::{CLOCK, pins};
use crate::board::nucleo_g474re::position::Position;
use crate::board::nucleo_g474re::registers::Registers;
use crate::board::{DualControlPort, DualPwmPort, DualSample, PlayedPeriod, PowerSample};
use crate::drive::dual::DualReport;
use crate::frames::Angle;
use crate::nine_switch::Scheme;
use crate::time::Instant;

/// Where the zero vectors lie: the least harmonics in the motors' currents.
const SCHEME: Scheme = Scheme::Rthd;

/// The control interrupt's side.
pub struct Control<'a, P> {
    registers: Registers,
    timer: ControlTimer,
    samplers: Samplers,
    zeros: Zeros,
    positions: [P; 2],
    operator: &'a Operator,
}

impl<'a, P: Position> Control<'a, P> {
    /// With the zeros that the start measured; positions of the upper and the lower motor.
    pub const fn new(registers: Registers, zeros: Zeros, positions: [P; 2], operator: &'a Operator) -> Self {
        Self {
            registers,
            timer: ControlTimer(registers.tim2),
            samplers: Samplers::new(&registers),
            zeros,
            positions,
            operator,
        }
    }

    /// First thing in the interrupt.
    #[inline]
    pub fn acknowledge(&mut self) {
        self.timer.acknowledge();
    }
}

impl<P: Position> DualControlPort for Control<'_, P> {
    /// Positions first: they are read, not sampled, and move on while the conversions end. A position that is not known yet is
    /// none that is lost: until both are known the gates stay off.
    fn sample(&mut self, _now: Instant) -> DualSample {
        let [first, second] = &mut self.positions;
        let angles = [first.angle(), second.angle()];
        let converted = self.samplers.read(&self.zeros);
        let known = angles.iter().all(Option::is_some);
        let healthy = known && !bridge(&self.registers).outputs().is_tripped();
        DualSample {
            currents_a: converted.currents_a,
            angles: angles.map(|angle| Some(angle.unwrap_or(Angle::ZERO))),
            capacitor_v: converted.capacitor_v,
            inductor_a: self.samplers.inductor_a(&self.zeros),
            source_v: converted.source_v,
            demands: self.operator.demands(),
            link_ref_v: self.operator.link_v(),
            scheme: SCHEME,
            enable: healthy && pins::is_enabled(&self.registers),
        }
    }

    fn gates_off(&mut self, _now: Instant) {
        bridge(&self.registers).outputs().trip();
    }

    fn overrun_ticks(&mut self, _now: Instant, deadline_ticks: u32) -> u32 {
        self.timer.overrun_ticks(deadline_ticks, CLOCK.control_ticks)
    }

    fn report(&mut self, _now: Instant, report: &DualReport) {
        self.operator.tell(report);
    }
}

/// The PWM interrupt's side.
pub struct Pwm {
    bridge: Bridge,
    samplers: Samplers,
    feedback: Feedback,
    zeros: Zeros,
    /// A peak has been served since the last valley.
    served: bool,
    /// The period that runs has pulses.
    pulses: bool,
}

impl Pwm {
    /// At rest, with the zeros that the start measured.
    pub const fn new(registers: Registers, zeros: Zeros) -> Self {
        Self {
            bridge: bridge(&registers),
            samplers: Samplers::new(&registers),
            feedback: feedback(&registers),
            zeros,
            served: false,
            pulses: false,
        }
    }

    /// First thing in the interrupt: acknowledges it, and says whether the drive's task is to run, which is so at a peak. A
    /// peak that was never served turns the gates off for good: the drive's time would be wrong from then on.
    #[inline]
    pub fn begin(&mut self) -> bool {
        match self.bridge.acknowledge() {
            Beat::Valley => {
                if !self.served {
                    self.bridge.outputs().trip();
                }
                self.served = false;
                false
            }
            Beat::Peak => {
                self.feedback.begin();
                self.samplers.forget();
                if self.bridge.outputs().is_tripped() {
                    // A break of one timer alone stops the others.
                    self.bridge.outputs().trip();
                }
                self.served = true;
                true
            }
        }
    }
}

impl DualPwmPort for Pwm {
    fn sample(&mut self, _now: Instant) -> PowerSample {
        let converted = self.samplers.read(&self.zeros);
        PowerSample {
            currents_a: converted.currents_a,
            capacitor_v: converted.capacitor_v,
            source_v: converted.source_v,
            gates: self.feedback.end(),
        }
    }

    /// The outputs go on half a carrier period before the first pulses, while all compares still say off, and go off half a
    /// period after the last ones. What these timers cannot play, and an interrupt that ends after its valley, turn the gates off
    /// for good.
    fn play(&mut self, _now: Instant, next: &PlayedPeriod) {
        let outputs = self.bridge.outputs();
        let Some(compares) = PeriodCompares::new(next) else {
            outputs.trip();
            return;
        };
        self.bridge.play(&compares);
        if self.bridge.is_late() {
            outputs.trip();
        }
        let pulses = compares != PeriodCompares::OFF;
        if pulses {
            if !outputs.is_on() {
                outputs.switch_on();
            }
        } else if !self.pulses {
            outputs.switch_off();
        }
        self.pulses = pulses;
    }

    fn gates_off(&mut self, _now: Instant) {
        self.bridge.outputs().trip();
    }
}
