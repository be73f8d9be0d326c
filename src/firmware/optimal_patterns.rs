//! The optimised pulse patterns.

use tractive::modulation::{Ladder, Schedule};
use tractive::time::Clock;

/// The schedule of the modulator: the optimised patterns above the free carrier.
pub const SCHEDULE: Option<fn(&Clock) -> Schedule> = Some(|clock| Schedule::on(Ladder::OPTIMAL, clock));

/// Highest frequency of the free carrier, as a share of the switches': it leaves room for the first edges of the pattern that follows it.
pub use tractive::modulation::FREE_CARRIER_SHARE;
