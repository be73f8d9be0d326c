//! The observations of the plant, and the energy that is stored in it.

use super::Bench;
use crate::bench::{Peaks, Stored};
use crate::inject::zs9::Kind;
use crate::plant::zs9::Source;

impl Bench {
    /// Takes note of the events at source and network, and of the plant's extremes.
    pub(super) fn watch(&mut self) {
        let kind = self.spoiler.injected.kind(self.time.now_s());
        match kind {
            Some(Kind::SourceSwitchOpen) => self.plant.source = Source::Diode,
            Some(Kind::CapacitorsHalved) if self.time.now == self.observed.from => {
                let capacitance_f = 0.5 * self.plant.parts.capacitance_f;
                self.plant.parts.capacitance_f = capacitance_f;
            }
            _ => {}
        }
        let currents_a = self.currents_a();
        let [v1, v2] = self.plant.network.capacitors_v;
        let id_a = self.plant.motors.iter().map(|motor| motor.currents_dq().0).fold(0.0, f64::min);
        let peaks = Peaks::at(currents_a.as_flattened(), id_a, self.plant.bridge_v(), v1.max(v2));
        let speeds = self.speeds_rpm().map(f64::abs);
        self.observed.note(self.time.now, &peaks, speeds[0].max(speeds[1]));
        // For a gate that stays off, [`Self::begin_period`] knows which pulses count.
        let disobey = !matches!(kind, Some(Kind::Gate(_, false))) && self.real_levels() != self.gates.levels;
        if disobey || self.plant.source_v < self.settings.limits.source_v {
            self.observed.makes_a_difference(self.time.now);
        }
    }

    /// The energy stored in network and motors, and the voltage to which the capacitors rise with the network's own oscillation.
    pub(super) fn stored(&self) -> Stored {
        let (parts, network) = (self.plant.parts, self.plant.network);
        let (source_v, link_v) = (self.plant.source_v, self.plant.link_v().max(self.plant.source_v));
        let surge_v = network.inductor_a() * (parts.inductance_h / parts.capacitance_f).sqrt();
        let unloaded_v = source_v + libm::hypot(network.capacitor_v() - source_v, surge_v);
        // In series with the other motor, each motor has a third of the link against it.
        let motors = &self.plant.motors;
        let stored = Stored::of(motors, link_v / 3.0, unloaded_v);
        let short_circuit_a =
            motors.iter().map(|motor| motor.later_short_circuit_peak_a()).fold(0.0, f64::max);
        Stored { short_circuit_a, ..stored }
    }
}
