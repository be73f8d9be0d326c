//! The paper's modes.

use tractive::modulation::Schedule;
use tractive::time::Clock;

/// The schedule of an image with other patterns: none, as the modulator has the paper's without being told.
pub const SCHEDULE: Option<fn(&Clock) -> Schedule> = None;

/// Highest frequency of the free carrier, as a share of the switches'.
pub const FREE_CARRIER_SHARE: f32 = 1.0;
