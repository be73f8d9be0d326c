//! Mode borders crossed at constant speed, by torque alone.

use super::script::{BEGIN_S, Script};
use super::{Plan, Scenario};
use crate::analysis::{self, Figures};
use crate::machine::Machine;
use crate::options::RunOptions;
use crate::report::Page;
use crate::trace::Recording;

/// Torque up to the envelope and back at `--speed`, in steps that the slew limit smooths.
pub struct ModeBorders;

const SPEED_RPM: f64 = 1860.0;
const LEVELS: usize = 20;
const LEVEL_S: f64 = 0.1;

impl Scenario for ModeBorders {
    fn name(&self) -> &'static str {
        "mode-borders"
    }

    fn figure(&self) -> &'static str {
        "figure 9: changes of pulse pattern, here at constant speed by torque alone"
    }

    fn plan(&self, options: &RunOptions, machine: &Machine) -> Plan {
        let most = machine.folder.parameters.max_torque_nm;
        let share = |level: usize| 1.0 - (level as f64 / LEVELS as f64 - 1.0).abs();
        let torque = (0..=2 * LEVELS).map(|k| (BEGIN_S + k as f64 * LEVEL_S, most * share(k)));
        Script {
            speed: vec![(0.0, options.speed.unwrap_or(SPEED_RPM))],
            torque: torque.collect(),
            slew_limited: true,
            duration_s: BEGIN_S + (2 * LEVELS + 2) as f64 * LEVEL_S,
            ..Script::default()
        }
        .plan()
    }

    fn figures(&self, recording: &Recording, _options: &RunOptions, _machine: &Machine) -> Figures {
        let mut figures = analysis::common(recording);
        figures.set("mode_switches", analysis::mode_switches(recording));
        figures.set("modes", analysis::modes(recording));
        figures
    }

    fn plots(&self, recording: &Recording, page: &mut Page) {
        page.overview(recording);
    }
}
