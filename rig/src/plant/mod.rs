//! The plant: a saturated machine behind three inverter legs, in f64; [`zs9`] is the one with two machines.
//!
//! Stator equation in the rotor frame, with the smooth flux map's incremental inductances:
//! `L(i) di/dt = u − R i − jω ψ(i)`. Amplitude-invariant, peak, electrical; d along the magnet flux; currents positive into the
//! machine. The legs' voltages count from the link's midpoint.

mod dc_link;
mod legs;
mod line_filter;
mod rotor;
mod speed;
mod stator;
pub mod stopwatch;
pub mod zs9;

pub use dc_link::{DcLink, DcLinkSettings, LinkEnergies, LinkSwitches, Source};
pub use legs::Leg;
pub use line_filter::{FilteredLink, LineFilter};
pub use rotor::{Rotor, Turning};
pub use speed::{SpeedSource, profile_speed};
pub use stator::{Stator, StatorSlopes};

use core::f64::consts::TAU;
use legs::{Clamp, LONGEST_STEP_S};
use tractive_tablegen::{MachineFolder, SmoothMap};

/// How the true machine differs from its folder.
#[derive(Clone, Copy, Debug)]
pub struct PlantSettings {
    /// True flux linkage over the map's.
    pub flux_scale: f64,
    /// True stator resistance over the rating.
    pub resistance_scale: f64,
}

impl Default for PlantSettings {
    fn default() -> Self {
        Self { flux_scale: 1.0, resistance_scale: 1.0 }
    }
}

/// Energies since the beginning, in J.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energies {
    /// Taken from the link.
    pub electrical_j: f64,
    /// Turned into heat in the stator.
    pub copper_j: f64,
    /// Given to the rotor by the air-gap torque.
    pub mechanical_j: f64,
}

/// Machine and legs.
pub struct Plant {
    stator: Stator,
    rotor: Rotor,
    clamp: Clamp,
    id_a: f64,
    iq_a: f64,
    energies: Energies,
}

/// What is integrated: id, iq, electrical energy, copper loss, the torque's impulse.
type State = [f64; 5];
/// The same, and of the link its voltage and its five energies.
type LinkedState = [f64; 11];

impl Plant {
    /// At rest electrically, angle zero, turning as the speed source says.
    pub fn new(machine: &MachineFolder, speed: SpeedSource, settings: &PlantSettings) -> Self {
        let stator = Stator::new(machine, settings);
        let map = SmoothMap::new(&machine.map);
        Self {
            rotor: Rotor::new(speed, stator.pole_pairs()),
            stator,
            clamp: Clamp::new(machine.parameters.max_current_a, &map, settings.flux_scale),
            id_a: 0.0,
            iq_a: 0.0,
            energies: Energies::default(),
        }
    }

    /// Sets the currents, in A.
    pub fn set_currents(&mut self, id_a: f64, iq_a: f64) {
        (self.id_a, self.iq_a) = (id_a, iq_a);
    }

    /// Currents in the rotor frame, in A.
    pub fn currents_dq(&self) -> (f64, f64) {
        (self.id_a, self.iq_a)
    }

    /// Phase currents, in A.
    pub fn currents_abc(&self) -> [f64; 3] {
        let (sin, cos) = (self.rotor.angle_turns() * TAU).sin_cos();
        phases(self.id_a * cos - self.iq_a * sin, self.id_a * sin + self.iq_a * cos)
    }

    /// Air-gap torque, in N·m.
    pub fn torque_nm(&self) -> f64 {
        self.stator.torque_nm(self.id_a, self.iq_a)
    }

    /// Loads a free rotor with a torque against forward rotation, in N·m; a prescribed speed stays as it is.
    pub fn set_load_nm(&mut self, load_nm: f64) {
        self.rotor.set_load_nm(load_nm);
    }

    /// Electrical rotor angle, in turns, 0 ≤ x < 1.
    pub fn angle_turns(&self) -> f64 {
        self.rotor.angle_turns()
    }

    /// Mechanical speed, in r/min.
    pub fn speed_rpm(&self) -> f64 {
        self.rotor.speed_rpm()
    }

    /// Largest current vector that the machine has when it is short-circuited now and turns on without losses, in A.
    pub fn short_circuit_peak_a(&self) -> f64 {
        self.stator.peak_on_flux_circle_a(self.id_a, self.iq_a)
    }

    /// Energy that the rotor gives when the gates are blocked now, in J: two thirds of the link take the flux linkage away.
    pub fn braked_j(&self, udc_v: f64) -> f64 {
        let speed_rad_s = self.rotor.speed_rpm() * TAU / 60.0;
        self.stator.braked_j((self.id_a, self.iq_a), speed_rad_s, 2.0 / 3.0 * udc_v)
    }

    /// Energy of the field, above that at no current, in J.
    pub fn field_j(&self) -> f64 {
        self.stator.field_j(self.id_a, self.iq_a)
    }

    /// Energies since the beginning.
    pub fn energies(&self) -> Energies {
        self.energies
    }

    /// Lets time pass with the legs unchanged.
    pub fn advance(&mut self, legs: [Leg; 3], udc_v: f64, dt_s: f64) {
        let open = legs.contains(&Leg::Open);
        let mut left = dt_s;
        while left > 0.0 {
            let longest =
                if open { self.clamp.step_s(udc_v, self.currents_abc(), &legs) } else { LONGEST_STEP_S };
            let steps = (left / longest).ceil().max(1.0);
            let step = if open { left.min(longest) } else { left / steps };
            self.step(legs, udc_v, step);
            left = if steps <= 1.0 { 0.0 } else { left - step };
        }
    }

    /// Lets time pass with the legs and the link's switches unchanged, on a link whose voltage follows.
    pub fn advance_on(&mut self, link: &mut DcLink, legs: [Leg; 3], dt_s: f64) {
        let open = legs.contains(&Leg::Open);
        let mut left = dt_s;
        while left > 0.0 {
            let longest = if open {
                self.clamp.step_s(link.udc_v().max(1.0), self.currents_abc(), &legs).min(LONGEST_STEP_S)
            } else {
                LONGEST_STEP_S
            };
            let steps = (left / longest).ceil().max(1.0);
            let step = if open { left.min(longest) } else { left / steps };
            self.step_on(link, legs, step);
            left = if steps <= 1.0 { 0.0 } else { left - step };
        }
    }

    fn step(&mut self, legs: [Leg; 3], udc_v: f64, dt_s: f64) {
        let y0: State = [self.id_a, self.iq_a, 0.0, 0.0, 0.0];
        let y = self
            .integrate(&y0, dt_s, |y, frame, omega| self.slope((y[0], y[1]), legs, udc_v, frame, omega).0);
        self.finish(y, dt_s);
    }

    /// The same with the link's voltage as one more state: what the legs take of its current is what they give the machine.
    fn step_on(&mut self, link: &mut DcLink, legs: [Leg; 3], dt_s: f64) {
        let y0: LinkedState = [self.id_a, self.iq_a, 0.0, 0.0, 0.0, link.udc_v(), 0.0, 0.0, 0.0, 0.0, 0.0];
        let [id, iq, electrical, copper, impulse, udc_v, energies @ ..] =
            self.integrate(&y0, dt_s, |y, frame, omega| {
                let ([id, iq, electrical, copper, impulse], current) =
                    self.slope((y[0], y[1]), legs, y[5], frame, omega);
                let [udc, source, path, discharge, chopper, inverter] = link.slopes(y[5], current);
                [id, iq, electrical, copper, impulse, udc, source, path, discharge, chopper, inverter]
            });
        link.finish(udc_v, energies);
        self.finish([id, iq, electrical, copper, impulse], dt_s);
    }

    fn finish(&mut self, [id, iq, electrical_j, copper_j, impulse]: State, dt_s: f64) {
        (self.id_a, self.iq_a) = (id, iq);
        self.energies.electrical_j += electrical_j;
        self.energies.copper_j += copper_j;
        self.energies.mechanical_j += self.rotor.finish(impulse, dt_s);
    }

    /// Runge–Kutta, fourth order. The frame turns during the step; the speed changes linearly at most.
    fn integrate<const N: usize>(
        &self,
        y0: &[f64; N],
        dt_s: f64,
        slope: impl Fn(&[f64; N], (f64, f64), f64) -> [f64; N],
    ) -> [f64; N] {
        let turning = self.rotor.turning(|| self.torque_nm(), dt_s);
        let (sin0, cos0) = (self.rotor.angle_turns() * TAU).sin_cos();
        let (sin_half, cos_half) = turning.turned(0.5 * dt_s).sin_cos();
        let (sin1, cos1) = (sin0 * cos_half + cos0 * sin_half, cos0 * cos_half - sin0 * sin_half);
        let (sin_whole, cos_whole) = turning.turned(dt_s).sin_cos();
        let (sin2, cos2) = (sin0 * cos_whole + cos0 * sin_whole, cos0 * cos_whole - sin0 * sin_whole);
        let half = turning.omega(0.5 * dt_s);
        let k1 = slope(y0, (sin0, cos0), turning.omega(0.0));
        let k2 = slope(&along(y0, &k1, 0.5 * dt_s), (sin1, cos1), half);
        let k3 = slope(&along(y0, &k2, 0.5 * dt_s), (sin1, cos1), half);
        let k4 = slope(&along(y0, &k3, dt_s), (sin2, cos2), turning.omega(dt_s));
        let mut y = *y0;
        for (index, value) in y.iter_mut().enumerate() {
            *value += dt_s / 6.0 * (k1[index] + 2.0 * (k2[index] + k3[index]) + k4[index]);
        }
        y
    }

    /// Rates of change, and the current that the legs take from the link.
    fn slope(
        &self,
        (id, iq): (f64, f64),
        legs: [Leg; 3],
        udc_v: f64,
        (sin, cos): (f64, f64),
        omega: f64,
    ) -> (State, f64) {
        let currents = phases(id * cos - iq * sin, id * sin + iq * cos);
        let mut volts = [0.0; 3];
        let mut link_a = 0.0;
        for ((volt, leg), current) in volts.iter_mut().zip(legs).zip(currents) {
            (*volt, link_a) = match leg {
                Leg::Upper => (0.5 * udc_v, link_a + current),
                Leg::Lower => (-0.5 * udc_v, link_a),
                Leg::Open => {
                    (self.clamp.voltage(current, udc_v), link_a + self.clamp.share(current) * current)
                }
            };
        }
        let [a, b, c] = volts;
        let (alpha, beta) = ((2.0 * a - b - c) / 3.0, (b - c) / 3.0_f64.sqrt());
        let (ud, uq) = (alpha * cos + beta * sin, beta * cos - alpha * sin);
        let StatorSlopes { id_a_s, iq_a_s, electrical_w, copper_w, torque_nm } =
            self.stator.slopes((id, iq), (ud, uq), omega);
        ([id_a_s, iq_a_s, electrical_w, copper_w, torque_nm], link_a)
    }
}

fn along<const N: usize>(y: &[f64; N], slope: &[f64; N], dt_s: f64) -> [f64; N] {
    let mut out = *y;
    for (value, rate) in out.iter_mut().zip(slope) {
        *value += dt_s * rate;
    }
    out
}

fn phases(alpha: f64, beta: f64) -> [f64; 3] {
    let (x, y) = (-0.5 * alpha, 0.5 * 3.0_f64.sqrt() * beta);
    [alpha, x + y, x - y]
}
