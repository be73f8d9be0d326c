//! The motors turn opposite ways: the paper's figures 20 to 23.

use super::prelude::*;

/// Both at 800 r/min; motor 2 goes to −800 r/min from 0.5 s to 1.5 s.
#[derive(Clone, Copy, Debug, Args, Serialize)]
pub struct Reverse {
    /// Motor 2 keeps its direction, for comparison.
    #[arg(long)]
    no_reverse: bool,
}

const SPEED_RPM: f64 = 800.0;
/// Load at that speed, in N·m; it goes with the speed and its sign.
const LOAD_NM: f64 = 20.0;
const BEGINS_S: f64 = 0.5;
const ENDS_S: f64 = 1.5;
const DURATION_S: f64 = 2.0;
const LEAD_S: f64 = 0.6;

fn wanted_rpm(t_s: f64, reverses: bool) -> [f64; 2] {
    let turned = if reverses { 2.0 * ramp(t_s, BEGINS_S, ENDS_S) } else { 0.0 };
    [SPEED_RPM, SPEED_RPM * (1.0 - turned)]
}

impl Scenario<Zs9> for Reverse {
    fn plan(&self, _options: &Options, _machine: &Machine) -> Plan {
        let reverses = !self.no_reverse;
        let operator = move |t_s: f64, speeds: SeenMotors| {
            let loaded = ramp(t_s, -0.5, -0.4);
            Orders {
                demands: wanted_rpm(t_s, reverses).map(|rpm| MotorDemand::Speed(rad_s(rpm) as f32)),
                loads_nm: speeds.map(|rpm| loaded * LOAD_NM * rpm / SPEED_RPM),
                enable: true,
            }
        };
        Plan::driven((LEAD_S, DURATION_S), free(super::load_step::INERTIA_KG_M2), [SPEED_RPM; 2], operator)
    }

    fn figures(&self, recording: &Recording, options: &Options, _machine: &Machine) -> Figures {
        let mut figures = figures::common(recording);
        let reverses = !self.no_reverse;
        let half_s = 0.5 * figures::step_s(recording);
        let error = |k: usize| {
            let off = |row: &Row| {
                let wanted = wanted_rpm(row.t_s + half_s, reverses)[k];
                (row.motors[k].speed_rpm - wanted).powi(2)
            };
            mean(&recording.rows, off).sqrt()
        };
        figures.set("motor1_speed_error_rms_rpm", error(0));
        figures.set("motor2_speed_error_rms_rpm", error(1));
        let last = figures::window(recording, DURATION_S - 0.1, DURATION_S);
        figures.set("motor1_speed_rpm", mean(last, |row| row.motors[0].speed_rpm));
        figures.set("motor2_speed_rpm", mean(last, |row| row.motors[1].speed_rpm));
        figures::link(&mut figures, &recording.rows, options.own.uin);
        let bounds = [
            ("motor 1's speed off, rms in r/min", "motor1_speed_error_rms_rpm", 0.001),
            ("motor 2's speed off, rms in r/min", "motor2_speed_error_rms_rpm", 1.6),
            ("link voltage off in %", "link_deviation_percent", 0.5),
        ];
        figures.set("verdicts", judge(&figures, options, &bounds));
        figures
    }

    fn plots(&self, recording: &Recording, _: &Options, _: &Machine, page: &mut Page) {
        page.mark(BEGINS_S, "motor 2 reverses", false);
        page.mark(ENDS_S, "it is there", false);
        let rows = figures::window(recording, 0.0, DURATION_S);
        plot(page, ("figures 20 to 23", "torque of motor 1", "N·m"), rows, &TORQUES[..1]);
        plot(page, ("figures 20 to 23", "speed of motor 1", "r/min"), rows, &SPEEDS[..1]);
        plot(page, ("figures 20 to 23", "torque of motor 2", "N·m"), rows, &TORQUES[1..]);
        plot(page, ("figure 23", "speed of motor 2", "r/min"), rows, &SPEEDS[1..]);
        plot(page, ("figures 20 to 23", "link voltage", "V"), rows, &VOLTAGES[..1]);
        plot(page, ("figures 20 to 23", "capacitor voltage", "V"), rows, &VOLTAGES[1..]);
        figures::phases(page, figures::window(recording, 0.95, 1.05));
    }
}
