//! The pulses: the modulator of a two-level inverter.
//!
//! Every mode is one carrier with one compare value a phase. Once for each carrier half the modulator
//! describes the half in the form that a timer's shadow registers take: its length, each phase's level at
//! its start, and the instant at which that level toggles. In the synchronous modes the halves are locked to
//! the pulse angle (voltage angle + 90°: phase a's reference is the sine of it). The length of each half takes the
//! carrier to its next boundary angle, so phase errors vanish within a half and nothing accumulates.
//!
//! Backward rotation is forward rotation seen in a mirror: the angle changes sign, and phases b and c are exchanged.
//!
//! # Examples
//! A [`Schedule`] chooses the mode by frequency and voltage, or holds one, as here. The asynchronous carrier: each half has the requested
//! mean voltage.
//!
//! ```
//! use tractive_control::frames::Angle;
//! use tractive_control::modulation::{SwitchLimits, Mode, Modulator, Reference, Schedule};
//! use tractive_control::time::{Clock, Instant};
//!
//! let clock = Clock::new(25_000_000, 2_500); // ticks of 40 ns, control at 10 kHz
//! let devices = SwitchLimits::new(250, 0, 900.0, &clock); // pulses of 10 µs at least, 900 Hz at most
//! let mut modulator = Modulator::new(devices, Schedule::fixed(Mode::Async, &clock));
//! // 600 V along phase a, at rest, on a link of 1,500 V: phase a is 600 V, b and c are −300 V.
//! let reference = Reference::turning(600.0, Angle::ZERO, 0.0, Instant(0), 1_500.0);
//! let half = modulator.step(Instant(0), Some(&reference));
//! let [a, b, c] = half.on_ticks(0).map(|on| on as f32 / half.period_ticks as f32);
//! assert!((1_500.0 * (a - b) - 900.0).abs() < 0.2 && b == c, "900 V from a to b");
//! assert!(half.period_ticks >= 25_000_000 / 1_800, "half a period of 900 Hz at least");
//! ```
//!
//! A locked carrier: fifteen carriers last one turn of the voltage, 20 ms at 50 Hz.
//!
//! ```
//! # use tractive_control::frames::Angle;
//! # use tractive_control::modulation::{SwitchLimits, Mode, Modulator, Reference, Schedule};
//! # use tractive_control::time::{Clock, Instant};
//! # let clock = Clock::new(25_000_000, 2_500);
//! # let devices = SwitchLimits::new(250, 0, 900.0, &clock);
//! let mut modulator = Modulator::new(devices, Schedule::fixed(Mode::Sync15, &clock));
//! let rate = clock.angle_rate(50.0 * core::f32::consts::TAU);
//! let mut now = Instant(0);
//! for _ in 0..30 {
//!     let angle = Angle::from_turns(now.0 as f32 / 500_000.0) - Angle::DEG_90;
//!     let half = modulator.step(now, Some(&Reference::turning(600.0, angle, rate, now, 1_500.0)));
//!     now = now.after(half.period_ticks);
//! }
//! assert!(now.0.abs_diff(500_000) < 10, "20 ms in ticks of 40 ns");
//! ```
//!
//! Middle 60° with three pulses at 90 % of six-step: each half has its part of a notch, β/2 = asin(0.1/2) = 2.87° by equation (16).
//!
//! ```
//! # use tractive_control::frames::Angle;
//! # use tractive_control::modulation::{SwitchLimits, Mode, Modulator, Reference, Schedule};
//! # use tractive_control::time::{Clock, Instant};
//! # let clock = Clock::new(25_000_000, 2_500);
//! # let devices = SwitchLimits::new(250, 0, 900.0, &clock);
//! let mut modulator = Modulator::new(devices, Schedule::fixed(Mode::Mid3, &clock));
//! let rate = clock.angle_rate(200.0 * core::f32::consts::TAU);
//! let six_step_v = core::f32::consts::FRAC_2_PI * 1_500.0;
//! let reference = Reference::turning(0.9 * six_step_v, -Angle::DEG_90, rate, Instant(0), 1_500.0);
//! // The first half leads the machine's flux to the pattern's hexagon, the second one is the pattern's.
//! let begun = Instant(0).after(modulator.step(Instant(0), Some(&reference)).period_ticks);
//! let half = modulator.step(begun, Some(&reference));
//! let toggle = half.compare_ticks.into_iter().min().unwrap_or_default();
//! let notch = toggle.min(half.period_ticks - toggle) as f32 / half.period_ticks as f32;
//! assert!((notch * 30.0 - 2.87).abs() < 0.05, "of a half of 30°");
//! ```
//!
//! Square wave: no edge within a half; in a turn each phase is on for half of the time.
//!
//! ```
//! # use tractive_control::frames::Angle;
//! # use tractive_control::modulation::{SwitchLimits, Mode, Modulator, Reference, Schedule};
//! # use tractive_control::time::{Clock, Instant};
//! # let clock = Clock::new(25_000_000, 2_500);
//! # let devices = SwitchLimits::new(250, 0, 900.0, &clock);
//! let mut modulator = Modulator::new(devices, Schedule::fixed(Mode::Square, &clock));
//! let rate = clock.angle_rate(300.0 * core::f32::consts::TAU);
//! let six_step_v = core::f32::consts::FRAC_2_PI * 1_500.0;
//! let (mut now, mut on_ticks) = (Instant(0), 0);
//! for half in 0..13 {
//!     let angle = Angle::from_turns(now.0 as f32 * 300.0 / 25e6) - Angle::DEG_90;
//!     let played = modulator.step(now, Some(&Reference::turning(six_step_v, angle, rate, now, 1_500.0)));
//!     now = now.after(played.period_ticks);
//!     // The first half leads the machine's flux to the pattern's hexagon.
//!     if half > 0 {
//!         assert_eq!(played.compare_ticks, [u32::MAX; 3]);
//!         on_ticks += played.on_ticks(0)[0];
//!     }
//! }
//! assert!(on_ticks.abs_diff(25_000_000 / 300 / 2) < 10, "half of 3.33 ms");
//! ```

#![forbid(unsafe_code)]

mod carrier;
mod dead_time;
mod flying_start;
mod half;
mod middle60;
mod mode;
mod modulator;
#[cfg(feature = "optimal")]
mod optimal;
mod reference;
mod ripple;
mod schedule;
mod switch_limits;

pub use dead_time::{EdgeDelay, compensate};
pub use half::CarrierHalf;
pub use mode::{MODE_CODES, Mode, Regulation};
pub use modulator::Modulator;
pub use reference::Reference;
use ripple::RippleFlux;
pub use ripple::{ripple_at, ripple_share, ripple_squares};
pub use schedule::{Ladder, Schedule, first_half, index_ceiling, index_floor, index_limit};
pub use switch_limits::{FREE_CARRIER_SHARE, SwitchLimits};
