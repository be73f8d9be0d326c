//! The first paper's machine: its current loci and its inductances, figures 1, 3 and 4.

use super::super::ink::draw;
use super::super::loci::Loci;
use super::super::sheet::{Axis, BLACK, BLUE, GREEN, GREY, ORANGE, Panel, Point, RED, Side, VIOLET, number};
use crate::machine::Machine;
use anyhow::Result;
use tractive_tablegen::SmoothMap;

/// Speeds of the ellipses as shares of the rated one.
const SPEEDS: [f64; 4] = [1.0, 1.5, 2.0, 3.0];
/// Largest current of the paper's machine, in A: distances of letters from their spots are in amperes of its plane.
const PAPERS_A: f64 = 233.345;
/// Share of the largest current below which a point of the outer locus is inside the circle.
const ON_THE_CIRCLE: f64 = 0.995;

/// Figure 1: MTPA (O–A1), along the current's limit (A1–A2), MTPV (A2–A3), constant torque in weakening (BC, DE).
pub fn loci(machine: &Machine) -> Result<String> {
    let parameters = &machine.folder.parameters;
    let loci = Loci::new(machine, parameters.dc_link_nominal_v);
    let largest = loci.largest_a();
    let unit = largest / PAPERS_A;
    let (x, y) =
        (Axis::of("i_{d} in A", -1.3 * largest, 0.22 * largest), Axis::of("i_{q} in A", 0.0, 1.1 * largest));
    let title = "Current loci, on the machine's own saturated map";
    let mut panel = Panel::plane((0.0, 0.0, 860.0, 720.0), title, x, y);
    for share in SPEEDS {
        let rpm = share * parameters.rated_speed_rpm;
        let ellipse: Vec<_> = loci.ellipse(rpm).into_iter().filter(|(d, _)| *d < 0.02 * largest).collect();
        label_end(&mut panel, &ellipse, &format!("{} r/min", number(rpm)), unit);
        panel.dashes(ellipse, GREY);
    }
    panel.line(loci.circle(), RED, 1.4);
    let torques = [(0.35, ["D", "E"]), (0.65, ["B", "C"])];
    let last_rpm = 5.0 * parameters.max_speed_rpm;
    for (share, letters) in torques {
        let torque_nm = share * parameters.max_torque_nm;
        panel.line(loci.torque(torque_nm), RED_FAINT, 1.0);
        let held = loci.held(torque_nm, parameters.max_speed_rpm);
        panel.line(held.iter().map(|(point, _)| *point), GREEN, 2.6);
        if let [(first, _), .., (last, _)] = held.as_slice() {
            spot(&mut panel, *first, letters[0], unit);
            panel.spot(*last, BLACK);
            panel.words((last.0 + 6.0 * unit, last.1 - 7.0 * unit), letters[1], Side::Right, BLACK);
        }
    }
    panel.line(loci.torque(parameters.max_torque_nm), RED_FAINT, 1.0);
    panel.line(loci.mtpa(), BLUE, 2.6);
    outer(&mut panel, &loci.outer(last_rpm), largest, unit);
    panel.line(loci.full_power(parameters.max_speed_rpm), ORANGE, 1.6);
    spot(&mut panel, (0.0, 0.0), "O", unit);
    panel.names = [
        ("MTPA", BLUE),
        ("most torque", VIOLET),
        ("constant torque", GREEN),
        ("full power", ORANGE),
        ("current limit", RED),
        ("voltage limit", GREY),
    ]
    .map(|(name, colour)| (name.to_owned(), colour))
    .to_vec();
    draw((860, 720), &[panel])
}

/// Lines of equal torque.
const RED_FAINT: super::super::sheet::Colour = plotters::style::RGBColor(222, 180, 180);

/// The most torque at every speed, A1 to A3.
fn outer(panel: &mut Panel, outer: &[(Point, f64)], largest: f64, unit: f64) {
    panel.line(outer.iter().map(|(point, _)| *point), VIOLET, 2.6);
    let inside = |(point, _): &&(Point, f64)| point.0.hypot(point.1) < ON_THE_CIRCLE * largest;
    if let Some((first, _)) = outer.first() {
        spot(panel, *first, "A1", unit);
    }
    if let (Some((second, rpm)), Some((last, _))) = (outer.iter().find(inside), outer.last()) {
        spot(panel, *second, &format!("A2 ({} r/min)", number((rpm / 10.0).round() * 10.0)), unit);
        panel.spot(*last, BLACK).words((last.0 + 6.0 * unit, last.1 + 5.0 * unit), "A3", Side::Right, BLACK);
    }
}

/// A spot with its letter to the upper left.
fn spot(panel: &mut Panel, at: Point, letter: &str, unit: f64) {
    panel.spot(at, BLACK);
    panel.words((at.0 - 5.0 * unit, at.1 + 9.0 * unit), letter, Side::Left, BLACK);
}

/// Words above the rightmost point of a curve that the panel shows.
fn label_end(panel: &mut Panel, curve: &[Point], words: &str, unit: f64) {
    let Some((Axis { range: Some(x), .. }, Axis { range: Some(y), .. })) = &panel.axes else { return };
    let seen = curve.iter().filter(|(d, q)| (x.0..x.1).contains(d) && (y.0..y.1).contains(q));
    if let Some((d, q)) = seen.copied().max_by(|a, b| a.0.total_cmp(&b.0)) {
        panel.words((d + 3.0 * unit, q), words, Side::Right, GREY);
    }
}

/// Figures 3 and 4: an inductance over both currents, in curves of one and points of the other.
pub fn inductance(machine: &Machine, d_axis: bool) -> Result<String> {
    let map = SmoothMap::new(&machine.folder.map);
    let largest = machine.folder.parameters.max_current_a;
    // True if mH would have more than three digits behind the point.
    let small = map.at(0.0, largest).psi_q_wb < 2e-4 * largest;
    let (unit, parts) = if small { ("µH", 1e6) } else { ("mH", 1e3) };
    let (along, other, what) = if d_axis { ("i_{d}", "i_{q}", "L_{d}") } else { ("i_{q}", "i_{d}", "L_{q}") };
    let (x, y) = (Axis::fitted(&format!("{along} in A")), Axis::fitted(&format!("{what} in {unit}")));
    let title = format!("{what} over {along}, for several {other}");
    let mut panel = Panel::new((0.0, 0.0, 800.0, 420.0), &title, x, y);
    let colours = [BLUE, GREEN, ORANGE, VIOLET, RED];
    for (share, colour) in [0.05, 0.25, 0.5, 0.75, 0.95].into_iter().zip(colours) {
        let fixed = if d_axis { share * largest } else { -share * largest };
        let points = (2..=100).map(|k| {
            let x = largest * f64::from(k) / 100.0;
            if d_axis {
                let at = map.at(-x, fixed);
                (-x, parts * (map.at(0.0, fixed).psi_d_wb - at.psi_d_wb) / x)
            } else {
                (x, parts * map.at(fixed, x).psi_q_wb / x)
            }
        });
        panel.named(&format!("{other} = {} A", number(fixed.round())), points, colour);
    }
    draw((800, 420), &[panel])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A machine of 233 A, and one of 30 A that has no current left at high speed.
    #[test]
    fn letters_stand_beside_their_spots_and_the_most_torque_within_the_circle() {
        for name in ["pmasynrm-180kw", "pmsm-48v-1kw"] {
            let machine = Machine::load(name).unwrap();
            let svg = loci(&machine).unwrap();
            let lines: Vec<_> = svg.lines().collect();
            let at = |line: &str, x: &str, y: &str| -> Point {
                let value =
                    |key: &str| line.split(&format!(" {key}=\"")).nth(1)?.split('"').next()?.parse().ok();
                value(x).zip(value(y)).unwrap()
            };
            // The last spot is that of the origin.
            let spot = at(lines.iter().rfind(|line| line.starts_with("<circle")).unwrap(), "cx", "cy");
            let letter = lines.iter().position(|line| *line == "O").unwrap();
            let letter = at(lines[letter - 1], "x", "y");
            let off = (letter.0 - spot.0).hypot(letter.1 - spot.1) / 4.0;
            assert!((3.0..30.0).contains(&off), "{name}: {off} px");
            let parameters = &machine.folder.parameters;
            let outer =
                Loci::new(&machine, parameters.dc_link_nominal_v).outer(5.0 * parameters.max_speed_rpm);
            let most = outer.iter().map(|((d, q), _)| d.hypot(*q)).fold(0.0, f64::max);
            assert!(outer.len() > 100 && most < 1.02 * parameters.max_current_a, "{name}: {most} A");
        }
    }
}
