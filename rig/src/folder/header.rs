//! The head of another tool's flux map: which column is which, in which unit.

/// Quantities, in the order in which their columns are kept.
pub const QUANTITIES: [&str; 4] = ["id", "iq", "psi_d", "psi_q"];

/// A column: its name in the file, the quantity, and the factor that makes its values A or Wb, peak.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// The name, as it stands in the file.
    pub name: String,
    /// Place in [`QUANTITIES`].
    pub quantity: usize,
    /// Peak value in A or Wb of a one in the file.
    pub factor: f64,
}

/// Names of a current along an axis, less the axis' letter `d`.
const CURRENTS: [&str; 10] = [
    "id",
    "isd",
    "ids",
    "currentd",
    "dcurrent",
    "daxiscurrent",
    "currentdaxis",
    "idaxis",
    "statorcurrentd",
    "currentsd",
];
/// The same of a flux linkage.
const FLUXES: [&str; 20] = [
    "psid",
    "psisd",
    "psids",
    "lambdad",
    "lambdasd",
    "fluxd",
    "dflux",
    "fluxlinkaged",
    "dfluxlinkage",
    "daxisflux",
    "daxisfluxlinkage",
    "fluxlinkagedaxis",
    "fluxdaxis",
    "linkaged",
    "fd",
    "phid",
    "phisd",
    "ψd",
    "λd",
    "φd",
];
/// Units, and what one of them is in A or Wb.
const CURRENT_UNITS: [(&str, f64); 4] = [("a", 1.0), ("ma", 1e-3), ("ka", 1e3), ("amp", 1.0)];
const FLUX_UNITS: [(&str, f64); 11] = [
    ("wb", 1.0),
    ("mwb", 1e-3),
    ("uwb", 1e-6),
    ("µwb", 1e-6),
    ("vs", 1.0),
    ("v s", 1.0),
    ("mvs", 1e-3),
    ("mv s", 1e-3),
    ("weber", 1.0),
    ("wbt", 1.0),
    ("wbturns", 1.0),
];

/// The meaning of a column by its name; nothing where it is none of the four quantities. `rms` holds where the name does not say.
///
/// # Errors
/// A unit in brackets that is none of the quantity's.
pub fn column(name: &str, rms: bool) -> Result<Option<Column>, String> {
    let lower = name.trim().trim_matches('"').to_lowercase();
    let bracketed: Vec<&str> =
        lower.split(['(', '[', '{']).skip(1).filter_map(|part| part.split([')', ']', '}']).next()).collect();
    let outside: String = lower
        .split([')', ']', '}'])
        .filter_map(|part| part.split(['(', '[', '{']).next())
        .collect::<Vec<_>>()
        .join(" ");
    let word = |text: &str| -> Vec<String> {
        let parts = text.split(|letter: char| !letter.is_alphanumeric());
        parts.filter(|part| !part.is_empty()).map(str::to_owned).collect()
    };
    let mut words = word(&outside);
    let mut units: Vec<String> = bracketed.iter().flat_map(|text| word(text)).collect();
    let said = amplitude(&mut words).or(amplitude(&mut units));
    let factor = if said.unwrap_or(rms) { 2.0_f64.sqrt() } else { 1.0 };
    let unit_in_brackets = (!units.is_empty()).then(|| units.join(" "));
    for tail in [0, 1, 2] {
        // A unit may stand at the end of the name: `id_a`, `psi_d_v_s`.
        let Some(kept) = words.len().checked_sub(tail) else { break };
        let Some((quantity, known)) = quantity(&words[..kept].concat()) else { continue };
        let of = |unit: &str| known.iter().find(|(one, _)| *one == unit).map(|(_, size)| *size);
        let after = (tail > 0).then(|| words[kept..].join(" "));
        let size = match after.as_deref().or(unit_in_brackets.as_deref()) {
            None => 1.0,
            Some(unit) => match of(unit) {
                Some(size) => size,
                None if tail > 0 => continue,
                None => {
                    let units: Vec<_> = known.iter().map(|(unit, _)| *unit).collect();
                    return Err(format!("unit {unit}: must be one of {}", units.join(", ")));
                }
            },
        };
        let name = name.trim().trim_matches('"').to_owned();
        return Ok(Some(Column { name, quantity, factor: factor * size }));
    }
    Ok(None)
}

/// Takes the word for rms (`true`) or peak out of the words; `arms` is a unit too.
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

/// The quantity of a name without blanks, and its units.
fn quantity(name: &str) -> Option<(usize, &'static [(&'static str, f64)])> {
    let along = |names: &[&str], axis: char| {
        names.iter().any(|known| {
            // The axis is the only d in a name, but for the one of `lambda`.
            let (head, tail) = known.strip_prefix("lambda").map_or(("", *known), |tail| ("lambda", tail));
            format!("{head}{}", tail.replace('d', &axis.to_string())) == name
        })
    };
    let of = |axis: usize, letter: char| {
        if along(&CURRENTS, letter) {
            Some((axis, &CURRENT_UNITS[..]))
        } else if along(&FLUXES, letter) {
            Some((axis + 2, &FLUX_UNITS[..]))
        } else {
            None
        }
    };
    of(0, 'd').or_else(|| of(1, 'q'))
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
        ] {
            let found = column(name, false).unwrap().unwrap_or_else(|| panic!("{name}"));
            assert_eq!(found.quantity, quantity, "{name}");
            assert!((found.factor / factor - 1.0).abs() < 1e-12, "{name}: {}", found.factor);
        }
        assert!((column("id_a", true).unwrap().unwrap().factor - root).abs() < 1e-12);
        assert!((column("Id (peak)", true).unwrap().unwrap().factor - 1.0).abs() < 1e-12);
        for other in ["torque", "T_nm", "theta", "speed", "", "d", "id_v"] {
            assert_eq!(column(other, false), Ok(None), "{other}");
        }
        assert!(column("id [V]", false).unwrap_err().contains("unit v: must be one of a, ma"));
    }
}
