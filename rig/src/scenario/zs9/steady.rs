//! Harmonics in steady state, in which the schemes of the nine-switch modulator differ.

use super::patterns;
use super::prelude::*;
use crate::scenario::System;
use crate::verdict::torque_bound;
use tractive::nine_switch::Scheme;

/// Both motors at prescribed speeds, with 60 N·m each on the paper's machine.
#[derive(Clone, Copy, Debug, Args, Serialize)]
pub struct Steady;

/// Speeds of the upper and the lower motor, in r/min.
pub const SPEEDS_RPM: [f64; 2] = [1000.0, 700.0];
/// Periods of both motors' currents in the same time.
const PERIODS: [f64; 2] = [10.0, 7.0];
const TORQUE_NM: f64 = 60.0;
/// Length of the recording, in s, rounded to whole multiples of that time: with the paper's machine 20 and 14 periods.
const DURATION_S: f64 = 0.3;
/// A coarser step would average ripple away.
const STEP_S: f64 = 1e-6;
const LEAD_S: f64 = 0.5;

/// Periods of both motors' currents in the recording, and its length, in s.
fn periods(machine: &Machine) -> ([f64; 2], f64) {
    let pole_pairs = f64::from(machine.folder.parameters.pole_pairs);
    let frequency_hz = scaled_rpm(SPEEDS_RPM[0], machine) / 60.0 * pole_pairs;
    let times = (DURATION_S * frequency_hz / PERIODS[0]).round().max(1.0);
    (PERIODS.map(|periods| periods * times), PERIODS[0] * times / frequency_hz)
}

impl Scenario<Zs9> for Steady {
    fn trace_step_s(&self, _own: &Zs9Options) -> f64 {
        STEP_S
    }

    fn plan(&self, _options: &Options, machine: &Machine) -> Plan {
        let wanted_nm = scaled_nm(TORQUE_NM, machine);
        let operator = move |t_s: f64, _: SeenMotors| {
            let torque_nm = (wanted_nm * ramp(t_s, -0.45, -0.35)) as f32;
            Orders {
                demands: [MotorDemand::Torque(Demand { torque_nm, slew_limited: true }); 2],
                loads_nm: [0.0; 2],
                enable: true,
            }
        };
        let from_rpm = SPEEDS_RPM.map(|rpm| scaled_rpm(rpm, machine));
        let speeds = from_rpm.map(|rpm| SpeedSource::profile(vec![(0.0, rpm)]));
        let plan = Plan::driven((LEAD_S, periods(machine).1), speeds, from_rpm, operator);
        Plan { judged_step_s: Some(STEP_S), ..plan }
    }

    fn figures(&self, recording: &Recording, options: &Options, machine: &Machine) -> Figures {
        let mut figures = figures::common(recording);
        for (k, name) in ["thd1_percent", "thd2_percent"].into_iter().enumerate() {
            let (cycles, _) = periods(machine);
            let thd_percent = figures::thd_percent(recording, cycles[k], |row| row.motors[k].phases_a[0]);
            figures.set(name, thd_percent);
        }
        let mut off_percent = [0.0; 2];
        for (k, name) in ["torque1_nm", "torque2_nm"].into_iter().enumerate() {
            let torque_nm = mean(&recording.rows, |row| row.motors[k].torque_nm);
            off_percent[k] = (torque_nm / scaled_nm(TORQUE_NM, machine) - 1.0).abs() * 100.0;
            figures.set(name, torque_nm);
        }
        let currents = || recording.rows.iter().map(|row| row.inductor_a);
        let (low, high) = currents().fold((f64::MAX, f64::MIN), |(low, high), i| (low.min(i), high.max(i)));
        figures.set("inductor_ripple_a", high - low);
        figures::link(&mut figures, &recording.rows, link_v(options, machine));
        let torques = torque_verdicts(off_percent, options, machine);
        figures.set("verdicts", [verdicts(&figures, options, machine), torques.to_vec()].concat());
        figures
    }

    fn plots(&self, recording: &Recording, _: &Options, _: &Machine, page: &mut Page) {
        patterns::draw(page);
        figures::phases(page, figures::window(recording, 0.0, 0.05));
        let rows = figures::window(recording, 0.0, 0.001);
        page.plot_rows("inductor current", "A", rows, &INDUCTOR);
    }
}

/// Upper bounds of each scheme at 10 kHz and 667 V: the distortion of the upper and of the lower motor's current in %, and the ripple of the
/// inductors' current in A.
const BOUNDS: [(Scheme, [f64; 3]); 4] = [
    (Scheme::S, [2.11, 1.545, 5.05]),
    (Scheme::Rs, [2.44, 1.97, 10.15]),
    (Scheme::Rthd, [1.812, 1.215, 10.15]),
    (Scheme::Zvo, [2.14, 1.65, 10.15]),
];

/// Largest deviation of the mean torque with flaws, in %.
const FLAWED_PERCENT: f64 = 2.0;

/// Verdicts on the mean torque.
fn torque_verdicts(off_percent: [f64; 2], options: &Options, machine: &Machine) -> [Verdict; 2] {
    let Zs9Options { device_drop, uncompensated, .. } = options.own;
    let ideal = if device_drop.is_some() { FLAWED_PERCENT } else { known(machine, 0.1, 0.5) };
    let at_most = if uncompensated { f64::INFINITY } else { torque_bound(options, ideal, FLAWED_PERCENT) };
    let of = ["upper", "lower"].map(|motor| format!("mean torque of the {motor} motor off in %"));
    [0, 1].map(|k| Verdict::at_most(&of[k], off_percent[k], at_most))
}

/// Verdicts with bounds, if any are known for the machine and the scheme at this carrier and link.
fn verdicts(figures: &Figures, options: &Options, machine: &Machine) -> Vec<Verdict> {
    let Zs9Options { carrier_hz, scheme, .. } = options.own;
    let usual = carrier_hz == 10_000 && link_v(options, machine) == machine.folder.parameters.zs9_link_v;
    let bounds = BOUNDS.iter().find(|(one, _)| *one == scheme && usual);
    let [upper, lower, ripple] =
        bounds.filter(|_| machine.is(Zs9::MACHINE)).map_or([f64::INFINITY; 3], |(_, bounds)| *bounds);
    judge(
        figures,
        options,
        machine,
        &[
            ("current THD of the upper motor in %", "thd1_percent", upper),
            ("current THD of the lower motor in %", "thd2_percent", lower),
            ("inductor current, peak to peak in A", "inductor_ripple_a", ripple),
        ],
    )
}
