//! Hard but healthy driving, at random, which must not trip.

pub mod command;
pub mod dual;
pub mod traction;

use crate::bench::{Flaws, Peaks};
use rand::Rng;
use rand::rngs::StdRng;
use tractive::protection::Trip;

/// The results of a cycle.
#[derive(Clone, Debug)]
pub struct Driven {
    /// Extremes of the cycle.
    pub peaks: Peaks,
    /// The trip, with its place and mode, if there was one.
    pub tripped: Option<String>,
}

/// Realistic sensors: 12 bits over a range a quarter above the trip level, and this much noise, in A rms.
fn flaws(trip_current_a: f64, noise_a: f64, seed: u64) -> Flaws {
    Flaws { adc_bits: Some(12), adc_full_scale_a: 1.25 * trip_current_a, noise_a, seed, ..Flaws::default() }
}

/// A trip in words.
fn named(trip: Trip) -> String {
    format!("{} {} (limit {})", trip.fault.name(), trip.value, trip.limit)
}

/// Corners of a speed that goes up and down: (time in s, r/min), from standstill on, with this largest speed (r/min) and steepest
/// change of it (r/min per s).
fn corners(random: &mut StdRng, most_rpm: f64, steepest_rpm_s: f64, duration_s: f64) -> Vec<(f64, f64)> {
    let (mut t_s, mut rpm) = (0.0, 0.0);
    let mut corners = vec![(t_s, rpm)];
    while t_s < duration_s {
        let next_rpm: f64 = random.random_range(-most_rpm..most_rpm);
        t_s += (next_rpm - rpm).abs() / (random.random_range(0.1..1.0) * steepest_rpm_s);
        rpm = next_rpm;
        corners.push((t_s, rpm));
        t_s += random.random_range(0.0..1.0);
        corners.push((t_s, rpm));
    }
    corners
}

/// Torques that jump or are slewed from one sign to the other: time in s, N·m, and whether the rate is limited.
fn torques(random: &mut StdRng, most_nm: f64, (from_s, until_s): (f64, f64)) -> Vec<(f64, (f64, bool))> {
    let (mut t_s, mut torques) = (from_s, Vec::new());
    while t_s < until_s {
        let share: f64 = if random.random_bool(0.2) { 0.0 } else { random.random_range(-1.0..1.0) };
        torques.push((t_s, (share * most_nm, random.random_bool(0.5))));
        t_s += random.random_range(0.02..0.8);
    }
    torques
}

/// A voltage that jumps within a range (V), by this many volts at most.
fn jumped(random: &mut StdRng, from_v: f64, (least_v, most_v): (f64, f64), jump_v: f64) -> f64 {
    random.random_range((from_v - jump_v).max(least_v)..(from_v + jump_v).min(most_v))
}
