//! Full torque in one step, and back.

use super::load_steps::verdicts;
use super::script::{BEGIN_S, Script};
use super::{Plan, Scenario};
use crate::analysis::{self, Figures};
use crate::machine::Machine;
use crate::options::RunOptions;
use crate::report::Page;
use crate::trace::Recording;

/// 0 → full torque → 0 at `--speed`.
pub struct FullStep;

const SPEED_RPM: f64 = 200.0;
const HOLD_S: f64 = 0.1;

impl Scenario for FullStep {
    fn name(&self) -> &'static str {
        "full-step"
    }

    fn figure(&self) -> &'static str {
        "figure 8: load steps, here all of them in one"
    }

    fn own_options(&self) -> &'static [&'static str] {
        &["speed"]
    }

    fn plan(&self, options: &RunOptions, machine: &Machine) -> Plan {
        let speed_rpm = options.speed.unwrap_or(SPEED_RPM);
        Script {
            speed: vec![(0.0, speed_rpm)],
            torque: vec![(BEGIN_S, machine.envelope_nm(speed_rpm)), (BEGIN_S + HOLD_S, 0.0)],
            duration_s: BEGIN_S + 2.0 * HOLD_S,
            ..Script::default()
        }
        .plan()
    }

    fn figures(&self, recording: &Recording, options: &RunOptions, machine: &Machine) -> Figures {
        let most = machine.envelope_nm(options.speed.unwrap_or(SPEED_RPM));
        let steps = [(BEGIN_S, 0.0, most), (BEGIN_S + HOLD_S, most, 0.0)].map(|(at_s, from_nm, to_nm)| {
            let step = analysis::Step { at_s, from_nm, to_nm, until_s: at_s + HOLD_S };
            analysis::step_response(recording, &step)
        });
        let mut figures = analysis::common(recording);
        // Where pulses are few the demand has a slew limit: there is no step to judge.
        let carrier = recording.rows.iter().all(|row| row.mode.is_carrier());
        if carrier {
            figures.set("verdicts", verdicts(&steps, options));
        }
        figures.set("steps", steps);
        figures
    }

    fn plots(&self, recording: &Recording, page: &mut Page) {
        page.phase_current(recording);
        page.torque(recording);
    }
}
