//! What the parts of an interrupt cost: every executed instruction belongs to one part, so they add up to the interrupt.

use std::collections::BTreeMap;

use anyhow::Result;

use super::profile::Profile;
use super::tally::Tally;

/// Parts by what the names of their functions contain. Whose an instruction is, is asked of the innermost function first, and
/// then of those that it was inlined into.
const PARTS: [(&str, &[&str]); 20] = [
    (
        "sine and cosine, Clarke, Park, angles",
        &[
            "Angle::sin_cos",
            "Angle::of_vector",
            "Angle::from_",
            "Angle::within_half_turn",
            "frames::angle::octant_atan",
            "::clarke",
            "::park",
            "::unpark",
            "::turned",
            "frames::vector::Abc::peak",
        ],
    ),
    ("flux map", &["control::flux_linkage"]),
    ("MTPA, two passes", &["control::mtpa::"]),
    ("operating point: weakening, limits", &["control::reference::"]),
    ("speed from the angle", &["control::speed::"]),
    ("speed loop", &["control::speed_loop::"]),
    ("torque demand and trim", &["control::demand::", "control::torque_trim::"]),
    ("disturbance, map error", &["control::disturbance::", "control::map_error::"]),
    ("current loop", &["control::current_loop::", "control::flux_path::"]),
    ("Z-source", &["control::z_source::"]),
    ("control law, the rest", &["tractive::control::"]),
    ("ripple of the pattern", &["modulation::ripple::", "::ripple"]),
    (
        "what is committed",
        &["committed", "traction::glide::", "::boundary", "::new_boundary", "::is_to_revise", "volt_seconds"],
    ),
    ("protection", &["tractive::protection::", "Task<M>::check", "::stale", "::violation", "::stuck"]),
    ("cells and messages", &["tractive::cell::", "messages::", "::Applied::"]),
    ("choice of the mode", &["modulation::schedule::", "::choose_mode"]),
    ("pulses", &["tractive::modulation::", "tractive::nine_switch::"]),
    ("axis of a motor", &["dual::axis::"]),
    ("task", &["tractive::drive::"]),
    ("entry and board", &["tractive::firmware", "zs9::firmware", "tractive::board::", "TIMER"]),
];
/// What no part owns: copies and the like.
const REST: &str = "library";

/// A part of an interrupt.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    pub name: &'static str,
    /// Instructions a call on the mean, and in the longest call.
    pub mean: f64,
    pub longest: u32,
}

/// The parts of an exception with `calls` interrupts, the dearest first.
pub fn parts(
    profile: &Profile,
    exception: u32,
    hits: &Tally,
    calls: usize,
    longest: &[u32],
) -> Result<Vec<Part>> {
    let mut known = BTreeMap::new();
    let mut part = |address: u32| -> Result<&'static str> {
        if let Some(name) = known.get(&address) {
            return Ok(*name);
        }
        let name = owner(&profile.chain(address)?);
        known.insert(address, name);
        Ok(name)
    };
    let mut sums = BTreeMap::<&str, (u64, u32)>::new();
    for (address, count) in hits.of(exception) {
        sums.entry(part(address)?).or_default().0 += count;
    }
    for address in longest {
        sums.entry(part(*address)?).or_default().1 += 1;
    }
    let mean = |count: u64| count as f64 / calls.max(1) as f64;
    let mut parts: Vec<_> =
        sums.into_iter().map(|(name, (count, longest))| Part { name, mean: mean(count), longest }).collect();
    parts.sort_by(|a, b| b.mean.total_cmp(&a.mean));
    Ok(parts)
}

/// The part of an instruction by its functions, the innermost first.
fn owner(chain: &[String]) -> &'static str {
    let of = |name: &String| {
        let owns = |patterns: &&[&str]| patterns.iter().any(|pattern| name.contains(pattern));
        PARTS.iter().find(|(_, patterns)| owns(patterns)).map(|(part, _)| *part)
    };
    chain.iter().find_map(of).unwrap_or(REST)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_innermost_function_that_a_part_knows_decides() {
        let of = |names: &[&str]| owner(&names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>());
        let lookup = "tractive::machine::lookup::Grid<_>::at";
        let [mtpa, point] =
            ["tractive::control::mtpa::pass", "tractive::control::reference::operating_point"];
        assert_eq!(of(&[lookup, mtpa, point, "TIMER0"]), "MTPA, two passes");
        assert_eq!(of(&[lookup, point, "TIMER0"]), "operating point: weakening, limits");
        assert_eq!(of(&["tractive::control::Controller::step"]), "control law, the rest");
        assert_eq!(of(&["memcpy"]), "library");
        assert_eq!(of(&["DUALTIMER"]), "entry and board");
    }
}
