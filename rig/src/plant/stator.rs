//! A machine's stator equation in the rotor frame.

use super::PlantSettings;
use super::runge_kutta::rotated;
use libm::{atan2, hypot, sincos};
use tractive_tablegen::{FluxMap, FluxPoint, Iron, MachineFolder, SmoothMap};

/// Stator of a machine: `L(i) di/dt = u − R i − jω ψ(i)`, with the incremental inductances of the flux map.
#[derive(Clone, Debug)]
pub struct Stator {
    flux: Flux,
    scale: f64,
    /// Flux linkage of the magnets lost through warming, in Wb.
    lost_wb: f64,
    /// Pole pairs.
    pub pole_pairs: f64,
    rated_ohm: f64,
    resistance_ohm: f64,
    /// Amplitude of the magnets' flux-linkage harmonic of order six over the angle, in Wb.
    slots_wb: f64,
    iron: Iron,
}

/// Flux linkage over current.
#[derive(Clone, Debug)]
enum Flux {
    /// A saturated machine: splines through the nodes.
    Smooth(SmoothMap),
    /// A linear machine, which needs no cell search: `ψ_d = ψ_f + L_d i_d`, `ψ_q = L_q i_q`.
    Linear { magnet_wb: f64, ld_h: f64, lq_h: f64 },
}

/// The rates of change in a stator at one instant.
#[derive(Clone, Copy, Debug)]
pub struct StatorSlopes {
    /// di_d/dt, in A/s.
    pub id_a_s: f64,
    /// di_q/dt, in A/s.
    pub iq_a_s: f64,
    /// Electrical power into the machine, in W: `1.5 (u_d i_d + u_q i_q)`.
    pub electrical_w: f64,
    /// Copper loss, in W: `1.5 R |i|²`.
    pub copper_w: f64,
    /// Air-gap torque, in N·m: `1.5 n_p (ψ_d i_q − ψ_q i_d)`; minus the iron's part.
    pub torque_nm: f64,
}

/// Deviation from a plane that counts as rounding in the file, as a share of the largest flux linkage.
const LINEAR_TOLERANCE: f64 = 1e-7;
/// Order of the slots' harmonic over the electrical angle.
const SLOT_ORDER: f64 = 6.0;
/// Number of pieces of the way from zero current along which the field's energy is summed.
const FIELD_PIECES: u32 = 500;

impl Flux {
    /// Flux linkage of the magnets, in Wb.
    fn magnet_wb(&self) -> f64 {
        match self {
            Self::Smooth(map) => map.at(0.0, 0.0).psi_d_wb,
            Self::Linear { magnet_wb, .. } => *magnet_wb,
        }
    }
}

impl Stator {
    /// Made for a machine that differs from its folder as the settings say.
    pub fn new(machine: &MachineFolder, settings: &PlantSettings) -> Self {
        let parameters = &machine.parameters;
        let flux = linear(&machine.map).unwrap_or_else(|| Flux::Smooth(SmoothMap::new(&machine.map)));
        let magnet_wb = settings.flux_scale * flux.magnet_wb();
        Self {
            flux,
            scale: settings.flux_scale,
            lost_wb: (1.0 - settings.magnet_scale) * magnet_wb,
            slots_wb: settings.slots_share / SLOT_ORDER * magnet_wb,
            iron: Iron::of(&machine.parameters, &machine.map, settings.iron_share),
            pole_pairs: f64::from(parameters.pole_pairs),
            rated_ohm: parameters.stator_resistance_ohm,
            resistance_ohm: parameters.stator_resistance_ohm * settings.resistance_scale,
        }
    }

    /// Sets the true flux linkage to a multiple of the map's. Currents stay.
    pub(super) fn set_flux_scale(&mut self, scale: f64) {
        self.scale = scale;
    }

    /// Sets the true resistance to a multiple of the rating. Currents stay.
    pub(super) fn set_resistance_scale(&mut self, scale: f64) {
        self.resistance_ohm = self.rated_ohm * scale;
    }

    /// Sets the magnets' flux linkage to a multiple of theirs; the iron's part stays, and so do the currents.
    pub(super) fn set_magnet_scale(&mut self, scale: f64) {
        self.lost_wb = (1.0 - scale) * self.scale * self.flux.magnet_wb();
    }

    /// True flux linkage over the map's.
    pub(super) fn flux_scale(&self) -> f64 {
        self.scale
    }

    /// Flux linkage and its Jacobian at a current in A.
    #[inline]
    pub fn flux(&self, id_a: f64, iq_a: f64) -> FluxPoint {
        let scale = self.scale;
        let flux = match &self.flux {
            Flux::Smooth(map) => map.at(id_a, iq_a),
            Flux::Linear { magnet_wb, ld_h, lq_h } => FluxPoint {
                psi_d_wb: magnet_wb + ld_h * id_a,
                psi_q_wb: lq_h * iq_a,
                ldd_h: *ld_h,
                ldq_h: 0.0,
                lqd_h: 0.0,
                lqq_h: *lq_h,
            },
        };
        FluxPoint {
            psi_d_wb: flux.psi_d_wb * scale - self.lost_wb,
            psi_q_wb: flux.psi_q_wb * scale,
            ldd_h: flux.ldd_h * scale,
            ldq_h: flux.ldq_h * scale,
            lqd_h: flux.lqd_h * scale,
            lqq_h: flux.lqq_h * scale,
        }
    }

    /// Air-gap torque at a current, in N·m.
    pub fn torque_nm(&self, id_a: f64, iq_a: f64) -> f64 {
        let flux = self.flux(id_a, iq_a);
        1.5 * self.pole_pairs * (flux.psi_d_wb * iq_a - flux.psi_q_wb * id_a)
    }

    /// The part of the torque caused by the slots at a current, with the rotor at an angle of this sine and cosine, in N·m.
    pub fn slot_torque_nm(&self, (id, iq): (f64, f64), rotor: (f64, f64)) -> f64 {
        if self.slots_wb == 0.0 {
            return 0.0;
        }
        let (d, q) = self.slots(rotor);
        1.5 * self.pole_pairs * (d * id + q * iq)
    }

    /// `true` if the iron takes torque.
    #[inline]
    pub fn loses_in_iron(&self) -> bool {
        self.iron.is_some()
    }

    /// The torque that the iron takes at a current and an electrical speed in rad/s, in N·m.
    pub fn iron_torque_nm(&self, (id_a, iq_a): (f64, f64), omega: f64) -> f64 {
        let flux = self.flux(id_a, iq_a);
        let square = flux.psi_d_wb * flux.psi_d_wb + flux.psi_q_wb * flux.psi_q_wb;
        self.iron.torque_nm(square, omega)
    }

    /// The voltage that the slots induce with the rotor at an angle of this sine and cosine, rotor frame, divided by the electrical speed, in Wb. The flux
    /// linkage is `h (cos 6θ, 0)`; its change and rotation are `h (−6 sin 6θ, cos 6θ)`.
    fn slots(&self, rotor: (f64, f64)) -> (f64, f64) {
        let twice = rotated(rotor, rotor);
        let (sin, cos) = rotated(rotated(twice, twice), twice);
        (-SLOT_ORDER * self.slots_wb * sin, self.slots_wb * cos)
    }

    /// The stator equation with the rotor at an angle of the sine and cosine `rotor`; see [`Self::slopes`], which includes neither slots nor iron
    /// loss.
    #[inline]
    pub fn slopes_at(
        &self,
        current: (f64, f64),
        voltage: (f64, f64),
        omega: f64,
        rotor: (f64, f64),
    ) -> StatorSlopes {
        let slopes = if self.slots_wb == 0.0 {
            self.slopes(current, voltage, omega)
        } else {
            self.slopes_with_slots(current, voltage, omega, rotor)
        };
        if !self.loses_in_iron() {
            return slopes;
        }
        StatorSlopes { torque_nm: slopes.torque_nm - self.iron_torque_nm(current, omega), ..slopes }
    }

    /// The same without iron loss, but with slots.
    fn slopes_with_slots(
        &self,
        current: (f64, f64),
        (ud, uq): (f64, f64),
        omega: f64,
        rotor: (f64, f64),
    ) -> StatorSlopes {
        let (slot_d, slot_q) = self.slots(rotor);
        let induced_v = (omega * slot_d, omega * slot_q);
        let without = self.slopes(current, (ud - induced_v.0, uq - induced_v.1), omega);
        let induced_w = 1.5 * (induced_v.0 * current.0 + induced_v.1 * current.1);
        StatorSlopes {
            electrical_w: without.electrical_w + induced_w,
            torque_nm: without.torque_nm + self.slot_torque_nm(current, rotor),
            ..without
        }
    }

    /// The stator equation at a current in A, under a voltage in V, both in the rotor frame, which turns with the electrical speed `omega` in rad/s.
    #[inline]
    pub fn slopes(&self, (id, iq): (f64, f64), (ud, uq): (f64, f64), omega: f64) -> StatorSlopes {
        let flux = self.flux(id, iq);
        let vd = ud - self.resistance_ohm * id + omega * flux.psi_q_wb;
        let vq = uq - self.resistance_ohm * iq - omega * flux.psi_d_wb;
        let det = flux.ldd_h * flux.lqq_h - flux.ldq_h * flux.lqd_h;
        StatorSlopes {
            id_a_s: (flux.lqq_h * vd - flux.ldq_h * vq) / det,
            iq_a_s: (flux.ldd_h * vq - flux.lqd_h * vd) / det,
            electrical_w: 1.5 * (ud * id + uq * iq),
            copper_w: 1.5 * self.resistance_ohm * (id * id + iq * iq),
            torque_nm: 1.5 * self.pole_pairs * (flux.psi_d_wb * iq - flux.psi_q_wb * id),
        }
    }

    /// The voltage of the machine without current, in V, rotor frame, at an electrical speed in rad/s, with the rotor at an angle of this sine and cosine.
    pub fn emf_v(&self, omega: f64, rotor: (f64, f64)) -> (f64, f64) {
        let flux = self.flux(0.0, 0.0);
        let (slot_d, slot_q) = if self.slots_wb == 0.0 { (0.0, 0.0) } else { self.slots(rotor) };
        (omega * (slot_d - flux.psi_q_wb), omega * (slot_q + flux.psi_d_wb))
    }

    /// The change of a current in A over `dt_s`, in A, by one implicit step, with a resistance in ohm between each phase and a common point, if it now changes
    /// at these rates in A/s: `(L/dt + R + jωL) Δi = L di/dt`.
    pub fn settles(
        &self,
        (id, iq): (f64, f64),
        outside_ohm: f64,
        omega: f64,
        (id_a_s, iq_a_s): (f64, f64),
        dt_s: f64,
    ) -> (f64, f64) {
        let FluxPoint { ldd_h, ldq_h, lqd_h, lqq_h, .. } = self.flux(id, iq);
        let ohm = self.resistance_ohm + outside_ohm;
        let (dd, dq) = (ldd_h / dt_s + ohm - omega * lqd_h, ldq_h / dt_s - omega * lqq_h);
        let (qd, qq) = (lqd_h / dt_s + omega * ldd_h, lqq_h / dt_s + ohm + omega * ldq_h);
        let (vd, vq) = (ldd_h * id_a_s + ldq_h * iq_a_s, lqd_h * id_a_s + lqq_h * iq_a_s);
        let det = dd * qq - dq * qd;
        ((qq * vd - dq * vq) / det, (dd * vq - qd * vd) / det)
    }

    /// Energy that the rotor gives if the gates are blocked, in J, at a current in A and a speed in mechanical rad/s: its power falls to zero while
    /// `against_v` removes the flux linkage.
    pub fn braked_j(&self, (id_a, iq_a): (f64, f64), speed_rad_s: f64, against_v: f64) -> f64 {
        let flux = self.flux(id_a, iq_a);
        let decay_s = hypot(flux.psi_d_wb, flux.psi_q_wb) / against_v;
        0.5 * (self.torque_nm(id_a, iq_a) * speed_rad_s).abs() * decay_s
    }

    /// Largest current with the same flux linkage magnitude as a current in A: the result of a short circuit when the rotor turns under a flux
    /// linkage that stands still.
    pub fn peak_on_flux_circle_a(&self, id_a: f64, iq_a: f64) -> f64 {
        const ANGLES: u32 = 180;
        const STEPS: u32 = 20;
        let start = self.flux(id_a, iq_a);
        let (radius, from) = (hypot(start.psi_d_wb, start.psi_q_wb), atan2(start.psi_q_wb, start.psi_d_wb));
        let (mut id, mut iq, mut most) = (id_a, iq_a, hypot(id_a, iq_a));
        for k in 0..=ANGLES {
            let angle = from - core::f64::consts::TAU * f64::from(k) / f64::from(ANGLES);
            for _ in 0..STEPS {
                let at = self.flux(id, iq);
                let (sin, cos) = sincos(angle);
                let (off_d, off_q) = (radius * cos - at.psi_d_wb, radius * sin - at.psi_q_wb);
                let det = at.ldd_h * at.lqq_h - at.ldq_h * at.lqd_h;
                id += (at.lqq_h * off_d - at.ldq_h * off_q) / det;
                iq += (at.ldd_h * off_q - at.lqd_h * off_d) / det;
            }
            most = most.max(hypot(id, iq));
        }
        most
    }

    /// The current of a short circuit in steady state at an electrical speed in rad/s, in A: no voltage is left of `R i + jω ψ`. Where the map is linear it
    /// is `i_d = −ω² L_q ψ_f/(R² + ω² L_d L_q)`, `i_q = −ω R ψ_f/(R² + ω² L_d L_q)`.
    pub fn short_circuit_a(&self, omega: f64) -> (f64, f64) {
        const STEPS: u32 = 50;
        let (mut id, mut iq) = (0.0, 0.0);
        for _ in 0..STEPS {
            let at = self.flux(id, iq);
            let vd = omega * at.psi_q_wb - self.resistance_ohm * id;
            let vq = -omega * at.psi_d_wb - self.resistance_ohm * iq;
            let (dd, dq) = (self.resistance_ohm - omega * at.lqd_h, -omega * at.lqq_h);
            let (qd, qq) = (omega * at.ldd_h, self.resistance_ohm + omega * at.ldq_h);
            let det = dd * qq - dq * qd;
            id += (qq * vd - dq * vq) / det;
            iq += (dd * vq - qd * vd) / det;
        }
        (id, iq)
    }

    /// Energy of the field at a current, above that at zero current, in J: `1.5 ∫ i·dψ` along a straight line from zero.
    pub fn field_j(&self, id_a: f64, iq_a: f64) -> f64 {
        // i·dψ = x iᵀ L(x i) i dx, evaluated in the middle of each piece.
        let pieces = if matches!(self.flux, Flux::Linear { .. }) { 1 } else { FIELD_PIECES };
        let sum: f64 = (0..pieces)
            .map(|k| {
                let x = (f64::from(k) + 0.5) / f64::from(pieces);
                let at = self.flux(id_a * x, iq_a * x);
                x * (id_a * (at.ldd_h * id_a + at.ldq_h * iq_a) + iq_a * (at.lqd_h * id_a + at.lqq_h * iq_a))
            })
            .sum();
        1.5 * sum / f64::from(pieces)
    }
}

/// The flux of a map that is a plane at every node.
fn linear(map: &FluxMap) -> Option<Flux> {
    let (rows, columns) = (map.id_a.len(), map.iq_a.len());
    let last = rows * columns - 1;
    let ld_h = (map.psi_d_wb[last] - map.psi_d_wb[0]) / (map.id_a[rows - 1] - map.id_a[0]);
    let lq_h = (map.psi_q_wb[last] - map.psi_q_wb[0]) / (map.iq_a[columns - 1] - map.iq_a[0]);
    let magnet_wb = map.psi_d_wb[0] - ld_h * map.id_a[0];
    let largest = map.psi_d_wb.iter().chain(&map.psi_q_wb).fold(0.0_f64, |most, psi| most.max(psi.abs()));
    let near = |a: f64, b: f64| (a - b).abs() <= LINEAR_TOLERANCE * largest;
    let nodes = map.id_a.iter().flat_map(|id| map.iq_a.iter().map(move |iq| (id, iq)));
    let fluxes = map.psi_d_wb.iter().zip(&map.psi_q_wb);
    let plane = nodes
        .zip(fluxes)
        .all(|((id, iq), (psi_d, psi_q))| near(magnet_wb + ld_h * id, *psi_d) && near(lq_h * iq, *psi_q));
    plane.then_some(Flux::Linear { magnet_wb, ld_h, lq_h })
}
