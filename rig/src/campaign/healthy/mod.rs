//! Hard but healthy driving, at random: what must not trip.

pub mod dual;
pub mod traction;

use crate::bench::{Flaws, Peaks};
use tractive::protection::Trip;

/// What a ride came to.
#[derive(Clone, Debug)]
pub struct Driven {
    /// Extremes of the ride.
    pub peaks: Peaks,
    /// The trip, where and in which mode, if there was one.
    pub tripped: Option<String>,
}

/// Sensors as they are: 12 bits over a quarter more than the trip level, and this much noise, in A rms.
fn flaws(trip_current_a: f64, noise_a: f64, seed: u64) -> Flaws {
    Flaws { adc_bits: Some(12), adc_full_scale_a: 1.25 * trip_current_a, noise_a, seed, ..Flaws::default() }
}

/// A trip in words.
fn named(trip: Trip) -> String {
    format!("{} {} (limit {})", trip.fault.name(), trip.value, trip.limit)
}
