//! The NUCLEO-G474RE's registers: the board's own functions against blocks of memory, with a model of the timers behind.

mod bench;
mod bus;
mod drive;
mod image;
mod legs;
mod operator;
mod outputs;
mod pins;
mod ports;
mod position;
mod sampling;
mod start;
mod temperatures;
mod zs9;

use nucleo_g474re::CLOCK;
use nucleo_g474re::built_in::traction::BUILT_IN;
use nucleo_g474re::power_stage::{POWER_STAGE, cycles_to_ticks, ns_to_cycles};
use tractive::modulation::SwitchLimits;

/// The carrier of the machine that is built in.
fn devices() -> SwitchLimits {
    let ticks = |ns| cycles_to_ticks(ns_to_cycles(ns), nucleo_g474re::PRESCALER);
    SwitchLimits::new(
        ticks(POWER_STAGE.min_pulse_ns),
        ticks(POWER_STAGE.dead_time_ns),
        BUILT_IN.ratings.max_switching_hz,
        &CLOCK,
    )
}
