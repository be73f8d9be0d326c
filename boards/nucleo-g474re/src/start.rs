//! The start: the configuration steps and their order. The gates stay off until all of it is done.

use super::comparators;
use super::control_timer::ControlTimer;
use super::half;
use super::outputs::Outputs;
use super::pins::{self, Pin};
use super::position::{Position, Sensor};
use super::power_stage::{POWER_STAGE, PowerStage};
use super::registers::Registers;
use super::sampling::{self, Sampler, Zeros};
pub use super::start_error::StartError;
pub use super::wait::{Timeout, Wait};
use super::{CLOCK, PRESCALER, clock, switchgear, temperatures, watchdog};
use tractive::modulation::SwitchLimits;

/// The results of the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Found {
    /// Zeros of the control interrupt's converter.
    pub control_zeros: Zeros,
    /// Zeros of the PWM interrupt's converter.
    pub pwm_zeros: Zeros,
}

/// Everything that a step works with.
pub struct Start<'a> {
    /// The peripherals.
    pub registers: &'a Registers,
    /// Time.
    pub wait: &'a mut dyn Wait,
    /// The power stage.
    pub stage: &'a PowerStage,
    /// The carrier.
    pub devices: SwitchLimits,
    /// Filled in on the way.
    pub found: Found,
}

/// One step of the start.
pub type Step = fn(&mut Start) -> Result<(), StartError>;

/// The steps in their order. The PWM timers are locked into their safe configuration before any gate pin is connected to them, and break inputs and
/// comparators are active before that; nothing counts until [`run`].
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
    // Not earlier: a refusal is reported over the bus, which needs the crystal and its pins.
    ("reset cause", |start| watchdog::refuse_after_bite(start.registers)),
    ("inputs", |start| {
        pins::configure_inputs(start.registers, &pins::PINS);
        pins::configure_inputs(start.registers, Sensor::PINS);
        Ok(())
    }),
    ("comparators", |start| {
        comparators::configure(start.registers, start.stage);
        Ok(())
    }),
    ("PWM timers", configure_legs),
    ("control timer and position sensor", |start| {
        ControlTimer(start.registers.tim3).configure(PRESCALER, CLOCK.control_ticks);
        Sensor::prepare(start.registers, start.stage, start.wait)
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

/// Runs all steps; after one that fails all outputs are off for good.
pub fn prepare(
    registers: &Registers,
    wait: &mut dyn Wait,
    devices: SwitchLimits,
) -> Result<Found, StartError> {
    let mut start = Start { registers, wait, stage: &POWER_STAGE, devices, found: Found::default() };
    let done = STEPS.iter().try_for_each(|(_, step)| step(&mut start));
    done.inspect_err(|_| switch_off(registers, &pins::PINS)).and(Ok(start.found))
}

/// Time for which the start waits for gate drivers that come up later than the chip, in ms.
const DRIVERS_MS: u32 = 200;

/// Clears what the break inputs saw before they were wired up. A driver that is not ready by the end is a fault of the drive, as it would be later:
/// its latch keeps the gates off until it is acknowledged.
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
    // All timers that may have gates, of either drive.
    Outputs([registers.legs.tim1, registers.legs.tim8, registers.tim20]).trip();
    switchgear::stop_chopper(registers);
    pins::release_switches(registers, pins);
}

/// Both timers count from this instant on; the converters follow them from their next updates on. Everything must be prepared, and the interrupts
/// ready.
pub fn run(registers: &Registers, wait: &mut dyn Wait) {
    let samplers = [control_sampler(registers), pwm_sampler(registers)];
    samplers.iter().for_each(|sampler| sampler.refresh(wait));
    Sensor::follow(registers, wait);
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
    let shortest = start.devices.shortest_half_ticks;
    let longest_ticks = start.devices.longest_half_ticks();
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
    temperatures::prepare(control.adc);
    pwm.prepare(start.wait)?;
    start.found.control_zeros = control.zeros(start.stage, start.wait)?;
    start.found.pwm_zeros = pwm.zeros(start.stage, start.wait)?;
    Ok(())
}
