//! The current loop's gains.

use super::{ABOVE_ZERO, Bound, Refused, within};
use crate::control::Gains;

impl Gains {
    /// The check of the gains by themselves.
    ///
    /// # Errors
    /// The first scalar that does not pass.
    pub const fn check(&self) -> Result<(), Refused> {
        let Self {
            carrier,
            pattern_rad,
            square_damping,
            observer,
            sixth_turn_rad,
            resistance_doubt,
            link_damping,
        } = *self;
        within(&[
            Bound("gains.carrier", carrier, ABOVE_ZERO, 1.0),
            Bound("gains.pattern_rad", pattern_rad, ABOVE_ZERO, 10.0),
            Bound("gains.square_damping", square_damping, ABOVE_ZERO, 10.0),
            Bound("gains.observer", observer, ABOVE_ZERO, 0.5),
            Bound("gains.sixth_turn_rad", sixth_turn_rad, 0.0, 3.0),
            Bound("gains.resistance_doubt", resistance_doubt, ABOVE_ZERO, 10.0),
            Bound("gains.link_damping", link_damping, 0.0, 10.0),
        ])
    }
}
