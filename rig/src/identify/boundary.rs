//! A carrier boundary, with everything that has acted up to it.

use tractive::identification::Stage;

/// A boundary, and everything that has acted up to it, stationary frame.
pub struct Boundary {
    /// The part of the experiment.
    pub stage: Stage,
    /// Current along d and q, in A.
    pub current: (f64, f64),
    /// Sine and cosine of the d axis.
    pub frame: (f64, f64),
    /// Volt-seconds that the modulator made, in V·s.
    pub volt_seconds: [f64; 2],
    /// `∫i dt`, in A·s.
    pub charge: [f64; 2],
    /// Volt-seconds that a dead time of one second takes away, in V.
    pub lacking: [f64; 2],
    /// Volt-seconds that a threshold of one volt takes away, in s.
    pub opposed: [f64; 2],
    /// Edges so far whose current sign was uncertain.
    pub unsure: f64,
    /// Time so far, in s.
    pub passed_s: f64,
}

/// Transforms from the rotor's frame to the stationary one.
pub fn turned((sin, cos): (f64, f64), [d, q]: [f64; 2]) -> [f64; 2] {
    [d * cos - q * sin, d * sin + q * cos]
}
