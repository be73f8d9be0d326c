//! A start without an angle: the encoder has seen no index since it was switched on, the rotor may stand anywhere, and the drive finds the
//! angle before it gives torque.

use super::line::{self, within};
use super::prelude::*;
use crate::bench::{Encoder, LinePlan};
use crate::options::number;
use crate::plant::SpeedSource;
use crate::steps::held;
use crate::verdict::bound;
use tractive::machine::Ratings;
use tractive::operator::Request;
use tractive::start_up::{PUSH_GROWTH_HZ, PUSHED};

/// See the module.
#[derive(Clone, Copy, Debug, Args, Serialize)]
pub struct Start {
    /// Position of the rotor behind its index, mechanical, in degrees.
    #[arg(long, value_name = "DEG", default_value_t = 77.0, value_parser = turn, allow_negative_numbers = true)]
    from_deg: f64,
    /// The brake holds the rotor.
    #[arg(long)]
    braked: bool,
}

/// From 0 to 360.
fn turn(text: &str) -> Result<f64, String> {
    number(text, "a number from 0 to 360", |value| (0.0..=360.0).contains(&value))
}

const CHARGE: (f64, f64) = (0.1, 0.2);
const ENABLE_S: f64 = 0.3;
/// Beginning of the torque demand, for a machine whose pushes last no longer than usual, and its length, in s.
const TORQUE_S: (f64, f64) = (0.8, 0.3);
/// Share of the largest torque at most; a light rotor gets less, which takes it to this share of the largest speed.
const TORQUE_SHARE: f64 = 0.2;
const SPEED_SHARE: f64 = 0.5;
/// Time after the demand begins from which the torque is judged, and time before its end until which it is judged, in s.
const JUDGED_S: (f64, f64) = (0.15, 0.01);
/// Time that torque takes to come if the angle is found later, in s.
const COMES_S: f64 = 0.05;
const REST_S: f64 = 0.1;
/// Push lengths that finding the polarity takes, with the braking after them, and the time that is available for them anyway, in s.
const PUSHES: f64 = 5.0;
const USUAL_PUSHES_S: f64 = 0.2;

/// The torque's course: its beginning and end in s, and its share of the largest torque.
struct Torque {
    from_s: f64,
    until_s: f64,
    share: f64,
}

impl Torque {
    fn of(ratings: &Ratings) -> Self {
        let acceleration = f64::from(ratings.max_acceleration_rad_s2);
        let growth_rad_s3 = f64::from(PUSH_GROWTH_HZ) * acceleration;
        let push_s = (6.0 * f64::from(PUSHED.signed_radians()) / growth_rad_s3).cbrt();
        let from_s = TORQUE_S.0 + (PUSHES * push_s - USUAL_PUSHES_S).max(0.0);
        let fast_rad_s = SPEED_SHARE * f64::from(ratings.pole_pairs * ratings.max_speed_rad_s);
        let share = TORQUE_SHARE.min(fast_rad_s / (acceleration * TORQUE_S.1));
        Self { from_s, until_s: from_s + TORQUE_S.1, share }
    }

    fn request(&self, t_s: f64, ratings: &Ratings) -> Request {
        let share = held(&[(self.from_s, self.share), (self.until_s, 0.0)], t_s).unwrap_or(0.0);
        Request {
            enable: t_s >= ENABLE_S,
            charge: within(&[CHARGE], t_s),
            torque_nm: share as f32 * ratings.max_torque_nm,
            ..Request::idle(ratings)
        }
    }
}

/// Largest backward turn of the rotor, mechanical, in degrees.
fn backward_deg(recording: &Recording) -> f64 {
    let turned = recording.rows.windows(2).scan(0.0, |turned, rows| {
        *turned += 6.0 * 0.5 * (rows[0].speed_rpm + rows[1].speed_rpm) * (rows[1].t_s - rows[0].t_s);
        Some(*turned)
    });
    turned.fold(0.0, |most, turned| f64::max(most, -turned))
}

impl Scenario<Traction> for Start {
    fn plan(&self, options: &Options, machine: &Machine) -> Plan {
        let (ratings, parameters) = (&machine.tables.ratings, &machine.folder.parameters);
        let line = LinePlan {
            starts_charged: true,
            ..LinePlan::new(
                line::fed(options, machine),
                Box::new(|t_s| Torque::of(ratings).request(t_s, ratings)),
            )
        };
        let plan = Plan::operated(Torque::of(ratings).until_s + REST_S, Vec::new(), line);
        let encoder = Encoder::new(ratings, self.from_deg / 360.0);
        let inertia_kg_m2 = parameters.rotor_inertia_kg_m2;
        let free = SpeedSource::Inertia { inertia_kg_m2, load_nm: 0.0 };
        Plan { speed: if self.braked { plan.speed } else { free }, encoder: Some(encoder), ..plan }
    }

    fn figures(&self, recording: &Recording, options: &Options, machine: &Machine) -> Figures {
        let mut figures = analysis::common(recording);
        let (largest_nm, torque) =
            (machine.folder.parameters.max_torque_nm, Torque::of(&machine.tables.ratings));
        let found = recording.found;
        // Torque that waits for the angle is judged once it has come.
        let begin_s = torque.from_s + JUDGED_S.0;
        let begin_s = found.map_or(begin_s, |found| begin_s.max(found.t_s + COMES_S));
        let judged = analysis::window(recording, begin_s, torque.until_s - JUDGED_S.1);
        let off_share = (mean(judged, |row| row.te_nm) / largest_nm - torque.share).abs();
        let torque_error = off_share / TORQUE_SHARE;
        let (error_deg, backward_deg) = (found.map(|found| found.error_deg), backward_deg(recording));
        figures.set("angle_found_after_s", found.map(|found| found.t_s - ENABLE_S));
        figures.set("angle_error_deg", error_deg);
        figures.set("turned_backward_deg", backward_deg);
        let mut verdicts = line::verdicts(recording, &[]);
        verdicts.extend([
            Verdict::never("drive tripped", recording.trip().is_some()),
            Verdict::at_most("angle off, electrical, in degrees", error_deg.map(f64::abs), 5.0),
            Verdict::at_most("turned backward, mechanical, in degrees", backward_deg, 5.0),
            Verdict::at_most(
                "mean torque off the demand (share of a fifth of the largest)",
                torque_error,
                bound(options, 0.01, 0.02),
            ),
        ]);
        line::figures(&mut figures, recording);
        figures.set("verdicts", verdicts);
        figures
    }

    fn plots(&self, recording: &Recording, _: &Options, _: &Machine, page: &mut Page) {
        line::plots(page, recording);
        let end_s = recording.found.map_or(TORQUE_S.0, |found| found.t_s + 0.01);
        page.zoom("the angle is found", recording, (ENABLE_S, end_s));
        page.zoom("the last pulses", recording, (end_s - 0.03, end_s));
    }
}
