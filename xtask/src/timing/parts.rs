//! What the parts of an interrupt cost: every executed instruction belongs to one part, so they add up to the interrupt.

use std::collections::BTreeMap;

use anyhow::Result;

use super::profile::Profile;
use super::tally::Tally;

/// Whether an interrupt could do without a part and still be what its target is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Group {
    /// What the targets name.
    Named,
    /// What the drive does beyond it.
    Beyond,
    /// What carries both.
    Around,
}

impl Group {
    pub const ALL: [Self; 3] = [Self::Named, Self::Beyond, Self::Around];

    /// As in the tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Named => "what the target names",
            Self::Beyond => "what the drive does beyond it",
            Self::Around => "cells, entry, messages",
        }
    }
}

use Group::{Around, Beyond, Named};

/// Parts, what they are in the control interrupt and in the PWM interrupt, and what the names of their functions contain. Whose an
/// instruction is, is asked of the innermost function first, and then of those that it was inlined into.
const PARTS: [(&str, [Group; 2], &[&str]); 30] = [
    (
        "sine and cosine, Clarke, Park, angles",
        [Named, Named],
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
    ("flux map", [Named, Named], &["control::flux_linkage"]),
    ("MTPA, two passes", [Named, Named], &["control::mtpa::"]),
    ("operating point: weakening, limits", [Named, Named], &["control::reference::"]),
    ("link's window", [Beyond, Beyond], &["control::link_filter::", "demand::LinkWindow"]),
    ("torque demand: envelope, slew", [Named, Named], &["control::demand::"]),
    ("trim of mean torque", [Beyond, Beyond], &["control::torque_trim::"]),
    ("speed from the angle", [Beyond, Beyond], &["control::speed::"]),
    ("speed loop", [Beyond, Beyond], &["control::speed_loop::"]),
    ("disturbance, its sixth harmonic", [Beyond, Beyond], &["control::disturbance::"]),
    ("map error", [Beyond, Beyond], &["control::map_error::"]),
    ("current loop", [Named, Named], &["control::current_loop::", "control::flux_path::"]),
    ("Z-source", [Beyond, Beyond], &["control::z_source::"]),
    ("control law, the rest", [Named, Named], &["tractive::control::"]),
    ("ripple of the pattern", [Named, Named], &["modulation::ripple::", "::ripple"]),
    ("revision of a committed half", [Beyond, Beyond], &["::is_to_revise", "::revise"]),
    (
        "flux predicted from committed pulses",
        [Beyond, Beyond],
        &["committed", "traction::glide::", "::boundary", "::new_boundary", "volt_seconds", "volt_ticks"],
    ),
    ("gates read back", [Beyond, Beyond], &["dual::pwm::Expected", "::stuck"]),
    ("protection", [Named, Named], &["tractive::protection::", "Task<M>::check", "::stale", "::violation"]),
    ("scaling", [Named, Named], &["ControlTask<M>::measured"]),
    ("flight recorder", [Beyond, Beyond], &["tractive::recorder::", "cell::ring::", "ControlTask<M>::entry"]),
    (
        "cells and messages",
        [Around, Around],
        &["cell::Downlink", "cell::Uplink", "cell::Trail", "messages::", "::Applied::"],
    ),
    ("choice of the mode", [Beyond, Named], &["modulation::schedule::", "::choose_mode", "::switch_to"]),
    ("dead-time compensation", [Beyond, Beyond], &["modulation::dead_time::"]),
    ("growth of a pattern, catching", [Beyond, Beyond], &["modulation::growth::", "modulation::catch::"]),
    ("shoot-through", [Named, Named], &["nine_switch::shoot_through::"]),
    ("pulses", [Beyond, Named], &["tractive::modulation::", "tractive::nine_switch::"]),
    ("axis of a motor", [Around, Around], &["dual::axis::"]),
    ("task", [Around, Around], &["tractive::drive::"]),
    (
        "entry and board",
        [Around, Around],
        &["tractive::firmware", "zs9::firmware", "tractive::board::", "TIMER"],
    ),
];
/// What no part owns: copies and the like.
const REST: &str = "library";

/// A part of an interrupt.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    pub name: &'static str,
    pub group: Group,
    /// Instructions a call on the mean, and in the longest call.
    pub mean: f64,
    pub longest: u32,
}

/// Instructions of these parts together, on the mean and in the longest call.
pub fn together<'a>(parts: impl Iterator<Item = &'a Part>) -> (f64, u32) {
    parts.fold((0.0, 0), |(mean, longest), part| (mean + part.mean, longest + part.longest))
}

/// The parts of an interrupt that came `calls` times, by their groups, the dearest first.
pub fn parts(
    profile: &Profile,
    (interrupt, exception): (&str, u32),
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
    let mut parts: Vec<_> = sums
        .into_iter()
        .map(|(name, (count, longest))| Part {
            name,
            group: group(interrupt, name),
            mean: mean(count),
            longest,
        })
        .collect();
    parts.sort_by(|a, b| a.group.cmp(&b.group).then(b.mean.total_cmp(&a.mean)));
    Ok(parts)
}

/// The part of an instruction by its functions, the innermost first.
fn owner(chain: &[String]) -> &'static str {
    let of = |name: &String| {
        let owns = |patterns: &&[&str]| patterns.iter().any(|pattern| name.contains(pattern));
        PARTS.iter().find(|(.., patterns)| owns(patterns)).map(|(part, ..)| *part)
    };
    chain.iter().find_map(of).unwrap_or(REST)
}

fn group(interrupt: &str, part: &str) -> Group {
    let known = PARTS.iter().find(|(name, ..)| *name == part);
    known.map_or(Around, |(_, [control, pwm], _)| if interrupt == "control" { *control } else { *pwm })
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
        let [store, ring] = ["tractive::cell::store", "tractive::cell::ring::Ring<T,_,_>::record"];
        assert_eq!(of(&[store, ring, "TIMER0"]), "flight recorder");
        assert_eq!(of(&[store, "tractive::cell::Downlink<T,_>::publish", "TIMER0"]), "cells and messages");
        assert_eq!(of(&["memcpy"]), "library");
        assert_eq!(of(&["DUALTIMER"]), "entry and board");
    }

    #[test]
    fn pulses_are_what_the_pwm_interrupt_is_for_and_control_only_foresees_them() {
        assert_eq!([group("control", "pulses"), group("pwm", "pulses")], [Beyond, Named]);
        assert_eq!([group("control", "MTPA, two passes"), group("control", REST)], [Named, Around]);
    }
}
