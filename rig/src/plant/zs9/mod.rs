//! The ZS9's plant: source, Z-network, nine-switch bridge, two motors, in f64.
//!
//! ```text
//!  U_dc ── source switch ── Z-network ── bridge: H ─┬─ M ─┬─ L, three legs
//!                                            upper motor  lower motor
//! ```
//!
//! Ideal switches, unless they have drops. Dead time is handled by the gates, not by the plant: while a leg waits, its diodes make one of the states that are
//! known here. Between two edges of the gates, network and motors are integrated together, as one set of equations. Outside shoot-through the bridge draws
//! `i_in = 1.5 Σ (s·i)` at `U_in = v1 + v2 − U_dc`, s being the terminals' shares of the link as a vector, and a motor sees `u = U_in s`; so everything that
//! leaves the network enters the motors, even while the diodes of a bridge without gates decide on s. In shoot-through the source is disconnected, and
//! `U_in = 0`.
//!
//! If the network would be charged to less than half the source, the bridge's diodes hold `U_in` at 0.

mod bridge;
mod diode;
mod drops;
mod means;
mod network;
mod step;

pub use super::motor::{Motor, MotorEnergies};
pub use super::vector::Vector;
pub use bridge::{IllegalState, LegGates};
pub use means::{Adder, Means, MotorMeans};
pub use network::{NetworkState, ZNetwork};

use super::legs::{Clamp, LONGEST_STEP_S};
use super::{DeviceDrops, PlantSettings, SpeedSource};
use bridge::Bridge;
use tractive_tablegen::{MachineFolder, SmoothMap};

/// Voltage below zero by which a link counts as zero, in V.
const NONE_V: f64 = 1e-6;
/// Lowest link voltage for which the length of steps is computed, in V.
const LEAST_LINK_V: f64 = 50.0;

/// The connection of the source to the network.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Source {
    /// A bidirectional switch, on outside shoot-through.
    #[default]
    Bidirectional,
    /// A diode: no current back into the source.
    Diode,
}

/// The parts of the plant.
#[derive(Clone, Copy, Debug)]
pub struct Zs9Settings {
    /// The network.
    pub network: ZNetwork,
    /// The connection of the source to it.
    pub source: Source,
    /// Source voltage U_dc, in V, above 0.
    pub source_v: f64,
    /// The deviations of the true machines from their folders: the upper motor, the lower one.
    pub motors: [PlantSettings; 2],
    /// Voltage drops of the nine devices and of the source's switch.
    pub drops: DeviceDrops,
}

impl Default for Zs9Settings {
    fn default() -> Self {
        Self {
            network: ZNetwork::ZS9,
            source: Source::Bidirectional,
            source_v: 400.0,
            motors: [PlantSettings::default(); 2],
            drops: DeviceDrops::NONE,
        }
    }
}

/// Energies since the beginning, in J, apart from the motors' own ([`Motor::energies`]).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Zs9Energies {
    /// Taken from the source.
    pub source_j: f64,
    /// Turned into heat in the inductors.
    pub inductors_j: f64,
    /// Likewise in the devices.
    pub devices_j: f64,
}

/// Source, network, bridge, motors.
#[derive(Clone, Debug)]
pub struct Zs9Plant {
    /// Inductances and capacitances of the network; change them, like everything here, between two steps.
    pub parts: ZNetwork,
    whole: ZNetwork,
    /// The connection between source and network.
    pub source: Source,
    /// Source voltage U_dc, in V, above 0.
    pub source_v: f64,
    clamp: Clamp,
    /// Drops of the devices; `None`: they are ideal.
    drops: Option<DeviceDrops>,
    /// Gates of the legs in the step that is made.
    gates: [LegGates; 3],
    bridge_v: f64,
    /// Inductor currents and capacitor voltages.
    pub network: NetworkState,
    /// The upper motor and the lower one.
    pub motors: [Motor; 2],
    time_s: f64,
    /// Energies since the beginning.
    pub energies: Zs9Energies,
    means: Adder,
}

impl Zs9Plant {
    /// The upper motor and the lower one, both without current and at angle zero, turning as their speed sources say; the capacitors are charged to
    /// the source's voltage, and the inductors carry no current.
    pub fn new(machines: [&MachineFolder; 2], speeds: [SpeedSource; 2], settings: &Zs9Settings) -> Self {
        let [clamp, other] = [0, 1].map(|k| {
            let map = SmoothMap::new(&machines[k].map);
            Clamp::new(machines[k].parameters.max_current_a, &map, settings.motors[k].flux_scale)
        });
        let [upper, lower] = speeds;
        let motors = [
            Motor::new(machines[0], upper, &settings.motors[0]),
            Motor::new(machines[1], lower, &settings.motors[1]),
        ];
        Self {
            parts: settings.network,
            whole: settings.network,
            source: settings.source,
            source_v: settings.source_v,
            clamp: clamp.of_both(&other),
            drops: settings.drops.is_some().then_some(settings.drops),
            gates: [LegGates::OFF; 3],
            bridge_v: settings.source_v,
            network: NetworkState::even(0.0, settings.source_v),
            motors,
            time_s: 0.0,
            energies: Zs9Energies::default(),
            means: Adder::default(),
        }
    }

    /// Restores the network's original parts.
    pub fn mend_network(&mut self) {
        self.parts = self.whole;
    }

    /// Sets both machines' true flux linkage to a multiple of their maps', above 0. Currents stay as they are.
    pub fn set_flux_scale(&mut self, flux_scale: f64) {
        let [motor, _] = &self.motors;
        self.clamp = self.clamp.scaled(flux_scale / motor.stator.flux_scale());
        for motor in &mut self.motors {
            motor.stator.set_flux_scale(flux_scale);
        }
    }

    /// Lets time pass with the gates of the legs u, v, w unchanged. The error names the first leg whose gates are illegal; in that case nothing has
    /// happened.
    pub fn advance(&mut self, gates: [LegGates; 3], dt_s: f64) -> Result<(), IllegalState> {
        let bridge = Bridge::of(gates, self.time_s)?;
        self.gates = gates;
        self.advance_bridge(&bridge, dt_s);
        Ok(())
    }

    /// The same if gates are stuck, so that any state may occur.
    pub fn advance_any(&mut self, gates: [LegGates; 3], dt_s: f64) {
        self.gates = gates;
        self.advance_bridge(&Bridge::of_any(gates), dt_s);
    }

    fn advance_bridge(&mut self, bridge: &Bridge, dt_s: f64) {
        let mut left = dt_s;
        while left > 0.0 {
            let longest = if bridge.is_free() { self.open_step_s() } else { LONGEST_STEP_S };
            // Equal pieces, unless something else shortens them.
            let step = if bridge.is_free() { left.min(longest) } else { left / (left / longest).ceil() };
            let taken = self.step(bridge, step);
            left = if taken >= left { 0.0 } else { left - taken };
        }
    }

    /// Time since the beginning, in s.
    pub fn time_s(&self) -> f64 {
        self.time_s
    }

    /// `U_in = v1 + v2 − U_dc`: the link's voltage outside shoot-through, in V.
    pub fn link_v(&self) -> f64 {
        let [v1, v2] = self.network.capacitors_v;
        v1 + v2 - self.source_v
    }

    /// The link's true voltage, in V; in shoot-through that outside it: [`Self::link_v`], unless a source that takes nothing back holds it lower, or the
    /// bridge's own diodes short it.
    pub fn bridge_v(&self) -> f64 {
        self.bridge_v
    }

    /// Lets the bridge's diodes, which conduct before the link reverses, charge the network's capacitors from a source of so many farad that has risen above
    /// both together; from a stiff one at once.
    pub fn hold_link(&mut self, source_f: f64) {
        let below_v = -self.link_v();
        if below_v <= NONE_V || self.source != Source::Bidirectional {
            return;
        }
        let before_j = self.parts.stored_j(&self.network);
        let charge_as = below_v / (2.0 / self.parts.capacitance_f + source_f.recip());
        for volts in &mut self.network.capacitors_v {
            *volts += charge_as / self.parts.capacitance_f;
        }
        self.source_v -= charge_as / source_f;
        self.energies.source_j += self.parts.stored_j(&self.network) - before_j;
    }

    /// Energy stored in the network and in the motors' fields, in J.
    pub fn stored_j(&self) -> f64 {
        self.parts.stored_j(&self.network) + self.motors.iter().map(Motor::field_j).sum::<f64>()
    }

    /// The residual of the energies since a time when `stored_j` was stored, in J, all energies counted from zero:
    /// `source − inductors − devices − Σ (copper + mechanical) − change of what is stored`.
    pub fn residual_j(&self, stored_j: f64) -> f64 {
        let used = |motor: &Motor| motor.energies.copper_j + motor.energies.mechanical_j;
        self.energies.source_j
            - self.energies.inductors_j
            - self.energies.devices_j
            - self.motors.iter().map(used).sum::<f64>()
            - (self.stored_j() - stored_j)
    }

    /// Mean values since the last call; `None` if no time has passed.
    pub fn take_means(&mut self) -> Option<Means> {
        self.take_sums().means(self.source_v)
    }

    /// The sums behind those means, since the last call.
    pub fn take_sums(&mut self) -> Adder {
        std::mem::take(&mut self.means)
    }

    /// Longest step while all gates are off, in s: short near a current at which a diode begins or ends to conduct.
    fn open_step_s(&self) -> f64 {
        let [upper, lower] = self.motors.each_ref().map(Motor::currents_abc);
        let near = upper.iter().zip(&lower).map(|(u, l)| u.abs().min(l.abs()).min((u + l).abs()));
        // A link shorted by the diodes may rise within the step.
        self.clamp.step_near_s(self.link_v().max(LEAST_LINK_V), near.fold(f64::INFINITY, f64::min))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    /// A source that has risen above both capacitors is their sum from then on; what the network has stored came from the source.
    #[test]
    fn diodes_charge_the_network_from_a_source_that_rises() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tables/ipm-zs9");
        let machine = MachineFolder::read(&folder).unwrap();
        let at_rest = || SpeedSource::profile(vec![(0.0, 0.0)]);
        for (source_f, sum_v) in [(f64::INFINITY, 500.0), (1e-3, 480.0)] {
            let settings = Zs9Settings::default();
            let mut plant = Zs9Plant::new([&machine, &machine], [at_rest(), at_rest()], &settings);
            (plant.source_v, plant.network.capacitors_v) = (500.0, [250.0, 150.0]);
            let stored_j = plant.stored_j();
            plant.hold_link(source_f);
            let [v1, v2] = plant.network.capacitors_v;
            assert!((v1 + v2 - sum_v).abs() < 1e-9 && (v1 - v2 - 100.0).abs() < 1e-9, "{v1} {v2}");
            assert!((plant.source_v - sum_v).abs() < 1e-9 && plant.residual_j(stored_j).abs() < 1e-9);
            plant.source_v = 300.0;
            plant.hold_link(source_f);
            assert_eq!((plant.source_v, plant.network.capacitors_v), (300.0, [v1, v2]), "a link above zero");
        }
    }
}
