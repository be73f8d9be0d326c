//! The paper's figures of the machine and of the modes, drawn from our own tables and pulses.

use crate::analysis::SteadyPoint;
use crate::machine::Machine;
use crate::options::usual_min_pulse_us;
use crate::pattern::{self, Wanted};
use crate::report::Page;
use crate::trace::Recording;
use crate::verdict::worst;
use tractive::control::{VoltageLimit, mtpa, operating_point};
use tractive::modulation::{Ladder, Mode};
use tractive_tablegen::SmoothMap;

/// Curves, each with its name.
pub type Series = Vec<(String, Curve)>;

/// Figures 1, 3, 4, 6, 7 and 10 beside ours.
pub fn draw(page: &mut Page, recording: &Recording, points: &[SteadyPoint], machine: &Machine) {
    for (title, unit, curve) in accuracy(points, machine) {
        page.draw_xy("figure 10", title, ("speed in r/min", unit), &[(title.to_owned(), curve)]);
    }
    const LOCI: &str = "currents of MTPA and of full power in weakening";
    const STRATEGY: &str = "the modes: pulses per fundamental period over frequency, going up at full torque";
    let frequency = ("stator frequency in Hz", "turn-ons per period");
    page.draw_xy("figure 1", LOCI, ("id in A", "iq in A"), &loci(machine));
    let (ld, lq) = (inductances(machine, true), inductances(machine, false));
    page.draw_xy("figure 3", "Ld over id, for several iq", ("id in A", "Ld in mH"), &ld);
    page.draw_xy("figure 4", "Lq over iq, for several id", ("iq in A", "Lq in mH"), &lq);
    page.draw_xy("figure 6", STRATEGY, frequency, &strategy(recording, machine));
    for mode in Mode::ALL.into_iter().filter(|mode| mode.is_pattern() && !mode.is_whole()) {
        // Notches of much the same width: 70 % for 7 pulses, 90 % for 3.
        let (f1_hz, share) = (100.0, 1.0 - 0.05 * f64::from(mode.turn_ons() - 1));
        let title =
            format!("middle 60°, {}: legs u, v, w at {:.0} % of six-step", mode.name(), 100.0 * share);
        let axes = ("pulse angle in degrees", "level");
        let figure = Ladder::PAPER.modes().any(|own| own == mode).then_some("figure 7");
        page.draw_xy(figure, &title, axes, &legs(machine, mode, f1_hz, share));
    }
}

/// Points of a curve.
pub type Curve = Vec<(f64, f64)>;

/// Torque over its demand, efficiency and current of the characteristic points, over speed: full torque, then full power.
fn accuracy(points: &[SteadyPoint], machine: &Machine) -> [(&'static str, &'static str, Curve); 3] {
    let rated_nm = machine.folder.parameters.rated_torque_nm;
    let curve = |value: fn(&SteadyPoint) -> Option<f64>| {
        let along = points.iter().filter(|point| point.demand_nm > rated_nm);
        along.filter_map(|point| Some((point.speed_rpm, value(point)?))).collect()
    };
    [
        (
            "torque accuracy",
            "100 % less the error",
            curve(|point| Some(100.0 - point.torque_error_percent.abs())),
        ),
        ("efficiency", "%", curve(|point| point.efficiency_percent)),
        ("phase current", "A rms", curve(|point| Some(point.current_rms_a))),
    ]
}

/// MTPA over torque, and full power over speed.
pub fn loci(machine: &Machine) -> Series {
    let ratings = &machine.tables.ratings;
    let parameters = &machine.folder.parameters;
    let mtpa_points = (0..=100).map(|k| {
        let current = mtpa(ratings.max_torque_nm * k as f32 / 100.0, machine.tables);
        (f64::from(current.d), f64::from(current.q))
    });
    let weakening = (0..=100).map(|k| {
        let speed_rad_s = ratings.max_speed_rad_s * (0.3 + 0.7 * k as f32 / 100.0);
        let torque_nm = (ratings.max_power_w / speed_rad_s).min(ratings.max_torque_nm);
        let limit = VoltageLimit { udc_v: parameters.dc_link_nominal_v as f32, depth: 1.0, filled: false };
        let point = operating_point(torque_nm, speed_rad_s * ratings.pole_pairs, &limit, machine.tables);
        (f64::from(point.current.d), f64::from(point.current.q))
    });
    let largest = parameters.max_current_a;
    let circle = (0..=90).map(|degrees| {
        let (sin, cos) = f64::from(degrees).to_radians().sin_cos();
        (-largest * sin, largest * cos)
    });
    vec![
        ("MTPA".to_owned(), mtpa_points.collect()),
        ("full power".to_owned(), weakening.collect()),
        ("current limit".to_owned(), circle.collect()),
    ]
}

/// Static inductances from the smooth map.
pub fn inductances(machine: &Machine, d_axis: bool) -> Series {
    let map = SmoothMap::new(&machine.folder.map);
    let largest = machine.folder.parameters.max_current_a;
    [0.05, 0.35, 0.65, 0.95]
        .iter()
        .map(|share| {
            let points = (2..=50).map(|k| {
                let x = largest * f64::from(k) / 50.0;
                if d_axis {
                    let iq = share * largest;
                    let at = map.at(-x, iq);
                    (-x, 1e3 * (map.at(0.0, iq).psi_d_wb - at.psi_d_wb) / x)
                } else {
                    (x, 1e3 * map.at(-share * largest, x).psi_q_wb / x)
                }
            });
            let (name, value) = if d_axis { ("iq", share * largest) } else { ("id", -share * largest) };
            (format!("{name} = {value:.0} A"), points.collect())
        })
        .collect()
}

/// Turn-ons a period of each mode over the frequencies at which the drive used it at full torque.
fn strategy(recording: &Recording, machine: &Machine) -> Series {
    let full_nm = worst(recording.rows.iter().map(|row| row.te_ref_nm)).unwrap_or(0.0);
    let pulsing = recording.rows.iter().filter(|row| row.mode != Mode::Off && row.f1_hz > 0.0);
    let full = pulsing.filter(|row| row.te_ref_nm > 0.999 * full_nm);
    let mut series = Series::new();
    for row in full {
        let turn_ons = match row.mode.turn_ons() {
            0 => f64::from(machine.tables.ratings.max_switching_hz) / row.f1_hz,
            locked => f64::from(locked),
        };
        let name = row.mode.name();
        match series.iter_mut().find(|(known, _)| known == name) {
            Some((_, points)) => points.push((row.f1_hz, turn_ons)),
            None => series.push((name.to_owned(), vec![(row.f1_hz, turn_ons)])),
        }
    }
    series.iter_mut().for_each(|(_, points)| thin(points));
    series
}

/// Every so-manieth point, and the last.
fn thin(points: &mut Vec<(f64, f64)>) {
    const KEPT: usize = 200;
    let (every, last) = (points.len().div_ceil(KEPT).max(1), points.len() - 1);
    *points = (0..points.len()).filter(|k| k % every == 0 || *k == last).map(|k| points[k]).collect();
}

/// The three legs over a period, one above the other.
fn legs(machine: &Machine, mode: Mode, f1_hz: f64, share: f64) -> Series {
    let udc_v = machine.folder.parameters.dc_link_nominal_v;
    let wanted = Wanted {
        mode,
        voltage_v: share * udc_v * core::f64::consts::FRAC_2_PI,
        udc_v,
        f1_hz,
        cycles: 1,
        dead_time_us: 0.0,
        min_pulse_us: usual_min_pulse_us(machine.folder.parameters.max_switching_hz),
        max_switching_hz: machine.tables.ratings.max_switching_hz,
    };
    let edges = pattern::edges(&wanted).unwrap_or_default();
    (0..3)
        .map(|leg| {
            let base = 1.5 * (2 - leg) as f64;
            let mut points: Vec<(f64, f64)> = Vec::new();
            for (t_s, _, on) in edges.iter().filter(|(_, which, _)| *which == leg) {
                let degrees = 360.0 * f1_hz * t_s;
                if let Some((_, last)) = points.last().copied() {
                    points.push((degrees, last));
                }
                points.push((degrees, base + f64::from(u8::from(*on))));
            }
            if let Some((_, last)) = points.last().copied() {
                points.push((360.0, last));
            }
            (["u", "v", "w"][leg].to_owned(), points)
        })
        .collect()
}
