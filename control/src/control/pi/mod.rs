//! The papers' own, ordinary control law: PI loops on measured currents.
//!
//! It is what an engineer builds from the papers and a textbook, to be run beside [`Controller`](super::Controller) on the same ports, tables
//! and modulator. Currents are measured where the carrier has no ripple; under the patterns their mean over 60° is used. The reference is that
//! of MTPA in the paper's two passes; when the voltage runs out, an integrator on it moves i_d. Two PIs, decoupled by `jωψ` of the
//! maps, have the gains of the modulus optimum; their integrators are held back at the circle of the largest voltage.
//!
//! Nothing here knows which pulses are on their way: there is no prediction, no ripple, and no disturbance but the integrators.
//!
//! From 600 to 700 N·m at standstill, the first voltage is that of the proportional part and what the integrator and the drop add:
//!
//! ```
//! use tractive_control::control::{
//!     AimInput, Committed, ControlLaw, Demand, Gains, Law, ModeLimits, PiLaw, RotorSample, flux_linkage, mtpa, torque_nm,
//! };
//! use tractive_control::frames::{AlphaBeta, Angle};
//! use tractive_control::time::Clock;
//! # fn main() -> Result<(), tractive_tablegen::InputError> {
//! let folder = std::path::Path::new("../tables/pmasynrm-180kw");
//! let tables = tractive_tablegen::MachineFolder::read(folder)?.tables();
//! let clock = Clock::new(25_000_000, 2_500);
//! let law = Law { gains: &Gains::DEFAULT, clock: &clock, tables: &tables };
//! let limits = ModeLimits::carrier(0.9);
//! let volt_seconds = Some(AlphaBeta::default());
//! let committed = Committed { horizon_s: 0.5e-3, volt_seconds, ripple_wb: None, interval_s: 0.5e-3 };
//! let mut pi = PiLaw::new();
//! let sample = RotorSample::new(mtpa(600.0, &tables).unpark(Angle::ZERO.sin_cos()).abc(), Angle::ZERO, &tables);
//! for _ in 0..20 {
//!     let demand = Demand { torque_nm: 700.0, slew_limited: false };
//!     pi.observe(&sample, &tables);
//!     pi.aim(&AimInput::plain(&demand, 1_500.0, &limits), &law);
//! }
//! let wanted = pi.target().current;
//! let torque = torque_nm(&tables, flux_linkage(&tables, wanted), wanted);
//! assert!((torque - 700.0).abs() < 7.0, "within 1 % of the demand once the passes no longer move");
//! let voltage = pi.regulate(&sample, &committed, &limits, &law);
//! assert!(voltage.vector.beta > 50.0 && voltage.voltage_v < 860.0, "more i_q is wanted");
//! # Ok(())
//! # }
//! ```

mod current;
mod reference;
mod samples;
mod weakening;

use super::demand::{self, Shaper};
use super::speed::SpeedTracker;
use super::{
    AimInput, Boundary, Committed, ControlLaw, Law, ModeLimits, Regulated, RotorSample, Target,
    VoltageVector, flux_linkage, torque_nm,
};
use crate::frames::{Dq, six_step_v};
use crate::machine::Tables;
use crate::time::Clock;
use core::f32::consts::FRAC_PI_3;
use current::{Design, Inductance, Loop};
use reference::Reference;
use samples::Samples;
use weakening::Weakening;

pub use reference::MtpaStart;

/// Bandwidth with which the voltage limit follows the link, in rad/s.
const LINK_RAD_S: f32 = 100.0;

/// Current step over which an incremental inductance is taken, in A.
const STEP_A: f32 = 10.0;

/// The law's state between two control periods.
#[derive(Clone, Copy, Debug)]
pub struct PiLaw {
    speed: SpeedTracker,
    demand: Shaper,
    reference: Reference,
    weakening: Weakening,
    current: Loop,
    samples: Samples,
    /// The link without its ripple, in V; `None` before the first operating point.
    link_v: Option<f32>,
    /// Torque by the map, summed over the samples since the last operating point, in N·m; and their number.
    sum_nm: f32,
    count: u32,
    /// Samples since the last voltage.
    unused: u32,
    target: Target,
    /// The largest voltage on the link without its ripple, in V.
    limit_v: f32,
}

impl PiLaw {
    /// The law at rest; MTPA starts from the point of the period before.
    pub const fn new() -> Self {
        Self::starting(MtpaStart::Previous)
    }

    /// The law at rest, with the given start of MTPA.
    pub const fn starting(start: MtpaStart) -> Self {
        Self::with_tracker(SpeedTracker::new(), start)
    }

    /// The law at rest, with a speed tracker of this natural frequency, in rad/s; MTPA starts from the point of the period before.
    pub const fn with_tracking(natural_rad_s: f32) -> Self {
        Self::with_tracker(SpeedTracker::with_natural(natural_rad_s), MtpaStart::Previous)
    }

    const fn with_tracker(speed: SpeedTracker, start: MtpaStart) -> Self {
        Self {
            speed,
            demand: Shaper::new(),
            reference: Reference::new(start),
            weakening: Weakening::NONE,
            current: Loop::AT_REST,
            samples: Samples::EMPTY,
            link_v: None,
            sum_nm: 0.0,
            count: 0,
            unused: 0,
            target: Target::NONE,
            limit_v: 0.0,
        }
    }
}

impl ControlLaw for PiLaw {
    const FEEDS_POWER_FORWARD: bool = false;

    fn tracker(&self) -> &SpeedTracker {
        &self.speed
    }

    fn tracker_mut(&mut self) -> &mut SpeedTracker {
        &mut self.speed
    }

    fn passed_s(&self, clock: &Clock) -> f32 {
        self.count as f32 * clock.control_s()
    }

    fn target(&self) -> &Target {
        &self.target
    }

    fn idle(&mut self) {
        *self = Self::with_tracker(self.speed, self.reference.start());
    }

    fn begin_without_torque(&mut self) {
        self.demand = Shaper::without_torque();
    }

    fn observe(&mut self, sample: &RotorSample, tables: &Tables) {
        self.sum_nm += torque_nm(tables, sample.flux, sample.current);
        self.count += 1;
        self.unused += 1;
        self.samples.push(sample.current);
    }

    fn learn(&mut self, _boundary: &Boundary, sample: &RotorSample, _follows: Regulated, _law: &Law) {
        self.samples.boundary = Some(sample.current);
    }

    fn pass(&mut self, sample: &RotorSample) {
        self.samples.boundary = Some(sample.current);
    }

    fn aim(&mut self, input: &AimInput, law: &Law) {
        let AimInput { demand, window, udc_v, limits, .. } = *input;
        let (tables, omega) = (law.tables, self.speed.omega());
        let period_s = self.passed_s(law.clock);
        let flowing_nm = self.sum_nm / self.count as f32;
        (self.sum_nm, self.count) = (0.0, 0);
        let can_step = limits.follows == Regulated::Mean;
        let shaping = demand::Input { demand, window, udc_v, omega, flowing_nm, can_step, period_s };
        let wanted_nm = self.demand.step(&shaping, &tables.ratings);
        let before_v = self.link_v.unwrap_or(udc_v);
        let link_v = before_v + LINK_RAD_S * period_s * (udc_v - before_v);
        self.link_v = Some(link_v);
        let limit_v = limits.steady_limit * six_step_v(link_v);
        let point = self.reference.step(wanted_nm, self.weakening.moved_a(), tables);
        self.target = Target {
            torque_nm: point.torque_nm,
            current: point.current,
            flux: point.flux,
            region: point.region,
            modulation_index: point.mtpa_voltage_v(omega, tables) / six_step_v(link_v),
            voltage_limit_v: limits.index_limit * six_step_v(udc_v),
        };
        self.limit_v = limit_v;
    }

    fn regulate(
        &mut self,
        sample: &RotorSample,
        committed: &Committed,
        limits: &ModeLimits,
        law: &Law,
    ) -> VoltageVector {
        let (omega, tables) = (self.speed.omega(), law.tables);
        let resistance = tables.ratings.stator_resistance_ohm;
        let control_s = law.clock.control_s();
        let passed_s = self.unused as f32 * control_s;
        self.unused = 0;
        let by_pulses = limits.follows.is_direct();
        if committed.volt_seconds.is_none() && !by_pulses {
            return self.start_flying(sample, omega);
        }
        let design = Design::of(limits.follows);
        let measured = sample.current;
        let without_ripple = match self.samples.boundary {
            _ if !by_pulses => self.samples.mean(FRAC_PI_3 / (omega.abs() * control_s)),
            Some(current) => current,
            None => measured,
        };
        let reference = self.target.current;
        let half_way = (measured + reference) * 0.5;
        let inductance = inductance(tables, half_way, flux_linkage(tables, half_way));
        let coupling = sample.flux * (1.0 - design.set_share) + self.target.flux * design.set_share;
        let output = self.current.step(&current::Input {
            reference,
            measured,
            without_ripple,
            forward: coupling.j() * omega + reference * resistance,
            inductance,
            design,
            half_s: committed.interval_s,
            passed_s,
            limit_v: self.target.voltage_limit_v,
            fills: limits.follows == Regulated::Angle,
        });
        self.weakening.step(&weakening::Input {
            wanted_v: output.wanted_v,
            limit_v: self.limit_v,
            filled: limits.filled,
            reactance_ohm: omega.abs() * inductance.by_d.d,
            resistance_ohm: resistance,
            largest_a: tables.ratings.max_current_a,
            least_id_a: tables.ratings.min_id_a,
            passed_s,
        });
        let vector = output.voltage.unpark(sample.frame);
        VoltageVector {
            voltage_v: output.length_v,
            vector,
            carrier: if by_pulses { output.steady.unpark(sample.frame) } else { vector },
            steady_v: output.steady.length(),
        }
    }
}

impl PiLaw {
    /// EMF of the flux that is present while the gates are off, from which a pattern begins.
    fn start_flying(&self, sample: &RotorSample, omega: f32) -> VoltageVector {
        let emf = sample.flux.j() * omega;
        let vector = emf.unpark(sample.frame);
        VoltageVector { voltage_v: emf.length(), vector, carrier: vector, steady_v: emf.length() }
    }
}

/// Incremental inductances at a current with its flux linkage, in H: the gain of both axes' flux linkage with the current of each.
fn inductance(tables: &Tables, current: Dq, flux: Dq) -> Inductance {
    let further = |d: f32, q: f32| (flux_linkage(tables, current + Dq { d, q }) - flux) * (1.0 / STEP_A);
    Inductance { by_d: further(STEP_A, 0.0), by_q: further(0.0, STEP_A) }
}

#[cfg(test)]
mod tests {
    use super::current::{Design, Inductance, Input, Loop};
    use super::weakening::{self, Weakening};
    use super::*;

    const HALF_S: f32 = 0.5e-3;
    const RESISTANCE: f32 = 0.1;
    const INDUCTANCE_H: Dq = Dq { d: 4e-3, q: 8e-3 };
    const LIMIT_V: f32 = 800.0;

    /// A linear machine without magnets behind the loops, one half of delay between a sample and its voltage.
    struct Plant {
        current: Dq,
        pending: Dq,
        omega: f32,
    }

    impl Plant {
        fn flux(&self) -> Dq {
            Dq { d: INDUCTANCE_H.d * self.current.d, q: INDUCTANCE_H.q * self.current.q }
        }

        /// One half, in small steps.
        fn step(&mut self, voltage: Dq) {
            let acts = core::mem::replace(&mut self.pending, voltage);
            for _ in 0..50 {
                let slope = acts - self.current * RESISTANCE - self.flux().j() * self.omega;
                let step_s = HALF_S / 50.0;
                let change = Dq { d: slope.d / INDUCTANCE_H.d, q: slope.q / INDUCTANCE_H.q };
                self.current = self.current + change * step_s;
            }
        }
    }

    /// So many halves towards a reference; the largest q current on the way, and the last voltage that was asked for.
    fn drive(plant: &mut Plant, loops: &mut Loop, reference: Dq, limit_v: f32, halves: usize) -> (f32, f32) {
        let (mut highest_a, mut wanted_v) = (0.0_f32, 0.0);
        for _ in 0..halves {
            let output = loops.step(&Input {
                reference,
                measured: plant.current,
                without_ripple: plant.current,
                forward: plant.flux().j() * plant.omega + reference * RESISTANCE,
                inductance: Inductance {
                    by_d: Dq { d: INDUCTANCE_H.d, q: 0.0 },
                    by_q: Dq { d: 0.0, q: INDUCTANCE_H.q },
                },
                design: Design::of(Regulated::Mean),
                half_s: HALF_S,
                passed_s: HALF_S,
                limit_v,
                fills: false,
            });
            assert!(output.length_v <= limit_v * 1.000_1);
            plant.step(output.voltage);
            highest_a = highest_a.max(plant.current.q);
            wanted_v = output.wanted_v;
        }
        (highest_a, wanted_v)
    }

    fn at_rest(omega: f32) -> (Plant, Loop) {
        (Plant { current: Dq::default(), pending: Dq::default(), omega }, Loop::AT_REST)
    }

    #[test]
    fn a_step_is_followed_as_the_modulus_optimum_has_it() {
        let (mut plant, mut loops) = at_rest(100.0);
        let reference = Dq { d: -20.0, q: 40.0 };
        let (highest_a, _) = drive(&mut plant, &mut loops, reference, LIMIT_V, 8);
        assert!(plant.current.q > 0.9 * 40.0, "{:?} after 4 ms", plant.current);
        assert!(highest_a < 1.15 * 40.0, "{highest_a} A");
        drive(&mut plant, &mut loops, reference, LIMIT_V, 400);
        assert!((plant.current - reference).length() < 0.05, "{:?}", plant.current);
    }

    #[test]
    fn a_voltage_that_is_not_to_be_had_winds_nothing_up() {
        // 200 A would take 1,600 V at this speed; after a second of that the way back takes a few integral times of 30 ms, and would take seconds.
        let (mut plant, mut loops) = at_rest(1_000.0);
        drive(&mut plant, &mut loops, Dq { d: 0.0, q: 200.0 }, LIMIT_V, 2_000);
        drive(&mut plant, &mut loops, Dq { d: 0.0, q: 20.0 }, LIMIT_V, 240);
        assert!((plant.current.q - 20.0).abs() < 0.5, "{:?} after 120 ms", plant.current);
    }

    #[test]
    fn weakening_keeps_the_limit_of_the_voltage() {
        // A magnet of 1 Wb at 1,000 rad/s asks for 1,000 V: i_d of (0.97 · 800 − 1,000) / (1,000 · 4 mH) leaves 776 V.
        let mut weakening = Weakening::NONE;
        let wanted_v = |moved_a: f32| 1_000.0 * (1.0 + INDUCTANCE_H.d * moved_a);
        let input = |moved_a: f32, wanted_v: f32| weakening::Input {
            wanted_v: if moved_a.is_finite() { wanted_v } else { f32::NAN },
            limit_v: LIMIT_V,
            filled: false,
            reactance_ohm: 1_000.0 * INDUCTANCE_H.d,
            resistance_ohm: RESISTANCE,
            largest_a: 200.0,
            least_id_a: -200.0,
            passed_s: HALF_S,
        };
        for _ in 0..2_000 {
            let moved_a = weakening.moved_a();
            weakening.step(&input(moved_a, wanted_v(moved_a)));
        }
        assert!((wanted_v(weakening.moved_a()) - 776.0).abs() < 1.0, "{} A", weakening.moved_a());
        // With voltage to spare it returns to MTPA, and no further.
        for _ in 0..2_000 {
            weakening.step(&input(weakening.moved_a(), 400.0));
        }
        assert_eq!(weakening.moved_a(), 0.0);
    }
}
