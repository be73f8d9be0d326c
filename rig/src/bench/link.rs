//! The DC link: stiff, or a capacitor behind the supply line's choke.

use super::inject::SupplyFault;

/// What feeds the inverter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Supply {
    /// A link whose voltage is what it is told to be.
    Stiff,
    /// A capacitor, fed from a line that takes back what is braked.
    Line(LineFilter),
}

/// Choke and capacitor between the line and the inverter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineFilter {
    /// Inductance of line and choke, in H.
    pub inductance_h: f64,
    /// Their resistance, in ohm.
    pub resistance_ohm: f64,
    /// Capacitance of the link, in F.
    pub capacitance_f: f64,
}

impl LineFilter {
    /// For 250 kW at 1,500 V: 46 Hz, damped enough for a load of constant power.
    pub const TRACTION: Self = Self { inductance_h: 3e-3, resistance_ohm: 0.3, capacitance_f: 4e-3 };
}

/// How fast a line that fails moves, in V/s.
const LINE_SLOPE_V_S: f64 = 50e3;
/// Longest step of the choke's current, in s.
const LONGEST_STEP_S: f64 = 20e-6;

/// The link's state behind a line filter.
#[derive(Clone, Copy, Debug)]
pub struct Link {
    filter: LineFilter,
    line_v: f64,
    /// Current out of the line, in A.
    choke_a: f64,
    voltage_v: f64,
}

impl Link {
    /// Charged to the line's voltage.
    pub fn new(filter: LineFilter, line_v: f64) -> Self {
        Self { filter, line_v, choke_a: 0.0, voltage_v: line_v }
    }

    /// Its voltage, in V.
    pub fn voltage_v(&self) -> f64 {
        self.voltage_v
    }

    /// Lets time pass while the inverter takes an energy, in J; `nominal_v` is the healthy line, `failed_s` the time since it
    /// failed, if it did.
    pub fn advance(&mut self, drawn_j: f64, dt_s: f64, nominal_v: f64, fault: Option<(SupplyFault, f64)>) {
        let LineFilter { inductance_h, resistance_ohm, capacitance_f } = self.filter;
        let steps = (dt_s / LONGEST_STEP_S).ceil().max(1.0);
        let step_s = dt_s / steps;
        for _ in 0..steps as u32 {
            let most = LINE_SLOPE_V_S * step_s;
            let wanted_v = match fault {
                Some((SupplyFault::To(line_v), _)) => line_v,
                Some((SupplyFault::Swinging(amplitude_v, hz), since_s)) => {
                    nominal_v + amplitude_v * (core::f64::consts::TAU * hz * since_s).sin()
                }
                _ => nominal_v,
            };
            self.line_v += (wanted_v - self.line_v).clamp(-most, most);
            if matches!(fault, Some((SupplyFault::Lost, _))) {
                self.choke_a = 0.0;
            } else {
                let across_v = self.line_v - self.voltage_v - resistance_ohm * self.choke_a;
                self.choke_a += across_v / inductance_h * step_s;
            }
            // By energy, so that none is lost: what the inverter takes, the capacitor gives.
            let given_j = self.choke_a * self.voltage_v * step_s - drawn_j / steps;
            let square = self.voltage_v * self.voltage_v + 2.0 * given_j / capacitance_f;
            self.voltage_v = square.max(1.0).sqrt();
        }
    }
}
