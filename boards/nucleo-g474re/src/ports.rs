//! The two interrupts' sides of the board.

use super::control_timer::ControlTimer;
use super::half::HalfRegisters;
use super::hardware;
use super::legs::SoftwareBreak;
use super::pins;
use super::position::{Position, PositionState, reported};
use super::registers::Registers;
use super::sampling::{Sampler, Zeros, currents_a};
use super::start::{control_sampler, pwm_sampler};
use tractive::frames::{Abc, Angle};
use tractive::modulation::{CarrierHalf, Mode};
use tractive::ports::{ControlPort, PwmPort, Report, Sample};
use tractive::protection::SafeState;
use tractive::time::Instant;

/// The control interrupt's side.
pub struct Control<'a, P> {
    registers: Registers,
    timer: ControlTimer,
    sampler: Sampler,
    zeros: Zeros,
    position: P,
    state: &'a PositionState,
}

impl<'a, P: Position> Control<'a, P> {
    /// Made with the zeros that the start measured, and the place where the position sensor's state is kept.
    pub const fn new(registers: Registers, zeros: Zeros, position: P, state: &'a PositionState) -> Self {
        Self {
            registers,
            timer: ControlTimer(registers.tim3),
            sampler: control_sampler(&registers),
            zeros,
            position,
            state,
        }
    }
}

impl<P: Position> ControlPort for Control<'_, P> {
    fn begin(&mut self, revises: bool) {
        self.timer.acknowledge();
        if revises {
            // Triggered at once, between two boundaries; on the host nothing happens.
            #[cfg(target_os = "none")]
            super::revise_pulses();
        }
    }

    /// The position comes first: it has been captured, while the conversions are still under way.
    fn sample(&mut self, _now: Instant) -> Sample {
        let angle = self.position.angle();
        let lost = self.position.is_lost();
        let angle = reported(angle, lost);
        self.state.tell(&[angle], &[lost], self.position.counted().is_some());
        let codes = self.sampler.read();
        let udc_v = match codes {
            Some([_, _, _, udc]) => udc.udc_v(),
            None => f32::NAN,
        };
        let hardware = hardware::latched_by(&self.registers);
        let healthy = hardware.is_none() && !self.registers.legs.is_tripped();
        Sample {
            currents_a: currents_a(codes, &self.zeros),
            udc_v,
            angle,
            may_pulse: healthy && pins::is_enabled(&self.registers),
            hardware,
        }
    }

    fn enter(&mut self, safe: SafeState, _now: Instant) {
        enter(&self.registers, safe);
    }

    fn overrun_ticks(&mut self, _now: Instant, _deadline_ticks: u32) -> u32 {
        self.timer.overrun_ticks()
    }

    fn report(&mut self, _now: Instant, _report: impl FnOnce() -> Report) {}

    fn turned(&mut self) -> Option<Angle> {
        self.position.counted()
    }

    fn align(&mut self, _now: Instant, zero: Angle) {
        self.position.align(zero);
    }
}

/// The PWM interrupt's side.
pub struct Pwm {
    registers: Registers,
    sampler: Sampler,
    zeros: Zeros,
    /// `true` if the next half has pulses.
    pulses: bool,
    /// The levels of the legs at its end.
    levels: [bool; 3],
}

impl Pwm {
    /// At rest, with the zeros that the start measured.
    pub const fn new(registers: Registers, zeros: Zeros) -> Self {
        let sampler = pwm_sampler(&registers);
        Self { registers, sampler, zeros, pulses: false, levels: [false; 3] }
    }

    /// First step in the interrupt: `true` if it belongs to a carrier boundary. If not, control wants a revision, and there is nothing to
    /// acknowledge.
    #[inline]
    pub fn is_boundary(&self) -> bool {
        self.registers.legs.has_updated()
    }

    /// First step at a boundary.
    #[inline]
    pub fn acknowledge(&mut self) {
        self.registers.legs.acknowledge();
    }

    /// Second step: the half that was preloaded last has just begun. The timers themselves produce levels and toggles; only the outputs as a whole
    /// are switched on in a first half with pulses and off after the last.
    #[inline]
    pub fn begin_half(&mut self) {
        let legs = &self.registers.legs;
        if legs.is_tripped() {
            // A break of one timer alone stops the other, too.
            legs.trip();
        } else if self.pulses {
            if !legs.is_on() {
                legs.switch_on();
            }
        } else {
            legs.switch_off();
        }
    }
}

impl PwmPort for Pwm {
    fn begin(&mut self) -> bool {
        let boundary = self.is_boundary();
        if boundary {
            self.acknowledge();
            self.begin_half();
        }
        boundary
    }

    fn sample(&mut self, _now: Instant) -> Abc {
        currents_a(self.sampler.read(), &self.zeros)
    }

    /// If the interrupt ends after its half, the timers hold a mixture of two halves: the gates go off.
    fn play(&mut self, _now: Instant, next: &CarrierHalf) {
        let half = HalfRegisters::new(next, self.levels);
        let legs = &self.registers.legs;
        legs.play(&half);
        if legs.has_updated() {
            legs.trip_by(SoftwareBreak::Late);
        }
        self.pulses = next.mode != Mode::Off;
        self.levels = half.end_levels();
    }

    fn enter(&mut self, safe: SafeState, _now: Instant) {
        enter(&self.registers, safe);
    }

    fn leave(&mut self, _now: Instant) -> bool {
        self.registers.legs.leave()
    }

    fn is_late(&mut self) -> bool {
        self.registers.legs.software_break() == Some(SoftwareBreak::Late)
    }
}

#[inline]
fn enter(registers: &Registers, safe: SafeState) {
    match safe {
        _ if registers.legs.is_short_circuited() => {}
        // No signal here reports a leg stuck at the upper rail.
        SafeState::GatesOff | SafeState::UpperShortCircuit => registers.legs.trip_by(SoftwareBreak::Drive),
        SafeState::ShortCircuit => registers.legs.short_circuit(),
    }
}
