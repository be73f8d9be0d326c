//! The tables of a machine, from its flux map.

use crate::axis::{Axis, curve, grid};
use crate::weakening_tables::{MtpaCurrents, weakening_tables};
use crate::{FluxMap, Iron, MachineFolder, Optimum, Parameters, SmoothMap};
use libm::hypot;
use tractive_control::machine::{IronLoss, Mtpa, Ratings, Tables, ZSourceNetwork};

/// Nodes of the universal curve.
const UNIVERSAL_NODES: usize = 65;
/// Nodes of the torque axis: 10 N·m apart for the reference machine.
const TORQUE_NODES: usize = 125;
/// Range of the torque axis over the largest torque, as far as current allows: room for a trim.
const TORQUE_ROOM: f64 = 1.06;
/// Flux ripple over which the torque's curvature is taken, in volts of the link times free carriers: 1.34 times the rms value that such a carrier
/// leaves across the flux linkage at most. For a ripple distributed uniformly over its range, that is right to the fourth power.
const RIPPLE: f64 = 0.03;
/// Least magnet flux and saliency of the MTPA parameters, as shares of flux and inductance at full torque.
const REGULAR_SHARE: f64 = 0.02;

impl MachineFolder {
    /// The tables that a drive runs on; they live as long as the program.
    pub fn tables(&self) -> Tables {
        let Self { parameters, map } = self;
        let smooth = SmoothMap::new(map);
        let optimum = Optimum::new(&smooth, parameters);
        let currents = CurrentGrid::new(map);
        let top = optimum.least_current(parameters.max_torque_nm);
        let top_flux = smooth.at(top.0, top.1);
        let top_flux_wb = hypot(top_flux.psi_d_wb, top_flux.psi_q_wb);
        let regular = Regular {
            psi_f_wb: REGULAR_SHARE * top_flux_wb,
            saliency_h: REGULAR_SHARE * top_flux.psi_q_wb.abs() / top.1.abs().max(1e-9),
        };
        let parameter_grid = ParameterGrid::new(&currents, &smooth, &regular);
        let universal = universal();
        let best = BestCurrents::new(&optimum, parameters);
        let start = best.start(&parameter_grid, &universal, 1.5 * f64::from(parameters.pole_pairs));
        let (rows, columns) = (axis_of(&currents.id_a), axis_of(&currents.iq_a));
        let nodes = |(psi, saliency): &(f64, f64)| [*psi as f32, *saliency as f32];
        let parameter_nodes = parameter_grid.nodes.iter().map(nodes).collect();
        let universal_nodes = universal.iter().map(|value| [*value as f32]).collect();
        let mtpa = Mtpa {
            universal: curve(Axis::new(0.0, 1.0, UNIVERSAL_NODES), universal_nodes),
            parameters: grid(rows, columns, parameter_nodes),
            start: curve(Axis::new(0.0, best.last_torque_nm(), TORQUE_NODES), start),
            curvature: curve(
                Axis::new(0.0, best.last_torque_nm(), TORQUE_NODES),
                best.curvature(&optimum, parameters),
            ),
        };
        Tables {
            name: parameters.name.clone().leak(),
            ratings: Ratings {
                iron: Iron::of(parameters, map, 1.0).known(),
                ..ratings(parameters, smooth.at(0.0, 0.0).psi_d_wb)
            },
            flux: grid(rows, columns, currents.flux(&smooth)),
            mtpa,
            weakening: weakening_tables(self, &smooth, top_flux_wb, &best.currents()),
            z_source: ZSourceNetwork {
                source_v: parameters.zs9_source_v as f32,
                inductance_h: parameters.zs9_inductance_h as f32,
                resistance_ohm: parameters.zs9_resistance_ohm as f32,
                capacitance_f: parameters.zs9_capacitance_f as f32,
            },
        }
    }
}

/// The currents of least magnitude over torque: (torque in N·m, (id, iq) in A).
struct BestCurrents(Vec<(f64, (f64, f64))>);

impl BestCurrents {
    fn new(optimum: &Optimum, parameters: &Parameters) -> Self {
        let last_torque = (TORQUE_ROOM * parameters.max_torque_nm).min(optimum.most_torque_nm());
        let torques = (0..TORQUE_NODES).map(|k| last_torque * k as f64 / (TORQUE_NODES - 1) as f64);
        Self(torques.map(|torque| (torque, optimum.least_current(torque))).collect())
    }

    fn last_torque_nm(&self) -> f64 {
        self.0[TORQUE_NODES - 1].0
    }

    /// `[id, iq, id trim, iq trim]`, in A: the start of the first pass, and the error that the second one leaves.
    fn start(&self, grid: &ParameterGrid, universal: &[f64], factor: f64) -> Vec<[f32; 4]> {
        let node = |(torque, best): &(f64, (f64, f64))| {
            let passed = grid.two_passes(torque / factor, *best, universal);
            [best.0, best.1, best.0 - passed.0, best.1 - passed.1].map(|value| value as f32)
        };
        self.0.iter().map(node).collect()
    }

    /// `[along, across]`, in N·m/Wb².
    fn curvature(&self, optimum: &Optimum, parameters: &Parameters) -> Vec<[f32; 2]> {
        let ripple_wb = RIPPLE * parameters.dc_link_nominal_v / parameters.max_switching_hz;
        let node = |best| optimum.curvature(best, ripple_wb).map(|value| value as f32);
        self.0.iter().map(|(_, best)| node(*best)).collect()
    }

    fn currents(&self) -> MtpaCurrents {
        MtpaCurrents {
            last_torque_nm: self.last_torque_nm(),
            currents_a: self.0.iter().map(|(_, current)| *current).collect(),
        }
    }
}

/// The grid of the target's current tables: the folder's own for iq ≥ 0, unless that is too coarse to be read bilinearly or too fine to be stored;
/// then it has another even step, with values from the smooth map.
struct CurrentGrid {
    id_a: Vec<f64>,
    iq_a: Vec<f64>,
}

impl CurrentGrid {
    fn new(map: &FluxMap) -> Self {
        let last = map.iq_a.len() - 1;
        // A grid with both signs may pass 0 between two nodes; its half then has a slightly smaller step.
        let half = map.iq_a.len() / 2;
        Self {
            id_a: even_axis(map.id_a[0], map.id_a[map.id_a.len() - 1], intervals(map.id_a.len() - 1)),
            iq_a: even_axis(0.0, map.iq_a[last], intervals(half)),
        }
    }

    /// Node values whose bilinear interpolation is right on average: a chord lies above a convex curve, by a twelfth of the second difference on
    /// average, so the nodes are lowered by that amount.
    fn flux(&self, smooth: &SmoothMap) -> Vec<[f32; 2]> {
        let (step_d, step_q) = (self.id_a[1] - self.id_a[0], self.iq_a[1] - self.iq_a[0]);
        let nodes = self.id_a.iter().flat_map(|id| self.iq_a.iter().map(|iq| (*id, *iq)));
        let at = |id: f64, iq: f64| {
            let point = smooth.at(id, iq);
            [point.psi_d_wb, point.psi_q_wb]
        };
        nodes
            .map(|(id, iq)| {
                let here = at(id, iq);
                let around =
                    [at(id - step_d, iq), at(id + step_d, iq), at(id, iq - step_q), at(id, iq + step_q)];
                core::array::from_fn(|axis| {
                    let second_differences =
                        around.iter().map(|flux| flux[axis]).sum::<f64>() - 4.0 * here[axis];
                    (here[axis] - second_differences / 12.0) as f32
                })
            })
            .collect()
    }
}

/// Bounds of the number of cells along a current axis.
const CELLS: std::ops::RangeInclusive<usize> = 20..=64;

/// Cells along an axis: the folder's number, or the nearest multiple or fraction of it within bounds.
fn intervals(own: usize) -> usize {
    if own < *CELLS.start() {
        own * CELLS.start().div_ceil(own)
    } else {
        own.div_ceil(own.div_ceil(*CELLS.end()))
    }
}

fn even_axis(first: f64, last: f64, cells: usize) -> Vec<f64> {
    (0..=cells).map(|k| first + (last - first) * k as f64 / cells as f64).collect()
}

fn axis_of(values: &[f64]) -> Axis {
    Axis::new(values[0], values[values.len() - 1], values.len())
}

/// Least values of the parameters, so that there is no division by zero.
struct Regular {
    psi_f_wb: f64,
    saliency_h: f64,
}

/// ψ_f(iq) = ψd(0, iq) and L_q − L_d over the grid.
struct ParameterGrid {
    id_a: Vec<f64>,
    iq_a: Vec<f64>,
    nodes: Vec<(f64, f64)>,
}

impl ParameterGrid {
    fn new(grid: &CurrentGrid, smooth: &SmoothMap, regular: &Regular) -> Self {
        let step_d = grid.id_a[1] - grid.id_a[0];
        let mut nodes = Vec::with_capacity(grid.id_a.len() * grid.iq_a.len());
        for &id in &grid.id_a {
            for &iq in &grid.iq_a {
                let here = smooth.at(id, iq);
                let psi_f = smooth.at(0.0, iq).psi_d_wb;
                // On the axes the limits of the static inductances are the incremental ones.
                let ld = if id.abs() < 1e-6 * step_d { here.ldd_h } else { (here.psi_d_wb - psi_f) / id };
                let lq = if iq == 0.0 { here.lqq_h } else { here.psi_q_wb / iq };
                nodes.push((psi_f.max(regular.psi_f_wb), (lq - ld).max(regular.saliency_h)));
            }
        }
        Self { id_a: grid.id_a.clone(), iq_a: grid.iq_a.clone(), nodes }
    }

    fn bilinear(&self, id: f64, iq: f64) -> (f64, f64) {
        let place = |axis: &[f64], value: f64| {
            let position = (value - axis[0]) / (axis[1] - axis[0]);
            let cell = (position.max(0.0) as usize).min(axis.len() - 2);
            (cell, position - cell as f64)
        };
        let ((r, x), (c, y)) = (place(&self.id_a, id), place(&self.iq_a, iq));
        let node = |dr: usize, dc: usize| self.nodes[(r + dr) * self.iq_a.len() + c + dc];
        let mix = |part: fn((f64, f64)) -> f64| {
            let (a, b, d, e) = (part(node(0, 0)), part(node(0, 1)), part(node(1, 0)), part(node(1, 1)));
            (a + (b - a) * y) * (1.0 - x) + (d + (e - d) * y) * x
        };
        (mix(|node| node.0), mix(|node| node.1))
    }

    /// The firmware's own result, without trims: two passes from `start` for `torque / (1.5 n_p)`.
    fn two_passes(&self, torque_per_factor: f64, start: (f64, f64), universal: &[f64]) -> (f64, f64) {
        let mut current = start;
        for _ in 0..2 {
            let (psi_f, saliency) = self.bilinear(current.0, current.1);
            let root = (torque_per_factor * saliency).sqrt() / psi_f;
            let position = root / (1.0 + root) * (universal.len() - 1) as f64;
            let cell = (position as usize).min(universal.len() - 2);
            let share = universal[cell] + (universal[cell + 1] - universal[cell]) * (position - cell as f64);
            let id = -(psi_f / saliency) * root * share;
            current = (id, torque_per_factor / (psi_f - saliency * id));
        }
        current
    }
}

/// `−i_dn/s` with `s⁴ = t_en² = i_dn (i_dn − 1)³`, over `x = s/(1+s)`.
fn universal() -> Vec<f64> {
    (0..UNIVERSAL_NODES)
        .map(|k| {
            let x = k as f64 / (UNIVERSAL_NODES - 1) as f64;
            if k == 0 || k == UNIVERSAL_NODES - 1 {
                return x;
            }
            let s = x / (1.0 - x);
            // With i = −i_dn: i (1 + i)³ = s⁴, and i < s.
            let (mut low, mut high) = (0.0, s);
            for _ in 0..200 {
                let i = 0.5 * (low + high);
                if i * (1.0 + i).powi(3) < s.powi(4) { low = i } else { high = i }
            }
            0.5 * (low + high) / s
        })
        .collect()
}

fn ratings(parameters: &Parameters, magnet_flux_wb: f64) -> Ratings {
    let rad_s = std::f64::consts::TAU / 60.0;
    Ratings {
        pole_pairs: parameters.pole_pairs as f32,
        stator_resistance_ohm: parameters.stator_resistance_ohm as f32,
        max_torque_nm: parameters.max_torque_nm as f32,
        max_power_w: parameters.max_power_w as f32,
        max_current_a: parameters.max_current_a as f32,
        min_id_a: parameters.min_id_a as f32,
        max_speed_rad_s: (parameters.max_speed_rpm * rad_s) as f32,
        magnet_flux_wb: magnet_flux_wb.max(0.0) as f32,
        dc_link_min_v: parameters.dc_link_min_v as f32,
        dc_link_nominal_v: parameters.dc_link_nominal_v as f32,
        dc_link_max_v: parameters.dc_link_max_v as f32,
        max_switching_hz: parameters.max_switching_hz as f32,
        trip_current_a: parameters.trip_current_a as f32,
        trip_dc_over_v: parameters.trip_dc_over_v as f32,
        trip_dc_under_v: parameters.trip_dc_under_v as f32,
        trip_speed_rad_s: (parameters.trip_speed_rpm * rad_s) as f32,
        torque_slew_nm_s: parameters.torque_slew_nm_per_s as f32,
        max_acceleration_rad_s2: (f64::from(parameters.pole_pairs) * parameters.max_torque_nm
            / parameters.rotor_inertia_kg_m2) as f32,
        iron: IronLoss::NONE,
        iron_share: parameters.iron_loss_share as f32,
    }
}

#[cfg(test)]
mod tests;
