//! Motor 2's load steps while motor 1 goes on: the paper's figures 14 to 19.

use super::prelude::*;
use crate::options::number;

/// Both at 1,000 r/min with 60 N·m; motor 2's load steps at 0.6 s.
#[derive(Clone, Copy, Debug, Args, Serialize)]
pub struct LoadStep {
    /// By how much motor 2's load steps, in N·m, −500 to 500.
    #[arg(long, default_value_t = 40.0, value_parser = load_step, allow_negative_numbers = true)]
    step: f64,
}

const SPEED_RPM: f64 = 1000.0;
const LOAD_NM: f64 = 60.0;
const STEP_S: f64 = 0.6;
const DURATION_S: f64 = 1.2;
const LEAD_S: f64 = 0.6;
/// Inertia of either motor, in kg·m².
pub const INERTIA_KG_M2: f64 = 0.1;

impl Scenario<Zs9> for LoadStep {
    fn plan(&self, _options: &Options, _machine: &Machine) -> Plan {
        let step_nm = self.step;
        let operator = move |t_s: f64, _: SeenMotors| {
            // The drive finds the speeds first; then the loads come.
            let load_nm = LOAD_NM * ramp(t_s, -0.5, -0.4);
            let stepped = if t_s >= STEP_S - 1e-9 { step_nm } else { 0.0 };
            Orders {
                demands: [MotorDemand::Speed(rad_s(SPEED_RPM) as f32); 2],
                loads_nm: [load_nm, load_nm + stepped],
                enable: true,
            }
        };
        Plan::driven((LEAD_S, DURATION_S), free(INERTIA_KG_M2), [SPEED_RPM; 2], operator)
    }

    fn figures(&self, recording: &Recording, options: &Options, _machine: &Machine) -> Figures {
        let mut figures = figures::common(recording);
        let (steady, after) =
            (figures::window(recording, 0.3, STEP_S), figures::window(recording, STEP_S, DURATION_S));
        let speed1 = mean(steady, |row| row.motors[0].speed_rpm);
        let torque1 = mean(steady, |row| row.motors[0].torque_nm);
        let motor1 = |what: &dyn Fn(&Row) -> f64| figures::largest(after, |row| what(row).abs());
        figures.set("motor1_torque_deviation_nm", motor1(&|row| row.motors[0].torque_nm - torque1));
        figures.set("motor1_speed_deviation_rpm", motor1(&|row| row.motors[0].speed_rpm - speed1));
        let off = |row: &Row| (row.motors[1].speed_rpm - SPEED_RPM).abs();
        figures.set("motor2_speed_deviation_rpm", figures::largest(after, off));
        let outside = after.iter().rev().find(|row| off(row) > 0.002 * SPEED_RPM);
        let step_s = figures::step_s(recording);
        let back_s = outside.map_or(0.0, |row| row.t_s + step_s - STEP_S);
        figures.set("motor2_back_within_0p2_percent_ms", back_s * 1e3);
        figures.set("motor2_peak_torque_nm", figures::largest(after, |row| row.motors[1].torque_nm));
        figures::link(&mut figures, after, options.own.uin);
        figures.set("verdicts", self.verdicts(&figures, options));
        figures
    }

    fn plots(&self, recording: &Recording, _: &Options, _: &Machine, page: &mut Page) {
        page.mark(STEP_S, "motor 2's load steps", false);
        let rows = figures::window(recording, STEP_S - 0.1, STEP_S + 0.2);
        plot(page, ("figures 14 to 19", "link voltage", "V"), rows, &VOLTAGES[..1]);
        plot(page, ("figures 14 to 19", "capacitor voltage", "V"), rows, &VOLTAGES[1..]);
        plot(page, ("figures 14 to 19", "inductor current", "A"), rows, &INDUCTOR);
        let [one, two] = TORQUES;
        let torques = [one, two, ("load 2", |row| row.motors[1].load_nm)];
        plot(page, ("figures 14 to 19", "torque", "N·m"), rows, &torques);
        plot(page, ("figure 17", "speed of motor 2", "r/min"), rows, &SPEEDS[1..]);
        plot(page, ("figures 14 to 19", "speed of motor 1", "r/min"), rows, &SPEEDS[..1]);
        figures::phases(page, figures::window(recording, STEP_S - 0.03, STEP_S + 0.05));
    }
}

impl LoadStep {
    /// Bounds for a step of at most 40 N·m.
    fn verdicts(&self, figures: &Figures, options: &Options) -> Vec<Verdict> {
        let judged = self.step.abs() <= 40.0 && options.own.inject.is_none();
        let at_most = |bound: f64| if judged { bound } else { f64::INFINITY };
        judge(
            figures,
            options,
            &[
                ("motor 1's torque moved in N·m", "motor1_torque_deviation_nm", at_most(0.023)),
                ("motor 1's speed moved in r/min", "motor1_speed_deviation_rpm", at_most(0.0011)),
                ("motor 2 within 0.2 % again in ms", "motor2_back_within_0p2_percent_ms", at_most(36.0)),
                ("link voltage off in %", "link_deviation_percent", at_most(0.8)),
            ],
        )
    }
}

fn load_step(text: &str) -> Result<f64, String> {
    number(text, "a number from -500 to 500", |step| step.abs() <= 500.0)
}
