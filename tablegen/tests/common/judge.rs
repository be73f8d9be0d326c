//! Reads the tables as the drive does and judges them on the smooth map.
#![allow(dead_code)] // each test file uses its part

use tractive_control::machine::Tables;
use tractive_tablegen::{MachineFolder, Optimum, SmoothMap};

/// A machine and its tables.
pub struct Judge {
    pub machine: MachineFolder,
    pub map: SmoothMap,
    pub tables: Tables,
}

/// The largest deviations found.
#[derive(Debug, Default)]
pub struct Worst {
    /// Torque, as a share of what was asked for, where that is at least a quarter of the largest torque.
    pub torque: f64,
    /// Torque, as a share of the largest torque, anywhere.
    pub torque_of_largest: f64,
    /// Current above the optimum (MTPA), flux linkage off its circle (weakening); for at least 2 % of the largest torque.
    pub other: f64,
    /// Flux linkage above its circle's, as a share.
    pub above: f64,
    /// Largest current, in A.
    pub current_a: f64,
}

impl Judge {
    pub fn new(machine: MachineFolder) -> Self {
        let map = SmoothMap::new(&machine.map);
        let tables = machine.tables();
        Self { machine, map, tables }
    }

    fn torque_nm(&self, [id, iq]: [f32; 2]) -> f64 {
        Optimum::new(&self.map, &self.machine.parameters).torque_nm(id.into(), iq.into())
    }

    /// The target's two passes.
    pub fn two_passes(&self, torque: f32) -> [f32; 2] {
        let mtpa = &self.tables.mtpa;
        let [mut id, mut iq, id_trim, iq_trim] = mtpa.start.at(torque);
        let per_flux = torque / (1.5 * self.tables.ratings.pole_pairs);
        for _ in 0..2 {
            let [psi_f, saliency] = mtpa.parameters.at(id, iq);
            let s = (per_flux * saliency).sqrt() / psi_f;
            let [share] = mtpa.universal.at(s / (1.0 + s));
            id = -(psi_f / saliency) * s * share;
            iq = per_flux / (psi_f - saliency * id);
        }
        [id + id_trim, iq + iq_trim]
    }

    /// MTPA over the whole range of torque.
    pub fn mtpa(&self) -> Worst {
        let optimum = Optimum::new(&self.map, &self.machine.parameters);
        let largest = self.machine.parameters.max_torque_nm;
        let mut worst = Worst::default();
        for step in 1..=700 {
            let torque = largest * f64::from(step) / 700.0;
            let [id, iq] = self.two_passes(torque as f32);
            let error = (self.torque_nm([id, iq]) - torque).abs();
            let current = f64::from(id).hypot(iq.into());
            worst.torque_of_largest = worst.torque_of_largest.max(error / largest);
            worst.current_a = worst.current_a.max(current);
            if torque >= 0.02 * largest {
                let (best_d, best_q) = optimum.least_current(torque);
                worst.torque = worst.torque.max(if torque < 0.25 * largest { 0.0 } else { error / torque });
                worst.other = worst.other.max(current / best_d.hypot(best_q) - 1.0);
            }
        }
        worst
    }

    /// Weakening over all circles and torques whose currents have id ≤ 0; above it, only square wave goes.
    pub fn weakening(&self) -> Worst {
        let (tables, largest) = (&self.tables.weakening, self.machine.parameters.max_torque_nm);
        let factor = 1.5 * self.tables.ratings.pole_pairs;
        let mut worst = Worst::default();
        for row in 0..=8 * (tables.currents.rows - 1) {
            let place = tables.torque.first + row as f32 / (8.0 * tables.torque.inverse_step);
            let psi = tables.flux_knee_wb * place / (1.0 - place);
            let [circle, limit, ..] = tables.torque.at(place);
            // No current within the limit has as little flux linkage as a row that gives nothing.
            if tables.torque.nodes[(row / 8).min(tables.currents.rows - 2)][0] < 0.01 {
                continue;
            }
            for step in 1..=80 {
                let torque = limit * step as f32 / 80.0;
                if torque > circle {
                    continue;
                }
                let w = 1.0 - (1.0 - torque / circle).sqrt();
                let [id, effective] = tables.currents.at(place, w / (w + tables.share_knee));
                let iq = torque / (factor * effective);
                if id > 0.0 {
                    continue;
                }
                worst.current_a = worst.current_a.max(f64::from(id).hypot(iq.into()));
                let error = (self.torque_nm([id, iq]) - f64::from(torque)).abs();
                worst.torque_of_largest = worst.torque_of_largest.max(error / largest);
                if f64::from(torque) >= 0.25 * largest {
                    worst.torque = worst.torque.max(error / f64::from(torque));
                }
                let at = self.map.at(id.into(), iq.into());
                let off = at.psi_d_wb.hypot(at.psi_q_wb) / f64::from(psi) - 1.0;
                worst.above = worst.above.max(off);
                if f64::from(torque) >= 0.02 * largest {
                    worst.other = worst.other.max(off.abs());
                }
            }
        }
        worst
    }
}
