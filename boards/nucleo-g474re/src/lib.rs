//! ST's NUCLEO-G474RE (STM32G474RE, Cortex-M4F at 170 MHz), registers only.
//!
//! * PWM timer: TIM1 with TIM8 in step, one period per carrier half; [`legs`] says how a half is played and which registers are shadowed, [`half`]
//!   how it becomes compare values, [`dead_time`] how the dead time is coded.
//! * Control timer: TIM3, started by TIM1's first update, so that both count from one instant.
//! * Both timers' clocks are 170 MHz divided by [`PRESCALER`], so that 16 bits hold the longest half. The power stage sets the control rate.
//! * Converters: ADC1 at the control timer's update, ADC2 at the PWM timer's ([`sampling`]). Position: an encoder on
//!   TIM4, or whatever implements [`Position`].
//! * Break inputs and comparators turn the gates off without clock and software ([`comparators`]); the watchdog turns them off when an interrupt
//!   stops coming ([`watchdog`]).
//! * [`zs9`] is the same for the nine-switch inverter.
//! * [`pins`] is the wiring, [`power_stage`] the scales, [`mod@start`] the order of the start.
//!
//! Everything here but `chip` and `log` takes its registers as values, so tests on the host run it against blocks of memory.
#![no_std]
#![cfg_attr(not(target_os = "none"), forbid(unsafe_code))]
#![cfg_attr(target_os = "none", deny(unsafe_code))]

pub mod built_in;
pub mod can;
pub mod clock;
pub mod comparators;
pub mod control_timer;
pub mod dead_time;
pub mod half;
pub mod hardware;
pub mod legs;
pub mod outputs;
pub mod patterns;
pub mod pins;
mod ports;
pub mod position;
pub mod power_stage;
pub mod rates;
pub mod registers;
pub mod sampling;
pub mod serve;
pub mod start;
pub mod start_error;
pub mod switchgear;
pub mod temperatures;
pub mod wait;
pub mod watchdog;
pub mod zs9;

#[cfg(target_os = "none")]
mod chip;
#[cfg(target_os = "none")]
mod log;

#[cfg(target_os = "none")]
pub use chip::*;
pub use ports::{Control, Pwm};
pub use position::Position;
pub use power_stage::{CLOCK, PRESCALER};
