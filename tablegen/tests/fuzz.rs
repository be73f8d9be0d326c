//! Anything into the table generator: bytes of any kind, and good files with something changed. It refuses in one line that names the
//! file, or makes tables in which every number is one. It never panics.
//!
//! `TRACTIVE_FUZZ_CASES=100000 cargo test --release -p tractive-tablegen --test fuzz` tries longer.

#[path = "common/change.rs"]
mod change;
mod common;
#[path = "../../fuzz/src/corpus.rs"]
mod corpus;
#[path = "../../fuzz/src/folder.rs"]
mod folder;

use change::{change, changed};
use common::{Folder, good_map, good_toml};
use folder::check_refusal;
use proptest::prelude::*;
use std::sync::LazyLock;
use tractive_tablegen::rust_source;

static TOML: LazyLock<String> = LazyLock::new(good_toml);
static MAP: LazyLock<String> = LazyLock::new(good_map);

fn config(usual: u32) -> ProptestConfig {
    let cases =
        std::env::var("TRACTIVE_FUZZ_CASES").ok().and_then(|cases| cases.parse().ok()).unwrap_or(usual);
    ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() }
}

/// Reads a folder with these bytes.
fn try_bytes(machine: &[u8], map: &[u8]) -> Result<(), TestCaseError> {
    let folder = Folder::new("", "");
    std::fs::write(folder.path().join("machine.toml"), machine)?;
    std::fs::write(folder.path().join("flux_map.csv"), map)?;
    let refused = match folder.read() {
        Err(error) => error.to_string(),
        Ok(machine) => {
            let source = rust_source(&machine.tables(), "tractive_control::machine");
            prop_assert!(!source.contains("NaN") && !source.contains("inf,") && !source.contains("inf]"));
            return Ok(());
        }
    };
    check_refusal(&refused);
    let path = folder.path().display().to_string();
    prop_assert!(refused.starts_with(&path), "names no file: {}", refused);
    Ok(())
}

proptest! {
    #![proptest_config(config(300))]

    #[test]
    fn any_bytes(machine in prop::collection::vec(any::<u8>(), 0..400), map in prop::collection::vec(any::<u8>(), 0..400)) {
        try_bytes(&machine, &map)?;
        try_bytes(TOML.as_bytes(), &map)?;
    }

    #[test]
    fn a_good_machine_with_something_changed(changes in prop::collection::vec(change(), 1..4)) {
        // Without a map it is read all the same, and refused at the latest for that.
        try_bytes(&changed(&TOML, &changes), b"")?;
    }

    #[test]
    fn a_good_map_with_something_changed(changes in prop::collection::vec(change(), 1..3)) {
        try_bytes(b"", &changed(&MAP, &changes))?;
        let folder = Folder::new(&TOML, "");
        std::fs::write(folder.path().join("flux_map.csv"), changed(&MAP, &changes))?;
        // Reading alone: making the tables takes too long for every case.
        if let Err(error) = folder.read() {
            check_refusal(&error.to_string());
        }
    }
}

proptest! {
    #![proptest_config(config(12))]

    /// Values that are good by themselves, in any company: tables or a refusal.
    #[test]
    fn any_ratings(
        key in prop::sample::select(vec![
            "pole_pairs", "stator_resistance_ohm", "max_torque_nm", "max_power_w", "max_current_a", "max_speed_rpm",
            "rated_torque_nm", "rated_speed_rpm", "dc_link_min_v", "dc_link_nominal_v", "dc_link_max_v", "max_switching_hz",
        ]),
        exponent in -12.0_f64..12.0,
    ) {
        let value = match key { "pole_pairs" => exponent.exp2().ceil(), _ => 10_f64.powf(exponent) };
        let lines = TOML.lines().map(|line| match line.starts_with(&format!("{key} =")) {
            true => format!("{key} = {value}\n"),
            false => format!("{line}\n"),
        });
        try_bytes(lines.collect::<String>().as_bytes(), MAP.as_bytes())?;
    }
}

#[test]
fn every_kept_input_is_read_or_refused() {
    corpus::each("../fuzz/corpus/folder", folder::check);
}
