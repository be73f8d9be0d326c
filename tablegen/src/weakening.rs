//! Field weakening: intersections of constant-torque curves with circles of constant flux linkage.

use crate::{MachineFolder, Optimum, SmoothMap};
use libm::{cos, hypot, sin};

/// A circle of constant flux linkage.
pub struct Circle {
    /// The largest torque on it within the current limit, in N·m.
    pub torque_nm: f64,
    /// Currents (id, iq) for the requested torques, in A.
    pub currents_a: Vec<(f64, f64)>,
}

/// Steps of load angle in which a circle is searched, per half turn.
const ANGLE_STEPS: usize = 720;

/// A point of a circle.
#[derive(Clone, Copy)]
struct Point {
    id: f64,
    iq: f64,
    angle: f64,
    torque: f64,
}

/// The circle of flux linkage `psi_wb` of a machine within a current limit and above its least i_d, with currents at `torque · shares`.
pub fn circle(
    psi_wb: f64,
    shares: &[f64],
    map: &SmoothMap,
    machine: &MachineFolder,
    max_current_a: f64,
) -> Circle {
    let optimum = Optimum::new(map, &machine.parameters);
    let highest_id = machine.map.id_a[machine.map.id_a.len() - 1];
    let least_id_a = machine.parameters.least_id_a();
    let within = |point: &Point| hypot(point.id, point.iq) <= max_current_a && point.id >= least_id_a;
    let arc = rising_arc(psi_wb, map, &optimum, within);
    let Some(top) = arc.last().copied() else {
        // No current within the limit has this flux: there is no torque, and the result is the current that comes nearest.
        let nearest = ((-max_current_a).max(least_id_a), 0.0);
        return Circle { torque_nm: TINY_TORQUE_NM, currents_a: vec![nearest; shares.len()] };
    };
    let torque_nm = top.torque.max(TINY_TORQUE_NM);
    let currents_a = shares
        .iter()
        .map(|share| {
            let wanted = share * torque_nm;
            let (id, iq) = if wanted < arc[0].torque {
                // The circle enters the current limit with more torque than that; less torque lies inside the limit.
                at_id(arc[0].id, wanted, &optimum, max_current_a)
            } else {
                on_arc(&arc, wanted, psi_wb, map, &optimum)
            };
            if id > highest_id { at_id(highest_id, wanted, &optimum, max_current_a) } else { (id, iq) }
        })
        .collect();
    Circle { torque_nm, currents_a }
}

/// Stands for zero torque where something divides by it.
const TINY_TORQUE_NM: f64 = 1e-3;

/// The part of the circle where torque rises to its maximum, within the limits.
///
/// On a circle wider than the magnets' flux the smallest load angles need id > 0, where reluctance torque is negative. So the whole circle is
/// searched first, and the arc is the part that leads up to its summit, from below zero torque.
fn rising_arc(
    psi_wb: f64,
    map: &SmoothMap,
    optimum: &Optimum,
    within: impl Fn(&Point) -> bool,
) -> Vec<Point> {
    let mut scanned: Vec<Point> = Vec::new();
    let mut from = (0.0, 0.0);
    for k in 0..=ANGLE_STEPS {
        let Some(point) = at_angle(psi_wb, STEP_RAD * k as f64, from, map, optimum) else { continue };
        from = (point.id, point.iq);
        scanned.push(point);
    }
    let by_torque = |a: &(usize, &Point), b: &(usize, &Point)| a.1.torque.total_cmp(&b.1.torque);
    let inside = scanned.iter().enumerate().filter(|(_, point)| within(point));
    let Some((top, _)) = inside.max_by(by_torque) else {
        return Vec::new();
    };
    let falls = |pair: &&[Point]| within(&pair[0]) && pair[0].torque < pair[1].torque;
    let steps = scanned[..=top].windows(2).rev().take_while(falls).count();
    let mut arc = scanned[top - steps..=top].to_vec();
    arc.push(summit(psi_wb, arc[arc.len() - 1], map, optimum, within));
    arc
}

/// Width of a search step, in rad.
const STEP_RAD: f64 = std::f64::consts::PI / ANGLE_STEPS as f64;

fn at_angle(psi_wb: f64, angle: f64, from: (f64, f64), map: &SmoothMap, optimum: &Optimum) -> Option<Point> {
    let (id, iq) = map.inverse(psi_wb * cos(angle), psi_wb * sin(angle), from)?;
    Some(Point { id, iq, angle, torque: optimum.torque_nm(id, iq) })
}

/// The summit, or the point where the current limit cuts the way to it: ever smaller steps from the best point scanned.
fn summit(
    psi_wb: f64,
    best: Point,
    map: &SmoothMap,
    optimum: &Optimum,
    within: impl Fn(&Point) -> bool,
) -> Point {
    let (mut best, mut step) = (best, STEP_RAD);
    while step > 1e-9 {
        let tries =
            [step, -step].map(|by| at_angle(psi_wb, best.angle + by, (best.id, best.iq), map, optimum));
        match tries.into_iter().flatten().find(|point| within(point) && point.torque > best.torque) {
            Some(better) => best = better,
            None => step *= 0.5,
        }
    }
    best
}

/// The point with a given torque on the arc: between the two neighbours, by bisection of the load angle.
fn on_arc(arc: &[Point], wanted_nm: f64, psi_wb: f64, map: &SmoothMap, optimum: &Optimum) -> (f64, f64) {
    let upper = arc.partition_point(|point| point.torque < wanted_nm).min(arc.len() - 1);
    let (a, b) = (arc[upper.saturating_sub(1)], arc[upper]);
    let (mut low, mut high) = (a.angle, b.angle);
    let mut best = (b.id, b.iq);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        let Some(found) = map.inverse(psi_wb * cos(middle), psi_wb * sin(middle), best) else { break };
        best = found;
        if optimum.torque_nm(found.0, found.1) < wanted_nm { low = middle } else { high = middle }
    }
    best
}

/// The current with a given id that gives a torque.
pub(crate) fn at_id(id: f64, wanted_nm: f64, optimum: &Optimum, max_current_a: f64) -> (f64, f64) {
    let (mut low, mut high) = (0.0, max_current_a);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if optimum.torque_nm(id, middle) < wanted_nm { low = middle } else { high = middle }
    }
    (id, high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::MachineFolder;
    use crate::testing::{IPM, near};
    use std::path::Path;

    /// Shares of a circle's torque, mainly small ones.
    const SHARES: [f64; 8] = [0.0, 0.01, 0.03, 0.1, 0.2, 0.4, 0.7, 1.0];

    /// Small torques lie at the id at which the circle enters the current limit: there the flux linkage is the circle's, within a step of the search.
    #[test]
    fn a_circle_is_entered_where_the_current_limit_cuts_it() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tables/pmasynrm-180kw");
        let machine = MachineFolder::read(&folder).unwrap();
        let (smooth, most_a) = (SmoothMap::new(&machine.map), machine.parameters.max_current_a);
        let flux_wb = |id: f64, iq: f64| smooth.at(id, iq).psi_d_wb.hypot(smooth.at(id, iq).psi_q_wb);
        let highest_id = machine.map.id_a[machine.map.id_a.len() - 1];
        let (mut inside, mut on, mut worst) = (0, 0, 0.0_f64);
        for psi_wb in (5..120).map(|k| 0.01 * f64::from(k) * flux_wb(0.0, most_a)) {
            let circle = circle(psi_wb, &SHARES, &smooth, &machine, most_a);
            if circle.torque_nm <= TINY_TORQUE_NM {
                continue;
            }
            for (id, iq) in circle.currents_a.into_iter().filter(|(id, _)| *id < highest_id) {
                if (flux_wb(id, iq) / psi_wb - 1.0).abs() < 1e-6 {
                    on += 1;
                    continue;
                }
                inside += 1;
                let entered_wb = flux_wb(id, (most_a * most_a - id * id).max(0.0).sqrt());
                worst = worst.max((entered_wb / psi_wb - 1.0).abs());
            }
        }
        assert!(on > 300 && inside > 10 && worst < 0.004, "{on}, {inside}, {worst}");
    }

    fn linear() -> (MachineFolder, SmoothMap) {
        let machine = IPM.folder(&[]);
        let smooth = SmoothMap::new(&machine.map);
        (machine, smooth)
    }

    /// The largest torque on a circle of a machine without saturation, by load angle, within the largest current.
    fn most_nm(psi_wb: f64, most_a: f64, least_id_a: f64) -> f64 {
        let at = |angle: f64| {
            let (id, iq) = ((psi_wb * angle.cos() - 0.2) / 0.006, psi_wb * angle.sin() / 0.015);
            (id.hypot(iq) <= most_a && id >= least_id_a).then(|| IPM.torque_nm(id, iq))
        };
        let angles = (0..=200_000).map(|k| std::f64::consts::PI * f64::from(k) / 200_000.0);
        angles.filter_map(at).fold(f64::NEG_INFINITY, f64::max)
    }

    #[test]
    fn a_summit_is_found_from_either_side() {
        const PSI_WB: f64 = 0.22;
        let (machine, smooth) = linear();
        let optimum = Optimum::new(&smooth, &machine.parameters);
        let [below, above] = [0.8, 2.4].map(|angle| {
            let start = at_angle(PSI_WB, angle, (0.0, 5.0), &smooth, &optimum).unwrap();
            summit(PSI_WB, start, &smooth, &optimum, |_| true)
        });
        near(below.angle, above.angle, 1e-6);
        near(below.torque, most_nm(PSI_WB, 1e9, -1e9), 1e-6);
    }

    #[test]
    fn circles_of_a_linear_machine() {
        let (machine, smooth) = linear();
        for (psi_wb, most_a) in
            [(0.1, 20.0), (0.14, 20.0), (0.18, 20.0), (0.22, 20.0), (0.25, 12.0), (0.3, 20.0)]
        {
            let circle = circle(psi_wb, &SHARES, &smooth, &machine, most_a);
            near(circle.torque_nm, most_nm(psi_wb, most_a, -1e9), 1e-4);
            assert_eq!(circle.currents_a.len(), SHARES.len());
            for ((id, iq), share) in circle.currents_a.into_iter().zip(SHARES) {
                let torque_nm = IPM.torque_nm(id, iq);
                assert!(
                    (torque_nm - share * circle.torque_nm).abs() < 1e-8 * circle.torque_nm,
                    "{torque_nm}"
                );
                let (psi_d, psi_q) = IPM.flux_wb(id, iq);
                let on = (psi_d.hypot(psi_q) / psi_wb - 1.0).abs() < 1e-9;
                let entered = (id.hypot(iq) <= most_a) && psi_d.hypot(psi_q) < psi_wb;
                assert!(on || entered || id == 2.0, "{psi_wb} {share}: {id}, {iq}");
                assert!(on || share < 0.99 || id == 2.0, "{psi_wb}: the most torque is on the circle");
                assert!(id <= 2.0 && iq >= -1e-9 && id.hypot(iq) <= most_a * (1.0 + 1e-9), "{id}, {iq}");
            }
        }
    }

    #[test]
    fn a_circle_that_no_current_reaches_gives_nothing() {
        let (mut machine, smooth) = linear();
        let of = |machine: &MachineFolder| circle(0.02, &SHARES, &smooth, machine, 18.0);
        let Circle { torque_nm, currents_a } = of(&machine);
        assert_eq!((torque_nm, currents_a), (TINY_TORQUE_NM, vec![(-18.0, 0.0); 8]));
        machine.parameters.min_id_a = -11.0;
        assert_eq!(of(&machine).currents_a, vec![(-11.0, 0.0); 8]);
    }

    #[test]
    fn circles_keep_the_least_id() {
        let (mut machine, smooth) = linear();
        machine.parameters.min_id_a = -6.0;
        for psi_wb in [0.18, 0.22, 0.3] {
            let circle = circle(psi_wb, &SHARES, &smooth, &machine, 20.0);
            near(circle.torque_nm, most_nm(psi_wb, 20.0, -6.0), 1e-4);
            assert!(circle.currents_a.iter().all(|(id, _)| *id >= -6.0 - 1e-9), "{:?}", circle.currents_a);
        }
    }

    /// The arc rises from point to point, and ends at its summit; for torques beyond its reach, the result is the summit.
    #[test]
    fn an_arc_rises_to_its_summit() {
        let (machine, smooth) = linear();
        let optimum = Optimum::new(&smooth, &machine.parameters);
        for psi_wb in [0.14, 0.2, 0.26] {
            let arc = rising_arc(psi_wb, &smooth, &optimum, |point| point.id.hypot(point.iq) <= 20.0);
            assert!(arc.len() > 10 && arc.windows(2).all(|pair| pair[0].torque <= pair[1].torque));
            for point in &arc {
                let (psi_d, psi_q) = IPM.flux_wb(point.id, point.iq);
                near(psi_d, psi_wb * point.angle.cos(), 1e-9);
                near(psi_q, psi_wb * point.angle.sin(), 1e-9);
                near(point.torque, IPM.torque_nm(point.id, point.iq), 1e-9);
            }
            let top = arc[arc.len() - 1];
            let (id, iq) = on_arc(&arc, 2.0 * top.torque, psi_wb, &smooth, &optimum);
            assert!((id - top.id).abs() < 1e-6 && (iq - top.iq).abs() < 1e-6);
            for wanted_nm in
                [arc[0].torque + 0.01 * top.torque, 0.5 * (arc[0].torque + top.torque), 0.999 * top.torque]
            {
                let (id, iq) = on_arc(&arc, wanted_nm, psi_wb, &smooth, &optimum);
                near(IPM.torque_nm(id, iq), wanted_nm, 1e-9);
                let (psi_d, psi_q) = IPM.flux_wb(id, iq);
                near(psi_d.hypot(psi_q), psi_wb, 1e-9);
            }
        }
    }

    #[test]
    fn torque_at_an_id() {
        let (machine, smooth) = linear();
        let optimum = Optimum::new(&smooth, &machine.parameters);
        for (id, wanted_nm) in [(-10.0, 12.0), (0.0, 7.0), (2.0, 1.0), (-20.0, 3.0)] {
            let (own, iq) = at_id(id, wanted_nm, &optimum, 20.0);
            assert_eq!(own, id);
            near(iq, wanted_nm / (4.5 * (0.2 - 0.009 * id)), 1e-9);
        }
        assert_eq!(at_id(0.0, 1e3, &optimum, 20.0), (0.0, 20.0));
    }
}
