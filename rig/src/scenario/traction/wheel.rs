//! A wheel that loses its grip for a while, motoring and braking: torque is reduced and comes back, without a fault.

use super::line;
use super::prelude::*;
use super::scaled::of_rated_rpm;
use crate::bench::LinePlan;
use crate::options::positive;
use crate::plant::{SpeedSource, Wheel as Rail};
use core::f64::consts::TAU;
use tractive::machine::Ratings;
use tractive::operator::{Request, TrainLimits};

/// See the module.
#[derive(Clone, Copy, Debug, Args, Serialize)]
pub struct Wheel {
    /// Acceleration limit, in r/min per s; default twice the train's acceleration at 70 % of the largest torque; 1e9: none.
    #[arg(long, value_parser = positive, allow_negative_numbers = true, value_name = "RPM_S")]
    acceleration_limit: Option<f64>,
}

/// Times of motoring and braking, in s, and their share of the largest torque.
const MOTORS: (f64, f64) = (1.3, 4.0);
const BRAKES: (f64, f64) = (4.4, 7.1);
const SHARE: f64 = 0.7;
/// Times of bad rail, in s, and its share of the dry rail's grip.
const BAD: [(f64, f64); 2] = [(1.8, 2.3), (4.9, 5.4)];
const BAD_SHARE: f64 = 0.15;
/// Ratio of a dry rail's grip to the largest torque.
const DRY: f64 = 1.4;
/// Time within which all torque has to be back on the dry rail, in s.
const BACK_S: f64 = 1.5;
const DURATION_S: f64 = 7.4;
/// Speed at the beginning, in r/min, and times in which the largest torque would bring the rotor alone, and the train, to it, in s.
const BEGINS_RPM: f64 = 1_000.0;
const ROTOR_S: f64 = 0.3;
const TRAIN_S: f64 = 8.0;
/// Time over which the speed's rise is taken, in s.
const RISE_S: f64 = 0.1;

impl Wheel {
    fn train(&self, machine: &Machine) -> TrainLimits {
        let usual_rpm_s = 2.0 * SHARE * of_rated_rpm(BEGINS_RPM, machine) / TRAIN_S;
        let limit_rpm_s = self.acceleration_limit.unwrap_or(usual_rpm_s);
        TrainLimits { acceleration_rad_s2: (limit_rpm_s * TAU / 60.0) as f32, ..TrainLimits::NONE }
    }
}

fn rail(machine: &Machine) -> Rail {
    let most_nm = machine.folder.parameters.max_torque_nm;
    let train_rad_s = of_rated_rpm(BEGINS_RPM, machine) * TAU / 60.0;
    Rail {
        inertia_kg_m2: most_nm * ROTOR_S / train_rad_s,
        train_kg_m2: most_nm * TRAIN_S / train_rad_s,
        most_nm: DRY * most_nm,
        bad: BAD.map(|(from, until)| (from, until, BAD_SHARE)).to_vec(),
        train_rad_s,
    }
}

fn request(t_s: f64, ratings: &Ratings) -> Request {
    let share = if line::within(&[MOTORS], t_s) {
        SHARE
    } else if line::within(&[BRAKES], t_s) {
        -SHARE
    } else {
        0.0
    };
    Request {
        enable: t_s >= 1.0,
        charge: t_s >= 0.1,
        torque_nm: share as f32 * ratings.max_torque_nm,
        ..Request::idle(ratings)
    }
}

/// A stretch of bad rail.
#[derive(Clone, Debug, Serialize)]
struct Stretch {
    at_s: f64,
    /// Largest change of speed within [`RISE_S`] while the rail is bad, relative to the speed before.
    rise_share: f64,
    /// Largest difference between the wheel's speed and the train's speed before, relative to the latter.
    slip_share: f64,
    /// Least torque, as a share of the torque before.
    least_share: f64,
    /// Torque [`BACK_S`] after the rail is dry, as a share of the torque before.
    back_share: f64,
}

fn stretch(recording: &Recording, (from, until): (f64, f64)) -> Stretch {
    let before = analysis::window(recording, from - 0.1, from);
    let (speed, torque) = (mean(before, |row| row.speed_rpm), mean(before, |row| row.te_nm));
    let slips = analysis::window(recording, from, until + BACK_S);
    let later = (RISE_S / (slips[1].t_s - slips[0].t_s)).round() as usize;
    let rises = slips.iter().zip(slips.iter().skip(later)).map(|(a, b)| (b.speed_rpm - a.speed_rpm).abs());
    let told = |row: &Row| row.status.map_or(f64::NAN, |status| f64::from(status.torque_nm) / torque);
    let back = analysis::window(recording, until + BACK_S, until + BACK_S + 0.1);
    Stretch {
        at_s: from,
        rise_share: worst(rises).unwrap_or(f64::NAN) / speed,
        slip_share: worst(slips.iter().map(|row| (row.speed_rpm - speed).abs())).unwrap_or(f64::NAN) / speed,
        least_share: -worst(slips.iter().map(|row| -told(row))).unwrap_or(f64::NAN),
        back_share: mean(back, |row| row.te_nm) / torque,
    }
}

impl Scenario<Traction> for Wheel {
    fn plan(&self, options: &Options, machine: &Machine) -> Plan {
        let ratings = &machine.tables.ratings;
        let mut link = line::fed(options, machine);
        link.source.reversible = true;
        let line =
            LinePlan { starts_charged: true, ..LinePlan::new(link, Box::new(|t_s| request(t_s, ratings))) };
        Plan {
            train: self.train(machine),
            speed: SpeedSource::Wheel(rail(machine)),
            ..Plan::operated(DURATION_S, Vec::new(), line)
        }
    }

    fn figures(&self, recording: &Recording, _: &Options, _machine: &Machine) -> Figures {
        let mut figures = analysis::common(recording);
        let stretches = BAD.map(|bad| stretch(recording, bad));
        let of = |share: fn(&Stretch) -> f64| worst(stretches.iter().map(share));
        let mut verdicts = line::verdicts(recording, &[]);
        verdicts.extend([
            Verdict::never("drive tripped", recording.trip().is_some()),
            Verdict::at_most("change of speed in 0.1 s (share)", of(|bad| bad.rise_share), 0.15),
            Verdict::at_most(
                "wheel's speed away from the train's before (share)",
                of(|bad| bad.slip_share),
                0.3,
            ),
            Verdict::at_most("least torque while the wheel slips (share)", of(|bad| bad.least_share), 0.5),
            Verdict::at_most("torque missing after it (share)", of(|bad| 1.0 - bad.back_share), 0.02),
        ]);
        line::figures(&mut figures, recording);
        figures.set("stretches", stretches.to_vec());
        figures.set("verdicts", verdicts);
        figures
    }

    fn plots(&self, recording: &Recording, _: &Options, _: &Machine, page: &mut Page) {
        line::plots(page, recording);
    }
}
