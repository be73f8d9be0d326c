//! Field weakening: constant-torque curves cut with circles of constant flux linkage.

use crate::{FluxMap, Optimum, Parameters, SmoothMap};

/// One circle.
pub struct Circle {
    /// The most torque on it within the current limit, in N·m.
    pub torque_nm: f64,
    /// Currents (id, iq) at the wanted torques, in A.
    pub currents_a: Vec<(f64, f64)>,
}

/// Steps of load angle in which a circle is searched, per half turn.
const ANGLE_STEPS: usize = 720;

/// A point of a circle.
#[derive(Clone, Copy)]
struct Point {
    id: f64,
    iq: f64,
    torque: f64,
}

/// The circle of flux linkage `psi_wb`, with currents at `torque · shares`.
pub fn circle(
    psi_wb: f64,
    shares: &[f64],
    map: &SmoothMap,
    nodes: &FluxMap,
    parameters: &Parameters,
) -> Circle {
    let optimum = Optimum::new(map, parameters);
    let highest_id = nodes.id_a[nodes.id_a.len() - 1];
    let arc = rising_arc(psi_wb, map, &optimum, parameters.max_current_a);
    let Some(top) = arc.last().copied() else {
        // No current within the limit has this flux: nothing to give, and the current that comes nearest.
        let nearest = (-parameters.max_current_a, 0.0);
        return Circle { torque_nm: TINY_TORQUE_NM, currents_a: vec![nearest; shares.len()] };
    };
    let torque_nm = top.torque.max(TINY_TORQUE_NM);
    let currents_a = shares
        .iter()
        .map(|share| {
            let wanted = share * torque_nm;
            let (id, iq) = on_arc(&arc, wanted, psi_wb, map, &optimum);
            if id > highest_id {
                at_id(highest_id, wanted, &optimum, parameters.max_current_a)
            } else {
                (id, iq)
            }
        })
        .collect();
    Circle { torque_nm, currents_a }
}

/// Stands for no torque where something divides by it.
const TINY_TORQUE_NM: f64 = 1e-3;

/// The part of the circle where torque rises with load angle, within the current limit.
fn rising_arc(psi_wb: f64, map: &SmoothMap, optimum: &Optimum, max_current_a: f64) -> Vec<Point> {
    let mut arc: Vec<Point> = Vec::new();
    let mut start = map.inverse(psi_wb, 0.0, (0.0, 0.0));
    let mut angle = 0.0;
    let mut step = std::f64::consts::PI / ANGLE_STEPS as f64;
    let mut limit = std::f64::consts::PI;
    // Whole steps first; past the summit or the current limit, halves of them, towards it.
    while step > 1e-9 && angle <= limit {
        let Some(from) = start else { break };
        let found = map.inverse(psi_wb * angle.cos(), psi_wb * angle.sin(), from);
        let point = found.map(|(id, iq)| Point { id, iq, torque: optimum.torque_nm(id, iq) });
        let last = arc.last().map_or(f64::NEG_INFINITY, |last| last.torque);
        match point {
            Some(point) if point.id.hypot(point.iq) > max_current_a && arc.is_empty() => {
                // The arc may enter the limit later.
                start = Some((point.id, point.iq));
                angle += step;
            }
            Some(point) if point.torque >= last && point.id.hypot(point.iq) <= max_current_a => {
                start = Some((point.id, point.iq));
                arc.push(point);
                angle += step;
            }
            _ => {
                limit = angle;
                angle -= step;
                step *= 0.5;
                angle += step;
            }
        }
    }
    arc
}

/// The point of a torque on the arc: between the two neighbours, by bisection of the load angle.
fn on_arc(arc: &[Point], wanted_nm: f64, psi_wb: f64, map: &SmoothMap, optimum: &Optimum) -> (f64, f64) {
    let upper = arc.partition_point(|point| point.torque < wanted_nm).min(arc.len() - 1);
    let (a, b) = (arc[upper.saturating_sub(1)], arc[upper]);
    let load_angle = |point: &Point| {
        let at = map.at(point.id, point.iq);
        at.psi_q_wb.atan2(at.psi_d_wb)
    };
    let (mut low, mut high) = (load_angle(&a), load_angle(&b));
    let mut best = (b.id, b.iq);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        let Some(found) = map.inverse(psi_wb * middle.cos(), psi_wb * middle.sin(), best) else { break };
        best = found;
        if optimum.torque_nm(found.0, found.1) < wanted_nm { low = middle } else { high = middle }
    }
    best
}

/// The current with a given id that gives a torque.
fn at_id(id: f64, wanted_nm: f64, optimum: &Optimum, max_current_a: f64) -> (f64, f64) {
    let (mut low, mut high) = (0.0, max_current_a);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if optimum.torque_nm(id, middle) < wanted_nm { low = middle } else { high = middle }
    }
    (id, high)
}
