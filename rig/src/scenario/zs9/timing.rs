//! A short drive of both motors for `cargo xtask timing`: every instruction of the interrupts is logged there.

use super::prelude::*;

/// Full torque by the speed loops at prescribed speeds: motoring at low and at high speed, then braking from there.
#[derive(Clone, Copy, Debug, Args, Serialize)]
pub struct Timing;

/// The motors turn opposite ways: time in s, r/min. A quicker ramp would count as a lost angle.
const PROFILE: [(f64, f64); 4] = [(0.0, 700.0), (0.01, 700.0), (0.11, 1450.0), (0.14, 1450.0)];
const BRAKES_FROM_S: f64 = 0.125;
const DURATION_S: f64 = 0.14;
const LEAD_S: f64 = 0.03;
/// A speed out of reach, in r/min: the loop asks for all the torque there is.
const FAR_RPM: f64 = 20_000.0;

impl Scenario<Zs9> for Timing {
    fn plan(&self, _options: &Options, _machine: &Machine) -> Plan {
        let operator = |t_s: f64, _: SeenMotors| {
            let towards = if t_s < BRAKES_FROM_S { FAR_RPM } else { -FAR_RPM };
            let wanted = |rpm: f64| MotorDemand::Speed(rad_s(rpm) as f32);
            Orders { demands: [wanted(towards), wanted(-towards)], loads_nm: [0.0; 2], enable: true }
        };
        let turning = |way: f64| {
            let points = PROFILE.iter().map(|(t_s, rpm)| (LEAD_S + t_s, way * rpm));
            SpeedSource::profile(points.collect())
        };
        Plan::driven((LEAD_S, DURATION_S), [turning(1.0), turning(-1.0)], [0.0; 2], operator)
    }

    fn plots(&self, recording: &Recording, _: &Options, _: &Machine, page: &mut Page) {
        figures::phases(page, &recording.rows);
    }
}
