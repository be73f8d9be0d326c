//! The scales of a system's signals.

use super::System;
use tractive::drive::dual::Settings;
use tractive::machine::Ratings;
use tractive::protocol::Scales;

impl System {
    /// The scales of its signals, of a machine of these ratings.
    pub const fn scales(self, ratings: &Ratings) -> Scales {
        match self {
            Self::Pmasynrm => Scales::of(ratings),
            Self::Zs9 => Scales::of_zs9(&Settings::operator_ratings(ratings)),
        }
    }
}
