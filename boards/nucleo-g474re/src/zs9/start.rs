//! The start: the configuration steps and their order. The gates stay off until all of it is done.

use super::bridge::Bridge;
use super::control_timer::ControlTimer;
use super::feedback::Feedback;
use super::sampling::{Samplers, Zeros};
use super::stage::{STAGE, Zs9Stage};
use super::{CLOCK, CYCLES_PER_TICK, pins};
use crate::comparators::{self, Watch};
use crate::position::{BY_TIM2, Encoder};
use crate::registers::Registers;
use crate::start::{StartError, Wait, settle_breaks, switch_off};
use crate::{clock, pins as all_pins, watchdog};
use stm32_metapac::comp::vals::Inm;
use stm32_metapac::syscfg::regs::Swpr;

/// Each current on one comparator, which trips above its threshold; and the gate drivers' ready line below the internal reference. If a current is
/// too far below zero, another one of its motor is above by half as much or more; the drive itself checks both signs.
const WATCHES: [Watch; 7] = [
    Watch::dac(1, false, false),
    Watch::dac(3, true, false),
    Watch::dac(6, false, false),
    Watch::dac(4, false, false),
    Watch::dac(7, false, false),
    Watch::dac(2, false, false),
    Watch { number: 5, second_input: false, below: true, threshold: Inm::VREF },
];

/// Everything that a step works with.
pub struct Start<'a> {
    /// The peripherals.
    pub registers: &'a Registers,
    /// Time.
    pub wait: &'a mut dyn Wait,
    /// The power stage.
    pub stage: &'a Zs9Stage,
    /// Zeros of the current sensors, found on the way.
    pub zeros: Zeros,
}

/// One step of the start.
pub type Step = fn(&mut Start) -> Result<(), StartError>;

/// The steps in their order. The PWM timers are locked into their safe configuration before any gate pin is connected to them, and break inputs and
/// comparators are active before that; nothing counts until [`run`].
pub const STEPS: [(&str, Step); 12] = [
    ("dead-battery pull-downs", |start| {
        clock::release_dead_battery(start.registers, start.wait);
        Ok(())
    }),
    ("clock tree", |start| clock::configure(start.registers, start.wait)),
    ("peripheral clocks", |start| {
        clock::enable_peripherals(start.registers, start.wait);
        // The CCM SRAM holds the interrupts' code alone: nobody writes to it any more.
        start.registers.syscfg.swpr().write_value(Swpr(u32::MAX));
        Ok(())
    }),
    // Not earlier: a refusal is reported over the bus, which needs the crystal and its pins.
    ("reset cause", |start| watchdog::refuse_after_bite(start.registers)),
    ("inputs", |start| {
        all_pins::configure_inputs(start.registers, &pins::PINS);
        Ok(())
    }),
    ("comparators", |start| {
        let (_, upper) = start.stage.common.break_codes();
        comparators::configure_watches(start.registers, [[upper; 2]; 2], &WATCHES);
        Ok(())
    }),
    ("PWM timers", |start| {
        let dead_time = start.stage.common.dead_time().ok_or(StartError::DeadTime)?;
        bridge(start.registers).configure(dead_time);
        Ok(())
    }),
    ("control timer, encoders, gate feedback", |start| {
        let Registers { tim2, tim3, tim4, .. } = *start.registers;
        ControlTimer(tim2).configure(CYCLES_PER_TICK as u16, CLOCK.control_ticks);
        Encoder::configure(tim4, &start.stage.common, BY_TIM2);
        Encoder::configure(tim3, &start.stage.common, BY_TIM2);
        feedback(start.registers).configure();
        Ok(())
    }),
    ("converters", |start| {
        start.zeros = Samplers::new(start.registers).prepare(start.registers, start.stage, start.wait)?;
        Ok(())
    }),
    ("gate pins", |start| {
        all_pins::configure_gates(start.registers, &pins::PINS);
        Ok(())
    }),
    ("break inputs", |start| {
        settle_breaks(&bridge(start.registers).outputs(), start.wait);
        Ok(())
    }),
    ("watchdog", |start| watchdog::start(start.registers, start.wait)),
];

/// Runs all steps; returns the zeros of the current sensors. After one that fails all outputs are off for good.
pub fn prepare(registers: &Registers, wait: &mut dyn Wait) -> Result<Zeros, StartError> {
    let mut start = Start { registers, wait, stage: &STAGE, zeros: Zeros::default() };
    let done = STEPS.iter().try_for_each(|(_, step)| step(&mut start));
    done.inspect_err(|_| switch_off(registers, &pins::PINS)).and(Ok(start.zeros))
}

/// All timers count from this instant on, a valley; the converters follow them from their next beat on. Everything must be prepared, and the
/// interrupts ready.
pub fn run(registers: &Registers, wait: &mut dyn Wait) {
    let samplers = Samplers::new(registers);
    samplers.refresh(wait);
    bridge(registers).start();
    samplers.follow_timer();
}

/// The nine gates' timers.
pub const fn bridge(registers: &Registers) -> Bridge {
    Bridge { timers: [registers.legs.tim1, registers.legs.tim8, registers.tim20] }
}

/// The gates' feedback.
pub const fn feedback(registers: &Registers) -> Feedback {
    Feedback { spi: registers.spi3, port: registers.gpioa }
}
