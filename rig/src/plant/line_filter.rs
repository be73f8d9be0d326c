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
    /// For 250 kW at 1,500 V: 46 Hz, damped enough for a load of constant power.
    pub const TRACTION: Self = Self { inductance_h: 3e-3, resistance_ohm: 0.3, capacitance_f: 4e-3 };
}

impl FromStr for LineFilter {
    type Err = String;

    /// Written `L_MH,C_MF,R_MOHM`.
    fn from_str(text: &str) -> Result<Self, String> {
        let parse = || {
            let parts = text.split(',').map(|part| part.parse::<f64>().ok()).collect::<Option<Vec<_>>>()?;
            let &[inductance_mh, capacitance_mf, resistance_mohm] = parts.as_slice() else { return None };
            let is_good = |low: f64, value: f64, high: f64| (low..=high).contains(&value);
            let good = is_good(0.1, inductance_mh, 1e3)
                && is_good(0.1, capacitance_mf, 1e3)
                && is_good(0.0, resistance_mohm, 1e3);
            good.then_some(Self {
                inductance_h: 1e-3 * inductance_mh,
                resistance_ohm: 1e-3 * resistance_mohm,
                capacitance_f: 1e-3 * capacitance_mf,
            })
        };
        parse().ok_or_else(|| {
            "must be L_MH,C_MF,R_MOHM (0.1 to 1,000 mH and mF, 0 to 1,000 mΩ), for instance 3,4,30".to_owned()
        })
    }
}

/// The slope of a line that fails, in V/s.
const LINE_SLOPE_V_S: f64 = 50e3;
/// Longest step of the choke's current, in s.
const LONGEST_STEP_S: f64 = 20e-6;

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

    /// Lets time pass while the inverter takes an energy, in J, and the line goes to a voltage, in V; `None`: the line is cut off.
    pub fn advance(&mut self, drawn_j: f64, dt_s: f64, line_v: Option<f64>) {
        let LineFilter { inductance_h, resistance_ohm, capacitance_f } = self.filter;
        let steps = (dt_s / LONGEST_STEP_S).ceil().max(1.0);
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
            // By energy, so that none is lost: what the inverter takes, the capacitor gives.
            let given_j = self.choke_a * self.udc_v * step_s - drawn_j / steps;
            let square = self.udc_v * self.udc_v + 2.0 * given_j / capacitance_f;
            self.udc_v = square.max(1.0).sqrt();
        }
    }
}
