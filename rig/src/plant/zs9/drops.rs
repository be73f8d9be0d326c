//! Voltage drops of the bridge's nine devices and of the source's switch.
//!
//! With both motors' currents into their terminals, `i_u` and `i_l`, the devices of a leg carry, from the positive rail to the negative one,
//!
//! | state | H | M | L |
//! |---|---|---|---|
//! | 1 | `i_u` | – | `−i_l` |
//! | 0 | – | `−i_u` | `−i_u − i_l` |
//! | −1 | `i_u + i_l` | `i_l` | – |
//! | shoot-through, `j` in L | `j + i_l + i_u` | `j + i_l` | `j` |
//!
//! In a device that is on, forward current flows through the IGBT and reverse current through the diode. The diodes of gates that are off or stuck are ideal,
//! and so are those that short the link by themselves.

use super::Vector;
use super::bridge::LegGates;
use crate::plant::legs::Clamp;
use crate::plant::{DeviceDrops, Leg};

/// The devices, and the fading of their thresholds near zero current.
#[derive(Clone, Copy)]
pub struct Devices<'a> {
    pub drops: &'a DeviceDrops,
    pub clamp: &'a Clamp,
}

/// The voltages lost in a bridge.
#[derive(Clone, Copy, Debug, Default)]
pub struct Lost {
    /// Voltage by which the terminals of the upper and of the lower motor are below their shares of the link, as vectors, in V.
    pub terminals: [Vector; 2],
    /// The link's voltage in shoot-through, in V.
    pub short_v: f64,
}

/// Phase currents into the upper motor and into the lower one, in A.
pub type Currents = [[f64; 3]; 2];

impl Devices<'_> {
    /// The drop of a device that is on, from its current from the positive rail to the negative one, in V.
    fn device_v(&self, current_a: f64) -> f64 {
        self.drops.drop_v(Leg::Upper, current_a, self.clamp.near_zero(current_a))
    }

    /// The drop of the source's switch, in V, from the source's current: its diode gives, its IGBT takes back.
    pub fn source_v(&self, current_a: f64) -> f64 {
        self.drops.drop_v(Leg::Lower, current_a, self.clamp.near_zero(current_a))
    }

    /// Voltage by which both terminals of a leg are below their rails, in V; without shoot-through.
    fn leg_v(&self, gates: LegGates, upper_a: f64, lower_a: f64) -> [f64; 2] {
        let both_a = upper_a + lower_a;
        match gates {
            LegGates::ONE => [self.device_v(upper_a), -self.device_v(-lower_a)],
            LegGates::ZERO => {
                let low_v = -self.device_v(-both_a);
                [low_v - self.device_v(-upper_a), low_v]
            }
            LegGates::MINUS_ONE => {
                let high_v = self.device_v(both_a);
                [high_v, high_v + self.device_v(lower_a)]
            }
            _ => [0.0; 2],
        }
    }

    /// The voltages lost outside shoot-through.
    pub fn driven(&self, gates: &[LegGates; 3], [upper, lower]: Currents) -> Lost {
        let legs = core::array::from_fn(|leg| self.leg_v(gates[leg], upper[leg], lower[leg]));
        Lost { terminals: vectors(legs), short_v: 0.0 }
    }

    /// The same in shoot-through, in which the bridge takes a current in A. If several legs short the link they share it evenly.
    pub fn shorted(&self, gates: &[LegGates; 3], [upper, lower]: Currents, bridge_a: f64) -> Lost {
        let short = |leg: usize| gates[leg] == LegGates::SHOOT_THROUGH;
        let high_a = |leg: usize| match gates[leg] {
            LegGates::ONE => upper[leg],
            LegGates::MINUS_ONE => upper[leg] + lower[leg],
            _ => 0.0,
        };
        let others_a: f64 = (0..3).filter(|leg| !short(*leg)).map(high_a).sum();
        let count = (0..3).filter(|leg| short(*leg)).count().max(1) as f64;
        let through_a = (bridge_a - others_a) / count;
        // From the negative rail: L, M, H.
        let rising = |leg: usize| {
            let low_v = self.device_v(through_a - upper[leg] - lower[leg]);
            let middle_v = low_v + self.device_v(through_a - upper[leg]);
            [low_v, middle_v, middle_v + self.device_v(through_a)]
        };
        let short_v = (0..3).filter(|leg| short(*leg)).map(|leg| rising(leg)[2]).sum::<f64>() / count;
        let legs = core::array::from_fn(|leg| {
            let [low_v, middle_v, _] = rising(leg);
            let ideal = |upper: bool| if upper { short_v } else { 0.0 };
            match gates[leg] {
                LegGates::SHOOT_THROUGH => [-middle_v, -low_v],
                other => {
                    let [upper_v, lower_v] = self.leg_v(other, upper[leg], lower[leg]);
                    // The shares of a shorted bridge are zero.
                    [upper_v - ideal(other.high), lower_v - ideal(other == LegGates::MINUS_ONE)]
                }
            }
        });
        Lost { terminals: vectors(legs), short_v }
    }
}

/// Both motors' vectors of voltages by leg.
fn vectors(legs: [[f64; 2]; 3]) -> [Vector; 2] {
    [0, 1].map(|motor| Vector::clarke(legs.map(|leg| leg[motor])))
}
