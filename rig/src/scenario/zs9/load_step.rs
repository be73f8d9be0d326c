//! Motor 2's load steps while motor 1 carries on: the paper's figures 14 to 19.

use super::prelude::*;
use super::scaled::LOAD_NM;
use crate::options::finite;
use crate::run::CLOCK;
use crate::zs9::settings;

/// Both motors at one speed with a load, on the paper's machine at 1,000 r/min with 60 N·m; motor 2's load steps at 0.6 s.
#[derive(Clone, Copy, Debug, Args, Serialize)]
pub struct LoadStep {
    /// Size of the step of motor 2's load, in N·m; default a third of the machine's largest torque.
    #[arg(long, value_parser = finite, allow_negative_numbers = true)]
    step: Option<f64>,
}

const SPEED_RPM: f64 = 1000.0;
const STEP_NM: f64 = 40.0;
const STEP_S: f64 = 0.6;
const DURATION_S: f64 = 1.2;
const LEAD_S: f64 = 0.6;
/// Time that the speed loops have to settle after each change of load, in s, and the time that they need, in periods of 1/ω₀: a heavy rotor's loop is slow.
const SETTLING_S: f64 = 0.6;
const SETTLING: f64 = 12.0;
/// Inertia for which the speed loops are designed, in kg·m².
pub const INERTIA_KG_M2: f64 = 0.1;

/// Time that a heavy rotor's loops need beyond the usual, in s, before the step of the load and after it.
fn longer_s(options: &Options, machine: &Machine) -> f64 {
    let speed = settings::drive(CLOCK, options.own.carrier_hz, machine.tables).speed;
    (SETTLING / f64::from(speed.natural_rad_s) - SETTLING_S).max(0.0)
}

impl Scenario<Zs9> for LoadStep {
    fn plan(&self, options: &Options, machine: &Machine) -> Plan {
        let longer_s = longer_s(options, machine);
        let (step_nm, speed_rpm) = (self.step_nm(machine), scaled_rpm(SPEED_RPM, machine));
        let whole_nm = scaled_nm(LOAD_NM, machine);
        let operator = move |t_s: f64, _: SeenMotors| {
            // The drive finds the speeds first, then the loads come.
            let load_nm = whole_nm * ramp(t_s, -0.5 - longer_s, -0.4 - longer_s);
            let stepped = if t_s >= STEP_S - 1e-9 { step_nm } else { 0.0 };
            Orders {
                demands: [MotorDemand::Speed(rad_s(speed_rpm) as f32); 2],
                loads_nm: [load_nm, load_nm + stepped],
                enable: true,
            }
        };
        let rotors = free(machine.folder.parameters.rotor_inertia_kg_m2);
        Plan::driven((LEAD_S + longer_s, DURATION_S + longer_s), rotors, [speed_rpm; 2], operator)
    }

    fn figures(&self, recording: &Recording, options: &Options, machine: &Machine) -> Figures {
        let speed_rpm = scaled_rpm(SPEED_RPM, machine);
        let mut figures = figures::common(recording);
        let (steady, after) =
            (figures::window(recording, 0.3, STEP_S), figures::window(recording, STEP_S, f64::INFINITY));
        let speed1 = mean(steady, |row| row.motors[0].speed_rpm);
        let torque1 = mean(steady, |row| row.motors[0].torque_nm);
        let motor1 = |what: &dyn Fn(&Row) -> f64| figures::largest(after, |row| what(row).abs());
        figures.set("motor1_torque_deviation_nm", motor1(&|row| row.motors[0].torque_nm - torque1));
        figures.set("motor1_speed_deviation_rpm", motor1(&|row| row.motors[0].speed_rpm - speed1));
        let off = |row: &Row| (row.motors[1].speed_rpm - speed_rpm).abs();
        figures.set("motor2_speed_deviation_rpm", figures::largest(after, off));
        figures.set("motor2_back_within_0p2_percent_ms", back_ms(after, |row| off(row) > 0.002 * speed_rpm));
        figures.set("motor2_peak_torque_nm", figures::largest(after, |row| row.motors[1].torque_nm));
        figures::link(&mut figures, after, link_v(options, machine));
        figures.set("verdicts", self.verdicts(&figures, options, machine));
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
    /// Size of the step of motor 2's load, in N·m.
    fn step_nm(&self, machine: &Machine) -> f64 {
        self.step.unwrap_or(scaled_nm(STEP_NM, machine))
    }

    /// Bounds for a step of at most a third of the largest torque. Behind a line filter they are those of other machines.
    fn verdicts(&self, figures: &Figures, options: &Options, machine: &Machine) -> Vec<Verdict> {
        let usual_nm = scaled_nm(STEP_NM, machine);
        let is_usual = self.step_nm(machine).abs() <= usual_nm;
        let why = if is_usual {
            String::new()
        } else {
            format!(", not judged for steps beyond {usual_nm:.1} N·m")
        };
        let judged = is_usual && options.own.inject.is_none();
        let at_most = |paper: f64, other: f64| match (judged, options.own.line) {
            (false, _) => f64::INFINITY,
            (true, Some(_)) => other,
            (true, None) => known(machine, paper, other),
        };
        let (moved_nm, moved_rpm) = (scaled_nm(0.6, machine), scaled_rpm(1.0, machine));
        let bounds = [
            ("motor 1's torque moved in N·m", "motor1_torque_deviation_nm", at_most(0.023, moved_nm)),
            ("motor 1's speed moved in r/min", "motor1_speed_deviation_rpm", at_most(0.0011, moved_rpm)),
            ("motor 2 within 0.2 % again in ms", "motor2_back_within_0p2_percent_ms", at_most(36.0, 300.0)),
            ("link voltage off in %", "link_deviation_percent", at_most(0.8, LINK_OFF_PERCENT)),
        ];
        let rows = bounds.map(|(what, name, at_most)| (format!("{what}{why}"), name, at_most));
        let rows = rows.each_ref().map(|(what, name, at_most)| (what.as_str(), *name, *at_most));
        judge(figures, options, machine, &rows)
    }
}

/// Time from the step until the speed is back for good, in ms; none if it never is.
fn back_ms(after: &[Row], is_off: impl Fn(&Row) -> bool) -> Option<f64> {
    let back = after.iter().rposition(is_off).map_or(0, |last_off| last_off + 1);
    after.get(back).map(|row| (row.t_s - STEP_S).max(0.0) * 1e3)
}
