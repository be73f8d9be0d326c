//! The ZS9's drive on the NUCLEO-G474RE: nine gates from three timers.
//!
//! * PWM timers: TIM1, TIM8 and TIM20, one per leg, counting up from the carrier's valley and down from its peak; [`bridge`] says how nine gates are
//!   played and what prevents a short through a leg, [`period`] how a period becomes compares.
//! * Control timer: TIM2, started by TIM1, so that both count from one valley.
//! * Converters: ADC1, ADC2 and ADC3 at every valley and every peak ([`sampling`]). Positions: encoders on TIM4 and TIM3.
//! * The driver board's latches tell what the gates really did ([`feedback`]).
//! * [`pins`] is the wiring, [`stage`] the scales, [`mod@start`] the order of the start.

pub mod bridge;
pub mod control_timer;
pub mod feedback;
pub mod hardware;
pub mod period;
pub mod pins;
mod ports;
pub mod rates;
pub mod sampling;
pub mod serve;
pub mod stage;
pub mod start;

#[cfg(target_os = "none")]
mod chip;

#[cfg(target_os = "none")]
pub use chip::*;
pub use ports::{Control, Pwm};
pub use rates::{CARRIER_TICKS, CLOCK, CONTROL_HZ, CYCLES_PER_TICK, HALF_CYCLES};

use crate::built_in::zs9::BUILT_IN;
use tractive::drive::dual::Settings;
use tractive::machine::Ratings;

/// The ratings in the operator's form.
pub static RATINGS: Ratings = Settings::operator_ratings(&BUILT_IN.ratings);

/// The settings of the drive's tasks.
pub const fn settings() -> Settings {
    rates::settings(&BUILT_IN, stage::STAGE.common.behind_line_filter)
}
