//! The demagnetisation limit of a machine folder in whole runs: no reference is below it, and what the currents reached is told.

use std::path::Path;
use tractive_rig::analysis::Figures;
use tractive_rig::campaign::Campaign;
use tractive_rig::scenario::catalogue;
use tractive_rig::trace::{Recorded, Recording};

const LEAST_A: f64 = -160.0;

/// A run of the reference machine with the limit or without, its torque turned over at a high speed; on both laws.
fn run(line: &str, limited: bool) -> (Figures, Recording) {
    let reference = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tables/pmasynrm-180kw");
    let folder = tempfile::tempdir().unwrap();
    let toml = std::fs::read_to_string(reference.join("machine.toml")).unwrap();
    let key = if limited { format!("\nmin_id_a = {LEAST_A}\n") } else { String::new() };
    std::fs::write(folder.path().join("machine.toml"), toml + &key).unwrap();
    std::fs::copy(reference.join("flux_map.csv"), folder.path().join("flux_map.csv")).unwrap();
    let chosen = catalogue::of_traction(&format!("{line} --machine {}", folder.path().display())).unwrap();
    let machine = chosen.machine().unwrap();
    let recording = chosen.drive(&machine).unwrap();
    assert!(recording.trip().is_none(), "{line}: {:?}", recording.trip());
    (chosen.figures(&recording, &machine), recording)
}

fn lowest(recording: &Recording, of: fn(&tractive_rig::trace::Row) -> f64) -> f64 {
    recording.rows.iter().map(of).fold(f64::INFINITY, f64::min)
}

#[test]
fn no_reference_of_a_run_is_below_the_limit_and_the_lowest_current_is_told() {
    for line in ["sweep", "reversal", "sweep --law pi"] {
        let ((figures, limited), (free_figures, free)) = (run(line, true), run(line, false));
        let [reference_a, free_a] = [&limited, &free].map(|recording| lowest(recording, |row| row.id_ref_a));
        let told_a = figures.number("lowest_id_a").expect("with a limit it is told");
        println!("{line}: reference {reference_a} A, without the limit {free_a} A; reached {told_a} A");
        assert!(reference_a >= LEAST_A && free_a < LEAST_A - 3.0, "{line}: {reference_a} A, {free_a} A");
        assert_eq!(told_a, limited.lowest_id_a());
        // Pulses have ripple, which is the plant's own.
        assert!(told_a <= lowest(&limited, |row| row.id_a) && told_a > LEAST_A - 60.0, "{line}: {told_a} A");
        assert!(free_figures.number("lowest_id_a").is_none(), "{line}: without a limit nothing is told");
    }
}

/// A short circuit at a high speed demagnetises more than any operating point: the campaign tells by how much.
#[test]
fn the_campaign_tells_the_lowest_current_of_a_fault() {
    let named = |case: &&tractive_rig::campaign::Case| {
        case.name() == "pmasynrm angle-jump square 6000 motoring"
            || case.name().contains("angle-jump 6000 motoring")
    };
    let campaign = Campaign::new(None).unwrap();
    let all = campaign.cases(false);
    let case = all.iter().find(named).unwrap_or_else(|| panic!("{:?}", all[9].name()));
    let outcome = campaign.run(case).unwrap();
    assert_eq!(outcome.safe_state, "short circuit, lower");
    assert!(
        outcome.lowest_id_a < -220.0
            && outcome.lowest_id_a > -1.1 * outcome.current_after_a.max(outcome.current_until_a),
        "{outcome:?}"
    );
}
