//! A leg, and the behaviour of its diodes while both gates are off.

use tractive_tablegen::SmoothMap;

/// Longest integration step, in s: a tenth of a radian at 400 Hz leaves Runge–Kutta's error near 1e-7.
pub(super) const LONGEST_STEP_S: f64 = 40e-6;

/// State of an inverter leg.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Leg {
    /// Upper device on.
    Upper,
    /// Lower device on.
    Lower,
    /// Both off: current flows through the diodes.
    Open,
}

impl Leg {
    /// `true` if its output is at the upper rail while this current flows out of it, in A: for an open leg the diodes decide.
    pub fn is_high(self, current_a: f64) -> bool {
        match self {
            Self::Upper => true,
            Self::Lower => false,
            Self::Open => current_a < 0.0,
        }
    }
}

/// The diodes of an open leg: current out of the leg (positive) flows through the lower one, current into it through the upper one. In between, for
/// currents below half a percent of the machine's largest, the leg's voltage follows the current linearly, which removes such a current within
/// microseconds.
#[derive(Clone, Copy, Debug)]
pub struct Clamp {
    small_current_a: f64,
    least_inductance_h: f64,
}

/// Current, as a share of the largest, at which a diode conducts fully.
const SMALL_SHARE: f64 = 0.005;
/// Step near the linear zone, as a share of its time constant; Runge–Kutta is stable up to 2.7.
const STIFF_SHARE: f64 = 0.8;
/// Time constants after which a current in the linear zone is gone.
const SETTLED: f64 = 5.0;

impl Clamp {
    /// For a machine.
    pub fn new(max_current_a: f64, map: &SmoothMap, flux_scale: f64) -> Self {
        let samples =
            (0..=20).flat_map(|r| (0..=20).map(move |c| (f64::from(r) / 20.0, f64::from(c) / 20.0)));
        let least = samples
            .map(|(x, y)| map.at(-max_current_a * x, max_current_a * y))
            .map(|flux| flux.ldd_h.min(flux.lqq_h))
            .fold(f64::INFINITY, f64::min);
        Self { small_current_a: SMALL_SHARE * max_current_a, least_inductance_h: least * flux_scale }
    }

    /// For the same machine with another multiple of its flux linkage.
    pub fn scaled(self, by: f64) -> Self {
        Self { least_inductance_h: by * self.least_inductance_h, ..self }
    }

    /// For two machines on one leg: the smaller current and the smaller inductance.
    pub fn of_both(self, other: &Self) -> Self {
        Self {
            small_current_a: self.small_current_a.min(other.small_current_a),
            least_inductance_h: self.least_inductance_h.min(other.least_inductance_h),
        }
    }

    /// Voltage of an open leg from the link's midpoint, in V.
    pub fn voltage(&self, current_a: f64, udc_v: f64) -> f64 {
        -0.5 * udc_v * self.near_zero(current_a)
    }

    /// A current over the small one, −1 ..= 1: its sign, except near zero.
    pub fn near_zero(&self, current_a: f64) -> f64 {
        (current_a / self.small_current_a).clamp(-1.0, 1.0)
    }

    /// Likewise as a share of the link, 0 ..= 1 from the negative rail.
    pub fn share(&self, current_a: f64) -> f64 {
        0.5 - 0.5 * (current_a / self.small_current_a).clamp(-1.0, 1.0)
    }

    /// Width of the linear zone, in A: the current below which an open leg acts as a resistor.
    pub fn small_current_a(&self) -> f64 {
        self.small_current_a
    }

    /// `true` if no such current is left once all legs have been open for this long on a link of this voltage.
    pub fn takes_away(&self, udc_v: f64, time_s: f64) -> bool {
        time_s * self.slope_ohm(udc_v) >= SETTLED * self.least_inductance_h
    }

    /// Resistance of an open leg in the linear zone, on a link of this voltage, in ohm.
    fn slope_ohm(&self, udc_v: f64) -> f64 {
        0.5 * udc_v / self.small_current_a
    }

    /// Longest step while legs are open, in s: short near the linear zone.
    pub fn step_s(&self, udc_v: f64, currents_a: [f64; 3], legs: &[Leg; 3]) -> f64 {
        let open = currents_a.iter().zip(legs).filter(|(_, leg)| **leg == Leg::Open);
        self.step_near_s(udc_v, open.map(|(current, _)| current.abs()).fold(f64::INFINITY, f64::min))
    }

    /// Longest step while the current closest to zero is `nearest_a`, in s.
    pub fn step_near_s(&self, udc_v: f64, nearest_a: f64) -> f64 {
        let stiff = STIFF_SHARE * self.least_inductance_h / self.slope_ohm(udc_v);
        // No current changes faster than with the whole link voltage across the least inductance.
        let away = (nearest_a - self.small_current_a) * self.least_inductance_h / (1.5 * udc_v);
        away.clamp(stiff, LONGEST_STEP_S.max(stiff))
    }
}
