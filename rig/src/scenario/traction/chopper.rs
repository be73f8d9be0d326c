//! Full braking into a link that cannot take the energy. The chopper takes it; half of the resistor is lost, then all of it, and the torque
//! is folded back; then the source takes energy back and all of the torque returns.

use super::line::{self, within};
use super::prelude::*;
use super::scaled::{emf_v, of_rated_rpm};
use super::setup::udc_v;
use crate::bench::LinePlan;
use tractive::machine::Ratings;
use tractive::operator::Request;

/// See the module.
#[derive(Clone, Copy, Debug, Args, Serialize)]
pub struct Chopper {
    /// Speed, in r/min.
    #[arg(long, value_parser = finite, allow_negative_numbers = true)]
    speed: Option<f64>,
}

const ENABLE: (f64, f64) = (0.5, 4.4);
const BRAKE: (f64, f64) = (0.7, 4.0);
/// The rotor is held at this speed, in r/min, except for the braking to `SLOW_RPM` with the whole chopper.
const FAST_RPM: f64 = 2_000.0;
const SLOW_RPM: f64 = 1_200.0;
/// Share of the link beyond which an EMF counts as near it; and times in which the rotor then goes from standstill to its speed, in s.
const NEAR: f64 = 0.5;
const TURNS: (f64, f64) = (0.3, 0.69);
/// Times from which half of the braking resistor is lost, then all of it, and the source takes energy back, in s.
const HALF_S: f64 = 1.7;
const NONE_S: f64 = 2.4;
const TAKES_S: f64 = 3.1;
const DURATION_S: f64 = 4.8;
/// Resistance of a lost resistor over that of the whole one.
const LOST: f64 = 1e6;

/// A stretch of the run.
#[derive(Clone, Debug, Serialize)]
struct Stretch {
    what: &'static str,
    /// Means over its second half.
    link_v: f64,
    torque_nm: f64,
    chopper_duty: f64,
    braking_kw: f64,
    /// Peaks over all of it.
    link_peak_v: f64,
    current_peak_a: f64,
}

fn request(t_s: f64, ratings: &Ratings) -> Request {
    let braking = within(&[BRAKE], t_s);
    Request {
        enable: within(&[ENABLE], t_s),
        charge: t_s >= 0.1,
        torque_nm: if braking { -ratings.max_torque_nm } else { 0.0 },
        ..Request::idle(ratings)
    }
}

fn stretches(recording: &Recording, machine: &Machine) -> Vec<Stretch> {
    let windows = [
        ("the chopper takes it", BRAKE.0, HALF_S),
        ("half of the resistor", HALF_S, NONE_S),
        ("no resistor", NONE_S, TAKES_S),
        ("the source takes it", TAKES_S, BRAKE.1),
    ];
    let ohm = machine.folder.parameters.stator_resistance_ohm;
    windows
        .into_iter()
        .map(|(what, from, until)| {
            let rows = analysis::window(recording, from, until);
            let steady = &rows[rows.len() / 2..];
            // The copper loss never reaches the link.
            let copper_w = |row: &Row| 1.5 * ohm * (row.id_a.powi(2) + row.iq_a.powi(2));
            let shaft_w = |row: &Row| -row.te_nm * row.speed_rpm * core::f64::consts::TAU / 60.0;
            let power = |row: &Row| 1e-3 * (shaft_w(row) - copper_w(row));
            Stretch {
                what,
                link_v: mean(steady, |row| row.udc_v),
                torque_nm: mean(steady, |row| row.te_nm),
                chopper_duty: mean(steady, |row| {
                    row.status.map_or(0.0, |status| f64::from(status.switches.chopper))
                }),
                braking_kw: mean(steady, power),
                link_peak_v: worst(rows.iter().map(|row| row.udc_v)).unwrap_or(f64::NAN),
                current_peak_a: worst(rows.iter().map(Row::peak_current_a)).unwrap_or(f64::NAN),
            }
        })
        .collect()
}

impl Scenario<Traction> for Chopper {
    fn plan(&self, options: &Options, machine: &Machine) -> Plan {
        let fast = self.speed.unwrap_or(of_rated_rpm(FAST_RPM, machine));
        let slow = fast * SLOW_RPM / FAST_RPM;
        // An EMF near the link's voltage would charge it, so such a machine turns only once the main contactor is closed.
        let near = emf_v(fast, machine) > NEAR * udc_v(options, machine);
        let begins = near.then_some([(TURNS.0, 0.0), (TURNS.1, fast)]).into_iter().flatten();
        let later = [
            (1.0, fast),
            (1.3, slow),
            (1.5, slow),
            (HALF_S, fast),
            (TAKES_S, fast),
            (BRAKE.1, slow),
            (DURATION_S, slow),
        ];
        let speed = begins.chain(later).collect();
        let ratings = &machine.tables.ratings;
        let link = line::fed(options, machine);
        let ohm = link.chopper_ohm;
        let line = LinePlan {
            starts_charged: true,
            chopper_ohm: vec![(HALF_S, 2.0 * ohm), (NONE_S, LOST * ohm)],
            reversible: vec![(TAKES_S, true)],
            ..LinePlan::new(link, Box::new(|t_s| request(t_s, ratings)))
        };
        Plan::operated(DURATION_S, speed, line)
    }

    fn figures(&self, recording: &Recording, _options: &Options, machine: &Machine) -> Figures {
        let mut figures = analysis::common(recording);
        let ratings = &machine.tables.ratings;
        let stretches = stretches(recording, machine);
        let [whole, half, none, source] = &stretches[..] else { unreachable!("four stretches") };
        let (trip_v, highest_v) = (f64::from(ratings.trip_dc_over_v), f64::from(ratings.dc_link_max_v));
        // End of the link's rise, between its highest operating voltage (0) and the trip (1).
        let rise = |stretch: &Stretch| (stretch.link_peak_v - highest_v) / (trip_v - highest_v);
        let largest_a = f64::from(ratings.max_current_a);
        let most_kw = machine.folder.parameters.max_power_w / 1e3;
        let folded = 1.0 - whole.torque_nm / source.torque_nm;
        let peak = worst(stretches.iter().map(|stretch| stretch.current_peak_a / largest_a));
        let mut verdicts = line::verdicts(recording, &[]);
        verdicts.extend([
            Verdict::never("drive tripped", recording.trip().is_some()),
            Verdict::at_most("link's rise, of the way to its trip: chopper", rise(whole), 0.3),
            Verdict::at_most("link's rise, of the way to its trip: half of it", rise(half), 0.7),
            Verdict::at_most("link's rise, of the way to its trip: none", rise(none), 0.9),
            Verdict::at_most("torque folded back while the chopper takes it (share)", folded, 0.02),
            Verdict::at_most(
                "braking power with half of the resistor (of all)",
                half.braking_kw / most_kw,
                0.7,
            ),
            Verdict::at_most("braking power without it (of all)", none.braking_kw / most_kw, 0.1),
            Verdict::at_most("peak current over the largest one", peak, 1.15),
        ]);
        line::figures(&mut figures, recording);
        figures.set("stretches", stretches);
        figures.set("verdicts", verdicts);
        figures
    }

    fn plots(&self, recording: &Recording, _: &Options, _: &Machine, page: &mut Page) {
        line::plots(page, recording);
        let window = (NONE_S - 0.02, NONE_S + 0.1);
        let link: [Curve; 1] = [("udc", |row| row.udc_v)];
        page.plot_window(("the braking resistor is lost", "DC link", "V"), recording, window, &link);
        let torque: [Curve; 2] = [("after limits", |row| row.te_ref_nm), ("torque", |row| row.te_nm)];
        page.plot_window(("the braking resistor is lost", "torque", "N·m"), recording, window, &torque);
    }
}
