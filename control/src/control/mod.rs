//! WHICH voltage: the control law, a pure step per control period.
//!
//! Torque demand → envelope and slew → current reference (MTPA in two passes, or field weakening) → decoupled
//! current loop in flux linkage → voltage limit. The loop acts on the flux *predicted* for the boundary at which the
//! new voltage begins to act, because everything until then is already committed to the modulator.
//!
//! Saturation has one order: the demand is limited to what current and voltage allow, the loop's output is limited
//! to what the mode can give, and the integral part looks only at voltages that really acted, so it cannot wind up.

#![forbid(unsafe_code)]

mod current_loop;
mod demand;
mod disturbance;
mod flux_path;
mod link_filter;
mod map_error;
mod mtpa;
mod reference;
mod speed;
mod speed_loop;
mod torque_trim;
mod z_source;

use crate::frames::{Abc, AlphaBeta, Angle, Dq, SinCos, six_step_v};
use crate::machine::Tables;
use crate::time::Clock;

pub use current_loop::{Follows, Gains};
pub use demand::{Demand, LinkWindow};
pub use mtpa::{mtpa, mtpa_passes};
pub use reference::{OperatingPoint, Region, VoltageLimit, operating_point};
pub use speed_loop::{SpeedDesign, SpeedInput, SpeedLoop};
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

/// Air-gap torque of a flux linkage and a current, in N·m: `1.5 n_p (psi_d i_q − psi_q i_d)`.
#[inline]
pub fn torque_nm(tables: &Tables, flux: Dq, current: Dq) -> f32 {
    1.5 * tables.ratings.pole_pairs * (flux.d * current.q - flux.q * current.d)
}

/// What is measured at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measurements {
    /// Phase currents, positive into the machine, in A.
    pub currents_a: Abc,
    /// DC-link voltage, in V.
    pub udc_v: f32,
    /// Rotor angle, electrical.
    pub angle: Angle,
}

/// What the modulator has already committed itself to, seen from the sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Committed {
    /// From the sample to the boundary where the next voltage begins to act, in s.
    pub horizon_s: f32,
    /// Volt-seconds until then, in V·s; `None` while the gates are off.
    pub volt_seconds: Option<AlphaBeta>,
    /// Ripple flux; `None` where there is none at the carrier's boundaries.
    pub ripple: Option<Ripple>,
    /// Expected length of the carrier half that begins there, in s, greater than zero.
    pub interval_s: f32,
    /// What of the command the modulator's mode can follow.
    pub follows: Follows,
    /// Largest fundamental of the mode as a share of six-step.
    pub depth_limit: f32,
    /// Share of that which the operating point may use; what is left is for regulation.
    pub steady_share: f32,
    /// Whether the fundamental is to be that large, whatever the torque needs.
    pub filled: bool,
    /// Flux ripple of the pattern, as a share of the fundamental flux, greater than zero.
    pub ripple_share: f32,
    /// Whether the pattern's flux is where it will stay; not while a switch between two of them is still going on.
    pub settled: bool,
}

/// Ripple flux of a pattern, in Wb.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ripple {
    /// At the boundary where the next voltage begins to act.
    pub at_horizon_wb: AlphaBeta,
    /// By how much the mean voltage of the half that begins there is to change it: from the ripple that an old pattern leaves to the
    /// one where the next pattern begins. Where a pattern is running nothing of it is led.
    pub led_wb: AlphaBeta,
}

/// A carrier boundary that has passed since the last step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Boundary {
    /// Its own sample; `None` where the present one was taken there.
    pub earlier: Option<Earlier>,
    /// Volt-seconds of the carrier half that ended there, in V·s; `None` when the gates were off in it.
    pub volt_seconds: Option<AlphaBeta>,
    /// Length of that half, in s, greater than zero.
    pub length_s: f32,
}

/// A sample before the present one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Earlier {
    /// Phase currents, in A.
    pub currents_a: Abc,
    /// Time from there to the present sample, in s, not negative.
    pub age_s: f32,
}

/// What a step works on.
#[derive(Clone, Copy, Debug)]
pub struct Input<'a> {
    /// The present sample.
    pub measured: &'a Measurements,
    /// The operator's demand.
    pub demand: &'a Demand,
    /// Where the link ends it; `None`: nowhere.
    pub window: Option<&'a LinkWindow>,
    /// What the modulator will do meanwhile.
    pub committed: &'a Committed,
    /// The carrier boundary that has passed since the last step, if one has.
    pub boundary: Option<&'a Boundary>,
}

/// What the control law is built with.
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
pub struct VoltageVector {
    /// Fundamental, peak phase, in V.
    pub voltage_v: f32,
    /// The same as a vector at the sample, as if it acted there already, in V; it turns with `omega`. While the gates are off and a
    /// pattern follows, the EMF: what the pattern starts from.
    pub vector: AlphaBeta,
    /// Likewise what a locked carrier keeps its angle to: the steady fundamental where pulses can regulate
    /// without it, the vector itself where the angle is what regulates.
    pub carrier: AlphaBeta,
    /// Fundamental of the operating point without regulation, peak phase, in V.
    pub steady_v: f32,
    /// Electrical angular speed, in rad/s, signed.
    pub omega: f32,
    /// Fundamental that the MTPA point asks for at this speed, as a share of six-step. Without what the torque's trim adds: that is
    /// each mode's own, and a mode chosen by it would not last.
    pub depth: f32,
}

/// What the trim is taken to add to an MTPA point's voltage, as shares of six-step and of the largest torque. Chosen by trial: by the maps of the
/// 180 kW machine it adds 0.55 at half torque and 0.76 at full torque; with none the mode hunts on a wrong map.
const DEPTH_PER_TORQUE: f32 = 0.4;

/// A step's result.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Output {
    /// The voltage.
    pub voltage: VoltageVector,
    /// Torque demand after envelope and slew, in N·m.
    pub torque_nm: f32,
    /// Current reference and where it comes from.
    pub point: OperatingPoint,
    /// By how much the machine's flux linkage seems to exceed the map's, as a share; 0 where it turns too slowly to tell.
    pub map_error: f32,
}

/// A sample as the rotor sees it.
#[derive(Clone, Copy)]
struct Seen {
    frame: SinCos,
    current: Dq,
    /// Flux linkage that belongs to the current.
    flux: Dq,
}

impl Seen {
    #[inline(always)]
    fn new(currents_a: Abc, angle: Angle, tables: &Tables) -> Self {
        let frame = angle.sin_cos();
        let current = currents_a.clarke().park(frame);
        Self { frame, current, flux: flux_linkage(tables, current) }
    }
}

/// The control law's state between two steps.
#[derive(Clone, Copy, Debug)]
pub struct Controller {
    speed: speed::SpeedTracker,
    demand: demand::Shaper,
    disturbance: disturbance::Observer,
    trim: torque_trim::TorqueTrim,
    link: link_filter::LinkFilter,
    path: flux_path::FluxPath,
    map_error: map_error::MapError,
}

impl Controller {
    /// At rest, with nothing known of the machine's angle.
    pub const fn new() -> Self {
        Self::with_tracker(speed::SpeedTracker::new())
    }

    /// The same with a speed tracker of this natural frequency, in rad/s.
    pub const fn with_tracking(natural_rad_s: f32) -> Self {
        Self::with_tracker(speed::SpeedTracker::with_natural(natural_rad_s))
    }

    const fn with_tracker(speed: speed::SpeedTracker) -> Self {
        Self {
            speed,
            demand: demand::Shaper::new(),
            disturbance: disturbance::Observer::new(),
            trim: torque_trim::TorqueTrim::new(),
            link: link_filter::LinkFilter::new(),
            path: flux_path::FluxPath::new(),
            map_error: map_error::MapError::new(),
        }
    }

    /// Follows the angle; call once per control period, before [`Controller::step`] and also while the gates are off.
    /// Returns the electrical angular speed, in rad/s.
    pub fn track(&mut self, angle: Angle, clock: &Clock) -> f32 {
        self.speed.step(angle, clock.control_s())
    }

    /// By how much a measured angle, in rad, is off what the speed makes of the one before.
    pub fn surprise_rad(&self, angle: Angle, clock: &Clock) -> f32 {
        (angle - self.speed.predicted(clock.control_s())).signed_radians()
    }

    /// The angle cannot be followed: it is not known, or far off. The speed stays as it was.
    pub fn lose_angle(&mut self) {
        self.speed.lose();
    }

    /// Follows the angle anew, where it was lost; call once its fault is acknowledged. The speed is not known until it has settled again.
    pub fn recover_angle(&mut self) {
        self.speed.recover();
    }

    /// Whether an angle has been followed since the start, or since it was recovered.
    pub fn is_following(&self) -> bool {
        self.speed.is_following()
    }

    /// Whether the speed has been followed long enough to be used.
    pub fn speed_is_known(&self) -> bool {
        self.speed.is_settled()
    }

    /// Electrical angular speed, in rad/s, signed.
    pub fn omega(&self) -> f32 {
        self.speed.omega()
    }

    /// The machine's flux linkage over the map's, as far as an error of it is believed.
    pub fn map_scale(&self) -> f32 {
        self.map_error.scale()
    }

    /// Forgets demand and disturbance, as the gates are off.
    pub fn idle(&mut self) {
        self.demand = demand::Shaper::new();
        self.disturbance = disturbance::Observer::new();
        self.trim = torque_trim::TorqueTrim::new();
        self.link = link_filter::LinkFilter::new();
        self.path = flux_path::FluxPath::new();
    }

    /// After [`Controller::idle`]: the next torque begins at none, whatever flows.
    pub fn begin_without_torque(&mut self) {
        self.demand = demand::Shaper::without_torque();
    }

    /// One control period: the voltage for the carrier half that begins at the horizon.
    pub fn step(&mut self, input: &Input, law: &Law) -> Output {
        let Input { measured, demand, window, committed, boundary } = *input;
        let Law { gains, clock, tables } = *law;
        let omega = self.speed.omega();
        let resistance = tables.ratings.stator_resistance_ohm;
        let half_way = Angle::within_half_turn(0.5 * omega * committed.horizon_s).sin_cos();
        // First of all: nothing else is to be kept meanwhile.
        let earlier = boundary.and_then(|boundary| boundary.earlier);
        if let (Some(boundary), Some(earlier)) = (boundary, earlier) {
            let angle = measured.angle - Angle::within_half_turn(omega * earlier.age_s);
            self.observe(boundary, &Seen::new(earlier.currents_a, angle, tables), committed.follows, law);
        }
        let seen = Seen::new(measured.currents_a, measured.angle, tables);
        if let (Some(boundary), None) = (boundary, earlier) {
            self.observe(boundary, &seen, committed.follows, law);
        }
        let scale = self.map_error.scale();
        let measured_nm = self::torque_nm(tables, seen.flux, seen.current) * scale;
        let ahead = current_loop::ahead(&seen, half_way, committed, &self.disturbance, resistance);
        let frame = seen.frame;
        let shaping = demand::Input {
            demand,
            window,
            udc_v: measured.udc_v,
            omega,
            flowing_nm: measured_nm,
            can_step: committed.follows == Follows::Mean,
            period_s: clock.control_s(),
        };
        let torque_nm = self.demand.step(&shaping, &tables.ratings);
        let link = self.link.step(measured.udc_v, clock.control_s());
        let depth = committed.depth_limit * committed.steady_share;
        let limit = VoltageLimit { udc_v: link.slow_v / scale, depth, filled: committed.filled };
        let trim_nm = self.trim.trim_nm(torque_nm, committed.ripple_share, tables.ratings.max_torque_nm);
        let trimmed_nm = if torque_nm < 0.0 { torque_nm - trim_nm } else { torque_nm + trim_nm };
        let point = operating_point(trimmed_nm / scale, omega, &limit, tables);
        let depth = point.depth - DEPTH_PER_TORQUE / tables.ratings.max_torque_nm * trim_nm;
        let point = OperatingPoint { torque_nm: point.torque_nm * scale, ..point };
        let limited = point.region == Region::Limit;
        let given_nm = if limited { nearer_zero(point.torque_nm, torque_nm) } else { torque_nm };
        self.trim.step(&torque_trim::Input {
            demand_nm: torque_nm,
            measured_nm,
            limited,
            short: given_nm != torque_nm,
            ripple_share: committed.ripple_share,
            largest_nm: tables.ratings.max_torque_nm,
            period_s: clock.control_s(),
        });
        let target = point.flux;
        let way = (shaping.can_step, committed.filled && !committed.settled);
        let reference = self.path.step(target, way, omega, clock.control_s());
        let voltage = current_loop::step(
            &current_loop::Input {
                ahead: &ahead,
                disturbance: &self.disturbance,
                current_reference: point.current,
                reference,
                omega,
                committed,
                resistance,
                voltage_limit_v: committed.depth_limit * six_step_v(link.usable_v),
            },
            gains,
        );
        let current_loop::Output { voltage, steady } = voltage;
        if let Some(boundary) = boundary {
            self.map_error.step(self.disturbance.mean(), target, omega, boundary.length_s);
        }
        let regulates_by_pulses = committed.follows == Follows::Mean;
        let catches = committed.volt_seconds.is_none() && !regulates_by_pulses;
        let caught = omega * self.map_error.caught_scale();
        let vector = if catches { ahead.flux.j() * caught } else { voltage.vector };
        Output {
            voltage: VoltageVector {
                voltage_v: voltage.length_v,
                vector: vector.unpark(frame),
                carrier: if regulates_by_pulses { steady.vector } else { voltage.vector }.unpark(frame),
                steady_v: steady.length_v,
                omega,
                depth,
            },
            map_error: self.map_error.share(),
            torque_nm: given_nm,
            point,
        }
    }
}

impl Controller {
    /// What a boundary tells of the disturbance.
    #[inline(always)]
    fn observe(&mut self, boundary: &Boundary, seen: &Seen, follows: Follows, law: &Law) {
        let omega = self.speed.omega();
        let turn_rad = 6.0 * omega.abs() * boundary.length_s;
        let sixth = follows == Follows::Mean && turn_rad < law.gains.sixth_turn_rad;
        let resistance = law.tables.ratings.stator_resistance_ohm;
        self.disturbance.step(&disturbance::Input { boundary, seen, omega, resistance, sixth }, law.gains);
    }
}

/// Of two torques of the same sign the smaller one.
fn nearer_zero(a: f32, b: f32) -> f32 {
    if a.abs() < b.abs() { a } else { b }
}

impl Default for Controller {
    fn default() -> Self {
        Self::new()
    }
}
