//! Runs of the ZS9's scenarios, as on the command line.

use serde_json::Value;
use tractive_rig::analysis::Figures;
use tractive_rig::scenario::catalogue;
use tractive_rig::zs9::trace::Recording;

/// The results of a run.
pub struct Outcome {
    pub recording: Recording,
    pub figures: Figures,
}

/// Runs a scenario as on the command line.
pub fn run(line: &str) -> Outcome {
    let chosen = catalogue::of_zs9(line).unwrap();
    let machine = chosen.machine().unwrap();
    let recording = chosen.drive(&machine).unwrap();
    let figures = chosen.figures(&recording, &machine);
    Outcome { recording, figures }
}

pub fn figure(outcome: &Outcome, name: &str) -> f64 {
    outcome.figures.get(name).and_then(Value::as_f64).unwrap_or_else(|| panic!("no figure {name}"))
}
