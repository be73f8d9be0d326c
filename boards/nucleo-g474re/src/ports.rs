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
    /// With the zeros that the start measured, and where the position sensor's word of itself is kept.
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
            // Between two boundaries, at once; on the host nothing comes.
            #[cfg(target_os = "none")]
            super::revise_pulses();
        }
    }

    /// Position first: it has been captured, and the conversions are still under way.
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
    /// `true` if the half that comes next has pulses.
    pulses: bool,
    /// The levels on which the legs stand at its end.
    levels: [bool; 3],
}

impl Pwm {
    /// At rest, with the zeros that the start measured.
    pub const fn new(registers: Registers, zeros: Zeros) -> Self {
        let sampler = pwm_sampler(&registers);
        Self { registers, sampler, zeros, pulses: false, levels: [false; 3] }
    }

    /// First thing in the interrupt: whether it is a carrier boundary's. If not, control wants a revision, and there is nothing to
    /// acknowledge.
    #[inline]
    pub fn is_boundary(&self) -> bool {
        self.registers.legs.has_updated()
    }

    /// First thing at a boundary.
    #[inline]
    pub fn acknowledge(&mut self) {
        self.registers.legs.acknowledge();
    }

    /// Second thing: the half that was preloaded last has just begun. Levels and toggles are the timers' own doing; only the
    /// outputs as a whole are switched on in a first half with pulses and off after the last.
    #[inline]
    pub fn begin_half(&mut self) {
        let legs = &self.registers.legs;
        if legs.is_tripped() {
            // A break of one timer alone stops the other.
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

    /// An interrupt that ends after its half has left the timers a mixture of two halves: the gates go off.
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
        // Nothing here tells of a leg stuck at the upper rail.
        SafeState::GatesOff | SafeState::UpperShortCircuit => registers.legs.trip_by(SoftwareBreak::Drive),
        SafeState::ShortCircuit => registers.legs.short_circuit(),
    }
}
