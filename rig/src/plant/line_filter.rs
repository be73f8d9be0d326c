//! The DC link behind the supply line's choke.

use serde::Serialize;
use std::str::FromStr;

/// Choke and capacitor between the line and the inverter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LineFilter {
    /// Inductance of line and choke, in H.
    pub inductance_h: f64,
    /// Their resistance, in ohm.
    pub resistance_ohm: f64,
    /// Capacitance of the link, in F.
    pub capacitance_f: f64,
}

impl LineFilter {
    /// For 250 kW at 1,500 V: 46 Hz, damped enough for a constant-power load.
    pub const TRACTION: Self = Self { inductance_h: 3e-3, resistance_ohm: 0.3, capacitance_f: 4e-3 };

    /// `true` if a drive that draws a power, in W, at a voltage, in V, has to damp it: its resistance is less than twice the limit below which such a load
    /// makes the link oscillate, `P L/(C U²)`. A battery's cable needs no damping.
    pub fn needs_damping(&self, power_w: f64, udc_v: f64) -> bool {
        let Self { inductance_h, resistance_ohm, capacitance_f } = *self;
        resistance_ohm < 2.0 * power_w * inductance_h / (capacitance_f * udc_v * udc_v)
    }

    /// The shorter of the time constants: the inverse of the angular frequency of the oscillation between choke and capacitor, and that of the
    /// current in choke and resistance, in s. From 0.1 mH and 0.1 mF on it is 0.1 ms or more.
    pub fn shortest_s(&self) -> f64 {
        let Self { inductance_h, resistance_ohm, capacitance_f } = *self;
        (inductance_h * capacitance_f).sqrt().min(inductance_h / resistance_ohm)
    }
}

impl FromStr for LineFilter {
    type Err = String;

    /// Written `L_MH,C_MF,R_MOHM`.
    fn from_str(text: &str) -> Result<Self, String> {
        let parse = || {
            let parts = text.split(',').map(|part| part.parse::<f64>().ok()).collect::<Option<Vec<_>>>()?;
            let &[inductance_mh, capacitance_mf, resistance_mohm] = parts.as_slice() else { return None };
            let is_good = |low: f64, value: f64, high: f64| (low..=high).contains(&value);
            let good = is_good(0.001, inductance_mh, 1e3)
                && is_good(0.1, capacitance_mf, 1e3)
                && is_good(0.0, resistance_mohm, 1e3);
            good.then_some(Self {
                inductance_h: 1e-3 * inductance_mh,
                resistance_ohm: 1e-3 * resistance_mohm,
                capacitance_f: 1e-3 * capacitance_mf,
            })
        };
        parse().ok_or_else(|| {
            "must be L_MH,C_MF,R_MOHM (0.001 to 1,000 mH, 0.1 to 1,000 mF, 0 to 1,000 mΩ), for instance 3,4,30"
                .to_owned()
        })
    }
}

/// The slope of a failing line, in V/s.
const LINE_SLOPE_V_S: f64 = 50e3;
/// Longest step of the choke's current, in s, and as a share of the filter's shortest time constant: explicit steps are stable up to twice that.
const LONGEST_STEP_S: f64 = 20e-6;
const LONGEST_SHARE: f64 = 0.2;

/// The link's state behind a line filter.
#[derive(Clone, Copy, Debug)]
pub struct FilteredLink {
    filter: LineFilter,
    /// Voltage of the line, in V.
    line_v: f64,
    /// Current out of the line, in A.
    pub choke_a: f64,
    /// Its voltage, in V.
    pub udc_v: f64,
}

impl FilteredLink {
    /// Charged to the line's voltage.
    pub fn new(filter: LineFilter, line_v: f64) -> Self {
        Self { filter, line_v, choke_a: 0.0, udc_v: line_v }
    }

    /// Capacitance of the link, in F.
    pub const fn capacitance_f(&self) -> f64 {
        self.filter.capacitance_f
    }

    /// Lets time pass while the inverter takes an energy, in J, and the line goes to a voltage, in V; `None`: the line is disconnected.
    pub fn advance(&mut self, drawn_j: f64, dt_s: f64, line_v: Option<f64>) {
        let LineFilter { inductance_h, resistance_ohm, capacitance_f } = self.filter;
        let longest_s = LONGEST_STEP_S.min(LONGEST_SHARE * self.filter.shortest_s());
        let steps = (dt_s / longest_s).ceil().max(1.0);
        let step_s = dt_s / steps;
        for _ in 0..steps as u32 {
            match line_v {
                None => self.choke_a = 0.0,
                Some(wanted_v) => {
                    let most = LINE_SLOPE_V_S * step_s;
                    self.line_v += (wanted_v - self.line_v).clamp(-most, most);
                    let across_v = self.line_v - self.udc_v - resistance_ohm * self.choke_a;
                    self.choke_a += across_v / inductance_h * step_s;
                }
            }
            // Computed by energy, so that none is lost: the capacitor gives what the inverter takes.
            let given_j = self.choke_a * self.udc_v * step_s - drawn_j / steps;
            let square = self.udc_v * self.udc_v + 2.0 * given_j / capacitance_f;
            self.udc_v = square.max(1.0).sqrt();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The filter of the guide has to be damped at 246 kW; a filter with twice the resistance that such a load takes away, and a battery's cable, need not.
    #[test]
    fn a_filter_that_damps_itself_needs_no_drive() {
        for (text, power_w, udc_v, needs) in [
            ("3,4,30", 246.4e3, 1_500.0, true),
            ("3,4,160", 246.4e3, 1_500.0, true),
            ("3,4,170", 246.4e3, 1_500.0, false),
            ("0.005,1,25", 1_078.0, 48.0, false),
            ("0.8,15,18", 1_078.0, 48.0, true),
        ] {
            let filter: LineFilter = text.parse().unwrap();
            assert_eq!(filter.needs_damping(power_w, udc_v), needs, "{text}");
        }
        assert!("0.0009,4,30".parse::<LineFilter>().is_err());
    }

    /// The smallest filters ring at their frequency, and lose energy only in their resistance.
    #[test]
    fn the_smallest_filters_ring_as_theory_says() {
        for text in ["0.001,0.1,0", "0.005,1,0"] {
            let filter: LineFilter = text.parse().unwrap();
            let mut link = FilteredLink::new(filter, 100.0);
            link.udc_v = 99.0;
            let period_s = std::f64::consts::TAU * (filter.inductance_h * filter.capacitance_f).sqrt();
            for _ in 0..10 {
                link.advance(0.0, period_s, Some(100.0));
            }
            assert!((link.udc_v - 99.0).abs() < 0.1, "{text}: {} V", link.udc_v);
        }
    }
}
