//! The scales of a system's signals.

use super::System;
use crate::run::CLOCK;
use tractive::drive::dual::Settings;
use tractive::machine::Ratings;
use tractive::protocol::Scales;

/// The ZS9's settings, as far as its operator's ratings of the link follow from them.
const LINK: Settings = Settings::new(CLOCK, CLOCK.control_ticks);

impl System {
    /// The scales of its signals, of a machine of these ratings.
    pub const fn scales(self, ratings: &Ratings) -> Scales {
        match self {
            Self::Pmasynrm => Scales::of(ratings),
            Self::Zs9 => Scales::of_zs9(&LINK.operator_ratings(ratings)),
        }
    }
}
