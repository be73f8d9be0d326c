//! A short drive through every mode and up to the highest speed, for `cargo xtask timing`: every instruction of the
//! interrupts is logged there, so a second of it takes the emulator ten.

use super::{Plan, Scenario, line};
use crate::bench::LinePlan;
use crate::machine::Machine;
use crate::options::RunOptions;
use tractive::control::Demand;
use tractive::machine::Ratings;
use tractive::operator::Request;

/// Full torque at a speed in the middle of each mode's range, then at `--to`.
pub struct Timing;

/// Speeds where async, sync 15, sync 12, middle 7, middle 3 and square are used, in r/min.
const SPEEDS_RPM: [f64; 6] = [150.0, 750.0, 1000.0, 1450.0, 1800.0, 2200.0];
/// From one speed to the next, to the last one, and at each, in s. A quicker ramp would count as a lost angle.
const RAMP_S: f64 = 0.03;
const LAST_RAMP_S: f64 = 0.16;
const HOLD_S: f64 = 0.03;
/// What is left of the run behind the fault, in s.
const AFTER_FAULT_S: f64 = 0.005;
const LEAD_S: f64 = 0.01;

/// When the operator charges, enables and wants all the torque, in s, and when the speeds begin.
const CHARGES_S: (f64, f64) = (0.1, 0.2);
const ENABLES_S: f64 = 0.5;
const PULLS_S: f64 = 0.6;
const OPERATED_S: f64 = 0.7;

fn request(t_s: f64, torque_nm: f32, ratings: &Ratings) -> Request {
    Request {
        enable: t_s >= ENABLES_S,
        charge: (CHARGES_S.0..CHARGES_S.1).contains(&t_s),
        torque_nm: if t_s < PULLS_S { 0.0 } else { torque_nm },
        ..Request::idle(ratings)
    }
}

impl Scenario for Timing {
    fn name(&self) -> &'static str {
        "timing"
    }

    fn figure(&self) -> &'static str {
        "no figure: every mode in half a second, for `cargo xtask timing`"
    }

    fn own_options(&self) -> &'static [&'static str] {
        &["brake", "torque_scale", "to", "fault_at", "freeze_at", "offset_at", "operated"]
    }

    fn plan(&self, options: &RunOptions, machine: &Machine) -> Plan {
        let turn = options.to.signum();
        let (mut speed, mut t_s) = (Vec::new(), if options.operated { OPERATED_S } else { 0.0 });
        for rpm in SPEEDS_RPM {
            speed.extend([(t_s, rpm * turn), (t_s + HOLD_S, rpm * turn)]);
            t_s += HOLD_S + RAMP_S;
        }
        t_s += LAST_RAMP_S - RAMP_S;
        speed.extend([(t_s, options.to), (t_s + HOLD_S, options.to)]);
        t_s += HOLD_S + RAMP_S;
        let direction = if options.brake { -turn } else { turn };
        let torque_nm = (machine.folder.parameters.max_torque_nm * options.torque_scale * direction) as f32;
        let fault_s = options.fault_at.unwrap_or(f64::INFINITY);
        let operator = move |t_s: f64| {
            let torque_nm = if t_s < 0.0 { 0.0 } else { torque_nm };
            (
                Demand { torque_nm: if t_s < fault_s { torque_nm } else { f32::NAN }, slew_limited: false },
                true,
            )
        };
        let freeze_s = options.freeze_at.unwrap_or(f64::INFINITY);
        let duration_s = t_s.min(fault_s.min(freeze_s) + AFTER_FAULT_S);
        Plan { lead_s: LEAD_S, duration_s, speed, link: Vec::new(), operator: Box::new(operator) }
    }

    fn line(&self, options: &RunOptions, machine: &Machine) -> Option<LinePlan> {
        let ratings = &machine.tables.ratings;
        let torque_nm = if options.brake { -ratings.max_torque_nm } else { ratings.max_torque_nm };
        options.operated.then(|| LinePlan {
            link: line::scaled(machine),
            starts_charged: true,
            commander: Box::new(move |t_s| request(t_s, torque_nm, ratings)),
            hardware: Vec::new(),
            chopper_ohm: Vec::new(),
            reversible: Vec::new(),
        })
    }
}
