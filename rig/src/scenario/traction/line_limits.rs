//! Limits of line current and line power: from standstill to two thirds of the largest speed with full torque, and back. The line's current
//! is limited when motoring, its power when braking. The line filter is 3 mH, 4 mF and 30 mΩ unless another one is chosen.

use super::gaps;
use super::line;
use super::prelude::*;
use super::scaled::scaled_rpm;
use super::setup::udc_v;
use crate::bench::LinePlan;
use crate::options::positive;
use crate::verdict::bound;
use tractive::machine::Ratings;
use tractive::operator::{Request, TrainLimits};

/// See the module.
#[derive(Clone, Copy, Debug, Args, Serialize)]
pub struct LineLimits {
    /// Largest line current while motoring, in A; default the current of 60 % of the largest power at the nominal voltage.
    #[arg(long, value_parser = positive, allow_negative_numbers = true, value_name = "A")]
    line_current: Option<f64>,
    /// Largest line power while braking, in kW; default half of the largest power.
    #[arg(long, value_parser = positive, allow_negative_numbers = true, value_name = "KW")]
    line_power: Option<f64>,
}

/// Times of full torque, motoring and braking, and of the speed's rise and fall within them, in s.
const MOTORS: (f64, f64) = (1.3, 4.9);
const BRAKES: (f64, f64) = (5.4, 9.0);
const RISES: (f64, f64) = (1.7, 4.5);
const FALLS: (f64, f64) = (5.6, 8.6);
const DURATION_S: f64 = 9.4;
const FAST_RPM: f64 = 4_000.0;
/// Time over which the line's current is averaged, in s: more than a period of the slowest filter's oscillation.
const MEAN_S: f64 = 0.05;

impl LineLimits {
    fn train(&self, machine: &Machine) -> TrainLimits {
        let parameters = &machine.folder.parameters;
        let usual_a = 0.6 * parameters.max_power_w / parameters.dc_link_nominal_v;
        let braking_w = self.line_power.map_or(0.5 * parameters.max_power_w, |power_kw| 1e3 * power_kw);
        TrainLimits {
            motoring_a: self.line_current.unwrap_or(usual_a) as f32,
            braking_w: braking_w as f32,
            ..TrainLimits::NONE
        }
    }
}

fn request(t_s: f64, ratings: &Ratings) -> Request {
    let share = if line::within(&[MOTORS], t_s) {
        1.0
    } else if line::within(&[BRAKES], t_s) {
        -1.0
    } else {
        0.0
    };
    Request {
        enable: t_s >= 1.0,
        charge: t_s >= 0.1,
        torque_nm: share * ratings.max_torque_nm,
        ..Request::idle(ratings)
    }
}

/// The largest mean of a quantity over [`MEAN_S`] between two times.
fn largest(recording: &Recording, (from, until): (f64, f64), of: impl Fn(&Row) -> f64 + Copy) -> f64 {
    let windows = ((until - from) / MEAN_S) as usize;
    let means = (0..windows).map(|k| {
        let begin_s = from + k as f64 * MEAN_S;
        mean(analysis::window(recording, begin_s, begin_s + MEAN_S), of)
    });
    worst(means).unwrap_or(f64::NAN)
}

/// Share of the line current's limit that is allowed at the source's voltage while motoring.
fn sagged(source_v: f64, machine: &Machine) -> f64 {
    let parameters = &machine.folder.parameters;
    let (full_v, none_v) = (0.9 * parameters.dc_link_nominal_v, parameters.dc_link_min_v);
    ((source_v - none_v) / (full_v - none_v)).clamp(0.0, 1.0)
}

/// The power of full torque on the shaft at the highest speed, in W.
fn shaft_w(machine: &Machine) -> f64 {
    let fast = scaled_rpm(FAST_RPM, machine);
    machine.envelope_nm(fast) * fast * core::f64::consts::TAU / 60.0
}

/// The largest power that full braking returns to the line, in W: the shaft's power less the copper loss of the largest current.
fn most_returned_w(machine: &Machine) -> f64 {
    shaft_w(machine) - largest_copper_w(machine)
}

/// The copper loss of the largest current, in W.
fn largest_copper_w(machine: &Machine) -> f64 {
    let parameters = &machine.folder.parameters;
    1.5 * parameters.stator_resistance_ohm * parameters.max_current_a.powi(2)
}

impl Scenario<Traction> for LineLimits {
    fn plan(&self, options: &Options, machine: &Machine) -> Plan {
        let ratings = &machine.tables.ratings;
        let fast = scaled_rpm(FAST_RPM, machine);
        let speed = vec![(RISES.0, 0.0), (RISES.1, fast), (FALLS.0, fast), (FALLS.1, 0.0)];
        let mut link = gaps::link(machine, udc_v(options, machine));
        link.source.reversible = true;
        link.auxiliary_ohm = f64::INFINITY;
        let line =
            LinePlan { starts_charged: true, ..LinePlan::new(link, Box::new(|t_s| request(t_s, ratings))) };
        Plan { train: self.train(machine), ..Plan::operated(DURATION_S, speed, line) }
    }

    fn figures(&self, recording: &Recording, options: &Options, machine: &Machine) -> Figures {
        let mut figures = analysis::common(recording);
        let train = self.train(machine);
        let allowed_a = f64::from(train.motoring_a) * sagged(udc_v(options, machine), machine);
        let line_a = |row: &Row| row.line_a.unwrap_or(f64::NAN);
        let taken = largest(recording, MOTORS, line_a) / allowed_a;
        let given = largest(recording, BRAKES, |row| -line_a(row) * row.udc_v) / f64::from(train.braking_w);
        let rises_nm = largest(recording, (MOTORS.0, RISES.0), |row| row.te_nm);
        // A line that has sagged, and a copper loss near the limit's power, leave less than the largest torque from the start.
        let started_w = allowed_a * udc_v(options, machine);
        let starts_freely =
            allowed_a >= f64::from(train.motoring_a) && 1.1 * largest_copper_w(machine) < started_w;
        // A limit beyond the power that full torque takes is out of reach.
        let motoring_reached = (shaft_w(machine) / started_w).min(1.0);
        // If the copper takes much of the braking power, its limit is out of reach; if it takes all of it, none comes back.
        let reached = (most_returned_w(machine) / f64::from(train.braking_w)).min(1.0);
        let used = (reached > 0.0).then(|| reached / given.max(0.0));
        let most = bound(options, 1.02, 1.05);
        let mut verdicts = line::verdicts(recording, &[]);
        verdicts.extend([
            Verdict::never("drive tripped", recording.trip().is_some()),
            Verdict::at_most("line current motoring over its limit", taken, most),
            Verdict::at_most("that limit over what is used of it", motoring_reached / taken, 1.06),
            Verdict::at_most("line power braking over its limit", given, most),
            Verdict::at_most("that limit over what is used of it", used, 1.06),
            Verdict::at_most(
                "torque missing where no limit is reached (share)",
                1.0 - rises_nm / machine.folder.parameters.max_torque_nm,
                if starts_freely { 0.02 } else { f64::INFINITY },
            ),
        ]);
        line::figures(&mut figures, recording);
        figures.set("line_current_over_limit", taken);
        figures.set("line_power_over_limit", given);
        figures.set("verdicts", verdicts);
        figures
    }

    fn plots(&self, recording: &Recording, _: &Options, _: &Machine, page: &mut Page) {
        line::plots(page, recording);
        let power: [Curve; 1] = [("line", |row| 1e-3 * row.line_a.unwrap_or(0.0) * row.udc_v)];
        page.plot("line power", "kW", recording, &power);
    }
}
