//! Derating: torque is reduced as a part gets hot.

use crate::frames::limit;

/// Temperatures of a part between which the torque is reduced to zero, in °C.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Derating {
    /// Temperature up to which the whole torque is left.
    pub from_c: f32,
    /// Temperature from which none is left; above `from_c`.
    pub none_c: f32,
}

impl Derating {
    /// The share of the torque that a temperature in °C leaves; NaN leaves none.
    pub fn share(&self, celsius: f32) -> f32 {
        if celsius < self.none_c {
            limit((self.none_c - celsius) / (self.none_c - self.from_c), 0.0, 1.0)
        } else {
            0.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn torque_goes_along_a_straight_line() {
        let derating = Derating { from_c: 140.0, none_c: 160.0 };
        for (celsius, share) in
            [(-40.0, 1.0), (140.0, 1.0), (145.0, 0.75), (160.0, 0.0), (300.0, 0.0), (f32::NAN, 0.0)]
        {
            assert_eq!(derating.share(celsius), share, "{celsius} °C");
        }
    }
}
