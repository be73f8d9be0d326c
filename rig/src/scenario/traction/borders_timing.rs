//! A short drive to and fro across each border between two modes, and in and out of pulses, for `cargo xtask test --only preemption`: it
//! covers the code that control executes only while a mode changes.

use super::prelude::*;
use super::scaled::{of_rated_rpm, ramp_scale};
use super::script::Script;

/// Full torque at speeds that swing across a border, with an enable that comes and goes.
#[derive(Clone, Copy, Debug, Args, Serialize)]
pub struct BordersTiming;

/// Speeds by which the mode has changed on the way down and on the way up at full torque, with a little margin, in r/min.
const SWINGS_RPM: [(f64, f64); 5] =
    [(550.0, 620.0), (835.0, 915.0), (1050.0, 1145.0), (1650.0, 1760.0), (1835.0, 1910.0)];
const SWINGS: usize = 4;
/// Times from one end of a swing to the other, longer than the shortest stay in a mode, and from one border to the next, in s. A quicker
/// ramp would count as a lost angle.
const HALF_SWING_S: f64 = 0.034;
const RAMP_S: f64 = 0.02;
/// Time long enough for control's occasional work, in s; then the enable goes and comes. It comes once in nine halves of the asynchronous
/// carrier, so always as shortly before a boundary as the first time here.
const FIRST_S: f64 = 0.0403;
const PAUSES: usize = 24;
const PAUSE_S: f64 = 0.0025;

impl Scenario<Traction> for BordersTiming {
    fn plan(&self, _options: &Options, machine: &Machine) -> Plan {
        let swings = SWINGS_RPM.map(|(low, high)| (of_rated_rpm(low, machine), of_rated_rpm(high, machine)));
        let (half_swing_s, ramp_s) = (HALF_SWING_S * ramp_scale(machine), RAMP_S * ramp_scale(machine));
        let (first_rpm, _) = swings[0];
        let mut speed = vec![(0.0, first_rpm)];
        let enable = (0..2 * PAUSES).map(|k| (FIRST_S + k as f64 * PAUSE_S, k % 2 == 1)).collect();
        let mut t_s = FIRST_S + 2.0 * PAUSES as f64 * PAUSE_S;
        for (low_rpm, high_rpm) in swings {
            for swing in 0..SWINGS {
                let swing_s = t_s + 2.0 * swing as f64 * half_swing_s;
                speed.extend([(swing_s, low_rpm), (swing_s + half_swing_s, high_rpm)]);
            }
            t_s += (2 * SWINGS - 1) as f64 * half_swing_s + ramp_s;
        }
        let torque_nm = machine.folder.parameters.max_torque_nm;
        Script {
            speed,
            torque: vec![(0.0, torque_nm)],
            enable,
            duration_s: t_s - ramp_s,
            ..Script::default()
        }
        .plan()
    }

    fn plots(&self, recording: &Recording, _: &Options, _: &Machine, page: &mut Page) {
        page.overview(recording);
    }
}
