//! The sizes of the cases, which were written for the 180 kW machine, scaled to another one.

use crate::machine::Machine;
use crate::plant::LineFilter;

/// Ratios of a machine's sizes to those of the 180 kW machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Of the largest speed.
    pub speed: f64,
    /// Of the current that trips.
    pub current: f64,
    /// Of the link's nominal voltage.
    pub voltage: f64,
    /// Of that voltage squared over the largest power: a line's chokes and resistors scale with it, and capacitors inversely.
    pub impedance: f64,
}

impl Scale {
    /// The 180 kW machine's.
    pub const ONE: Self = Self { speed: 1.0, current: 1.0, voltage: 1.0, impedance: 1.0 };

    /// A machine's.
    pub fn of(machine: &Machine) -> Self {
        let parameters = &machine.folder.parameters;
        let link_v = parameters.dc_link_nominal_v;
        let ohm = |voltage_v: f64, power_w: f64| voltage_v * voltage_v / power_w;
        Self {
            speed: parameters.max_speed_rpm / 6_000.0,
            current: parameters.trip_current_a / (1.3 * 233.345),
            voltage: link_v / 1_500.0,
            impedance: ohm(link_v, parameters.max_power_w) / ohm(1_500.0, 246.4e3),
        }
    }

    /// The filter of the campaign's line.
    pub fn filter(&self) -> LineFilter {
        let LineFilter { inductance_h, resistance_ohm, capacitance_f } = LineFilter::TRACTION;
        LineFilter {
            inductance_h: inductance_h * self.impedance,
            resistance_ohm: resistance_ohm * self.impedance,
            capacitance_f: capacitance_f / self.impedance,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::System;
    use crate::scenario::traction::Traction;

    /// To the last bit: the 180 kW machine's campaign is that of its own sizes.
    #[test]
    fn the_machine_of_the_cases_has_no_scale() {
        let scale = Scale::of(&Machine::load(Traction::MACHINE).unwrap());
        assert_eq!((scale, scale.filter()), (Scale::ONE, LineFilter::TRACTION));
    }
}
