//! The drive of the rotor.

use super::wheel::Wheel;
use core::f64::consts::TAU;

/// The source of the speed.
#[derive(Clone, Debug)]
pub enum SpeedSource {
    /// A prescribed speed: (time in s, r/min), straight lines between, constant before and after.
    Profile(Vec<(f64, f64)>),
    /// A free rotor.
    Inertia {
        /// Inertia, in kg·m².
        inertia_kg_m2: f64,
        /// Load torque against forward rotation, in N·m.
        load_nm: f64,
    },
    /// A wheel set on its rail.
    Wheel(Wheel),
}

impl SpeedSource {
    /// A prescribed speed; no points at all mean standstill.
    pub fn profile(points: Vec<(f64, f64)>) -> Self {
        Self::Profile(points)
    }

    /// Inertia of all that turns, in kg·m²; `None` if a speed is prescribed.
    pub fn inertia_kg_m2(&self) -> Option<f64> {
        match self {
            Self::Profile(_) => None,
            Self::Inertia { inertia_kg_m2, .. } => Some(*inertia_kg_m2),
            Self::Wheel(wheel) => Some(wheel.inertia_kg_m2),
        }
    }
}

/// Speed of a profile at a time, in mechanical rad/s.
pub fn profile_speed(points: &[(f64, f64)], t_s: f64) -> f64 {
    let after = points.partition_point(|(time, _)| *time <= t_s);
    let rpm = match (after.checked_sub(1).and_then(|k| points.get(k)), points.get(after)) {
        (Some((t0, n0)), Some((t1, n1))) => n0 + (n1 - n0) * (t_s - t0) / (t1 - t0),
        (Some((_, rpm)), None) | (None, Some((_, rpm))) => *rpm,
        (None, None) => 0.0,
    };
    rpm * TAU / 60.0
}
