//! The ZS9's drive on the NUCLEO-G474RE: nine gates from three timers.
//!
//! * PWM timers: TIM1, TIM8 and TIM20, one a leg, counting up from the carrier's valley and down from its peak; [`bridge`] says
//!   how nine gates are played and what keeps a leg from being shorted, [`period`] how a period becomes compares.
//! * Control timer: TIM2, started by TIM1, so that both count from one valley.
//! * Converters: ADC1, ADC2 and ADC3 at every valley and every peak ([`sampling`]). Positions: encoders on TIM4 and TIM3.
//! * What the gates really did is read from the driver board's latches ([`feedback`]).
//! * [`pins`] is the wiring, [`stage`] the scales, [`mod@start`] the order of the start.

pub mod bridge;
pub mod control_timer;
pub mod feedback;
pub mod hardware;
pub mod period;
pub mod pins;
mod ports;
pub mod sampling;
pub mod stage;
pub mod start;

#[cfg(target_os = "none")]
mod chip;

#[cfg(target_os = "none")]
pub use chip::*;
pub use ports::{Control, Pwm};

use super::power_stage::CORE_HZ;
use crate::built_in::zs9::BUILT_IN;
use crate::drive::dual::Settings;
use crate::machine::Ratings;
use crate::operator::LineTimes;
use crate::time::Clock;

/// Cycles of the timers' clock in a tick of the drive's.
pub const CYCLES_PER_TICK: u32 = 5;

/// Control interrupts per second, in Hz.
const CONTROL_HZ: u32 = 10_000;

/// Carrier periods in a control period: 1 (10 kHz) or 2 (20 kHz).
pub const CARRIERS_PER_CONTROL: u32 = 1;

/// 34 MHz ticks; control at 10 kHz.
pub const CLOCK: Clock = {
    let ticks_per_s = CORE_HZ / CYCLES_PER_TICK;
    assert!(ticks_per_s * CYCLES_PER_TICK == CORE_HZ && ticks_per_s.is_multiple_of(CONTROL_HZ));
    Clock::new(ticks_per_s, ticks_per_s / CONTROL_HZ)
};

/// The carrier's period, in ticks.
pub const CARRIER_TICKS: u32 = {
    let ticks = CLOCK.control_ticks / CARRIERS_PER_CONTROL;
    assert!(ticks * CARRIERS_PER_CONTROL == CLOCK.control_ticks && ticks.is_multiple_of(2) && ticks <= 4_000);
    ticks
};

/// Cycles of the timers' clock from a valley to a peak.
pub const HALF_CYCLES: u16 = {
    let cycles = CARRIER_TICKS / 2 * CYCLES_PER_TICK;
    assert!(cycles < u16::MAX as u32);
    cycles as u16
};

/// What the drive's tasks are built with.
pub const fn settings() -> Settings {
    Settings::new(CLOCK, CARRIER_TICKS)
}

/// The ratings as the operator looks at them.
pub static RATINGS: Ratings = settings().operator_ratings(&BUILT_IN.ratings);

/// Time constants of the line side that this board file is for: 50 ohm and 500 ohm on both capacitors of 500 µF.
pub const TIMES: LineTimes = LineTimes { precharge_s: 0.05, discharge_s: 0.5 };
