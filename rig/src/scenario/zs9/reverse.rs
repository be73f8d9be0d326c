//! The motors turn in opposite directions: the paper's figures 20 to 23.

use super::prelude::*;

/// Both motors at one speed, 800 r/min on the paper's machine; motor 2 goes to the same speed backwards from 0.5 s to 1.5 s.
#[derive(Clone, Copy, Debug, Args, Serialize)]
pub struct Reverse {
    /// Motor 2 keeps its direction, for comparison.
    #[arg(long)]
    no_reverse: bool,
}

const SPEED_RPM: f64 = 800.0;
/// Load at that speed, in N·m; it is proportional to the speed, sign included.
const LOAD_NM: f64 = 20.0;
const BEGINS_S: f64 = 0.5;
/// Time for the reversal, and time after it, in s.
const REVERSES_S: f64 = 1.0;
const AFTER_S: f64 = 0.5;
/// Share of the largest torque that may be used to reverse the rotor.
const TURNING_SHARE: f64 = 0.5;
const LEAD_S: f64 = 0.6;

/// The speed in r/min, and the time at which motor 2 has reversed, in s: later if its rotor is too heavy for the usual time.
fn measures(machine: &Machine) -> (f64, f64) {
    let parameters = &machine.folder.parameters;
    let speed_rpm = scaled_rpm(SPEED_RPM, machine);
    let turning_nm = TURNING_SHARE * parameters.max_torque_nm;
    let least_s = 2.0 * rad_s(speed_rpm) * parameters.rotor_inertia_kg_m2 / turning_nm;
    (speed_rpm, BEGINS_S + least_s.max(REVERSES_S))
}

fn wanted_rpm(t_s: f64, reverses: bool, (speed_rpm, ends_s): (f64, f64)) -> [f64; 2] {
    let turned = if reverses { 2.0 * ramp(t_s, BEGINS_S, ends_s) } else { 0.0 };
    [speed_rpm, speed_rpm * (1.0 - turned)]
}

impl Scenario<Zs9> for Reverse {
    fn plan(&self, _options: &Options, machine: &Machine) -> Plan {
        let reverses = !self.no_reverse;
        let (measures, whole_nm) = (measures(machine), scaled_nm(LOAD_NM, machine));
        let (speed_rpm, ends_s) = measures;
        let operator = move |t_s: f64, speeds: SeenMotors| {
            let loaded = ramp(t_s, -0.5, -0.4);
            Orders {
                demands: wanted_rpm(t_s, reverses, measures).map(|rpm| MotorDemand::Speed(rad_s(rpm) as f32)),
                loads_nm: speeds.map(|rpm| loaded * whole_nm * rpm / speed_rpm),
                enable: true,
            }
        };
        let rotors = free(machine.folder.parameters.rotor_inertia_kg_m2);
        Plan::driven((LEAD_S, ends_s + AFTER_S), rotors, [speed_rpm; 2], operator)
    }

    fn figures(&self, recording: &Recording, options: &Options, machine: &Machine) -> Figures {
        let mut figures = figures::common(recording);
        let reverses = !self.no_reverse;
        let measures = measures(machine);
        let half_s = 0.5 * figures::step_s(recording);
        let error = |k: usize| {
            let off = |row: &Row| {
                let wanted = wanted_rpm(row.t_s + half_s, reverses, measures)[k];
                (row.motors[k].speed_rpm - wanted).powi(2)
            };
            mean(&recording.rows, off).sqrt()
        };
        figures.set("motor1_speed_error_rms_rpm", error(0));
        figures.set("motor2_speed_error_rms_rpm", error(1));
        let end_s = measures.1 + AFTER_S;
        let last = figures::window(recording, end_s - 0.1, end_s);
        figures.set("motor1_speed_rpm", mean(last, |row| row.motors[0].speed_rpm));
        figures.set("motor2_speed_rpm", mean(last, |row| row.motors[1].speed_rpm));
        figures::link(&mut figures, &recording.rows, link_v(options, machine));
        let off_rpm = scaled_rpm(1.0, machine);
        let bounds = [
            (
                "motor 1's speed off, rms in r/min",
                "motor1_speed_error_rms_rpm",
                known(machine, 0.001, off_rpm),
            ),
            (
                "motor 2's speed off, rms in r/min",
                "motor2_speed_error_rms_rpm",
                known(machine, 1.6, 8.0 * off_rpm),
            ),
            ("link voltage off in %", "link_deviation_percent", known(machine, 0.5, LINK_OFF_PERCENT)),
        ];
        figures.set("verdicts", judge(&figures, options, machine, &bounds));
        figures
    }

    fn plots(&self, recording: &Recording, _: &Options, machine: &Machine, page: &mut Page) {
        page.mark(BEGINS_S, "motor 2 reverses", false);
        let (_, ends_s) = measures(machine);
        page.mark(ends_s, "it is there", false);
        let rows = figures::window(recording, 0.0, ends_s + AFTER_S);
        plot(page, ("figures 20 to 23", "torque of motor 1", "N·m"), rows, &TORQUES[..1]);
        plot(page, ("figures 20 to 23", "speed of motor 1", "r/min"), rows, &SPEEDS[..1]);
        plot(page, ("figures 20 to 23", "torque of motor 2", "N·m"), rows, &TORQUES[1..]);
        plot(page, ("figure 23", "speed of motor 2", "r/min"), rows, &SPEEDS[1..]);
        plot(page, ("figures 20 to 23", "link voltage", "V"), rows, &VOLTAGES[..1]);
        plot(page, ("figures 20 to 23", "capacitor voltage", "V"), rows, &VOLTAGES[1..]);
        figures::phases(
            page,
            figures::window(recording, 0.5 * (BEGINS_S + ends_s) - 0.05, 0.5 * (BEGINS_S + ends_s) + 0.05),
        );
    }
}
