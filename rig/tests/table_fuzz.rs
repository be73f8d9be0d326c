//! Anything as a table from the user: a good CSV of operating points, or another tool's flux map, with something changed. It is refused in
//! one line that names the file and a line of it, or it is read, and every resulting value is a number.
//!
//! `TRACTIVE_FUZZ_CASES=100000 cargo test --release -p tractive-rig --test table_fuzz` tries longer.

#[path = "../../tablegen/tests/common/change.rs"]
mod change;
#[path = "../../tablegen/tests/common/mod.rs"]
mod folders;

use change::{change, changed};
use clap::Parser;
use folders::{SMALL, axis};
use proptest::prelude::*;
use std::path::Path;
use std::sync::LazyLock;
use tractive_rig::folder::Import;
use tractive_rig::machine::Machine;
use tractive_rig::points;

fn config(usual: u32) -> ProptestConfig {
    let cases =
        std::env::var("TRACTIVE_FUZZ_CASES").ok().and_then(|cases| cases.parse().ok()).unwrap_or(usual);
    ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() }
}

/// A refusal is one line; `true` if it begins with the file and one of its lines.
fn names_a_line(refused: &anyhow::Error, file: &Path) -> bool {
    let refused = format!("{refused:#}");
    assert_eq!(refused.lines().count(), 1, "{refused}");
    let rest = refused.strip_prefix(&format!("{}:", file.display()));
    rest.and_then(|rest| rest.split_once(':')).is_some_and(|(line, _)| line.parse::<u64>().is_ok())
}

static MACHINE: LazyLock<Machine> = LazyLock::new(|| Machine::load("pmasynrm-180kw").unwrap());

const POINTS: &str =
    "torque_nm,speed_rpm,udc_v\n# motoring\n1000,600,1500\n-400,3000,1700\n0, -5000 ,1200\n500,2500,1500\n";

proptest! {
    #![proptest_config(config(500))]

    #[test]
    fn good_points_with_something_changed(changes in prop::collection::vec(change(), 1..4)) {
        let folder = tempfile::tempdir()?;
        let [input, output] = ["in.csv", "out.csv"].map(|name| folder.path().join(name));
        std::fs::write(&input, changed(POINTS, &changes))?;
        match points::run(&input, &output, &MACHINE, None) {
            Err(refused) => prop_assert!(names_a_line(&refused, &input), "{refused:#}"),
            Ok(()) => {
                let text = std::fs::read_to_string(&output)?;
                let cells = text.lines().skip(1).flat_map(|line| line.split(',').take(5));
                let numbers: Vec<f64> = cells.map(|cell| cell.parse().unwrap()).collect();
                prop_assert!(numbers.iter().all(|number| number.is_finite()), "{text}");
            }
        }
    }
}

/// The command's options.
#[derive(Parser)]
struct Command {
    #[command(flatten)]
    import: Import,
}

/// A map of nine by nine nodes.
static MAP: LazyLock<String> = LazyLock::new(|| SMALL.truth.map(&axis(-20.0, 5.0, 9), &axis(-20.0, 5.0, 9)));

proptest! {
    #![proptest_config(config(500))]

    /// A map that is read ends before the largest current, and is refused for that alone: the making of tables from it has tests of its own.
    #[test]
    fn a_good_map_of_another_tool_with_something_changed(changes in prop::collection::vec(change(), 0..3)) {
        let folder = tempfile::tempdir()?;
        let [map, out] = ["map.csv", "machine"].map(|name| folder.path().join(name));
        std::fs::write(&map, changed(&MAP, &changes))?;
        let limits = "import --pole-pairs 3 --rs 0.001 --max-current 1000 --udc 560 --max-speed-rpm 6000 --max-switching-hz 5000";
        let paths = ["--out".to_owned(), out.display().to_string(), map.display().to_string()];
        let Command { import } = Command::parse_from(limits.split(' ').map(str::to_owned).chain(paths));
        let refused = import.make().unwrap_err();
        let by_line = names_a_line(&refused, &map);
        let refused = format!("{refused:#}");
        let is_read = refused.starts_with("--max-current 1000: must be at most ");
        prop_assert!(!changes.is_empty() || is_read, "the map as it is: {refused}");
        // Of a map that is no grid the file alone is told.
        prop_assert!(by_line || is_read || refused.starts_with(&format!("{}: ", map.display())), "{refused}");
    }
}
