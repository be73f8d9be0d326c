//! The current reference: MTPA in the paper's two passes; in field weakening, the same torque with more negative i_d.

use super::super::{Region, flux_linkage, mtpa_passes, torque_nm};
use crate::frames::{Dq, limit, sqrt};
use crate::machine::Tables;

/// The point whose inductances the first of the two passes takes. The paper does not name it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum MtpaStart {
    /// The previous operating point: with each one the passes come nearer to where they no longer move.
    #[default]
    Previous,
    /// Zero current: the plain reading of the paper.
    Zero,
}

/// The maker of the reference.
#[derive(Clone, Copy, Debug)]
pub struct Reference {
    start: MtpaStart,
    /// The last point of MTPA and the last reference, for a torque of at least zero, in A.
    mtpa: Dq,
    last: Dq,
}

/// A reference.
pub struct Point {
    /// Current, in A.
    pub current: Dq,
    /// Flux linkage for that current by the map, in Wb.
    pub flux: Dq,
    /// Torque that it gives by the map, in N·m; the wanted torque if nothing limits it.
    pub torque_nm: f32,
    pub region: Region,
    /// The MTPA current, in A.
    mtpa: Dq,
}

impl Reference {
    pub const fn new(start: MtpaStart) -> Self {
        const NONE: Dq = Dq { d: 0.0, q: 0.0 };
        Self { start, mtpa: NONE, last: NONE }
    }

    pub const fn start(&self) -> MtpaStart {
        self.start
    }

    /// The reference for a torque in N·m, with i_d moved by `moved_a`, in A, from that of MTPA.
    pub fn step(&mut self, wanted_nm: f32, moved_a: f32, tables: &Tables) -> Point {
        let ratings = &tables.ratings;
        let wanted = wanted_nm.abs();
        let most = tables.mtpa.start.last();
        let torque = if wanted > most { most } else { wanted };
        let (start, at) = match self.start {
            MtpaStart::Previous => (self.mtpa, self.last),
            MtpaStart::Zero => (Dq::default(), self.mtpa),
        };
        self.mtpa = mtpa_passes::<2>(torque, start, tables);
        let weakened = moved_a != 0.0;
        let off = weakened || self.mtpa.d < ratings.min_id_a;
        let unlimited = if off { moved(self.mtpa, at, moved_a, torque, tables) } else { self.mtpa };
        let largest = ratings.max_current_a;
        let d = limit(unlimited.d, ratings.min_id_a, largest);
        let left = sqrt(largest * largest - d * d);
        let is_limited = unlimited.q > left || wanted > most;
        self.last = Dq { d, q: if unlimited.q > left { left } else { unlimited.q } };
        let signed =
            |current: Dq| Dq { d: current.d, q: if wanted_nm < 0.0 { -current.q } else { current.q } };
        let current = signed(self.last);
        let flux = flux_linkage(tables, current);
        let (region, torque_nm) = match (is_limited, weakened) {
            (true, _) => (Region::Limit, torque_nm(tables, flux, current)),
            (false, true) => (Region::Weakening, wanted_nm),
            (false, false) => (Region::Mtpa, wanted_nm),
        };
        Point { current, flux, torque_nm, region, mtpa: signed(self.mtpa) }
    }
}

/// The current for a torque in N·m, at least zero, with i_d off that of MTPA; equation (2) with the inductances at a point.
fn moved(mtpa: Dq, at: Dq, moved_a: f32, torque: f32, tables: &Tables) -> Dq {
    let [psi_f, saliency] = tables.mtpa.parameters.at(at.d, at.q);
    let d = tables.ratings.kept_id_a(mtpa.d + moved_a);
    let effective = psi_f - saliency * d;
    // If magnets and saliency cancel, no current gives the torque.
    let least = 0.1 * psi_f;
    let effective = if effective > least { effective } else { least };
    Dq { d, q: torque / (1.5 * tables.ratings.pole_pairs * effective) }
}

impl Point {
    /// Voltage of the MTPA point at an electrical angular speed, in V.
    pub fn mtpa_voltage_v(&self, omega: f32, tables: &Tables) -> f32 {
        let flux = flux_linkage(tables, self.mtpa);
        (flux.j() * omega + self.mtpa * tables.ratings.stator_resistance_ohm).length()
    }
}
