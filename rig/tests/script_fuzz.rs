//! Anything as a talk's script. What must hold is in `fuzz/src/script.rs`.
//!
//! `TRACTIVE_FUZZ_CASES=100000 cargo test --release -p tractive-rig --test script_fuzz` tries longer.

#[path = "../../fuzz/src/corpus.rs"]
mod corpus;
#[path = "../../fuzz/src/script.rs"]
mod script;
use tractive_rig::talk;

use proptest::prelude::*;
use script::check_text;

fn config() -> ProptestConfig {
    let cases =
        std::env::var("TRACTIVE_FUZZ_CASES").ok().and_then(|cases| cases.parse().ok()).unwrap_or(2_000);
    ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() }
}

/// Words that a script has, and some that it has not.
fn word() -> impl Strategy<Value = String> {
    const KNOWN: &str = "enable disable off on coast charge discharge acknowledge torque speed load over limits \
        link read write corrupt truncate replay reorder out-of-range unknown drop expect state running none within end with #";
    let known: Vec<&str> = KNOWN.split_whitespace().collect();
    prop_oneof![
        4 => prop::sample::select(known).prop_map(str::to_owned),
        3 => any::<i32>().prop_map(|number| number.to_string()),
        2 => any::<f64>().prop_map(|number| format!("{number:e}")),
        1 => prop::sample::select(vec!["NaN", "inf", "-0", "1e400", "0x10", ""]).prop_map(str::to_owned),
        1 => "\\PC{0,8}",
    ]
}

fn text() -> impl Strategy<Value = String> {
    let line = prop::collection::vec(word(), 0..7).prop_map(|words| words.join(" "));
    prop_oneof![6 => prop::collection::vec(line, 0..12).prop_map(|lines| lines.join("\n")), 1 => any::<String>()]
}

proptest! {
    #![proptest_config(config())]

    #[test]
    fn any_text_is_a_script_or_is_refused_by_its_line(text in text()) {
        check_text(&text);
    }
}

#[test]
fn every_kept_input_is_a_script_or_is_refused_by_its_line() {
    corpus::each("../fuzz/corpus/script", script::check);
}
