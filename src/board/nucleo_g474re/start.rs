//! The start: what is configured, in which order. The gates stay off until all of it is done.

use super::comparators;
use super::control_timer::ControlTimer;
use super::half;
use super::outputs::Outputs;
use super::pins::{self, Pin};
use super::position::{Encoder, TIM4_BY_TIM3};
use super::power_stage::{POWER_STAGE, PowerStage};
use super::registers::Registers;
use super::sampling::{self, Sampler, Zeros};
use super::{CLOCK, PRESCALER, clock, switchgear, watchdog, zs9};
use crate::protection::{Fault, Violation};

/// Waiting for the hardware: on the chip a loop with a bound, in a test the hardware's turn.
pub trait Wait {
    /// Until `done` says so; an error if it does not for too long.
    fn until(&mut self, done: &mut dyn FnMut() -> bool) -> Result<(), Timeout>;
    /// At least this long.
    fn microseconds(&mut self, us: u32);
}

/// The hardware did not answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Timeout;

/// Why the board did not start. All outputs are off and stay off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum StartError {
    /// The watchdog has reset the chip. The drive does not start again by itself: the next reset, by hand, starts it.
    WatchdogReset,
    /// The flash memory did not take the wait states.
    FlashLatency,
    /// The crystal does not oscillate.
    Crystal,
    /// The PLL does not lock.
    Pll,
    /// The system clock was not switched to the PLL.
    ClockSwitch,
    /// The dead time is none or longer than the generator can make.
    DeadTime,
    /// A carrier half may be longer than the 16-bit timers count.
    Carrier {
        /// The longest half, in ticks.
        longest_ticks: u32,
    },
    /// A converter's calibration does not end.
    ConverterCalibration,
    /// A converter does not get ready or converts nothing.
    Converter,
    /// A current sensor's zero is too far from the nominal one.
    CurrentSensor {
        /// What it gives at no current.
        code: u16,
    },
    /// The CAN controller does not answer.
    Can,
    /// The watchdog does not take its settings.
    Watchdog,
}

impl StartError {
    /// The fault that a drive tells which was refused to start for this: [`Fault::StartRefused`], and the reason's number.
    pub const fn violation(&self) -> Violation {
        let number = match self {
            Self::WatchdogReset => 1.0,
            Self::FlashLatency => 2.0,
            Self::Crystal => 3.0,
            Self::Pll => 4.0,
            Self::ClockSwitch => 5.0,
            Self::DeadTime => 6.0,
            Self::Carrier { .. } => 7.0,
            Self::ConverterCalibration => 8.0,
            Self::Converter => 9.0,
            Self::CurrentSensor { .. } => 10.0,
            Self::Can => 12.0,
            Self::Watchdog => 13.0,
        };
        (Fault::StartRefused, number, 0.0)
    }
}

/// How long the first carrier half is, and what the machine needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plan {
    /// The shortest carrier half, in ticks; the longest is four times as long.
    pub shortest_half_ticks: u32,
}

/// What the start found out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Found {
    /// Zeros of the control interrupt's converter.
    pub control_zeros: Zeros,
    /// Zeros of the PWM interrupt's converter.
    pub pwm_zeros: Zeros,
}

/// What a step works with.
pub struct Start<'a> {
    /// The peripherals.
    pub registers: &'a Registers,
    /// Time.
    pub wait: &'a mut dyn Wait,
    /// The power stage.
    pub stage: &'a PowerStage,
    /// The carrier.
    pub plan: Plan,
    /// Filled in on the way.
    pub found: Found,
}

/// One step of the start.
pub type Step = fn(&mut Start) -> Result<(), StartError>;

/// The steps in their order. The PWM timers are locked into their safe configuration before any gate pin is theirs,
/// and break inputs and comparators watch before that; nothing counts until [`run`].
pub const STEPS: [(&str, Step); 13] = [
    ("dead-battery pull-downs", |start| {
        clock::release_dead_battery(start.registers, start.wait);
        Ok(())
    }),
    ("clock tree", |start| clock::configure(start.registers, start.wait)),
    ("peripheral clocks", |start| {
        clock::enable_peripherals(start.registers, start.wait);
        Ok(())
    }),
    // Not earlier: what is refused is told over the bus, which needs the crystal and its pins.
    ("reset cause", |start| watchdog::refuse_after_bite(start.registers)),
    ("inputs", |start| {
        pins::configure_inputs(start.registers, &pins::PINS);
        Ok(())
    }),
    ("comparators", |start| {
        comparators::configure(start.registers, start.stage);
        Ok(())
    }),
    ("PWM timers", configure_legs),
    ("control timer and encoder", |start| {
        ControlTimer(start.registers.tim3).configure(PRESCALER, CLOCK.control_ticks);
        Encoder::configure(start.registers.tim4, start.stage, TIM4_BY_TIM3);
        Ok(())
    }),
    ("switchgear", |start| {
        switchgear::configure(start.registers);
        Ok(())
    }),
    ("converters", prepare_samplers),
    ("gate pins", |start| {
        pins::configure_gates(start.registers, &pins::PINS);
        Ok(())
    }),
    ("break inputs", |start| {
        settle_breaks(&start.registers.legs.outputs(), start.wait);
        Ok(())
    }),
    ("watchdog", |start| watchdog::start(start.registers, start.wait)),
];

/// All steps; after one that fails all outputs are off for good.
pub fn prepare(registers: &Registers, wait: &mut dyn Wait, plan: Plan) -> Result<Found, StartError> {
    let mut start = Start { registers, wait, stage: &POWER_STAGE, plan, found: Found::default() };
    let done = STEPS.iter().try_for_each(|(_, step)| step(&mut start));
    done.inspect_err(|_| switch_off(registers, &pins::PINS)).and(Ok(start.found))
}

/// Time for which the start waits for gate drivers that come up later than the chip, in ms.
const DRIVERS_MS: u32 = 200;

/// Forgets what the break inputs saw before they were wired up. A driver that is not ready by the end is a fault of the drive as it is later
/// on: its latch holds the gates until it is acknowledged.
pub(super) fn settle_breaks<const N: usize>(outputs: &Outputs<N>, wait: &mut dyn Wait) {
    for _ in 0..DRIVERS_MS {
        outputs.forget_breaks();
        wait.microseconds(1_000);
        // A flag whose cause is still there cannot be cleared.
        if !outputs.is_tripped() {
            return;
        }
    }
}

/// Switches off for good, until the next reset, whatever is commanded: all gates, the chopper, and what these pins switch.
pub fn switch_off(registers: &Registers, pins: &[Pin]) {
    // All timers that may have gates, of whichever drive.
    zs9::start::bridge(registers).outputs().trip();
    switchgear::stop_chopper(registers);
    pins::release_switches(registers, pins);
}

/// Both timers count from this instant on; from their next updates on the converters follow them. Everything must be
/// prepared, and the interrupts be ready.
pub fn run(registers: &Registers, wait: &mut dyn Wait) {
    let samplers = [control_sampler(registers), pwm_sampler(registers)];
    samplers.iter().for_each(|sampler| sampler.refresh(wait));
    registers.legs.start();
    samplers.iter().for_each(Sampler::follow_timer);
}

/// The control interrupt's converter.
pub const fn control_sampler(registers: &Registers) -> Sampler {
    Sampler { adc: registers.adc1, sequence: sampling::CONTROL }
}

/// The PWM interrupt's converter.
pub const fn pwm_sampler(registers: &Registers) -> Sampler {
    Sampler { adc: registers.adc2, sequence: sampling::PWM }
}

fn configure_legs(start: &mut Start) -> Result<(), StartError> {
    let shortest = start.plan.shortest_half_ticks;
    let longest_ticks = shortest.saturating_mul(4);
    if shortest == 0 || longest_ticks > half::LONGEST_HALF_TICKS {
        return Err(StartError::Carrier { longest_ticks });
    }
    let dead_time = start.stage.dead_time().ok_or(StartError::DeadTime)?;
    start.registers.legs.configure(PRESCALER, dead_time, half::reload(shortest));
    Ok(())
}

fn prepare_samplers(start: &mut Start) -> Result<(), StartError> {
    sampling::configure_clock(start.registers.adc12);
    let (control, pwm) = (control_sampler(start.registers), pwm_sampler(start.registers));
    control.prepare(start.wait)?;
    pwm.prepare(start.wait)?;
    start.found.control_zeros = control.zeros(start.stage, start.wait)?;
    start.found.pwm_zeros = pwm.zeros(start.stage, start.wait)?;
    Ok(())
}
