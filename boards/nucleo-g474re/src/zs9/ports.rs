//! The two interrupts' sides of the board.

use super::bridge::{Beat, Bridge};
use super::control_timer::ControlTimer;
use super::feedback::Feedback;
use super::period::PeriodCompares;
use super::sampling::{Samplers, Zeros};
use super::stage::STAGE;
use super::start::{bridge, feedback};
use super::{CLOCK, hardware, pins};
use crate::outputs::SoftwareBreak;
use crate::position::{Position, PositionState, reported};
use crate::registers::Registers;
use tractive::ports::{
    ControlPort, Dual, DualDriveCommand, DualReport, DualSample, PlayedPeriod, PowerSample, PwmPort,
};
use tractive::protection::SafeState;
use tractive::time::Instant;

/// The dead time as produced by the timers.
const DEAD_CYCLES: u16 = match STAGE.common.dead_time() {
    Some(dead_time) => dead_time.cycles() as u16,
    None => panic!("no such dead time"),
};

/// The control interrupt's side.
pub struct Control<'a, P> {
    registers: Registers,
    timer: ControlTimer,
    samplers: Samplers,
    zeros: Zeros,
    positions: [P; 2],
    state: &'a PositionState,
}

impl<'a, P: Position> Control<'a, P> {
    /// Made with the zeros that the start measured, the positions of the upper and the lower motor, and the place where the sensors' state is kept.
    pub const fn new(
        registers: Registers,
        zeros: Zeros,
        positions: [P; 2],
        state: &'a PositionState,
    ) -> Self {
        Self {
            registers,
            timer: ControlTimer(registers.tim2),
            samplers: Samplers::new(&registers),
            zeros,
            positions,
            state,
        }
    }
}

impl<P: Position> ControlPort<Dual> for Control<'_, P> {
    fn begin(&mut self, _revises: bool) {
        self.timer.acknowledge();
    }

    /// The positions come first: they have been captured, while the conversions are still under way.
    fn sample(&mut self, _now: Instant) -> DualSample {
        let [first, second] = &mut self.positions;
        let angles = [first.angle(), second.angle()];
        let converted = self.samplers.read(&self.zeros);
        let lost = [first.is_lost(), second.is_lost()];
        let ([a1, a2], [lost1, lost2]) = (angles, lost);
        let angles = [reported(a1, lost1), reported(a2, lost2)];
        self.state.tell(&angles, &lost, false);
        let hardware = hardware::latched_by(&self.registers);
        let healthy = !bridge(&self.registers).outputs().is_tripped();
        DualSample {
            currents_a: converted.currents_a,
            angles,
            capacitor_v: converted.capacitor_v,
            inductor_a: self.samplers.inductor_a(&self.zeros),
            source_v: converted.source_v,
            may_pulse: healthy && pins::is_enabled(&self.registers),
            hardware,
        }
    }

    /// The link voltage is the power stage's until the operator sets one.
    fn command(&mut self, _now: Instant, operator: impl FnOnce() -> DualDriveCommand) -> DualDriveCommand {
        operator().with_link(STAGE.link_ref_v)
    }

    fn enter(&mut self, _safe: SafeState, _now: Instant) {
        bridge(&self.registers).outputs().trip_by(SoftwareBreak::Drive);
    }

    fn overrun_ticks(&mut self, _now: Instant, deadline_ticks: u32) -> u32 {
        self.timer.overrun_ticks(deadline_ticks, CLOCK.control_ticks)
    }

    fn report(&mut self, _now: Instant, _report: impl FnOnce() -> DualReport) {}
}

/// The PWM interrupt's side.
pub struct Pwm {
    bridge: Bridge,
    samplers: Samplers,
    feedback: Feedback,
    zeros: Zeros,
    /// `true` if a peak has been served since the last valley.
    served: bool,
    /// `true` if a valley has left conversions that nobody has read. The first peak has none: there the interrupt builds the drive before it gets
    /// here, and its own conversions are complete by then.
    stale: bool,
    /// `true` if the running period has pulses.
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
            stale: false,
            pulses: false,
        }
    }

    /// First step in the interrupt.
    #[inline]
    pub fn acknowledge(&mut self) {
        self.bridge.acknowledge();
    }

    /// Second step: `true` if the drive's task is to run, which is the case at a peak. A peak that was never served turns the gates off for good: the
    /// drive's time would be wrong from then on.
    #[inline]
    pub fn begin_half(&mut self) -> bool {
        match self.bridge.beat() {
            Beat::Valley => {
                if !self.served {
                    self.bridge.outputs().trip_by(SoftwareBreak::Late);
                }
                (self.served, self.stale) = (false, true);
                false
            }
            Beat::Peak => {
                self.feedback.begin();
                if self.stale {
                    self.samplers.forget();
                }
                if self.bridge.outputs().is_tripped() {
                    // A break of one timer alone stops the others, too.
                    self.bridge.outputs().trip();
                }
                self.served = true;
                true
            }
        }
    }
}

impl PwmPort<Dual> for Pwm {
    fn begin(&mut self) -> bool {
        self.acknowledge();
        self.begin_half()
    }

    fn sample(&mut self, _now: Instant) -> PowerSample {
        let converted = self.samplers.read(&self.zeros);
        PowerSample {
            currents_a: converted.currents_a,
            capacitor_v: converted.capacitor_v,
            source_v: converted.source_v,
            gates: self.feedback.end(),
        }
    }

    /// The outputs go on half a carrier period before the first pulses, while all compares still say off, and go off half a period after the last
    /// ones. A period that these timers cannot play, or an interrupt that ends after its valley, turns the gates off for good.
    fn play(&mut self, _now: Instant, next: &PlayedPeriod) {
        let outputs = self.bridge.outputs();
        let Some(compares) = PeriodCompares::new(next, DEAD_CYCLES) else {
            outputs.trip_by(SoftwareBreak::Drive);
            return;
        };
        self.bridge.play(&compares);
        if self.bridge.is_late() {
            outputs.trip_by(SoftwareBreak::Late);
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

    fn enter(&mut self, _safe: SafeState, _now: Instant) {
        self.bridge.outputs().trip_by(SoftwareBreak::Drive);
    }

    fn leave(&mut self, _now: Instant) -> bool {
        self.bridge.outputs().leave()
    }
}
