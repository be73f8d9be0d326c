//! The pulses of nine switches: one inverter that feeds two motors and short-circuits its legs on purpose to boost
//! its Z-source link.
//!
//! Three legs of three switches in series, H, M and L; the upper motor is connected to the H–M nodes, the lower motor
//! to the M–L nodes ([`LegState`]). One triangular carrier has the period T, with its valley at t = 0 in the centre of V15 and its peak at T/2 in
//! the centre of V14. The two motors share the time: the lower one has the time around the valley, the upper one the time
//! around the peak. They meet at T/4 and 3T/4, or at a boundary that slides.
//!
//! The period is its own mirror image, so half of it says everything, and in a half every leg makes at most two steps:
//! −1 → 1 at the lower motor's compare instant l, 1 → 0 at the upper motor's u. With p the phase's share of the unit vector
//! (cos θ, cos(θ − 120°), cos(θ + 120°)), both are, in periods,
//!
//! ```text
//! l = c₂ + m₂ p₂/4     u = c₁ + m₁ p₁/4     0 ≤ l ≤ b ≤ u ≤ 1/2
//! ```
//!
//! The mean voltages are then (m/2) U_in at θ, whatever the offsets c are. The offsets place the zero vectors, and the schemes
//! differ in nothing else ([`Scheme`]). So H is off in [u, 1/2], L in [0, l] and M in [l, u]: one pause a gate and
//! half ([`GatePattern`]). Shoot-through moves one end of one pause at each border of a zero vector.
//!
//! # What cannot be
//! The shoot-through duty is kept first, because it feeds the link that both motors live on. Then each motor's voltage is scaled, at its
//! angle, to what its share of the period allows: span ≤ 1 − D, where the span is m (p_max − p_min), √3 m at worst.
//! With the sliding boundary a motor may also use what the other leaves, and always has 1 − D. [`Applied`] says what was
//! given and which motor was limited. A request that is not finite or not in its range is refused by name ([`Refused`]).
//!
//! # Dead time
//! The pulses are ideal. If two gates of a leg toggle at the same instant, the one that turns on has to wait for the
//! dead time, in hardware: M after H and H after M (1 ↔ 0), L after M and M after L (−1 ↔ 1), L after H and H after L
//! (−1 ↔ 0, with M on). Otherwise all three conduct for a moment. At a border with shoot-through nothing has to wait:
//! all three are meant to conduct there. [`DeadTime`] moves the pulses so that the motors still get their voltages.

#![forbid(unsafe_code)]

mod dead_time;
mod gates;
#[cfg(test)]
mod proofs;
mod sequence;
mod shares;
mod shoot_through;
mod vectors;

use crate::frames::Angle;

pub use dead_time::DeadTime;
pub use gates::{GATES, GatePattern, GateTicks, Period};
pub use sequence::Scheme;
pub use vectors::LegState;

use sequence::Sequence;
use shares::Share;
use shoot_through::Shoot;
use vectors::Direction;

/// The mean voltage that one motor is to have.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MotorVoltage {
    /// Angle of the voltage vector.
    pub angle: Angle,
    /// Modulation index m = 2 |V| / U_in, with |V| the peak phase voltage and U_in the link voltage outside
    /// shoot-through; 0 or more.
    pub modulation_index: f32,
}

/// The modulator's input.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Request {
    /// The place of the zero vectors and of the shoot-through.
    pub scheme: Scheme,
    /// The motor at the H–M nodes.
    pub upper: MotorVoltage,
    /// The motor at the M–L nodes.
    pub lower: MotorVoltage,
    /// Shoot-through duty D: the share of the period in which a leg is shorted, 0 ..= 1.
    pub shoot_through: f32,
}

/// The voltages that the pulses give.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Applied {
    /// The upper motor's modulation index.
    pub upper_index: f32,
    /// The lower motor's modulation index.
    pub lower_index: f32,
    /// The upper motor has less than it asked for.
    pub upper_limited: bool,
    /// The lower motor has less than it asked for.
    pub lower_limited: bool,
}

impl Applied {
    /// Both motors have what they asked for.
    pub const fn feasible(&self) -> bool {
        !self.upper_limited && !self.lower_limited
    }
}

/// A request without meaning: the value that is not finite or is outside its range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Refused {
    /// The upper motor's modulation index; must be finite, 0 or more.
    UpperIndex,
    /// The lower motor's modulation index; must be finite, 0 or more.
    LowerIndex,
    /// The shoot-through duty; must lie in 0 ..= 1.
    ShootThrough,
}

/// The gates of one carrier period. Voltages and shoot-through are exact within 1e-6 U_in and 1e-6 T.
///
/// # Errors
/// A value that is not finite or outside its range, by its name.
///
/// # Example
/// ```
/// use tractive_control::frames::Angle;
/// use tractive_control::nine_switch::{MotorVoltage, Refused, Request, Scheme, step};
/// let request = Request {
///     scheme: Scheme::Rs,
///     upper: MotorVoltage { angle: Angle::from_turns(0.1), modulation_index: 0.4 },
///     lower: MotorVoltage { angle: Angle::from_turns(0.7), modulation_index: 0.3 },
///     shoot_through: 0.2,
/// };
/// let period = step(&request)?;
/// assert!(period.applied.feasible());
/// // RS-SVPWM toggles 16 gates a period; all three switches of a leg are on for a fifth of it.
/// assert_eq!(period.gates.iter().map(|gate| gate.toggles().count()).sum::<usize>(), 16);
/// let gates = period.ticks(10_000);
/// let shorted = |tick: &u32| (0..3).any(|leg| [0, 3, 6].iter().all(|row| gates[row + leg].is_on(*tick)));
/// assert_eq!((0..10_000).filter(shorted).count(), 2_000);
/// // What has no meaning is refused by name.
/// assert_eq!(step(&Request { shoot_through: 1.5, ..request }), Err(Refused::ShootThrough));
/// # Ok::<(), Refused>(())
/// ```
#[inline]
pub fn step(request: &Request) -> Result<Period, Refused> {
    check(request)?;
    let (upper, lower) = (Direction::of(request.upper.angle), Direction::of(request.lower.angle));
    let sequence = Sequence::of(request.scheme, &upper, &lower);
    let shares = shares::divide(request, sequence.slides, &upper, &lower);
    let duty = request.shoot_through;
    let edges = |share: &Share, inner, gap| {
        let steps = sequence::steps(share, inner, gap);
        Shoot::new(duty, inner, sequence.central).insert(&steps, share)
    };
    // Next to the boundary the upper motor's smallest phase steps, and the lower motor's largest.
    let gap = shares.upper.span - shares.applied.upper_index * upper.high_gap;
    let [near, between, far] = edges(&shares.upper, sequence.upper_inner, gap);
    let upper_legs = upper.by_leg([far, between, near]);
    let gap = shares.applied.lower_index * lower.high_gap;
    let lower_legs = lower.by_leg(edges(&shares.lower, sequence.lower_inner, gap));
    Ok(Period::new(upper_legs, lower_legs, shares.applied))
}

/// NaN fails every comparison, so it is refused as well.
fn check(request: &Request) -> Result<(), Refused> {
    let is_index = |modulation_index: f32| (0.0..=f32::MAX).contains(&modulation_index);
    if !is_index(request.upper.modulation_index) {
        Err(Refused::UpperIndex)
    } else if !is_index(request.lower.modulation_index) {
        Err(Refused::LowerIndex)
    } else if !(0.0..=1.0).contains(&request.shoot_through) {
        Err(Refused::ShootThrough)
    } else {
        Ok(())
    }
}
