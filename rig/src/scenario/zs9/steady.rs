//! Harmonics in steady state: what the schemes of the nine-switch modulator differ in.

use super::prelude::*;
use crate::zs9::patterns;

/// 60 N·m each at prescribed speeds.
#[derive(Clone, Copy, Debug, Args, Serialize)]
pub struct Steady;

/// Speeds of the upper and the lower motor, in r/min: 20 and 14 periods of the currents in 0.3 s.
pub const SPEEDS_RPM: [f64; 2] = [1000.0, 700.0];
const POLE_PAIRS: f64 = 4.0;
const TORQUE_NM: f64 = 60.0;
const DURATION_S: f64 = 0.3;
const LEAD_S: f64 = 0.5;

impl Scenario<Zs9> for Steady {
    fn trace_step_s(&self, _own: &Zs9Options) -> f64 {
        1e-6
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
        Plan::driven((LEAD_S, DURATION_S), speeds, SPEEDS_RPM, operator)
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
        figures
    }

    fn plots(&self, recording: &Recording, _: &Options, _: &Machine, page: &mut Page) {
        patterns::draw(page);
        figures::phases(page, "table 1", figures::window(recording, 0.0, 0.05));
        let rows = figures::window(recording, 0.0, 0.001);
        plot(page, ("table 1", "inductor current", "A"), rows, &INDUCTOR);
    }
}
