//! The guide's list of faults against the code.

use std::path::Path;
use tractive::protection::Fault;

#[test]
fn every_fault_is_explained_once_and_in_the_order_of_its_code() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/faults.md");
    let text = std::fs::read_to_string(page).unwrap();
    let explained: Vec<_> = text
        .lines()
        .filter_map(|line| line.strip_prefix("| `")?.split_once("` | "))
        .map(|(name, rest)| {
            assert!(rest.split(" | ").nth(1).is_some_and(|causes| causes.len() > 10), "{name} has no causes");
            name
        })
        .collect();
    assert_eq!(explained, Fault::ALL.map(Fault::name));
}
