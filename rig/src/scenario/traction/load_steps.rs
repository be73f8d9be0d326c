//! Load steps at 200 r/min: the paper's figure 8.

use super::plan::LEAD_S;
use super::prelude::*;
use super::scaled::{carrier_step_s, of_rated_rpm, scaled_nm, time_scale};
use crate::analysis::StepResponse;
use crate::verdict::bound;

/// 0 → 200 → … → 1,235 N·m and back, 100 ms each.
#[derive(Clone, Copy, Debug, Args, Serialize)]
pub struct LoadSteps;

const SPEED_RPM: f64 = 200.0;
const STEP_S: f64 = 0.1;
const LEVELS_NM: [f64; 13] =
    [0.0, 200.0, 400.0, 600.0, 800.0, 1000.0, 1235.0, 1000.0, 800.0, 600.0, 400.0, 200.0, 0.0];

/// The levels as shares of this machine's largest torque.
fn levels_nm(machine: &Machine) -> [f64; 13] {
    LEVELS_NM.map(|level_nm| scaled_nm(level_nm, machine))
}

impl Scenario<Traction> for LoadSteps {
    fn plan(&self, _options: &Options, machine: &Machine) -> Plan {
        let levels_nm = levels_nm(machine);
        let level_nm = move |t_s: f64| {
            let index = (t_s / STEP_S).max(0.0) as usize;
            levels_nm[index.min(levels_nm.len() - 1)]
        };
        let operator =
            move |t_s: f64| (Demand { torque_nm: level_nm(t_s + 1e-9) as f32, slew_limited: false }, true);
        let speed = vec![(0.0, of_rated_rpm(SPEED_RPM, machine))];
        let plan = Plan::driven(LEAD_S, STEP_S * LEVELS_NM.len() as f64, speed, operator);
        Plan { judged_step_s: carrier_step_s(machine), ..plan }
    }

    fn figures(&self, recording: &Recording, options: &Options, machine: &Machine) -> Figures {
        let levels_nm = levels_nm(machine);
        let steps = (1..LEVELS_NM.len()).map(|index| analysis::Step {
            at_s: index as f64 * STEP_S,
            from_nm: levels_nm[index - 1],
            to_nm: levels_nm[index],
            until_s: (index + 1) as f64 * STEP_S,
            carrier_s: machine.folder.parameters.max_switching_hz.recip(),
        });
        let steps: Vec<_> = steps.map(|step| analysis::step_response(recording, &step)).collect();
        let mut figures = analysis::common(recording);
        figures.set("verdicts", verdicts(&steps, options, machine));
        figures.set("steps", steps);
        figures
    }

    fn plots(&self, recording: &Recording, _: &Options, _: &Machine, page: &mut Page) {
        page.overview(recording);
        page.rotor_currents(recording);
        for step in [1.0, 6.0] {
            let at_s = step * STEP_S;
            page.zoom(&format!("the step at {at_s:.1} s"), recording, (at_s - 0.01, at_s + 0.03));
        }
    }
}

/// Bounds of every step. With flaws only the final mean is judged: the effect of noise and ripple on the torque is no
/// part of the step.
pub fn verdicts(steps: &[StepResponse], options: &RunOptions, machine: &Machine) -> Vec<Verdict> {
    let most = |value: fn(&StepResponse) -> f64| worst(steps.iter().map(value));
    // An error of one is 0.3 % of the command (1.5 % with flaws) or 0.16 % of the largest torque, whichever is more.
    let percent = bound(options, 0.3, 1.5);
    let least_nm = scaled_nm(2.0, machine);
    let error = |step: &StepResponse| step.final_error_nm.abs() / (0.01 * percent * step.to_nm).max(least_nm);
    let ideal = |what: &str, value: fn(&StepResponse) -> f64, at_most: f64| {
        Verdict::at_most(what, most(value), bound(options, at_most, f64::INFINITY))
    };
    let scale = time_scale(machine);
    let of_final = format!("final mean over {percent} % or 0.16 % of the largest torque");
    let (error, most_error) = (worst(steps.iter().map(error)), torque_bound(options, 1.0, 1.0));
    vec![
        ideal("t90 in ms", |step| step.t90_ms, 2.5 * scale),
        ideal(
            "overshoot in % of the step, of torque averaged over a carrier",
            |step| step.overshoot_percent,
            2.0,
        ),
        ideal("settled within 2 % in ms", |step| step.settling_2_percent_ms, 5.0 * scale),
        Verdict::at_most(&of_final, error, most_error),
    ]
}
