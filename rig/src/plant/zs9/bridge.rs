//! The nine-switch bridge: the rail to which each motor's terminals are connected.

use super::Vector;
use crate::plant::legs::Clamp;
use std::fmt;

/// The three gates of a leg; true is on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LegGates {
    /// Between the positive rail and the upper motor's terminal.
    pub high: bool,
    /// Between the two motors' terminals.
    pub middle: bool,
    /// Between the lower motor's terminal and the negative rail.
    pub low: bool,
}

impl LegGates {
    /// Leg state 1: upper terminal positive, lower terminal negative.
    pub const ONE: Self = Self { high: true, middle: false, low: true };
    /// Leg state 0: both terminals negative.
    pub const ZERO: Self = Self { high: false, middle: true, low: true };
    /// Leg state −1: both terminals positive.
    pub const MINUS_ONE: Self = Self { high: true, middle: true, low: false };
    /// Shoot-through: the leg shorts the link.
    pub const SHOOT_THROUGH: Self = Self { high: true, middle: true, low: true };
    /// All three off.
    pub const OFF: Self = Self { high: false, middle: false, low: false };

    /// The connection of upper and lower terminal to the positive rail; `None` unless the gates alone determine it.
    fn terminals(self) -> Option<[bool; 2]> {
        match (self.high, self.middle, self.low) {
            (true, false, true) => Some([true, false]),
            (false, true, true) => Some([false, false]),
            (true, true, false) => Some([true, true]),
            _ => None,
        }
    }
}

impl fmt::Display for LegGates {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}{}", u8::from(self.high), u8::from(self.middle), u8::from(self.low))
    }
}

/// Gates that are not allowed for the bridge.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("leg {leg} at {time_s:.7} s: gates {gates}: must be 101, 011, 110 or 111, or 000 in all three legs")]
pub struct IllegalState {
    /// The first such leg: `u`, `v` or `w`.
    pub leg: char,
    /// Its gates, printed in the order high, middle, low.
    pub gates: LegGates,
    /// The time at which it began, in s.
    pub time_s: f64,
}

/// The state into which the gates put the bridge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bridge {
    /// Every terminal on a rail: for the upper and the lower motor, the terminals' shares of the link as a vector.
    Driven([Vector; 2]),
    /// A leg shorts the link: all terminals are at the same potential.
    Short,
    /// All gates off: the diodes decide.
    Off,
    /// Gates stuck: the diodes decide for each terminal that they leave free.
    Partly([LegGates; 3]),
}

impl Bridge {
    /// Checks the gates of the legs u, v, w. The error names the first leg whose state is illegal.
    pub fn of(gates: [LegGates; 3], time_s: f64) -> Result<Self, IllegalState> {
        if gates == [LegGates::OFF; 3] {
            return Ok(Self::Off);
        }
        let mut shares = [[0.0; 3]; 2];
        let mut short = false;
        for (index, (leg, gates)) in ['u', 'v', 'w'].into_iter().zip(gates).enumerate() {
            if gates == LegGates::SHOOT_THROUGH {
                short = true;
                continue;
            }
            let [upper, lower] = gates.terminals().ok_or(IllegalState { leg, gates, time_s })?;
            shares[0][index] = f64::from(u8::from(upper));
            shares[1][index] = f64::from(u8::from(lower));
        }
        Ok(if short { Self::Short } else { Self::Driven(shares.map(Vector::clarke)) })
    }

    /// The same if gates are stuck: any state may occur. A leg with all gates on shorts the link, whatever the others do.
    pub fn of_any(gates: [LegGates; 3]) -> Self {
        if gates.contains(&LegGates::SHOOT_THROUGH) {
            return Self::Short;
        }
        Self::of(gates, 0.0).unwrap_or(Self::Partly(gates))
    }

    /// `true` if diodes decide for a terminal.
    pub fn is_free(&self) -> bool {
        matches!(self, Self::Off | Self::Partly(_))
    }
}

/// The terminals' shares of the link while all gates are off.
///
/// A leg's three diodes are in series, all conducting towards the positive rail. Current out of the leg comes from the negative rail, current into it
/// goes to the positive one; if the upper motor takes current, or the lower one gives it, the middle diode connects the two terminals and their sum
/// decides. Around zero current each share changes linearly, as in [`Clamp`]. The link carries the shares times the currents, so no energy is lost.
///
/// The middle diodes put the motors in series: current flows if the sum of both EMFs exceeds the link, although neither does alone.
///
/// A gate that is on connects its two sides.
pub fn freewheeling(
    clamp: &Clamp,
    gates: &[LegGates; 3],
    upper_a: [f64; 3],
    lower_a: [f64; 3],
) -> [Vector; 2] {
    let mut shares = [[0.0; 3]; 2];
    for leg in 0..3 {
        let (upper, lower) = (clamp.share(upper_a[leg]), clamp.share(lower_a[leg]));
        let joined = clamp.share(upper_a[leg] + lower_a[leg]);
        let LegGates { high, middle, low } = gates[leg];
        let (upper, lower) = match (high, middle, low) {
            (false, false, false) => (upper.max(joined), lower.min(joined)),
            (true, false, false) => (1.0, lower),
            (false, false, true) => (upper, 0.0),
            (false, true, false) => (joined, joined),
            (true, true, false) => (1.0, 1.0),
            (false, true, true) => (0.0, 0.0),
            (true, _, true) => (1.0, 0.0),
        };
        (shares[0][leg], shares[1][leg]) = (upper, lower);
    }
    shares.map(Vector::clarke)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_illegal_leg_is_named_with_its_instant() {
        let lonely = LegGates { high: true, ..LegGates::OFF };
        let refused = Bridge::of([LegGates::ONE, lonely, LegGates::OFF], 0.0125).unwrap_err();
        assert_eq!(
            refused.to_string(),
            "leg v at 0.0125000 s: gates 100: must be 101, 011, 110 or 111, or 000 in all three legs"
        );
        let half_off = [LegGates::SHOOT_THROUGH, LegGates::ZERO, LegGates::OFF];
        assert_eq!(Bridge::of(half_off, 0.0).map_err(|error| error.leg), Err('w'));
    }

    #[test]
    fn active_vectors_are_those_of_the_table() {
        use LegGates as L;
        let sixty = Vector { alpha: 1.0 / 3.0, beta: 1.0 / 3.0_f64.sqrt() };
        // V2: 2/3 of the link at 60° for the upper motor; V8: likewise for the lower one; V13 to V15: nothing.
        let v2 = Bridge::Driven([sixty, Vector::default()]);
        let v8 = Bridge::Driven([Vector::default(), sixty]);
        let nothing = Bridge::Driven([Vector::default(); 2]);
        assert_eq!(Bridge::of([L::ONE, L::ONE, L::ZERO], 0.0), Ok(v2));
        assert_eq!(Bridge::of([L::MINUS_ONE, L::MINUS_ONE, L::ONE], 0.0), Ok(v8));
        for zero in [L::ONE, L::ZERO, L::MINUS_ONE] {
            assert_eq!(Bridge::of([zero; 3], 0.0), Ok(nothing));
        }
        assert_eq!(Bridge::of([L::SHOOT_THROUGH, L::ONE, L::ZERO], 0.0), Ok(Bridge::Short));
    }

    #[test]
    fn open_legs_follow_their_currents() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../tables/ipm-zs9");
        let machine = tractive_tablegen::MachineFolder::read(&folder).unwrap();
        let clamp = Clamp::new(85.0, &tractive_tablegen::SmoothMap::new(&machine.map), 1.0);
        // Currents out of a leg to the upper and to the lower motor; then `true` for each positive terminal. With i > 0 to the upper motor or i < 0
        // to the lower one the middle diode connects them.
        let legs = [
            (10.0, 10.0, [0.0, 0.0]),
            (-10.0, 10.0, [1.0, 0.0]),
            (-10.0, -10.0, [1.0, 1.0]),
            (10.0, -4.0, [0.0, 0.0]),
            (4.0, -10.0, [1.0, 1.0]),
        ];
        for (upper, lower, terminals) in legs {
            let shares = freewheeling(&clamp, &[LegGates::OFF; 3], [upper, 0.0, 0.0], [lower, 0.0, 0.0]);
            // The other legs carry no current and are in the middle.
            let expected = terminals.map(|share| Vector::clarke([share, 0.5, 0.5]));
            assert_eq!(shares, expected, "{upper} {lower}");
        }
    }
}
