//! A short drive through every mode and up to the highest speed, for `cargo xtask timing`, which logs every instruction of the
//! interrupts: the emulator takes ten seconds for a second of the run.

use super::line;
use super::prelude::*;
use super::scaled::{of_rated_rpm, ramp_scale};
use crate::bench::LinePlan;
use crate::inject::Injection;
use crate::inject::sensor::CurrentFault;
use crate::inject::traction::Kind;
use crate::options::not_negative;
use tractive::machine::Ratings;
use tractive::operator::Request;

/// Full torque at a speed in the middle of each mode's range, then at `--to`.
#[derive(Clone, Copy, Debug, Args, Serialize)]
pub struct Timing {
    /// Brake instead of pulling.
    #[arg(long)]
    brake: bool,
    /// Share of the full torque.
    #[arg(long, default_value_t = 1.0, value_parser = finite, allow_negative_numbers = true)]
    torque_scale: f64,
    /// Last speed, in r/min; default the machine's rated one.
    #[arg(long, value_parser = finite, allow_negative_numbers = true)]
    to: Option<f64>,
    /// Time from which the demand is not finite, in s.
    #[arg(long, value_parser = not_negative, allow_negative_numbers = true)]
    fault_at: Option<f64>,
    /// Time from which control is given the same currents again and again, in s.
    #[arg(long, value_parser = not_negative, allow_negative_numbers = true)]
    freeze_at: Option<f64>,
    /// Time from which a current sensor reads too much, in s.
    #[arg(long, value_parser = not_negative, allow_negative_numbers = true)]
    offset_at: Option<f64>,
    /// The operator commands the drive, and the speeds come later by the time that this takes.
    #[arg(long)]
    operated: bool,
}

/// Speeds where async, sync 15, sync 12, middle 7, middle 3 and square are used, in r/min.
const SPEEDS_RPM: [f64; 6] = [150.0, 750.0, 1000.0, 1450.0, 1800.0, 2200.0];
const TO_RPM: f64 = 2000.0;
/// Times from one speed to the next, to the last one, and at each speed, in s. A quicker ramp would count as a lost angle.
const RAMP_S: f64 = 0.03;
const LAST_RAMP_S: f64 = 0.16;
const HOLD_S: f64 = 0.03;
/// Rest of the run after the fault, in s.
const AFTER_FAULT_S: f64 = 0.005;
const LEAD_S: f64 = 0.01;
/// Offset that `--offset-at` adds to a phase current, as a share of the largest: more than the phases' sum is allowed to be.
const OFFSET: f64 = 0.2;

/// Times at which the operator charges, enables and wants all the torque, in s, and at which the speeds begin.
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

impl Scenario<Traction> for Timing {
    fn plan(&self, options: &Options, machine: &Machine) -> Plan {
        let to_rpm = self.to.unwrap_or(of_rated_rpm(TO_RPM, machine));
        let turn = to_rpm.signum();
        let (mut speed, mut t_s) = (Vec::new(), if self.operated { OPERATED_S } else { 0.0 });
        let (ramp_s, last_ramp_s) = (RAMP_S * ramp_scale(machine), LAST_RAMP_S * ramp_scale(machine));
        for rpm in SPEEDS_RPM.map(|rpm| of_rated_rpm(rpm, machine)) {
            speed.extend([(t_s, rpm * turn), (t_s + HOLD_S, rpm * turn)]);
            t_s += HOLD_S + ramp_s;
        }
        t_s += last_ramp_s - ramp_s;
        speed.extend([(t_s, to_rpm), (t_s + HOLD_S, to_rpm)]);
        t_s += HOLD_S + ramp_s;
        let direction = if self.brake { -turn } else { turn };
        let torque_nm = (machine.folder.parameters.max_torque_nm * self.torque_scale * direction) as f32;
        let fault_s = self.fault_at.unwrap_or(f64::INFINITY);
        let operator = move |t_s: f64| {
            let torque_nm = if t_s < 0.0 { 0.0 } else { torque_nm };
            (
                Demand { torque_nm: if t_s < fault_s { torque_nm } else { f32::NAN }, slew_limited: false },
                true,
            )
        };
        let freeze_s = self.freeze_at.unwrap_or(f64::INFINITY);
        let duration_s = t_s.min(fault_s.min(freeze_s) + AFTER_FAULT_S);
        Plan {
            line: self.operated.then(|| self.line(options, machine)),
            freeze_at_s: self.freeze_at,
            injection: self.offset_at.map(|at_s| {
                let fault = CurrentFault::Offset(OFFSET * machine.folder.parameters.max_current_a);
                Injection { kind: Kind::Current(0, fault), at_s }
            }),
            ..Plan::driven(LEAD_S, duration_s, speed, operator)
        }
    }

    fn plots(&self, recording: &Recording, _: &Options, _: &Machine, page: &mut Page) {
        page.overview(recording);
    }
}

impl Timing {
    fn line(&self, options: &Options, machine: &Machine) -> LinePlan {
        let ratings = &machine.tables.ratings;
        let torque_nm = if self.brake { -ratings.max_torque_nm } else { ratings.max_torque_nm };
        let commander = Box::new(move |t_s| request(t_s, torque_nm, ratings));
        LinePlan { starts_charged: true, ..LinePlan::new(line::fed(options, machine), commander) }
    }
}
