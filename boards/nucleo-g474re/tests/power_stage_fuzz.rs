//! A good power stage with something changed: it is refused in one line that names the file and its line, or it is a stage whose
//! values are all numbers.
//!
//! `TRACTIVE_FUZZ_CASES=100000 cargo test --release -p tractive-nucleo-g474re --test power_stage_fuzz` tries longer.

#[path = "../../../tablegen/tests/common/change.rs"]
mod change;
#[path = "../build/power_stage/mod.rs"]
mod power_stage;

use change::{change, changed};
use nucleo_g474re::built_in::{traction, zs9};
use nucleo_g474re::{dead_time, rates, zs9::rates as zs9_rates};
use power_stage::Machine;
use proptest::prelude::*;
use std::path::Path;

const FILE: &str = "power_stage.toml";
/// The stages as they are delivered, with one position sensor each; the last one is the ZS9's.
const TEXTS: [&str; 5] = [
    include_str!("../power_stage.toml"),
    include_str!("../power_stage_absolute.toml"),
    include_str!("../power_stage_biss.toml"),
    include_str!("../power_stage_resolver.toml"),
    include_str!("../power_stage_zs9.toml"),
];

fn config() -> ProptestConfig {
    let cases =
        std::env::var("TRACTIVE_FUZZ_CASES").ok().and_then(|cases| cases.parse().ok()).unwrap_or(2_000);
    ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() }
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn a_good_stage_with_something_changed(
        which in 0..TEXTS.len(),
        changes in prop::collection::vec(change(), 0..4),
    ) {
        let text = String::from_utf8_lossy(&changed(TEXTS[which], &changes)).into_owned();
        let is_zs9 = which + 1 == TEXTS.len();
        let tables = if is_zs9 { &zs9::BUILT_IN } else { &traction::BUILT_IN };
        let machine = Machine { folder: Path::new("machine"), tables, carrier_share: 1.0 };
        let check = if is_zs9 { power_stage::zs9 } else { power_stage::traction };
        let file = Path::new(FILE);
        let made = check(file, &text, &machine).and_then(|stage| Ok(stage + &power_stage::sensor(file, &text, &machine)?));
        match made.map_err(|error| error.to_string()) {
            Ok(stage) => prop_assert!(!stage.contains("NaN") && !stage.contains("inf"), "{stage}"),
            Err(refused) => {
                prop_assert!(!changes.is_empty(), "as it is delivered: {refused}");
                prop_assert_eq!(refused.lines().count(), 1, "{}", refused);
                let place = refused.strip_prefix(&format!("{FILE}:")).and_then(|rest| rest.split_once(':'));
                let is_place = place.is_some_and(|(line, _)| line.parse::<usize>().is_ok());
                // A key that is not there has no line, and what a machine does not suit is told of its folder.
                let is_missing = refused.starts_with(&format!("{FILE}: ")) && refused.ends_with(" is missing");
                let is_place = is_place || is_missing || refused.starts_with("machine/machine.toml: ");
                prop_assert!(is_place, "{refused}");
            }
        }
    }
}
