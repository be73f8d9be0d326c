//! The decoupled current loop, in flux linkage.
//!
//! Written in flux, the stator equation `dψ/dt = u − R i − jωψ` is linear however much the machine saturates; the maps turn
//! current into flux and back. Proportional part: the flux error predicted for the boundary where the voltage begins
//! to act. Decoupling: `jωψ`. Integral part: [`Observer`].
//!
//! One carrier half removes three quarters of the flux error, on the saturated map as well:
//!
//! ```
//! use tractive_control::control::{
//!     Committed, Gains, ModeLimits, Observer, RotorSample, Target, current_loop, flux_linkage, mtpa,
//! };
//! use tractive_control::frames::{AlphaBeta, Angle};
//! # fn main() -> Result<(), tractive_tablegen::InputError> {
//! let folder = std::path::Path::new("../tables/pmasynrm-180kw");
//! let tables = tractive_tablegen::MachineFolder::read(folder)?.tables();
//! // From 600 to 700 N·m with the rotor at rest at 40°. The next half begins at once and lasts 0.5 ms.
//! let (now, wanted) = (mtpa(600.0, &tables), mtpa(700.0, &tables));
//! let reference = flux_linkage(&tables, wanted);
//! let drop_v = wanted * tables.ratings.stator_resistance_ohm;
//! let (angle, at_rest, none) = (Angle::from_turns(40.0 / 360.0), Angle::ZERO.sin_cos(), Observer::new());
//! let sample = RotorSample::new(now.unpark(angle.sin_cos()).abc(), angle, &tables);
//! let volt_seconds = Some(AlphaBeta::default());
//! let committed = Committed { horizon_s: 0.0, volt_seconds, ripple_wb: None, interval_s: 0.5e-3 };
//! let limits = ModeLimits::carrier(0.9);
//! let target = Target { current: wanted, flux: reference, voltage_limit_v: 800.0, ..Target::NONE };
//! let input = current_loop::Input {
//!     ahead: &current_loop::ahead(&sample, at_rest, &committed, &none, drop_v),
//!     disturbance: &none,
//!     target: &target,
//!     omega: 0.0,
//!     committed: &committed,
//!     limits: &limits,
//!     drop_v,
//!     max_switching_hz: tables.ratings.max_switching_hz,
//! };
//! let voltage = current_loop::step(&input, &Gains::DEFAULT).voltage.vector;
//! let flux = sample.flux + (voltage - drop_v) * 0.5e-3;
//! let left = (flux - reference).length() / (sample.flux - reference).length();
//! assert!((left - 0.25).abs() < 0.001, "a quarter of the error is left");
//! # Ok(())
//! # }
//! ```

use super::disturbance::Observer;
use super::{Committed, ModeLimits, RotorSample, Target};
use crate::frames::{Angle, Dq, SinCos, root};

/// The part of a voltage command that the modulator's mode can follow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Regulated {
    /// The mean of every carrier half: triangular carriers.
    Mean,
    /// The fundamental, with a pattern's delay: middle 60°.
    Fundamental,
    /// The angle alone: square wave.
    Angle,
    /// The flux along a pattern's own path, as far as the pattern's next edges can move: optimised patterns.
    #[cfg(feature = "optimal")]
    Path,
}

impl Regulated {
    /// `true` if the mean voltage of the very next half can be chosen.
    #[inline(always)]
    pub const fn is_direct(self) -> bool {
        #[cfg(feature = "optimal")]
        return matches!(self, Self::Mean | Self::Path);
        #[cfg(not(feature = "optimal"))]
        return matches!(self, Self::Mean);
    }
}

/// Gains of the loop.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Gains {
    /// Share of the predicted flux error that one carrier half removes, 0 ..= 1, for triangular carriers.
    pub carrier: f32,
    /// Bandwidth for middle-60° patterns over the highest switching frequency, in rad: the faster these follow each other, the faster a flux error goes.
    pub pattern_rad: f32,
    /// Damping of the flux error in square wave, as a share of the stator frequency.
    pub square_damping: f32,
    /// Share of an unexplained voltage that one carrier half moves into the integral part.
    pub observer: f32,
    /// Turn in a carrier half, in rad, up to which the integral part follows six times the stator frequency (the residue of dead
    /// time); 0: never.
    pub sixth_turn_rad: f32,
    /// Likely error of the stator's resistance, as a share of its rating, above 0 and up to 10; the larger it is, the more of the unexplained voltage
    /// along the current counts as resistance error and not as an error of the flux linkage.
    pub resistance_doubt: f32,
    /// Percent of torque by which a motoring drive follows a percent of its link's swing, to damp a line filter in front of it;
    /// 0: none.
    pub link_damping: f32,
}

impl Gains {
    /// Gains that suit carrier halves of 0.2 to 0.8 ms. A pattern's is 350 rad/s at 900 Hz; with the same at every frequency a motor of 8 kHz that comes out of
    /// weakening had 7 % more current than either mode has, where it now has 3 %.
    pub const DEFAULT: Self = Self {
        carrier: 0.75,
        pattern_rad: 7.0 / 18.0,
        square_damping: 0.5,
        observer: 0.02,
        sixth_turn_rad: 1.0,
        resistance_doubt: 0.5,
        link_damping: 0.0,
    };
    /// The same without compensation of a dead time's harmonics.
    pub const WITHOUT_SIXTH: Self = Self { sixth_turn_rad: 0.0, ..Self::DEFAULT };
    /// Percent of torque per percent of swing that damps every line filter of 1 to 8 mH, 2 to 8 mF and 10 mΩ or more.
    pub const LINE_DAMPING: f32 = 3.0;

    /// The gains for a dead time that is not compensated, and for a link behind a line filter.
    pub const fn of(uncompensated: bool, behind_line_filter: bool) -> Self {
        let gains = if uncompensated { Self::WITHOUT_SIXTH } else { Self::DEFAULT };
        if behind_line_filter { Self { link_damping: Self::LINE_DAMPING, ..gains } } else { gains }
    }
}

/// The flux expected at the horizon, whatever is wanted then.
pub struct Ahead {
    /// Flux linkage at the horizon less the pattern's ripple, in the rotor frame there; while the gates are off, the present flux linkage.
    pub flux: Dq,
    /// That frame.
    frame: SinCos,
}

/// The inputs of a step of the loop.
#[derive(Clone, Copy)]
pub struct Input<'a> {
    /// The flux predicted for the horizon.
    pub ahead: &'a Ahead,
    /// The integral part.
    pub disturbance: &'a Observer,
    /// The operating point: its flux linkage is the reference, and its current's resistive drop is fed forward.
    pub target: &'a Target,
    /// Electrical angular speed, in rad/s, signed.
    pub omega: f32,
    /// The modulator's commitments.
    pub committed: &'a Committed,
    /// The limits of the mode.
    pub limits: &'a ModeLimits,
    /// The resistive drop of the target's current, in V.
    pub drop_v: Dq,
    /// The highest switching frequency, in Hz.
    pub max_switching_hz: f32,
}

/// Voltages for the carrier half that begins at the horizon, in V, in the rotor frame that turns with it.
pub struct Output {
    /// The voltage to be made; limited.
    pub voltage: Voltage,
    /// The voltage of the operating point alone; limited likewise.
    pub steady: Voltage,
}

/// A vector and its length, in V.
pub struct Voltage {
    /// The vector, rotor frame, in V.
    pub vector: Dq,
    /// Its length, in V.
    pub length_v: f32,
}

/// The largest voltage of a carrier, in the corners of its hexagon, over the one available in every direction: 2/√3. Transients may
/// use it; beyond the hexagon's edges the modulator's phases saturate, and the prediction sees that they did.
const TRANSIENT_REACH: f32 = 1.154_7;

/// One step of the loop.
pub fn step(input: &Input, gains: &Gains) -> Output {
    let reference = input.target.flux;
    let steady = reference.j() * input.omega + input.drop_v;
    let limit = input.target.voltage_limit_v;
    let towards = |gain: f32| {
        let steady = steady - input.disturbance.mean();
        let gain = if input.limits.joins { 0.0 } else { gain };
        (steady - (input.ahead.flux - reference) * gain, steady, limit)
    };
    let direct = |reference: Dq| {
        let (mean, disturbance) = mean_voltage(input, reference, gains);
        let reach = limit * TRANSIENT_REACH;
        let holding = || input.ahead.flux.j() * input.omega + (input.drop_v - disturbance);
        let wanted = mean + input.drop_v - disturbance;
        // If more is asked for than every angle has, the modulator makes what there is, in the same direction: going straight there cost the ZS9's motors
        // 55 N·m on a map that is 20 % off, of 54 that its campaign allows.
        let vector = if input.limits.index_limit > 1.0 { wanted } else { straight(wanted, holding, reach) };
        (vector, steady - disturbance, reach)
    };
    let (regulated, steady, reach) = match input.limits.follows {
        Regulated::Mean => direct(reference),
        #[cfg(feature = "optimal")]
        Regulated::Path => direct(held(input, steady - input.disturbance.mean())),
        Regulated::Fundamental => towards(gains.pattern_rad * input.max_switching_hz),
        Regulated::Angle => towards(gains.square_damping * input.omega.abs()),
    };
    let fills = input.limits.follows == Regulated::Angle;
    Output {
        voltage: Voltage::fitted(regulated, reach, fills),
        steady: Voltage::fitted(steady, limit, fills),
    }
}

/// The `wanted` voltage, or as much of the way to it as `reach_v` allows, from the voltage that is `holding` the flux linkage where it is. The flux then
/// goes straight to its reference, only more slowly. With a shorter voltage in the wanted direction the rotor would turn away from it meanwhile, and
/// a machine without magnets that reverses its torque just above the speed where it weakens takes 1.3 times its steady current on that way.
#[inline(always)]
fn straight(wanted: Dq, holding: impl Fn() -> Dq, reach_v: f32) -> Dq {
    let beyond = reach_v * reach_v;
    if wanted.squared() <= beyond {
        return wanted;
    }
    let holding = holding();
    let square = holding.squared();
    if square >= beyond {
        return wanted;
    }
    let way = wanted - holding;
    let (length, along) = (way.squared(), holding.dot(way));
    holding + way * ((root(along * along + length * (beyond - square)) - along) / length)
}

/// The flux linkage that a pattern can hold if the operating point's voltage exceeds the available one: the flux linkage of the available voltage, in
/// the same direction. Edges moved for more, without an end, would leave the flux at another angle.
#[cfg(feature = "optimal")]
fn held(input: &Input, steady: Dq) -> Dq {
    let beyond = steady - Voltage::fitted(steady, input.target.voltage_limit_v, false).vector;
    input.target.flux + beyond.j() * (1.0 / input.omega)
}

/// The mean voltage of a carrier half that moves the flux from where it is predicted to where it should be, without the
/// resistive drop.
///
/// Voltages that are constant over a half move the flux along chords, so at the boundaries it lies outside the circle of its
/// fundamental by x/sin x. The error e becomes (1 − g) e by the half's end, both in the rotor frame that turns by 2x
/// meanwhile; everything is seen from the frame in the middle of the half. The second result is the disturbance in the middle of the half.
fn mean_voltage(input: &Input, reference: Dq, gains: &Gains) -> (Dq, Dq) {
    let committed = input.committed;
    let x = 0.5 * input.omega * committed.interval_s;
    let half_turn = Angle::within_half_turn(x).sin_cos();
    let middle = input.ahead.frame.turned(half_turn);
    let error = input.ahead.flux - reference * (1.0 + x * x * (1.0 / 6.0));
    let remaining = 1.0 - gains.carrier;
    let chord = reference.j() * (2.0 * x)
        + error * ((remaining - 1.0) * half_turn.cos)
        + error.j() * ((remaining + 1.0) * half_turn.sin);
    (chord * (1.0 / committed.interval_s), input.disturbance.voltage(middle))
}

/// Looks ahead from what is seen now; `half_way` is the rotor's turn in half the time to the horizon, `drop_v` the current's resistive
/// drop until then.
#[inline(always)]
pub fn ahead(
    sample: &RotorSample,
    half_way: SinCos,
    committed: &Committed,
    disturbance: &Observer,
    drop_v: Dq,
) -> Ahead {
    let on_the_way = sample.frame.turned(half_way);
    let flux = match committed.volt_seconds {
        None => sample.flux,
        Some(volt_seconds) => {
            let moved = match &committed.ripple_wb {
                None => volt_seconds,
                Some(ripple_wb) => volt_seconds - *ripple_wb,
            };
            let unexplained = disturbance.voltage(on_the_way) - drop_v;
            // By half the way, and then by as much again.
            let back = half_way.back();
            (sample.flux.turned(back) + moved.park(on_the_way) + unexplained * committed.horizon_s)
                .turned(back)
        }
    };
    Ahead { flux, frame: on_the_way.turned(half_way) }
}

impl Voltage {
    /// The vector, no longer than `limit_v`, its direction kept; if it `fills` the limit, no shorter either. The zero vector stays.
    #[inline(always)]
    fn fitted(vector: Dq, limit_v: f32, fills: bool) -> Self {
        let length_v = vector.length();
        let fits = length_v <= limit_v && !fills;
        if fits || length_v == 0.0 {
            Self { vector, length_v }
        } else {
            Self { vector: vector * (limit_v / length_v), length_v: limit_v }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const OMEGA: f32 = 1_000.0;
    const LIMIT_V: f32 = 500.0;

    /// A carrier's voltage for a reference at a measured flux linkage, both in Wb, with a limit in V.
    fn voltage(flux: Dq, reference: Dq, limit_v: f32) -> Dq {
        voltage_of(&ModeLimits::carrier(0.9), flux, reference, limit_v)
    }

    fn voltage_of(limits: &ModeLimits, flux: Dq, reference: Dq, limit_v: f32) -> Dq {
        let at_rest = Angle::ZERO.sin_cos();
        let sample = RotorSample { frame: at_rest, current: Dq::default(), flux };
        let committed = Committed { horizon_s: 0.0, volt_seconds: None, ripple_wb: None, interval_s: 50e-6 };
        let target =
            Target { flux: reference, modulation_index: 0.5, voltage_limit_v: limit_v, ..Target::NONE };
        let disturbance = Observer::new();
        let input = Input {
            ahead: &ahead(&sample, at_rest, &committed, &disturbance, Dq::default()),
            disturbance: &disturbance,
            target: &target,
            omega: OMEGA,
            committed: &committed,
            limits,
            drop_v: Dq::default(),
            max_switching_hz: 1_800.0,
        };
        step(&input, &Gains::DEFAULT).voltage.vector
    }

    /// A distant reference is approached on a straight line, with all the voltage available.
    #[test]
    fn the_flux_goes_straight_where_the_voltage_is_limited() {
        let (flux, reach_v) = (Dq { d: 0.1, q: -0.45 }, LIMIT_V * TRANSIENT_REACH);
        for reference in [Dq::default(), Dq { d: 0.1, q: 0.45 }, Dq { d: -0.3, q: -0.2 }] {
            let vector = voltage(flux, reference, LIMIT_V);
            assert!((vector.length() / reach_v - 1.0).abs() < 1e-5, "{vector:?}");
            let (way, moves) = (reference - flux, vector - flux.j() * OMEGA);
            let across = moves.dot(way.j()) / (moves.length() * way.length());
            assert!(across.abs() < 0.03 && moves.dot(way) > 0.0, "{reference:?}: {vector:?}, {across}");
        }
    }

    /// The voltage of a pattern that joins the path of another one is the operating point's.
    #[test]
    fn a_pattern_regulates_nothing_where_it_joins() {
        let (flux, reference) = (Dq { d: 0.1, q: -0.4 }, Dq { d: 0.12, q: -0.39 });
        let pattern = ModeLimits { follows: Regulated::Fundamental, ..ModeLimits::carrier(0.9) };
        let off = |joins| {
            voltage_of(&ModeLimits { joins, ..pattern }, flux, reference, LIMIT_V) - reference.j() * OMEGA
        };
        assert_eq!(off(true), Dq::default());
        let regulated = (reference - flux) * 700.0;
        assert!((off(false) - regulated).length() < 1e-3, "{:?}, not {regulated:?}", off(false));
    }

    /// A voltage stays as it was if it cannot go straight, because the holding voltage is beyond the limit, or if it is within the limit.
    #[test]
    fn a_voltage_keeps_its_direction_where_no_straight_way_is_left() {
        let (flux, reference) = (Dq { d: 0.1, q: -0.6 }, Dq { d: 0.1, q: -0.55 });
        let (free, limited) = (voltage(flux, reference, 1e5), voltage(flux, reference, LIMIT_V));
        let across = free.dot(limited.j()) / (free.length() * limited.length());
        assert!(across.abs() < 1e-6 && (limited.length() - LIMIT_V * TRANSIENT_REACH).abs() < 0.01);
        assert_eq!(voltage(flux, reference, 1e6), free, "there is enough");
    }
}
