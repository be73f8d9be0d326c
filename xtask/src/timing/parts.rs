//! The cost of the parts of an interrupt: every executed instruction belongs to one part, so they add up to the interrupt.

use super::profile::{Place, Profile};
use crate::build;
use anyhow::{Result, bail};
use std::collections::{BTreeMap, BTreeSet};

/// The group of a part, by whether the papers' systems have it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Group {
    /// A part that the papers' systems have, too.
    Paper,
    /// A part that the drive has beyond them.
    Beyond,
    /// A part that carries both.
    Around,
}

impl Group {
    pub const ALL: [Self; 3] = [Self::Paper, Self::Beyond, Self::Around];

    /// As in the tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Paper => "what the papers' systems have",
            Self::Beyond => "what the drive has beyond them",
            Self::Around => "cells, entry, messages",
        }
    }
}

use Group::{Around, Beyond, Paper};

/// Parts, their groups and their sources: files and folders below `src/` of any of the repository's crates; after a `#`, a word of the function's name.
/// Among the sources that contain an instruction's file, the longest decides. The innermost function is asked first, then those that it was inlined
/// into.
const PARTS: [(&str, Group, &[&str]); 31] = [
    ("frames: vectors, angles, sine and cosine", Paper, &["frames/"]),
    ("look-up in flux map and tables", Paper, &["machine/lookup.rs"]),
    ("MTPA, two passes", Paper, &["control/mtpa.rs"]),
    ("operating point: weakening, limits", Paper, &["control/reference.rs"]),
    ("link's filter", Beyond, &["control/link_filter.rs"]),
    ("torque demand: envelope, slew, link's window", Paper, &["control/demand.rs"]),
    ("trim of mean torque", Beyond, &["control/torque_trim.rs"]),
    ("speed from the angle", Paper, &["control/speed.rs"]),
    ("speed loop", Beyond, &["control/speed_loop.rs"]),
    ("disturbance, its sixth harmonic", Beyond, &["control/disturbance.rs"]),
    ("map error", Beyond, &["control/map_error.rs"]),
    ("position sensor's errors", Beyond, &["control/angle_harmonics.rs"]),
    (
        "current sensors' offsets, gains, delay",
        Beyond,
        &[
            "drive/traction/current_zeros.rs",
            "drive/traction/current_gains.rs",
            "drive/traction/current_delay.rs",
        ],
    ),
    ("temperatures", Beyond, &["control/warmth.rs"]),
    ("current loop", Paper, &["control/current_loop.rs", "control/flux_path.rs"]),
    ("Z-source", Paper, &["control/z_source.rs"]),
    ("control law, the rest", Paper, &["control/"]),
    ("ripple of the pattern", Paper, &["modulation/ripple.rs"]),
    (
        "flux predicted from committed pulses",
        Beyond,
        &["drive/traction/applied.rs", "drive/traction/six_step_exit.rs"],
    ),
    ("gates read back", Beyond, &["drive/dual/pwm.rs#Expected", "drive/dual/pwm.rs#stuck"]),
    ("protection", Paper, &["protection/"]),
    ("flight recorder", Beyond, &["recorder.rs", "cell/ring.rs"]),
    ("cells and messages", Around, &["cell.rs", "drive/messages.rs", "drive/dual/messages.rs"]),
    ("choice of the mode", Paper, &["modulation/schedule.rs"]),
    ("dead-time compensation", Beyond, &["modulation/dead_time.rs"]),
    ("link's ripple", Beyond, &["control/link_ripple.rs"]),
    ("shoot-through", Paper, &["nine_switch/shoot_through.rs"]),
    ("pulses", Paper, &["modulation/", "nine_switch/", "drive/traction/pulses.rs"]),
    ("axis of a motor", Around, &["drive/dual/axis.rs"]),
    ("task", Around, &["drive/"]),
    ("entry and board", Around, &["firmware/", "board/"]),
];
/// The part that belongs to no source: copies and the like.
const REST: &str = "library";

/// A part of an interrupt.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    pub name: &'static str,
    pub group: Group,
    /// Instructions per call on average, and in the longest call.
    pub mean: f64,
    pub longest: u32,
}

/// The names of the parts of a group, and of the part that belongs to none.
pub fn names(group: Group) -> impl Iterator<Item = &'static str> {
    let named = PARTS.iter().filter(move |(_, of, _)| *of == group).map(|(name, ..)| *name);
    named.chain((group == Around).then_some(REST))
}

/// Instructions of these parts together, on average and in the longest call.
pub fn together<'a>(parts: impl Iterator<Item = &'a Part>) -> (f64, u32) {
    parts.fold((0.0, 0), |(mean, longest), part| (mean + part.mean, longest + part.longest))
}

/// The parts of an interrupt that came `calls` times and executed the addresses that `hits` counts, by their groups, the most expensive first. The
/// sources that instructions came from are added to `sources`.
pub fn parts(
    profile: &Profile,
    hits: impl Iterator<Item = (u32, u64)>,
    calls: usize,
    longest: &[u32],
    sources: &mut BTreeSet<&'static str>,
) -> Result<Vec<Part>> {
    let mut known = BTreeMap::new();
    let mut part = |address: u32| -> Result<&'static str> {
        if let Some(name) = known.get(&address) {
            return Ok(*name);
        }
        let owner = owner(&profile.places(address)?);
        sources.extend(owner.map(|(_, source)| source));
        let name = owner.map_or(REST, |(name, _)| name);
        known.insert(address, name);
        Ok(name)
    };
    let mut sums = BTreeMap::<&str, (u64, u32)>::new();
    for (address, count) in hits {
        sums.entry(part(address)?).or_default().0 += count;
    }
    for address in longest {
        sums.entry(part(*address)?).or_default().1 += 1;
    }
    let mean = |count: u64| count as f64 / calls.max(1) as f64;
    let mut parts: Vec<_> = sums
        .into_iter()
        .map(|(name, (count, longest))| Part { name, group: group(name), mean: mean(count), longest })
        .collect();
    parts.sort_by(|a, b| a.group.cmp(&b.group).then(b.mean.total_cmp(&a.mean)));
    Ok(parts)
}

/// The part of an instruction and the source that says so, by its functions, the innermost first.
fn owner(places: &[Place]) -> Option<(&'static str, &'static str)> {
    let sources =
        || PARTS.iter().flat_map(|(part, _, sources)| sources.iter().map(move |source| (*part, *source)));
    let of = |place: &Place| {
        let owns = |(_, source): &(&str, &str)| lies_in(place, source);
        sources().filter(owns).max_by_key(|(_, source)| source.len())
    };
    places.iter().find_map(of)
}

fn lies_in(place: &Place, source: &str) -> bool {
    let (path, word) = source.split_once('#').unwrap_or((source, ""));
    let mut words = place.function.split(|c: char| !c.is_alphanumeric() && c != '_');
    below_src(&place.file).is_some_and(|file| file == path || path.ends_with('/') && file.starts_with(path))
        && (word.is_empty() || words.any(|of_name| of_name == word))
}

/// The path below `src/` of one of the repository's crates; `None` for a library's file.
fn below_src(file: &str) -> Option<&str> {
    let inside = file.strip_prefix(build::root().to_str()?)?;
    let (_, path) = inside.split_once("/src/")?;
    // A module in another folder: `bin/../firmware/zs9.rs`.
    Some(path.rsplit_once("/../").map_or(path, |(_, path)| path))
}

/// Refuses a list of parts if one of its sources is in no interrupt: it was renamed, and its cost is counted elsewhere.
pub fn all_found(sources: &BTreeSet<&str>) -> Result<()> {
    let listed = PARTS.iter().flat_map(|(part, _, listed)| listed.iter().map(move |source| (part, source)));
    let missing = listed.filter(|(_, source)| !sources.contains(**source));
    let missing: Vec<_> = missing.map(|(part, source)| format!("`{source}` ({part})")).collect();
    if !missing.is_empty() {
        bail!("timing/parts.rs: no interrupt executes anything of {}; was it renamed?", missing.join(", "));
    }
    Ok(())
}

fn group(part: &str) -> Group {
    PARTS.iter().find(|(name, ..)| *name == part).map_or(Around, |(_, group, _)| *group)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(file: &str, function: &str) -> Place {
        let file = format!("{}/{file}", build::root().display());
        Place { function: function.to_owned(), file }
    }

    #[test]
    fn the_innermost_file_that_a_part_knows_decides() {
        let of = |files: &[&str]| {
            owner(&files.iter().map(|file| place(file, "f")).collect::<Vec<_>>()).map(|(part, _)| part)
        };
        let [mtpa, point] = ["src/control/mtpa.rs", "src/control/reference.rs"];
        assert_eq!(of(&[mtpa, point, "src/main.rs"]), Some("MTPA, two passes"));
        assert_eq!(of(&["src/time.rs", point, "src/main.rs"]), Some("operating point: weakening, limits"));
        // Whichever crate it is in.
        assert_eq!(of(&["control/src/control/mtpa.rs"]), Some("MTPA, two passes"));
        assert_eq!(of(&["control/src/modulation/mode.rs"]), Some("pulses"));
        assert_eq!(of(&["src/control/mod.rs"]), Some("control law, the rest"));
        assert_eq!(of(&["src/drive/traction/control.rs"]), Some("task"));
        assert_eq!(of(&["src/firmware/pmasynrm.rs"]), Some("entry and board"));
        assert_eq!(of(&["src/bin/../firmware/zs9.rs"]), Some("entry and board"));
        assert_eq!(of(&["target/firmware/build/x/out/tables.rs"]), None);
        let library = |file: &str| Place { file: file.to_owned(), function: "f".to_owned() };
        assert_eq!(owner(&[library("/rustc/1/library/core/src/cell.rs")]), None);
    }

    #[test]
    fn a_word_tells_functions_of_a_file_apart() {
        let of = |function: &str| owner(&[place("src/drive/dual/pwm.rs", function)]).unwrap().0;
        assert_eq!(of("tractive::drive::dual::pwm::PwmTask<M>::stuck"), "gates read back");
        assert_eq!(of("tractive::drive::dual::pwm::PwmTask<M>::unstuck"), "task");
    }

    #[test]
    fn a_source_that_is_gone_is_told() {
        let mut sources: BTreeSet<_> = PARTS.iter().flat_map(|(.., sources)| *sources).copied().collect();
        assert!(all_found(&sources).is_ok());
        sources.remove("control/mtpa.rs");
        assert!(
            all_found(&sources).unwrap_err().to_string().contains("`control/mtpa.rs` (MTPA, two passes)")
        );
    }
}
