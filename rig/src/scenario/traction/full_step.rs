//! Full torque in one step, and back.

use super::load_steps::verdicts;
use super::prelude::*;
use super::scaled::{carrier_step_s, of_rated_rpm};
use super::script::{BEGIN_S, Script};

/// 0 → full torque → 0 at `--speed`.
#[derive(Clone, Copy, Debug, Args, Serialize)]
pub struct FullStep {
    /// Speed, in r/min.
    #[arg(long, value_parser = finite, allow_negative_numbers = true)]
    speed: Option<f64>,
}

const SPEED_RPM: f64 = 200.0;
const HOLD_S: f64 = 0.1;

impl Scenario<Traction> for FullStep {
    fn plan(&self, _options: &Options, machine: &Machine) -> Plan {
        let speed_rpm = self.speed_rpm(machine);
        let script = Script {
            speed: vec![(0.0, speed_rpm)],
            torque: vec![(BEGIN_S, machine.envelope_nm(speed_rpm)), (BEGIN_S + HOLD_S, 0.0)],
            duration_s: BEGIN_S + 2.0 * HOLD_S,
            ..Script::default()
        };
        Plan { judged_step_s: carrier_step_s(machine), ..script.plan() }
    }

    fn figures(&self, recording: &Recording, options: &Options, machine: &Machine) -> Figures {
        let most = machine.envelope_nm(self.speed_rpm(machine));
        let carrier_s = machine.folder.parameters.max_switching_hz.recip();
        let steps = [(BEGIN_S, 0.0, most), (BEGIN_S + HOLD_S, most, 0.0)].map(|(at_s, from_nm, to_nm)| {
            let step = analysis::Step { at_s, from_nm, to_nm, until_s: at_s + HOLD_S, carrier_s };
            analysis::step_response(recording, &step)
        });
        let mut figures = analysis::common(recording);
        // With few pulses the demand has a slew limit: there is no step to judge.
        let carrier = recording.rows.iter().all(|row| row.mode.is_carrier());
        if carrier {
            figures.set("verdicts", verdicts(&steps, options, machine));
        }
        figures.set("steps", steps);
        figures
    }

    fn plots(&self, recording: &Recording, _: &Options, _: &Machine, page: &mut Page) {
        page.overview(recording);
        page.zoom("the step", recording, (BEGIN_S - 0.005, BEGIN_S + 0.02));
    }
}

impl FullStep {
    fn speed_rpm(&self, machine: &Machine) -> f64 {
        self.speed.unwrap_or(of_rated_rpm(SPEED_RPM, machine))
    }
}
