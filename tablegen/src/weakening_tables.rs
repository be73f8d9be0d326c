//! The weakening tables: a family of circles of flux linkage, interpolated as the target interpolates them.
//!
//! The target interpolates. So that the result never has more flux linkage or current than it asked for, every circle is made slightly narrower than
//! its row says: by the largest excess that interpolation next to it would cause.

use crate::axis::{Axis, curve, grid};
use crate::weakening::{Circle, circle};
use crate::{MachineFolder, SmoothMap};
use libm::hypot;
use std::f64::consts::{FRAC_2_PI, TAU};
use tractive_control::machine::Weakening;

/// Rows and columns.
const ROWS: usize = 119;
const COLUMNS: usize = 49;
/// Knee of the row axis as a share of the largest flux linkage, and of the column axis: the value half-way along the axis. Rows are closer together
/// at small flux, columns at small torque.
const FLUX_KNEE: f64 = 0.3;
const SHARE_KNEE: f64 = 0.3;
/// Lowest voltage that counts, as a share of six-step at the lowest link.
const LEAST_DEPTH: f64 = 0.8;
/// Least effective flux linkage, as a share of the largest: the divisor of torque stays above zero.
const LEAST_EFFECTIVE: f64 = 1e-6;
/// Torque below this, in N·m, counts as none: no current within the limit has the row's flux linkage.
const NO_TORQUE_NM: f64 = 0.01;
/// Samples per cell and axis at which interpolation is checked, and the number of times that circles are then recomputed.
const SAMPLES: usize = 8;
const ROUNDS: usize = 6;

/// Neighbouring circles, in f64.
struct Circles<'a> {
    machine: &'a MachineFolder,
    smooth: &'a SmoothMap,
    factor: f64,
    knee_wb: f64,
    /// First and last position on the row axis.
    ends: (f64, f64),
    /// Shares of the circle's torque at the columns.
    shares: Vec<f64>,
    margins: Vec<Margins>,
    rows: Vec<Row>,
}

/// Reductions of the flux linkage of a row's nodes, and of its largest current, relative to the row's own, as shares.
#[derive(Clone)]
struct Margins {
    flux: Vec<f64>,
    current: f64,
}

/// A circle as the target reads it.
#[derive(Clone)]
struct Row {
    torque_nm: f64,
    /// id and effective flux linkage `T/(1.5 n_p iq)`.
    nodes: Vec<(f64, f64)>,
}

/// The weakening tables of a machine whose MTPA currents are known.
pub(crate) fn weakening_tables(
    machine: &MachineFolder,
    smooth: &SmoothMap,
    top_flux_wb: f64,
    mtpa: &MtpaCurrents,
) -> Weakening {
    let mut circles = Circles::new(machine, smooth, top_flux_wb);
    for _ in 0..ROUNDS {
        if !circles.narrow() {
            break;
        }
    }
    let rows = Axis::new(circles.ends.0, circles.ends.1, ROWS);
    let columns = Axis::new(0.0, 1.0 / (1.0 + SHARE_KNEE), COLUMNS);
    let currents = circles.rows.iter().flat_map(|row| &row.nodes);
    let currents = currents.map(|(id, effective)| [*id as f32, *effective as f32]).collect();
    Weakening {
        currents: grid(rows, columns, currents),
        torque: curve(rows, circles.torque(mtpa)),
        flux_knee_wb: circles.knee_wb as f32,
        share_knee: SHARE_KNEE as f32,
    }
}

/// The MTPA currents over torque.
pub struct MtpaCurrents {
    /// Torque of the last node, in N·m.
    pub last_torque_nm: f64,
    /// id, iq at even steps from zero torque, in A.
    pub currents_a: Vec<(f64, f64)>,
}

impl MtpaCurrents {
    fn at(&self, torque_nm: f64) -> (f64, f64) {
        let (k, share) = place(torque_nm / self.last_torque_nm, self.currents_a.len());
        let ((id, iq), (next_id, next_iq)) = (self.currents_a[k], self.currents_a[k + 1]);
        (mix(id, next_id, share), mix(iq, next_iq, share))
    }
}

/// Node and share of the way to the next one, for a position of 0 to 1 among `count` nodes.
fn place(position: f64, count: usize) -> (usize, f64) {
    let cells = position * (count - 1) as f64;
    let k = (cells.max(0.0) as usize).min(count - 2);
    (k, cells - k as f64)
}

fn mix(a: f64, b: f64, share: f64) -> f64 {
    a + (b - a) * share
}

/// Just within a limit, in single precision, as a share.
const ALMOST: f64 = 0.999;
/// Upper bound of the smallest circle, as a share of the largest flux linkage.
const MOST_LOW: f64 = 0.7;

impl<'a> Circles<'a> {
    fn new(machine: &'a MachineFolder, smooth: &'a SmoothMap, top_flux_wb: f64) -> Self {
        let parameters = &machine.parameters;
        let max_omega = parameters.max_speed_rpm * TAU / 60.0 * f64::from(parameters.pole_pairs);
        // Below what the lowest link gives at the highest speed, and above what full torque needs. If the link has much voltage in reserve, the
        // circles still lie where the machine's flux linkage does.
        let least_wb = FRAC_2_PI * parameters.dc_link_min_v / max_omega;
        let low = (LEAST_DEPTH * least_wb).min(MOST_LOW * top_flux_wb);
        // Nor where the demagnetisation limit leaves no current, except for what any table has.
        let reach_wb = smooth.at(parameters.least_id_a().max(-parameters.max_current_a), 0.0).psi_d_wb;
        let limited = parameters.least_id_a().is_finite();
        let low = if limited { low.max(reach_wb.min(ALMOST * least_wb)) } else { low };
        let high = (1.15 * top_flux_wb).max(1.5 * low);
        // The largest torque may then need almost all of the available flux linkage.
        let most = smooth.at(0.0, parameters.max_current_a);
        let high = if limited { high.min(ALMOST * hypot(most.psi_d_wb, most.psi_q_wb)) } else { high };
        let knee_wb = FLUX_KNEE * high;
        let share = |k: usize| {
            let x = k as f64 / (COLUMNS - 1) as f64 / (1.0 + SHARE_KNEE);
            let w = SHARE_KNEE * x / (1.0 - x);
            1.0 - (1.0 - w).powi(2)
        };
        let mut circles = Self {
            machine,
            smooth,
            factor: 1.5 * f64::from(parameters.pole_pairs),
            knee_wb,
            ends: (low / (low + knee_wb), high / (high + knee_wb)),
            shares: (0..COLUMNS).map(share).collect(),
            margins: vec![Margins { flux: vec![0.0; COLUMNS], current: 0.0 }; ROWS],
            rows: Vec::new(),
        };
        circles.rows = (0..ROWS).map(|k| circles.row(k)).collect();
        circles
    }

    /// Flux linkage at a position of 0 to 1 on the row axis.
    fn flux_wb(&self, position: f64) -> f64 {
        let x = mix(self.ends.0, self.ends.1, position);
        self.knee_wb * x / (1.0 - x)
    }

    fn row(&self, k: usize) -> Row {
        let Margins { flux, current } = &self.margins[k];
        let wide_wb = self.flux_wb(k as f64 / (ROWS - 1) as f64);
        let psi_wb = wide_wb * (1.0 - flux[COLUMNS - 1]);
        let max_current_a = self.machine.parameters.max_current_a * (1.0 - current);
        let Circle { torque_nm, currents_a } =
            circle(psi_wb, &self.shares, self.smooth, self.machine, max_current_a);
        let least = LEAST_EFFECTIVE * self.flux_wb(1.0);
        let nodes = currents_a.iter().zip(&self.shares).zip(flux).map(|((start, share), margin)| {
            let wanted_nm = share * torque_nm;
            let (id, iq) = self.moved(*start, wanted_nm, psi_wb, wide_wb * (1.0 - margin));
            let effective = if iq > 1e-6 * max_current_a {
                wanted_nm / (self.factor * iq)
            } else {
                // The limit of this where iq vanishes with the torque.
                let at = self.smooth.at(id, 0.0);
                at.psi_d_wb - at.lqq_h * id
            };
            (id, effective.max(least))
        });
        Row { torque_nm, nodes: nodes.collect() }
    }

    /// The current that gives the same torque on a circle slightly off the one it lies on; unchanged if it lies on none, or if no current gives that
    /// torque there.
    fn moved(&self, start: (f64, f64), torque_nm: f64, from_wb: f64, to_wb: f64) -> (f64, f64) {
        let (mut id, mut iq) = start;
        let highest_id = self.machine.map.id_a[self.machine.map.id_a.len() - 1];
        let allowed = |id: f64| id <= highest_id && id >= self.machine.parameters.least_id_a();
        let at = self.smooth.at(id, iq);
        if from_wb == to_wb || (hypot(at.psi_d_wb, at.psi_q_wb) / from_wb - 1.0).abs() > 1e-9 {
            return start;
        }
        for _ in 0..20 {
            let at = self.smooth.at(id, iq);
            let torque = self.factor * (at.psi_d_wb * iq - at.psi_q_wb * id) - torque_nm;
            let square = at.psi_d_wb.powi(2) + at.psi_q_wb.powi(2) - to_wb * to_wb;
            if torque.abs() < 1e-9 * self.machine.parameters.max_torque_nm
                && square.abs() < 1e-12 * to_wb * to_wb
            {
                return if allowed(id) { (id, iq) } else { start };
            }
            let torque_by_id = self.factor * (at.ldd_h * iq - at.lqd_h * id - at.psi_q_wb);
            let torque_by_iq = self.factor * (at.psi_d_wb + at.ldq_h * iq - at.lqq_h * id);
            let square_by_id = 2.0 * (at.psi_d_wb * at.ldd_h + at.psi_q_wb * at.lqd_h);
            let square_by_iq = 2.0 * (at.psi_d_wb * at.ldq_h + at.psi_q_wb * at.lqq_h);
            let det = torque_by_id * square_by_iq - torque_by_iq * square_by_id;
            id -= (torque * square_by_iq - torque_by_iq * square) / det;
            iq -= (torque_by_id * square - torque * square_by_id) / det;
        }
        start
    }

    /// id, iq and torque, as the target finds them between the nodes.
    fn read(&self, row_position: f64, column_position: f64) -> (f64, f64, f64) {
        let (r, x) = place(row_position, ROWS);
        let (c, y) = place(column_position, COLUMNS);
        let node = |dr: usize, dc: usize| self.rows[r + dr].nodes[c + dc];
        let both = |part: fn((f64, f64)) -> f64| {
            let along = |dr: usize| mix(part(node(dr, 0)), part(node(dr, 1)), y);
            mix(along(0), along(1), x)
        };
        let circle_nm = mix(self.rows[r].torque_nm, self.rows[r + 1].torque_nm, x);
        let reach = column_position / (1.0 + SHARE_KNEE);
        let w = SHARE_KNEE * reach / (1.0 - reach);
        let torque_nm = circle_nm * (1.0 - (1.0 - w).powi(2));
        (both(|node| node.0), torque_nm / (self.factor * both(|node| node.1)), torque_nm)
    }

    /// Makes the circles narrower where interpolation next to them exceeds flux linkage or current; `true` if it had to.
    fn narrow(&mut self) -> bool {
        const ROUNDING: f64 = 1e-7;
        let mut more = vec![Margins { flux: vec![0.0; COLUMNS], current: 0.0 }; ROWS];
        for r in (0..ROWS - 1).filter(|r| self.rows[*r].torque_nm > NO_TORQUE_NM) {
            for c in 0..COLUMNS - 1 {
                let (flux, current) = self.excess(r, c);
                for row in &mut more[r..=r + 1] {
                    row.current = row.current.max(current);
                    for node in &mut row.flux[c..=c + 1] {
                        *node = node.max(flux);
                    }
                }
            }
        }
        let mut narrowed = false;
        for (k, more) in more.into_iter().enumerate() {
            if more.current > ROUNDING || more.flux.iter().any(|flux| *flux > ROUNDING) {
                let margins = &mut self.margins[k];
                margins.current += more.current;
                for (margin, more) in margins.flux.iter_mut().zip(more.flux) {
                    *margin += more;
                }
                self.rows[k] = self.row(k);
                narrowed = true;
            }
        }
        narrowed
    }

    /// Largest excess of flux linkage and current within a cell, as shares.
    fn excess(&self, row: usize, column: usize) -> (f64, f64) {
        let mut most = (0.0_f64, 0.0_f64);
        let position = |node: usize, sample: usize, count: usize| {
            (node as f64 + sample as f64 / SAMPLES as f64) / (count - 1) as f64
        };
        for (r, c) in (0..=SAMPLES).flat_map(|r| (0..=SAMPLES).map(move |c| (r, c))) {
            let at_row = position(row, r, ROWS);
            let (id, iq, _) = self.read(at_row, position(column, c, COLUMNS));
            // At id > 0 there is no field weakening.
            if id > 0.0 {
                continue;
            }
            let at = self.smooth.at(id, iq);
            let flux = hypot(at.psi_d_wb, at.psi_q_wb) / self.flux_wb(at_row) - 1.0;
            let current = hypot(id, iq) / self.machine.parameters.max_current_a - 1.0;
            most = (most.0.max(flux), most.1.max(current));
        }
        most
    }

    fn torque(&self, mtpa: &MtpaCurrents) -> Vec<[f32; 5]> {
        let mut most = 0.0_f64;
        let limits: Vec<f64> = self
            .rows
            .iter()
            .map(|row| {
                most = most.max(row.torque_nm);
                most
            })
            .collect();
        let at = |k: usize| {
            let (without, rise) = self.above_mtpa(k, &limits, mtpa);
            let row = [self.rows[k].torque_nm, limits[k], self.slope(k, &limits), without, rise];
            row.map(|value| value as f32)
        };
        (0..ROWS).map(at).collect()
    }

    /// Largest share by which ψ² falls below, or rises above, what the voltage leaves without torque: the copper's part of the power, for a torque at
    /// a row and the lowest voltage.
    fn copper_share(&self, psi_wb: f64, torque_nm: f64) -> f64 {
        let parameters = &self.machine.parameters;
        let voltage_v = LEAST_DEPTH * FRAC_2_PI * parameters.dc_link_min_v;
        2.0 * parameters.stator_resistance_ohm * torque_nm / (self.factor * voltage_v * psi_wb)
    }

    /// Least value of dT_limit/dψ² within the range by which the copper's voltage moves ψ².
    fn slope(&self, k: usize, limits: &[f64]) -> f64 {
        let square = |k: usize| self.flux_wb(k as f64 / (ROWS - 1) as f64).powi(2);
        let reach = self.copper_share(square(k).sqrt(), limits[k]);
        let cells = (0..ROWS - 1).filter(|cell| {
            square(cell + 1) >= square(k) * (1.0 - reach) && square(*cell) <= square(k) * (1.0 + reach)
        });
        let slopes = cells.map(|cell| (limits[cell + 1] - limits[cell]) / (square(cell + 1) - square(cell)));
        slopes.fold(f64::INFINITY, f64::min)
    }

    /// A line over `w = 1 − √(1 − |T|/T_most)` above the excess of i² over that of the MTPA point: its height without torque, and its rise to the
    /// largest torque. The circles are those that the copper's voltage leaves, motoring and braking.
    fn above_mtpa(&self, k: usize, limits: &[f64], mtpa: &MtpaCurrents) -> (f64, f64) {
        const STEPS: usize = 64;
        let psi_wb = self.flux_wb(k as f64 / (ROWS - 1) as f64);
        let at = |torque_nm: f64, sign: f64| {
            let left_wb = psi_wb * (1.0 - sign * self.copper_share(psi_wb, torque_nm)).max(0.0).sqrt();
            let x = left_wb / (left_wb + self.knee_wb);
            let position = ((x - self.ends.0) / (self.ends.1 - self.ends.0)).max(0.0);
            let (r, share) = place(position, ROWS);
            let circle_nm = mix(self.rows[r].torque_nm, self.rows[r + 1].torque_nm, share);
            let w = 1.0 - (1.0 - torque_nm / circle_nm).max(0.0).sqrt();
            let (id, iq, _) = self.read(position, w / (w + SHARE_KNEE) * (1.0 + SHARE_KNEE));
            let (best_d, best_q) = mtpa.at(torque_nm);
            // To the right of the MTPA point there is no field weakening.
            if id > best_d { 0.0 } else { (id * id + iq * iq - best_d * best_d - best_q * best_q).max(0.0) }
        };
        let without = at(0.0, 1.0);
        let slope = self.slope(k, limits) * psi_wb.powi(2);
        let rise = [1.0, -1.0].into_iter().flat_map(|sign| {
            let most = limits[k] / (1.0 + sign * self.copper_share(psi_wb, slope));
            let steps = (1..=STEPS).map(|step| step as f64 / STEPS as f64);
            steps.map(move |w| (at(most * (1.0 - (1.0 - w).powi(2)), sign) - without) / w)
        });
        (without, rise.fold(0.0, f64::max))
    }
}

#[cfg(test)]
mod tests;
