//! The control law's state, and its stages.
//!
//! Nothing is computed without need: each control period follows the rotor and takes its sample into the mean torque. The
//! operating point is made once for each command or once for several that are close together; the voltage is made once for each command.

use super::speed::SpeedTracker;
use super::{
    Boundary, Committed, ControlLaw, DeadTime, Demand, Law, LinkSwing, LinkWindow, ModeLimits,
    OperatingPoint, Region, Regulated, RotorSample, Scales, VoltageLimit, VoltageVector, Warmth,
    current_loop, demagnetisation, demand, disturbance, flux_path, link_filter, map_error, reference,
    torque_nm, torque_trim,
};
use crate::frames::{Angle, Dq, six_step_v};
use crate::machine::Tables;
use crate::time::Clock;

/// Assumed increase of an MTPA point's voltage by the trim and the link's damping, as shares of six-step and of the largest torque. Chosen by trial: by the
/// maps of the 180 kW machine the increase is 0.55 at half torque and 0.76 at full torque; with none the mode hunts if the map is wrong.
const DEPTH_PER_TORQUE: f32 = 0.4;

/// Time constant of the torque that is told, in s: half of telemetry's period.
const TOLD_S: f32 = 0.005;

/// The target of the current loop.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Target {
    /// Torque demand after envelope, slew, the link's damping and the limits of current and voltage, in N·m.
    pub torque_nm: f32,
    /// Current reference, in A.
    pub current: Dq,
    /// Flux linkage of the reference, on its way there, in Wb.
    pub flux: Dq,
    /// The source of the reference.
    pub region: Region,
    /// Fundamental that the MTPA point asks for at this speed, as a share of six-step on the link's slow value. It excludes the additions of the torque's
    /// trim, which differ from mode to mode, and of the link's damping: a mode chosen by them would not last.
    pub modulation_index: f32,
    /// Largest fundamental that may be made, peak phase, in V.
    pub voltage_limit_v: f32,
}

impl Target {
    /// The target while no pulses are made.
    pub const NONE: Self = Self {
        torque_nm: 0.0,
        current: Dq { d: 0.0, q: 0.0 },
        flux: Dq { d: 0.0, q: 0.0 },
        region: Region::Mtpa,
        modulation_index: 0.0,
        voltage_limit_v: 0.0,
    };
}

/// The inputs of an operating point.
#[derive(Clone, Copy, Debug)]
pub struct AimInput<'a> {
    /// The operator's demand.
    pub demand: &'a Demand,
    /// The window of link voltage within which torque is given; `None`: no limit.
    pub window: Option<&'a LinkWindow>,
    /// Measured DC-link voltage, in V.
    pub udc_v: f32,
    /// Expected rise of the link above that by the time the voltage acts, in V.
    pub change_v: f32,
    /// The link's voltage over that, as far as the drive uses [`ControlLaw::link_scale`] for its volt-seconds; 1 if it does not.
    pub link_scale: f32,
    /// The link's swing, if it is to be damped.
    pub swing: Option<LinkSwing>,
    /// The share of the machine's iron loss that is compensated, 0 ..= 1: torque is then the rotor's, not the air gap's. The papers' ordinary law
    /// knows nothing of it.
    pub iron_share: f32,
    /// The limits of the mode.
    pub limits: &'a ModeLimits,
}

impl<'a> AimInput<'a> {
    /// A demand on a constant link, without a window, damping or compensation of iron loss.
    pub const fn plain(demand: &'a Demand, udc_v: f32, limits: &'a ModeLimits) -> Self {
        let (window, swing) = (None, None);
        Self { demand, window, udc_v, change_v: 0.0, link_scale: 1.0, swing, iron_share: 0.0, limits }
    }
}

/// The control law's state between two control periods, for a drive whose samples contain the ripple of their currents unless `RIPPLE` is `false`.
#[derive(Clone, Copy, Debug)]
pub struct Controller<const RIPPLE: bool = true> {
    speed: SpeedTracker,
    demand: demand::Shaper,
    disturbance: disturbance::Observer,
    trim: torque_trim::TorqueTrim,
    link: link_filter::LinkFilter,
    path: flux_path::FluxPath,
    map_error: map_error::MapError,
    /// Torque by the map, summed over the samples since the last operating point, in N·m; and their number.
    sum_nm: f32,
    samples: u32,
    /// That torque, smoothed, in N·m.
    flowing_nm: f32,
    target: Target,
    /// Stator resistance over its rating.
    resistance_ratio: f32,
}

impl Controller {
    /// A controller at rest that knows nothing of the machine's angle.
    pub const fn new() -> Self {
        Self::with_tracker(SpeedTracker::new())
    }
}

impl Controller<false> {
    /// The same for a drive that samples where its currents have no ripple, with a speed tracker of this natural frequency, in rad/s.
    pub const fn with_tracking(natural_rad_s: f32) -> Self {
        Self::with_tracker(SpeedTracker::with_natural(natural_rad_s))
    }
}

impl<const RIPPLE: bool> Controller<RIPPLE> {
    const fn with_tracker(speed: SpeedTracker) -> Self {
        Self {
            speed,
            demand: demand::Shaper::new(),
            disturbance: disturbance::Observer::new(),
            trim: torque_trim::TorqueTrim::new(),
            link: link_filter::LinkFilter::new(),
            path: flux_path::FluxPath::new(),
            map_error: map_error::MapError::new(),
            sum_nm: 0.0,
            samples: 0,
            flowing_nm: 0.0,
            target: Target::NONE,
            resistance_ratio: 1.0,
        }
    }
}

impl<const RIPPLE: bool> ControlLaw for Controller<RIPPLE> {
    #[inline(always)]
    fn tracker(&self) -> &SpeedTracker {
        &self.speed
    }

    #[inline(always)]
    fn tracker_mut(&mut self) -> &mut SpeedTracker {
        &mut self.speed
    }

    fn flowing_nm(&self) -> f32 {
        self.flowing_nm
    }

    fn link_scale(&self) -> f32 {
        self.map_error.link_scale()
    }

    fn map_error(&self) -> f32 {
        self.map_error.share()
    }

    fn unexplained_v(&self) -> Option<Dq> {
        Some(self.disturbance.latest())
    }

    fn passed_s(&self, clock: &Clock) -> f32 {
        self.samples as f32 * clock.control_s()
    }

    fn target(&self) -> &Target {
        &self.target
    }

    #[inline(always)]
    fn warm(&mut self, warmth: Warmth) {
        self.resistance_ratio = warmth.resistance_ratio();
    }

    #[inline(always)]
    fn explain(&mut self, dead: DeadTime, law: &Law) {
        self.map_error.step(&map_error::Input {
            current: self.target.current,
            resistance: self.resistance_ohm(law.tables),
            resistance_doubt: law.gains.resistance_doubt,
            dead,
            tables: law.tables,
        });
    }

    fn idle(&mut self) {
        self.demand = demand::Shaper::new();
        self.disturbance = disturbance::Observer::new();
        self.map_error.pause();
        self.trim = torque_trim::TorqueTrim::new();
        self.link = link_filter::LinkFilter::new();
        self.path = flux_path::FluxPath::new();
        (self.sum_nm, self.samples, self.flowing_nm) = (0.0, 0, 0.0);
        self.target = Target::NONE;
    }

    fn begin_without_torque(&mut self) {
        self.demand = demand::Shaper::without_torque();
    }

    #[inline(always)]
    fn observe(&mut self, sample: &RotorSample, tables: &Tables) {
        self.sum_nm += torque_nm(tables, sample.flux, sample.current);
        self.samples += 1;
    }

    #[inline(always)]
    fn learn(&mut self, boundary: &Boundary, sample: &RotorSample, follows: Regulated, law: &Law) {
        let omega = self.speed.omega();
        let turn_rad = 6.0 * omega.abs() * boundary.length_s;
        let sixth = follows == Regulated::Mean && turn_rad < law.gains.sixth_turn_rad;
        let drop_v = self.mean_a(sample) * self.resistance_ohm(law.tables);
        let input = disturbance::Input { boundary, sample, omega, drop_v, sixth };
        if let Some(unexplained) = self.disturbance.step(&input, law.gains) {
            let length_s = boundary.length_s;
            self.map_error.see(&map_error::Half { unexplained, omega, length_s });
        }
    }

    fn aim(&mut self, input: &AimInput, law: &Law) {
        let AimInput { demand, window, udc_v, change_v, link_scale, swing, iron_share, limits } = *input;
        let (tables, ratings, omega) = (law.tables, &law.tables.ratings, self.speed.omega());
        let Scales { torque, flux } = self.map_error.scales();
        let period_s = self.passed_s(law.clock);
        let iron_nm = self.iron_nm(iron_share, tables);
        let measured_nm = self.measured_nm(iron_nm, period_s);
        let can_step = limits.follows == Regulated::Mean;
        let shaping =
            demand::Input { demand, window, udc_v, omega, flowing_nm: measured_nm, can_step, period_s };
        let demand_nm = self.demand.step(&shaping, ratings);
        let link = self.link.step(udc_v * link_scale, change_v * link_scale, period_s);
        // In square wave the voltage follows the link by itself; a limit that followed it too made the torque swing by up to 68 % over its ripple.
        let limiting = swing.filter(|_| limits.follows != Regulated::Angle);
        let limit = VoltageLimit {
            udc_v: limiting.map_or(link.slow_v, |swing| swing.udc_v * link_scale) / flux,
            modulation_index: limits.steady_limit,
            filled: limits.filled,
        };
        let (trim_nm, foreseen_nm) = self.trim_nm(demand_nm, limits, udc_v, tables);
        let damping_nm = swing.map_or(0.0, |swing| {
            swing.damping_nm(law.gains.link_damping, demand_nm, omega, ratings.max_torque_nm)
        });
        let more_nm = trim_nm + damping_nm;
        let outwards = |nm: f32| if demand_nm < 0.0 { demand_nm - nm } else { demand_nm + nm };
        let (trimmed_nm, damped_nm) = (outwards(more_nm), outwards(damping_nm));
        let point = reference::point(
            (trimmed_nm + iron_nm) / torque,
            omega,
            &limit,
            self.resistance_ohm(tables),
            tables,
        );
        let modulation_index = point.modulation_index
            * swing.map_or(link.slow_v / self.link.lowest_v(), |swing| 1.0 + swing.share)
            - DEPTH_PER_TORQUE / ratings.max_torque_nm * more_nm;
        let limited = point.region == Region::Limit;
        let given_nm =
            if limited { nearer_zero(point.torque_nm * torque - iron_nm, demand_nm) } else { demand_nm };
        self.trim.step(&torque_trim::Input {
            demand_nm,
            measured_nm: swing.map_or(measured_nm, |_| measured_nm - (damped_nm - demand_nm)),
            foreseen_nm,
            limited,
            short: given_nm != demand_nm,
            ripple_share: limits.ripple_share,
            largest_nm: ratings.max_torque_nm,
            period_s,
            #[cfg(feature = "optimal")]
            by_sixths: (limits.follows == Regulated::Path).then_some(omega),
        });
        let way = (can_step, limits.filled && !limits.settled);
        self.target = Target {
            torque_nm: if limited || swing.is_none() { given_nm } else { damped_nm },
            current: point.current,
            flux: self.led(&point, way, period_s, tables),
            region: point.region,
            modulation_index,
            voltage_limit_v: limits.index_limit * six_step_v(link.usable_v),
        };
        self.map_error.scaled(link_scale);
    }

    #[inline(always)]
    fn regulate(
        &mut self,
        sample: &RotorSample,
        committed: &Committed,
        limits: &ModeLimits,
        law: &Law,
    ) -> VoltageVector {
        let omega = self.speed.leading();
        let resistance = self.resistance_ohm(law.tables);
        let half_way = Angle::within_half_turn(0.5 * omega * committed.horizon_s).sin_cos();
        let ahead = current_loop::ahead(
            sample,
            half_way,
            committed,
            &self.disturbance,
            self.mean_a(sample) * resistance,
        );
        let input = current_loop::Input {
            ahead: &ahead,
            disturbance: &self.disturbance,
            target: &self.target,
            omega,
            committed,
            limits,
            drop_v: self.target.current * resistance,
            max_switching_hz: law.tables.ratings.max_switching_hz,
        };
        let current_loop::Output { voltage, steady } = current_loop::step(&input, law.gains);
        let regulates_by_pulses = limits.follows.is_direct();
        let starts_flying = committed.volt_seconds.is_none() && !regulates_by_pulses;
        let vector = if starts_flying { self.start_flying(ahead.flux) } else { voltage.vector };
        let vector = vector.unpark(sample.frame);
        let steadies = regulates_by_pulses || starts_flying;
        VoltageVector {
            voltage_v: voltage.length_v,
            vector,
            carrier: if steadies { steady.vector.unpark(sample.frame) } else { vector },
            steady_v: steady.length_v,
        }
    }
}

impl<const RIPPLE: bool> Controller<RIPPLE> {
    /// This share of the torque that the iron takes, in N·m.
    #[inline(always)]
    fn iron_nm(&self, share: f32, tables: &Tables) -> f32 {
        if share == 0.0 {
            0.0
        } else {
            share * tables.ratings.iron.torque_nm(self.target.flux.squared(), self.speed.omega())
        }
    }

    /// Growth of a demand's magnitude that makes the mean torque equal to the demand, and the torque of the ripple in it, in N·m.
    #[inline(always)]
    fn trim_nm(&self, demand_nm: f32, limits: &ModeLimits, udc_v: f32, tables: &Tables) -> (f32, f32) {
        let at = (udc_v, self.target.modulation_index);
        let ripple_s2 = if RIPPLE { limits.ripple_s2 } else { None };
        let ripple_nm = torque_trim::ripple_nm(demand_nm, ripple_s2, at, tables);
        let largest_nm = tables.ratings.max_torque_nm;
        let learnt_nm = self.trim.trim_nm(demand_nm, ripple_nm, limits.ripple_share, largest_nm);
        (learnt_nm - ripple_nm, ripple_nm)
    }

    /// The steady-state current without its ripple, in A: the target's if samples have ripple. The samples used for commands lie at the same places of
    /// their carriers again and again; the drop of the ripple there, held until the horizon, turns the flux by a thousandth and more.
    #[inline(always)]
    fn mean_a(&self, sample: &RotorSample) -> Dq {
        if RIPPLE { self.target.current } else { sample.current }
    }

    /// Mean torque since the last operating point, in N·m, less the part that the iron takes.
    #[inline(always)]
    fn measured_nm(&mut self, iron_nm: f32, period_s: f32) -> f32 {
        let mean_nm = self.sum_nm / self.samples as f32 * self.map_error.scales().torque - iron_nm;
        (self.sum_nm, self.samples) = (0.0, 0);
        self.flowing_nm += (mean_nm - self.flowing_nm) * (period_s / (period_s + TOLD_S));
        mean_nm
    }

    /// Stator resistance of a phase, in ohm.
    #[inline(always)]
    fn resistance_ohm(&self, tables: &Tables) -> f32 {
        tables.ratings.stator_resistance_ohm * self.resistance_ratio
    }

    /// The flux reference on its way to an operating point, in Wb.
    #[inline(always)]
    fn led(&mut self, point: &OperatingPoint, way: (bool, bool), period_s: f32, tables: &Tables) -> Dq {
        let flux = self.path.step(point.flux, way, self.speed.omega(), period_s);
        // Once it is there, the point keeps the limit by itself.
        if flux == point.flux { flux } else { demagnetisation::kept(flux, point.current.q, tables) }
    }

    /// EMF of the `present` flux linkage in Wb, from which a pattern will lead to that of the operating point, in V: corrected as far as the map's
    /// error is known. Expects, too, the voltage that this error will leave unexplained there.
    fn start_flying(&mut self, present: Dq) -> Dq {
        let omega = self.speed.omega();
        self.disturbance.expect(self.map_error.more_wb(self.target.flux).j() * -omega);
        (present + self.map_error.more_wb(present)).j() * omega
    }
}

/// The smaller of two torques with the same sign.
fn nearer_zero(a: f32, b: f32) -> f32 {
    if a.abs() < b.abs() { a } else { b }
}
