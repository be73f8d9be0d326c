//! The control law, which decides the voltage to be made, in pure stages.
//!
//! Torque demand → envelope and slew → current reference (MTPA in two passes, or field weakening) → decoupled
//! current loop in flux linkage → voltage limit. The loop acts on the flux *predicted* for the boundary at which the
//! new voltage begins to act, because everything until then is already committed to the modulator.
//!
//! Saturation has a fixed order: current and voltage limit the demand, the mode limits the loop's output,
//! and the integral part looks only at voltages that really acted, so it cannot wind up.

#![forbid(unsafe_code)]

mod angle_harmonics;
mod angle_zero;
mod controller;
pub mod current_loop;
mod demagnetisation;
mod demand;
mod disturbance;
mod flux_path;
mod law;
mod link_damper;
mod link_filter;
mod link_ripple;
mod map_error;
mod mtpa;
mod pi;
mod reference;
mod source_damper;
mod speed;
mod speed_loop;
mod torque_trim;
mod warmth;
mod z_source;

use crate::frames::{Abc, AlphaBeta, Angle, Dq, SinCos};
use crate::machine::Tables;
use crate::time::Clock;

pub use angle_harmonics::AngleHarmonics;
pub use angle_zero::{AngleZero, WithoutTorque};
pub use controller::{AimInput, Controller, Target};
pub use current_loop::{Gains, Regulated};
pub use demand::{Demand, LinkWindow};
pub use disturbance::Observer;
pub use law::ControlLaw;
pub use link_damper::{LinkDamper, LinkSwing};
pub use link_ripple::LinkRipple;
pub use map_error::DeadTime;
pub use mtpa::{mtpa, mtpa_passes};
pub use pi::{MtpaStart, PiLaw};
pub use reference::{OperatingPoint, Region, VoltageLimit, operating_point};
pub use speed::SpeedTracker;
pub use speed_loop::{SpeedDesign, SpeedInput, SpeedLoop};
pub use warmth::{Scales, Warmth};
pub use z_source::{
    Limited, ZSource, ZSourceDesign, ZSourceError, ZSourceGains, ZSourceInput, ZSourceOutput,
};

/// The machine's flux linkage at a current, in Wb.
#[inline]
pub fn flux_linkage(tables: &Tables, current: Dq) -> Dq {
    const SIGN: u32 = 1 << 31;
    let [psi_d, psi_q] = tables.flux.at(current.d, current.q.abs());
    Dq { d: psi_d, q: f32::from_bits(psi_q.to_bits() ^ (current.q.to_bits() & SIGN)) }
}

/// Air-gap torque for a flux linkage and a current, in N·m: `1.5 n_p (psi_d i_q − psi_q i_d)`.
#[inline]
pub fn torque_nm(tables: &Tables, flux: Dq, current: Dq) -> f32 {
    1.5 * tables.ratings.pole_pairs * (flux.d * current.q - flux.q * current.d)
}

/// Measurements of one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Measurements {
    /// Phase currents, positive into the machine, in A.
    pub currents_a: Abc,
    /// DC-link voltage, in V.
    pub udc_v: f32,
    /// Rotor angle, electrical.
    pub angle: Angle,
}

/// Limits that a half's mode sets for the command of that half.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ModeLimits {
    /// The part of the command that the modulator's mode can follow.
    pub follows: Regulated,
    /// Largest fundamental of the mode as a share of six-step.
    pub index_limit: f32,
    /// Largest fundamental that the operating point may use, as a share of six-step; the rest up to [`Self::index_limit`] is for regulation.
    pub steady_limit: f32,
    /// The fundamental must be that large, whatever the torque needs.
    pub filled: bool,
    /// Flux ripple of the pattern, as a share of the fundamental flux; zero if the samples do not show its effect on the torque,
    /// which then is not trimmed.
    pub ripple_share: f32,
    /// Mean squares of the pattern's flux ripple along the flux linkage and across it, over the square of the link's voltage, in s²; `None` if it does
    /// nothing to the torque.
    pub ripple_s2: Option<[f32; 2]>,
    /// The pattern's flux is where it will stay; not during a switch between two patterns.
    pub settled: bool,
    /// The half is a pattern's first one after another pattern: it begins where their paths meet, away from its own angle, and the difference of its flux
    /// linkage there is no error.
    pub joins: bool,
}

impl ModeLimits {
    /// The limits of a triangular carrier with little ripple, whose operating point may use all of its fundamental.
    pub const fn carrier(index_limit: f32) -> Self {
        Self {
            follows: Regulated::Mean,
            index_limit,
            steady_limit: index_limit,
            filled: false,
            ripple_share: 0.05,
            ripple_s2: None,
            settled: true,
            joins: false,
        }
    }
}

/// The voltages already committed to the modulator, seen from the sample.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Committed {
    /// From the sample to the boundary where the next voltage begins to act, in s.
    pub horizon_s: f32,
    /// Volt-seconds until then, in V·s; `None` while the gates are off.
    pub volt_seconds: Option<AlphaBeta>,
    /// Ripple flux of the pattern at the horizon, in Wb; `None` if there is none.
    pub ripple_wb: Option<AlphaBeta>,
    /// Expected time for which the next voltage acts, in s, greater than zero: that of the carrier halves made with it.
    pub interval_s: f32,
}

/// A carrier boundary that has passed, and the half that ended there.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Boundary {
    /// Volt-seconds of that half, in V·s; `None` if the gates were off in it or the half before it was not seen.
    pub volt_seconds: Option<AlphaBeta>,
    /// Length of that half, in s, greater than zero.
    pub length_s: f32,
}

/// Constants that the control law is built with.
#[derive(Clone, Copy, Debug)]
pub struct Law<'a> {
    /// Gains of the current loop.
    pub gains: &'a Gains,
    /// The timers' clock.
    pub clock: &'a Clock,
    /// The machine.
    pub tables: &'a Tables,
}

/// The voltage to make from now on.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct VoltageVector {
    /// Fundamental, peak phase, in V.
    pub voltage_v: f32,
    /// The same as a vector at the sample, as if it acted there already, in V; it turns with the rotor. While the gates are off and a
    /// pattern follows, the EMF, from which the pattern starts.
    pub vector: AlphaBeta,
    /// Likewise the vector that a locked carrier keeps its angle to: the steady fundamental if pulses can regulate
    /// without it or there are none yet, the vector itself if the angle is what regulates.
    pub carrier: AlphaBeta,
    /// Fundamental of the operating point without regulation, peak phase, in V.
    pub steady_v: f32,
}

/// Phase currents at one instant as the rotor sees them.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RotorSample {
    /// Direction of the rotor's d axis.
    pub frame: SinCos,
    /// Current, rotor frame, in A.
    pub current: Dq,
    /// Flux linkage for that current by the map, in Wb.
    pub flux: Dq,
}

impl RotorSample {
    /// Phase currents in A, with the rotor at an electrical angle and the machine's flux map.
    #[inline(always)]
    pub fn new(currents_a: Abc, angle: Angle, tables: &Tables) -> Self {
        let frame = angle.sin_cos();
        let current = currents_a.clarke().park(frame);
        Self { frame, current, flux: flux_linkage(tables, current) }
    }
}
