//! The plant: a saturated machine behind three inverter legs, in f64; [`zs9`] is the plant with two machines.
//!
//! Stator equation in the rotor frame, with the smooth flux map's incremental inductances: `L(i) di/dt = u − R i − jω ψ(i)`. Amplitude-invariant,
//! peak, electrical; d along the magnet flux; currents positive into the machine. The legs' voltages are measured from the link's midpoint.
#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

mod dc_link;
mod devices;

mod legs;
mod line_filter;
mod motor;
mod rest;
mod rotor;
mod runge_kutta;
mod shaft;
mod speed;
mod stator;
pub mod stopwatch;
mod thermal;
mod vector;
mod wheel;
pub mod zs9;

pub use dc_link::{DcLink, DcLinkSettings, LinkEnergies, LinkSwitches, Source};
pub use devices::DeviceDrops;
pub use legs::Leg;
pub use line_filter::{FilteredLink, LineFilter};
pub use motor::{Motor, MotorEnergies};
pub use rotor::{Rotor, Turning};
pub use shaft::ShaftSettings;
pub use speed::{SpeedSource, profile_speed};
pub use stator::{Stator, StatorSlopes};
pub use thermal::{Heat, HeatSettings, Node, Wire, Wired};
pub use vector::Vector;
pub use wheel::Wheel;

use legs::{Clamp, LONGEST_STEP_S};
use runge_kutta::{rotated, stepped};
use tractive_tablegen::{MachineFolder, SmoothMap};

/// The deviations of the true machine from its folder.
#[derive(Clone, Copy, Debug)]
pub struct PlantSettings {
    /// True flux linkage over the map's.
    pub flux_scale: f64,
    /// True stator resistance over the rating.
    pub resistance_scale: f64,
    /// The magnets' flux linkage over the map's, at 20 °C.
    pub magnet_scale: f64,
    /// Sixth harmonic of the magnets' voltage over the rotor's angle, as a share of that voltage.
    pub slots_share: f64,
    /// Voltage drops of the inverter's devices; a plant with several motors has its own.
    pub drops: DeviceDrops,
    /// Iron loss as a torque, as a share of the loss that the machine's folder names; a plant with several motors has none.
    pub iron_share: f64,
    /// The elastic shaft between rotor and load, if there is one.
    pub shaft: Option<ShaftSettings>,
}

impl Default for PlantSettings {
    fn default() -> Self {
        Self {
            flux_scale: 1.0,
            resistance_scale: 1.0,
            slots_share: 0.0,
            magnet_scale: 1.0,
            drops: DeviceDrops::NONE,
            iron_share: 0.0,
            shaft: None,
        }
    }
}

impl PlantSettings {
    /// The machine's folder with its true flux map and its true resistance.
    pub fn folder(&self, machine: &MachineFolder) -> MachineFolder {
        let mut truth = machine.clone();
        let magnet_wb = self.flux_scale * SmoothMap::new(&machine.map).at(0.0, 0.0).psi_d_wb;
        let lost_wb = (1.0 - self.magnet_scale) * magnet_wb;
        truth.map.psi_d_wb.iter_mut().for_each(|psi_wb| *psi_wb = *psi_wb * self.flux_scale - lost_wb);
        truth.map.psi_q_wb.iter_mut().for_each(|psi_wb| *psi_wb *= self.flux_scale);
        truth.parameters.stator_resistance_ohm *= self.resistance_scale;
        truth
    }
}

/// Machine and legs.
pub struct Plant {
    /// The machine.
    pub motor: Motor,
    clamp: Clamp,
    drops: DeviceDrops,
    flux_scale: f64,
}

/// The rotor frame at an instant.
#[derive(Clone, Copy)]
struct Frame {
    /// Sine and cosine of its angle.
    sin_cos: (f64, f64),
    /// Its electrical speed, in rad/s.
    omega: f64,
}

/// The quantities that are integrated: id, iq, electrical energy, copper loss, the torque's impulse.
type State = [f64; 5];
/// The same, plus the link's voltage, its choke's current and its five energies.
type LinkedState = [f64; 12];

impl Plant {
    /// Without current, angle zero, turning as the speed source says.
    pub fn new(machine: &MachineFolder, speed: SpeedSource, settings: &PlantSettings) -> Self {
        let map = SmoothMap::new(&machine.map);
        Self {
            motor: Motor::new(machine, speed, settings),
            clamp: Clamp::new(machine.parameters.max_current_a, &map, settings.flux_scale),
            drops: settings.drops,
            flux_scale: settings.flux_scale,
        }
    }

    /// Sets the machine's true flux linkage to a multiple of the map's, above 0. Currents stay as they are.
    pub fn set_flux_scale(&mut self, flux_scale: f64) {
        self.clamp = self.clamp.scaled(flux_scale / self.flux_scale);
        self.motor.stator.set_flux_scale(flux_scale);
        self.flux_scale = flux_scale;
    }

    /// Sets the machine's true resistance to a multiple of its rating, from 0. Currents stay as they are.
    pub fn set_resistance_scale(&mut self, scale: f64) {
        self.motor.stator.set_resistance_scale(scale);
    }

    /// Sets the flux linkage of the machine's magnets to a multiple of theirs, from 0. Currents stay as they are.
    pub fn set_magnet_scale(&mut self, scale: f64) {
        self.motor.stator.set_magnet_scale(scale);
    }

    /// Lets time pass with the legs unchanged.
    pub fn advance(&mut self, legs: [Leg; 3], udc_v: f64, dt_s: f64) {
        let mut left_s = dt_s;
        while left_s > 0.0 {
            left_s -= if let Some(rest) = self.rest(legs, udc_v, left_s) {
                self.finish(rest.state, rest.dt_s);
                rest.dt_s
            } else {
                let step_s = self.step_s(&legs, udc_v, left_s);
                self.step(legs, udc_v, step_s);
                step_s
            };
        }
    }

    /// Lets time pass with the legs and the link's switches unchanged, on a link whose voltage changes.
    pub fn advance_on(&mut self, link: &mut DcLink, legs: [Leg; 3], dt_s: f64) {
        let mut left_s = dt_s;
        while left_s > 0.0 {
            let now_s = left_s.min(link.longest_step_s());
            left_s -= if let Some(rest) = self.rest(legs, link.udc_v, now_s) {
                link.advance(rest.link_a, rest.dt_s);
                self.finish(rest.state, rest.dt_s);
                rest.dt_s
            } else {
                let step_s = self.step_s(&legs, link.udc_v, now_s);
                self.step_on(link, legs, step_s);
                step_s
            };
        }
    }

    /// The next step out of the time that is left, in s: equal parts of it, except where diodes decide.
    fn step_s(&self, legs: &[Leg; 3], udc_v: f64, left_s: f64) -> f64 {
        if legs.contains(&Leg::Open) {
            let longest_s = self.clamp.step_s(udc_v.max(1.0), self.motor.currents_abc(), legs);
            left_s.min(longest_s).min(LONGEST_STEP_S)
        } else {
            left_s / (left_s / LONGEST_STEP_S).ceil().max(1.0)
        }
    }

    fn step(&mut self, legs: [Leg; 3], udc_v: f64, dt_s: f64) {
        let y0: State = [self.motor.id_a, self.motor.iq_a, 0.0, 0.0, 0.0];
        let y = self.integrate(&y0, dt_s, |y, frame| self.slope((y[0], y[1]), legs, udc_v, frame).0);
        self.finish(y, dt_s);
    }

    /// The same with the link's voltage as one more state: the current that the legs take from the link is the current that they give the machine.
    fn step_on(&mut self, link: &mut DcLink, legs: [Leg; 3], dt_s: f64) {
        let (id, iq) = self.motor.currents_dq();
        let y0: LinkedState = [id, iq, 0.0, 0.0, 0.0, link.udc_v, link.choke_a, 0.0, 0.0, 0.0, 0.0, 0.0];
        let [id, iq, electrical, copper, impulse, udc_v, choke_a, energies @ ..] =
            self.integrate(&y0, dt_s, |y, frame| {
                let ([id, iq, electrical, copper, impulse], current) =
                    self.slope((y[0], y[1]), legs, y[5], frame);
                let link_slopes = link.slopes(y[5], y[6], current);
                let mut slopes = [0.0; 12];
                slopes[..5].copy_from_slice(&[id, iq, electrical, copper, impulse]);
                slopes[5..].copy_from_slice(&link_slopes);
                slopes
            });
        link.finish(udc_v, choke_a, energies);
        self.finish([id, iq, electrical, copper, impulse], dt_s);
    }

    fn finish(&mut self, [id, iq, energies @ ..]: State, dt_s: f64) {
        self.motor.finish([id, iq], energies, dt_s);
    }

    /// Runge–Kutta, fourth order. The frame turns during the step; the speed changes linearly at most.
    fn integrate<const N: usize>(
        &self,
        y0: &[f64; N],
        dt_s: f64,
        slope: impl Fn(&[f64; N], Frame) -> [f64; N],
    ) -> [f64; N] {
        let rotor = &self.motor.rotor;
        let turning = rotor.turning(|| self.motor.torque_nm(), dt_s);
        let begin = rotor.sin_cos();
        let frame = |t_s: f64| Frame {
            sin_cos: if t_s > 0.0 { rotated(begin, libm::sincos(turning.turned(t_s))) } else { begin },
            omega: turning.omega(t_s),
        };
        stepped(y0, [frame(0.0), frame(0.5 * dt_s), frame(dt_s)], dt_s, |y, frame| slope(y, *frame))
    }

    /// Rates of change, and the current that the legs take from the link.
    fn slope(
        &self,
        (id, iq): (f64, f64),
        legs: [Leg; 3],
        udc_v: f64,
        Frame { sin_cos, omega }: Frame,
    ) -> (State, f64) {
        let currents = Vector::from_rotor((id, iq), sin_cos).phases();
        let mut volts = [0.0; 3];
        let mut link_a = 0.0;
        let has_drops = self.drops.is_some();
        for ((volt, leg), current) in volts.iter_mut().zip(legs).zip(currents) {
            (*volt, link_a) = match leg {
                Leg::Upper => (0.5 * udc_v, link_a + current),
                Leg::Lower => (-0.5 * udc_v, link_a),
                Leg::Open => {
                    (self.clamp.voltage(current, udc_v), link_a + self.clamp.share(current) * current)
                }
            };
            if has_drops {
                *volt -= self.drops.drop_v(leg, current, self.clamp.near_zero(current));
            }
        }
        let stator = &self.motor.stator;
        let StatorSlopes { id_a_s, iq_a_s, electrical_w, copper_w, torque_nm } =
            stator.slopes_at((id, iq), Vector::clarke(volts).to_rotor(sin_cos), omega, sin_cos);
        ([id_a_s, iq_a_s, electrical_w, copper_w, torque_nm], link_a)
    }
}
