//! The decoupled current loop, in flux linkage.
//!
//! Written in flux, the stator equation `dψ/dt = u − R i − jωψ` is linear however the machine saturates; the maps turn
//! current into flux and back. Proportional part: the flux error predicted for the boundary where the voltage begins
//! to act. Decoupling: `jωψ`. Integral part: [`super::disturbance`].

use super::disturbance::Observer;
use super::{Committed, Seen};
use crate::frames::{Angle, Dq, SinCos};

/// What of a voltage command the modulator's mode can follow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Follows {
    /// The mean of every carrier half: triangular carriers.
    Mean,
    /// The fundamental, with a pattern's delay: middle 60°.
    Fundamental,
    /// The angle alone: square wave.
    Angle,
}

/// Gains of the loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gains {
    /// Share of the predicted flux error that one carrier half removes, 0 ..= 1, for triangular carriers.
    pub carrier: f32,
    /// Bandwidth for middle-60° patterns, in rad/s.
    pub pattern_rad_s: f32,
    /// Damping of the flux error in square wave, as a share of the stator frequency.
    pub square_damping: f32,
    /// Share of an unexplained voltage that one carrier half moves into the integral part.
    pub observer: f32,
    /// Turn in a carrier half, in rad, up to which the integral part follows six times the stator frequency (what dead time
    /// leaves); 0: never.
    pub sixth_turn_rad: f32,
}

impl Gains {
    /// Gains that suit carrier halves of 0.2 to 0.8 ms.
    pub const DEFAULT: Self = Self {
        carrier: 0.75,
        pattern_rad_s: 350.0,
        square_damping: 0.5,
        observer: 0.02,
        sixth_turn_rad: 1.0,
    };
    /// The same without what would compensate a dead time's harmonics.
    pub const WITHOUT_SIXTH: Self = Self { sixth_turn_rad: 0.0, ..Self::DEFAULT };
}

/// What lies ahead, without what is wanted.
pub struct Ahead {
    /// Flux linkage at the horizon less the pattern's ripple, in the rotor frame there; while the gates are off, as it is.
    pub flux: Dq,
    /// That frame.
    frame: SinCos,
}

pub struct Input<'a> {
    pub ahead: &'a Ahead,
    pub disturbance: &'a Observer,
    pub current_reference: Dq,
    /// Flux linkage of that reference, as [`super::flux_path`] leads there.
    pub reference: Dq,
    pub omega: f32,
    pub committed: &'a Committed,
    pub resistance: f32,
    pub voltage_limit_v: f32,
}

/// Voltages for the carrier half that begins at the horizon, in V, in the rotor frame that turns with it.
pub struct Output {
    /// To be made; limited.
    pub voltage: Voltage,
    /// Of the operating point alone; limited likewise.
    pub steady: Voltage,
}

/// A vector and its length, in V.
pub struct Voltage {
    pub vector: Dq,
    pub length_v: f32,
}

/// What a carrier gives at most, in the corners of its hexagon, over what it gives in every direction: 2/√3. Transients may
/// use it; beyond the hexagon's edges the modulator's phases saturate, and the prediction sees that they did.
const TRANSIENT_REACH: f32 = 1.154_7;

/// One step of the loop.
pub fn step(input: &Input, gains: &Gains) -> Output {
    let reference = input.reference;
    let resistive = input.current_reference * input.resistance;
    let steady = reference.j() * input.omega + resistive;
    let limit = input.voltage_limit_v;
    let towards = |gain: f32| {
        let gain = if input.committed.settled { gain } else { 0.0 };
        let steady = steady - input.disturbance.mean();
        (steady - (input.ahead.flux - reference) * gain, steady, limit)
    };
    let (regulated, steady, reach) = match input.committed.follows {
        Follows::Mean => {
            let (mean, disturbance) = mean_voltage(input, reference, gains);
            (mean + resistive - disturbance, steady - disturbance, limit * TRANSIENT_REACH)
        }
        Follows::Fundamental => towards(gains.pattern_rad_s),
        Follows::Angle => towards(gains.square_damping * input.omega.abs()),
    };
    let fills = input.committed.follows == Follows::Angle;
    Output {
        voltage: Voltage::fitted(regulated, reach, fills),
        steady: Voltage::fitted(steady, limit, fills),
    }
}

/// The mean voltage of a carrier half that moves the flux from where it is predicted to where it should be, without the
/// resistive drop.
///
/// Voltages that hold for a half move the flux along chords, so at the boundaries it stands outside the circle of its
/// fundamental by x/sin x. The error e goes to (1 − g) e at the half's end, both in the rotor frame that turns by 2x
/// meanwhile; all is seen from the frame in the middle of the half. Where a pattern gives way to another, the flux is
/// led from the ripple of the one to the ripple of the other. With it comes the disturbance in the middle of the half.
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
    let led = match &committed.ripple {
        None => chord,
        Some(ripple) => chord + ripple.led_wb.park(middle),
    };
    (led * (1.0 / committed.interval_s), input.disturbance.voltage(middle))
}

/// Looks ahead from what is seen now; `half_way` is the rotor's turn in half the time to the horizon.
#[inline(always)]
pub fn ahead(
    seen: &Seen,
    half_way: SinCos,
    committed: &Committed,
    disturbance: &Observer,
    resistance: f32,
) -> Ahead {
    let on_the_way = seen.frame.turned(half_way);
    let flux = match committed.volt_seconds {
        None => seen.flux,
        Some(volt_seconds) => {
            let moved = match &committed.ripple {
                None => volt_seconds,
                Some(ripple) => volt_seconds - ripple.at_horizon_wb,
            };
            let unexplained = disturbance.voltage(on_the_way) - seen.current * resistance;
            // By half the way, and by that once more.
            let back = half_way.back();
            (seen.flux.turned(back) + moved.park(on_the_way) + unexplained * committed.horizon_s).turned(back)
        }
    };
    Ahead { flux, frame: on_the_way.turned(half_way) }
}

impl Voltage {
    /// The vector, no longer than `limit_v`, its direction kept; where it `fills` that, neither shorter. The zero vector stays.
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
