//! The project's own control law with optimised pulse patterns.

#[path = "own_law.rs"]
mod own;

pub use own::{AT_REST, Law, SET_UP, connect};
use tractive::modulation::Ladder;

/// The optimised patterns above the free carrier.
pub const LADDER: Option<Ladder> = Some(Ladder::OPTIMAL);

/// Room for the first edges of the pattern that follows the free carrier.
pub use tractive::modulation::FREE_CARRIER_SHARE;
