//! The head of another tool's flux map: the quantity and the unit of each column.

/// Quantities, in the order in which their columns are kept.
pub const QUANTITIES: [&str; 4] = ["id", "iq", "psi_d", "psi_q"];
/// Places of the current's magnitude and of its angle, which may stand for id and iq.
pub const MAGNITUDE: usize = 4;
/// See [`MAGNITUDE`].
pub const ANGLE: usize = 5;

/// A column: its name in the file, its quantity, and the factor that converts its values to A, Wb or rad, peak.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// The name as it appears in the file.
    pub name: String,
    /// Place in [`QUANTITIES`], or [`MAGNITUDE`], or [`ANGLE`].
    pub quantity: usize,
    /// Peak value in A, Wb or rad of a value of one in the file.
    pub factor: f64,
    /// Value in A, Wb or rad of the unit that the name says; `None` if it says none.
    pub unit: Option<f64>,
}

impl Column {
    /// `true` if the name says the unit.
    pub const fn has_unit(&self) -> bool {
        self.unit.is_some()
    }
}

/// Words of a name that carry no information of their own.
const FILLERS: [&str; 13] = [
    "axis",
    "stator",
    "s",
    "motor",
    "machine",
    "mean",
    "average",
    "avg",
    "strom",
    "fluss",
    "component",
    "value",
    "winding",
];
/// Words for a current and for a flux linkage, which stand before or after the axis' letter.
const CURRENTS: [&str; 4] = ["i", "is", "current", "statorcurrent"];
const FLUXES: [&str; 16] = [
    "psi",
    "psis",
    "lambda",
    "lambdas",
    "flux",
    "fluxlinkage",
    "linkedflux",
    "linkage",
    "fluxlink",
    "f",
    "phi",
    "phis",
    "ψ",
    "λ",
    "φ",
    "coilflux",
];
/// Names of the axes after those words: of a complex number, d is the real part.
const AXES: [[&str; 4]; 2] = [["d", "ds", "dqreal", "dqre"], ["q", "qs", "dqimag", "dqim"]];
/// Names of a current's magnitude and of its angle.
const MAGNITUDES: [&str; 9] =
    ["i", "is", "current", "currentmagnitude", "currentamplitude", "iabs", "imag", "iamp", "imagnitude"];
const ANGLES: [&str; 14] = [
    "gamma",
    "beta",
    "γ",
    "β",
    "currentangle",
    "currentphase",
    "currentphaseangle",
    "phaseadvance",
    "currentadvance",
    "advance",
    "advanceangle",
    "phaseadvanceangle",
    "gammaangle",
    "iangle",
];
/// Units, without blanks, and the value of one of them in A, Wb or rad.
type Units = &'static [(&'static str, f64)];
const CURRENT_UNITS: Units =
    &[("a", 1.0), ("ma", 1e-3), ("ka", 1e3), ("amp", 1.0), ("amps", 1.0), ("ampere", 1.0)];
const FLUX_UNITS: Units = &[
    ("wb", 1.0),
    ("mwb", 1e-3),
    ("uwb", 1e-6),
    ("µwb", 1e-6),
    ("vs", 1.0),
    ("mvs", 1e-3),
    ("weber", 1.0),
    ("wbt", 1.0),
    ("wbturn", 1.0),
    ("wbturns", 1.0),
];
const DEGREE: f64 = core::f64::consts::PI / 180.0;
const ANGLE_UNITS: Units = &[
    ("deg", DEGREE),
    ("edeg", DEGREE),
    ("elecdeg", DEGREE),
    ("degree", DEGREE),
    ("degrees", DEGREE),
    ("rad", 1.0),
];

/// Words of a text, of letters and digits.
fn words(text: &str) -> impl Iterator<Item = String> + '_ {
    text.split(|letter: char| !letter.is_alphanumeric()).filter(|part| !part.is_empty()).map(str::to_owned)
}

/// The meaning of a column by its name; `None` if it is none of the quantities. `rms` applies if the name does not say.
///
/// # Errors
/// A unit in brackets that does not belong to the quantity.
pub fn column(name: &str, rms: bool) -> Result<Option<Column>, String> {
    let lower = name.trim().trim_matches('"').to_lowercase().replace('°', "deg");
    let parts: Vec<&str> = lower.split(['(', '[', '{']).collect();
    let inside = |part: &&str| part.split([')', ']', '}']).next().map(str::to_owned);
    let mut units: Vec<String> =
        parts[1..].iter().filter_map(inside).flat_map(|text| words(&text).collect::<Vec<_>>()).collect();
    let outside = parts.iter().enumerate().map(|(k, part)| {
        if k == 0 { part } else { part.split_once([')', ']', '}']).map_or("", |(_, rest)| rest) }
    });
    let mut words: Vec<String> = words(&outside.collect::<Vec<_>>().join(" ")).collect();
    let said = amplitude(&mut words).or(amplitude(&mut units));
    let in_brackets = (!units.is_empty()).then(|| units.concat());
    for tail in [0, 1, 2] {
        // A unit may stand at the end of the name: `id_a`, `psi_d_v_s`.
        let Some(kept) = words.len().checked_sub(tail) else { break };
        let Some((quantity, known)) = quantity(&words[..kept]) else { continue };
        let after = (tail > 0).then(|| words[kept..].concat());
        let unit = after.or_else(|| in_brackets.clone());
        let size = known.iter().find(|(one, _)| unit.as_deref() == Some(*one)).map(|(_, size)| *size);
        let size = match (size, &unit) {
            (Some(size), _) => size,
            (None, None) if quantity == ANGLE => DEGREE,
            (None, None) => 1.0,
            (None, Some(_)) if tail > 0 => continue,
            (None, Some(unit)) => {
                let units: Vec<_> = known.iter().map(|(unit, _)| *unit).collect();
                return Err(format!("unit {unit}: must be one of {}", units.join(", ")));
            }
        };
        let is_rms = quantity != ANGLE && said.unwrap_or(rms);
        let factor = if is_rms { size * 2.0_f64.sqrt() } else { size };
        let name = name.trim().trim_matches('"').to_owned();
        return Ok(Some(Column { name, quantity, factor, unit: unit.map(|_| size) }));
    }
    Ok(None)
}

/// Removes the word for rms (`true`) or peak from the words; `arms` is a unit too.
fn amplitude(words: &mut Vec<String>) -> Option<bool> {
    if let Some(arms) = words.iter_mut().find(|word| ["arms", "apk", "apeak"].contains(&word.as_str())) {
        let rms = arms == "arms";
        "a".clone_into(arms);
        return Some(rms);
    }
    let at = words.iter().position(|word| ["rms", "peak", "pk", "eff"].contains(&word.as_str()))?;
    let word = words.remove(at);
    Some(word == "rms" || word == "eff")
}

/// The quantity of a name's words, and its units.
fn quantity(words: &[String]) -> Option<(usize, Units)> {
    let said: Vec<&str> =
        words.iter().map(String::as_str).filter(|word| words.len() == 1 || !FILLERS.contains(word)).collect();
    let name = said.concat();
    let along = |names: &[&str], axis: usize| {
        names.iter().any(|word| {
            let before = name.strip_prefix(AXES[axis][0]);
            // Not `di` or `df`, which are differences.
            let behind = name.strip_prefix(word);
            behind.is_some_and(|rest| AXES[axis].contains(&rest)) || (word.len() > 2 && before == Some(word))
        })
    };
    for axis in 0..AXES.len() {
        if along(&CURRENTS, axis) {
            return Some((axis, CURRENT_UNITS));
        }
        if along(&FLUXES, axis) {
            return Some((axis + 2, FLUX_UNITS));
        }
    }
    if MAGNITUDES.contains(&name.as_str()) {
        return Some((MAGNITUDE, CURRENT_UNITS));
    }
    ANGLES.contains(&name.as_str()).then_some((ANGLE, ANGLE_UNITS))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_names_of_other_tools_are_known_with_their_units() {
        let root = 2.0_f64.sqrt();
        for (name, quantity, factor) in [
            ("id_a", 0, 1.0),
            ("i_q [A]", 1, 1.0),
            ("Id", 0, 1.0),
            ("Iq (Arms)", 1, root),
            ("Id (Peak)", 0, 1.0),
            ("i_sd_mA", 0, 1e-3),
            ("d-axis current (A)", 0, 1.0),
            ("psi_d_wb", 2, 1.0),
            ("Psi_q [mWb]", 3, 1e-3),
            ("psi_d [Vs]", 2, 1.0),
            ("lambda_d (V.s)", 2, 1.0),
            ("Lambda_q", 3, 1.0),
            ("Fd", 2, 1.0),
            ("Flux Linkage D", 2, 1.0),
            ("Flux Linkage Q (mVs)", 3, 1e-3),
            ("\"psi_q rms\"", 3, root),
            ("ψ_d [Wb]", 2, 1.0),
            ("i_s_dq.real (A)", 0, 1.0),
            ("psi_s_dq.imag (Vs)", 3, 1.0),
            ("Strom Id [A]", 0, 1.0),
            ("Stator Current Q (RMS)", 1, root),
            ("D-Axis Flux Linkage (Wb)", 2, 1.0),
            ("lambda_q (Wb-turns)", 3, 1.0),
            ("FluxLinkage_d", 2, 1.0),
            ("Iq_avg [A]", 1, 1.0),
            ("Phi_d", 2, 1.0),
            ("fluxQ_Wb", 3, 1.0),
            ("psi_d_mV_s", 2, 1e-3),
            ("Is (RMS) [A]", MAGNITUDE, root),
            ("Stator Current [kA]", MAGNITUDE, 1e3),
            ("Gamma [EDeg]", ANGLE, DEGREE),
            ("Phase Advance (°)", ANGLE, DEGREE),
            ("beta_rad", ANGLE, 1.0),
        ] {
            let found = column(name, false).unwrap().unwrap_or_else(|| panic!("{name}"));
            assert_eq!(found.quantity, quantity, "{name}");
            assert!((found.factor / factor - 1.0).abs() < 1e-12, "{name}: {}", found.factor);
        }
        assert!((column("id_a", true).unwrap().unwrap().factor - root).abs() < 1e-12);
        assert!((column("Id (peak)", true).unwrap().unwrap().factor - 1.0).abs() < 1e-12);
        for other in ["torque", "T_nm", "theta", "speed", "", "d", "id_v", "dI", "df", "Ld", "s", "FluxA(Wb)"]
        {
            assert_eq!(column(other, false), Ok(None), "{other}");
        }
        assert!(column("id [V]", false).unwrap_err().contains("unit v: must be one of a, ma"));
    }
}
