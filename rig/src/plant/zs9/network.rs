//! The Z-source network.

use crate::plant::legs::LONGEST_STEP_S;
use tractive_tablegen::Parameters;

/// Two equal inductors and two equal capacitors, crosswise between source and bridge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ZNetwork {
    /// Inductance of each inductor, in H, above 0.
    pub inductance_h: f64,
    /// Resistance of each inductor, in ohm, from 0.
    pub resistance_ohm: f64,
    /// Capacitance of each capacitor, in F, above 0.
    pub capacitance_f: f64,
}

/// Currents and voltages of the network.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NetworkState {
    /// Inductor currents, from source to bridge, in A.
    pub inductors_a: [f64; 2],
    /// Capacitor voltages, in V.
    pub capacitors_v: [f64; 2],
}

impl ZNetwork {
    /// The paper's ZS9: 0.5 mH, 10 mΩ, 500 µF.
    pub const ZS9: Self = Self { inductance_h: 0.5e-3, resistance_ohm: 10e-3, capacitance_f: 500e-6 };

    /// The network that a machine folder names.
    pub fn of(parameters: &Parameters) -> Self {
        Self {
            inductance_h: parameters.zs9_inductance_h,
            resistance_ohm: parameters.zs9_resistance_ohm,
            capacitance_f: parameters.zs9_capacitance_f,
        }
    }

    /// The quickest oscillation and the quickest decay that the plant's steps resolve: the least product of inductance and capacitance, in H·F, and the
    /// largest resistance, in ohm.
    pub fn resolved(&self) -> (f64, f64) {
        (LONGEST_STEP_S * LONGEST_STEP_S, self.inductance_h / LONGEST_STEP_S)
    }

    /// Rates of change, in A/s and V/s, with `feed_v` across the source's side and `bridge_a` into the bridge:
    /// `L di1/dt = u_s − v2 − r i1`, `L di2/dt = u_s − v1 − r i2`, `C dv1/dt = i2 − i_in`, `C dv2/dt = i1 − i_in`.
    ///
    /// The bridge then sees `U_in = v1 + v2 − u_s`, and the source gives `i1 + i2 − i_in`. In shoot-through the source is disconnected and the bridge
    /// is a short: `u_s = v1 + v2`, `i_in = i1 + i2`, which gives `L di1/dt = v1 − r i1`, `C dv1/dt = −i1`, and likewise for the others.
    #[inline]
    pub fn slopes(&self, at: &NetworkState, feed_v: f64, bridge_a: f64) -> NetworkState {
        let ([i1, i2], [v1, v2]) = (at.inductors_a, at.capacitors_v);
        let (per_h, per_f) = (1.0 / self.inductance_h, 1.0 / self.capacitance_f);
        NetworkState {
            inductors_a: [
                (feed_v - v2 - self.resistance_ohm * i1) * per_h,
                (feed_v - v1 - self.resistance_ohm * i2) * per_h,
            ],
            capacitors_v: [(i2 - bridge_a) * per_f, (i1 - bridge_a) * per_f],
        }
    }

    /// Heat in the inductors, in W.
    #[inline]
    pub fn loss_w(&self, at: &NetworkState) -> f64 {
        let [i1, i2] = at.inductors_a;
        self.resistance_ohm * (i1 * i1 + i2 * i2)
    }

    /// Stored energy, in J.
    pub fn stored_j(&self, at: &NetworkState) -> f64 {
        let squares = |pair: [f64; 2]| pair[0] * pair[0] + pair[1] * pair[1];
        0.5 * (self.inductance_h * squares(at.inductors_a) + self.capacitance_f * squares(at.capacitors_v))
    }
}

impl NetworkState {
    /// Both capacitors charged equally, with equal inductor currents.
    pub fn even(inductor_a: f64, capacitor_v: f64) -> Self {
        Self { inductors_a: [inductor_a; 2], capacitors_v: [capacitor_v; 2] }
    }

    /// Mean of the capacitor voltages, in V.
    pub fn capacitor_v(&self) -> f64 {
        0.5 * (self.capacitors_v[0] + self.capacitors_v[1])
    }

    /// Mean of the inductor currents, in A.
    pub fn inductor_a(&self) -> f64 {
        0.5 * (self.inductors_a[0] + self.inductors_a[1])
    }
}
