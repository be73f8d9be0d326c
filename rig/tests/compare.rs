//! Both control laws in the same runs: the tables of the guide are what `cargo rig compare` prints, and ours is ahead or it is said
//! why not.

use std::sync::LazyLock;
use tractive_rig::compare::{self, PartRow, Row};

const README: &str = include_str!("../../README.md");
const RESULTS: &str = include_str!("../../docs/results.md");
const PAGE: &str = include_str!("../../docs/papers.md");

/// The tables, of runs that all tests share.
static FOUND: LazyLock<(Vec<Row>, Vec<PartRow>)> = LazyLock::new(|| compare::rows_and_parts().unwrap());

/// Those whose name has this in it.
fn rows(word: &str) -> Vec<&'static Row> {
    FOUND.0.iter().filter(|row| row.quantity.contains(word)).collect()
}

#[test]
fn the_guide_says_what_both_laws_reach() {
    let rows = rows("");
    assert_eq!(rows.len(), 21);
    for row in rows {
        println!("{}: {:?}, ahead: {}", row.quantity, row.found, row.mark());
        assert!(
            RESULTS.lines().any(|line| line == row.markdown()),
            "docs/results.md has no line\n{}",
            row.markdown()
        );
        let [own, pi] = &row.found;
        let begins = format!("| {} | {own} | {pi} | ", row.quantity);
        assert!(PAGE.lines().any(|line| line.starts_with(&begins)), "docs/papers.md has no line\n{begins}");
        assert!(row.ahead || !row.why.is_empty(), "{}: {:?}", row.quantity, row.found);
        // A reason is for a row that needs one.
        assert!(!row.ahead || row.why.is_empty(), "{}: ahead, and still {}", row.quantity, row.why);
        assert!(!row.found[0].starts_with("trips"), "{}: {}", row.quantity, row.found[0]);
    }
}

#[test]
fn the_readme_shows_rows_of_the_guide() {
    let section = README.split("\n## ").find(|section| section.starts_with("What it reaches")).unwrap();
    let rows: Vec<_> = section.lines().filter(|line| line.starts_with("| ")).collect();
    assert!(rows.len() > 6, "{rows:?}");
    for row in rows {
        assert!(RESULTS.lines().any(|line| line == row), "docs/results.md has no line\n{row}");
    }
}

#[test]
fn the_ordinary_law_is_no_straw_man() {
    // What was asked of an ordinary drive before it was written: no trip, torque as the paper claims it, steps in some carriers.
    let [torque] = &rows("characteristic points")[..] else { panic!("one row") };
    let within: f64 = torque.found[1].split(' ').nth(1).unwrap().parse().unwrap();
    assert!(within < 5.0, "{}", torque.found[1]);
    let [step] = &rows("full torque in one step")[..] else { panic!("one row") };
    let slowest: f64 = step.found[1].split(' ').nth(2).unwrap().parse().unwrap();
    assert!(slowest < 3.6, "{}", step.found[1]);
    // Two motors do not disturb each other, and the link stays within what regulates it.
    let both = rows("ZS9");
    assert!(both.len() > 5 && both.iter().all(|row| !row.found[1].starts_with("trips")), "{both:?}");
    let [coupling] = &rows("motor 1's torque moves by")[..] else { panic!("one row") };
    let moved_nm: f64 = coupling.found[1].split(' ').next().unwrap().parse().unwrap();
    assert!(moved_nm < 0.023, "{}", coupling.found[1]);
    let [link] = &rows("link voltage within, at 10 kHz")[..] else { panic!("one row") };
    let within: f64 = link.found[1].split(' ').next().unwrap().parse().unwrap();
    assert!(within < 6.0, "{}", link.found[1]);
}

#[test]
fn the_page_says_what_each_part_buys() {
    let rows = &FOUND.1;
    assert_eq!(rows.len(), 13);
    for row in rows {
        let line = row.markdown();
        assert!(PAGE.lines().any(|one| one == line), "docs/papers.md has no line\n{line}");
        assert!(!row.found[0].starts_with("trips"), "{line}");
    }
}

#[test]
fn a_word_that_no_row_has_is_named() {
    let error = compare::rows(&["flywheel".to_owned()]).unwrap_err().to_string();
    assert_eq!(error, "--only flywheel: no row has all of these words");
}
