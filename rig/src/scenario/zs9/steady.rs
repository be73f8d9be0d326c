//! Harmonics in steady state: what the schemes of the nine-switch modulator differ in.

use super::patterns;
use super::prelude::*;
use tractive::nine_switch::Scheme;

/// 60 N·m each at prescribed speeds.
#[derive(Clone, Copy, Debug, Args, Serialize)]
pub struct Steady;

/// Speeds of the upper and the lower motor, in r/min: 20 and 14 periods of the currents in 0.3 s.
pub const SPEEDS_RPM: [f64; 2] = [1000.0, 700.0];
const POLE_PAIRS: f64 = 4.0;
const TORQUE_NM: f64 = 60.0;
const DURATION_S: f64 = 0.3;
/// A coarser step would average ripple away.
const STEP_S: f64 = 1e-6;
const LEAD_S: f64 = 0.5;

impl Scenario<Zs9> for Steady {
    fn trace_step_s(&self, _own: &Zs9Options) -> f64 {
        STEP_S
    }

    fn plan(&self, _options: &Options, _machine: &Machine) -> Plan {
        let operator = |t_s: f64, _: SeenMotors| {
            let torque_nm = (TORQUE_NM * ramp(t_s, -0.45, -0.35)) as f32;
            Orders {
                demands: [MotorDemand::Torque(Demand { torque_nm, slew_limited: true }); 2],
                loads_nm: [0.0; 2],
                enable: true,
            }
        };
        let speeds = SPEEDS_RPM.map(|rpm| SpeedSource::profile(vec![(0.0, rpm)]));
        let plan = Plan::driven((LEAD_S, DURATION_S), speeds, SPEEDS_RPM, operator);
        Plan { judged_step_s: Some(STEP_S), ..plan }
    }

    fn figures(&self, recording: &Recording, options: &Options, _machine: &Machine) -> Figures {
        let mut figures = figures::common(recording);
        for (k, name) in ["thd1_percent", "thd2_percent"].into_iter().enumerate() {
            let cycles = SPEEDS_RPM[k] / 60.0 * POLE_PAIRS * DURATION_S;
            figures
                .set(name, figures::thd_percent(recording, cycles.round(), |row| row.motors[k].phases_a[0]));
        }
        for (k, name) in ["torque1_nm", "torque2_nm"].into_iter().enumerate() {
            figures.set(name, mean(&recording.rows, |row| row.motors[k].torque_nm));
        }
        let currents = || recording.rows.iter().map(|row| row.inductor_a);
        let (low, high) = currents().fold((f64::MAX, f64::MIN), |(low, high), i| (low.min(i), high.max(i)));
        figures.set("inductor_ripple_a", high - low);
        figures::link(&mut figures, &recording.rows, options.own.uin);
        figures.set("verdicts", verdicts(&figures, options));
        figures
    }

    fn plots(&self, recording: &Recording, _: &Options, _: &Machine, page: &mut Page) {
        patterns::draw(page);
        figures::phases(page, figures::window(recording, 0.0, 0.05));
        let rows = figures::window(recording, 0.0, 0.001);
        page.plot_rows("inductor current", "A", rows, &INDUCTOR);
    }
}

/// Of each scheme the distortion of the upper and of the lower motor's current in %, and the ripple of the inductors' current in A, at 10 kHz
/// and 667 V: the most that is allowed.
const BOUNDS: [(Scheme, [f64; 3]); 4] = [
    (Scheme::S, [2.11, 1.545, 5.05]),
    (Scheme::Rs, [2.44, 1.97, 10.15]),
    (Scheme::Rthd, [1.812, 1.215, 10.15]),
    (Scheme::Zvo, [2.14, 1.65, 10.15]),
];

/// Bounds where something is known of the scheme at this carrier and link.
fn verdicts(figures: &Figures, options: &Options) -> Vec<Verdict> {
    let Zs9Options { carrier_hz, uin, scheme, .. } = options.own;
    let known =
        BOUNDS.iter().find(|(one, _)| *one == scheme && (carrier_hz, uin) == (10_000, LEAST_JUDGED_V));
    let [upper, lower, ripple] = known.map_or([f64::INFINITY; 3], |(_, bounds)| *bounds);
    judge(
        figures,
        options,
        &[
            ("current THD of the upper motor in %", "thd1_percent", upper),
            ("current THD of the lower motor in %", "thd2_percent", lower),
            ("inductor current, peak to peak in A", "inductor_ripple_a", ripple),
        ],
    )
}
