//! Mode borders crossed at constant speed, by torque alone.

use super::script::{BEGIN_S, Script};
use super::{Plan, Scenario};
use crate::analysis::{self, Figures};
use crate::machine::Machine;
use crate::options::RunOptions;
use crate::report::Page;
use crate::trace::Recording;

/// Torque up to the envelope and back at `--speed`, slowly: small steps that the slew limit smooths.
pub struct ModeBorders;

const SPEED_RPM: f64 = 1860.0;
const LEVELS: usize = 800;
/// So slow that the envelopes beside a switch, 100 ms away, are those of its torque within a percent.
const LEVEL_S: f64 = 0.01;
/// At the envelope, in s.
const HOLD_S: f64 = 0.6;

impl Scenario for ModeBorders {
    fn name(&self) -> &'static str {
        "mode-borders"
    }

    fn figure(&self) -> &'static str {
        "figure 9: changes of pulse pattern, here at constant speed by torque alone"
    }

    fn plan(&self, options: &RunOptions, machine: &Machine) -> Plan {
        let most = machine.folder.parameters.max_torque_nm;
        let share = |level: usize| level as f64 / LEVELS as f64;
        let up = (0..=LEVELS).map(|k| (BEGIN_S + k as f64 * LEVEL_S, most * share(k)));
        let down_s = BEGIN_S + LEVELS as f64 * LEVEL_S + HOLD_S;
        let down = (0..=LEVELS).map(|k| (down_s + k as f64 * LEVEL_S, most * share(LEVELS - k)));
        let torque = up.chain(down);
        Script {
            speed: vec![(0.0, options.speed.unwrap_or(SPEED_RPM))],
            torque: torque.collect(),
            slew_limited: true,
            duration_s: down_s + (LEVELS + 20) as f64 * LEVEL_S,
            ..Script::default()
        }
        .plan()
    }

    fn figures(&self, recording: &Recording, options: &RunOptions, _machine: &Machine) -> Figures {
        let mut figures = analysis::common(recording);
        let switches = analysis::mode_switches(recording);
        let verdicts = analysis::switch_verdicts(&switches, recording, options);
        figures.set("verdicts", verdicts);
        figures.set("mode_switches", switches);
        figures.set("modes", analysis::modes(recording));
        figures
    }

    fn plots(&self, recording: &Recording, page: &mut Page) {
        page.overview(recording);
    }
}
