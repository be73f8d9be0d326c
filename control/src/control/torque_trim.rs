//! The trim of mean torque.
//!
//! The current loop holds the fundamental of the flux. In a saturated machine the ripple around it changes the mean torque by up
//! to some percent, most in the patterns of few pulses: in proportion to the square of the ripple, by the curvature of torque over
//! flux. The part that follows from the map is known beforehand ([`ripple_nm`]). The rest is found from the torque of the measured currents: what is
//! missing on average is slowly added to the demand, and what was learned under one pattern holds for the next one.
//!
//! Under optimised patterns the average is taken over whole sixths of a turn, in which torque repeats. A trim that followed the torque ripple would shake the
//! reference in step with the pulses, whose edges reach the flux linkage in one direction at a time: half a percent too much torque was made. Nor may a sixth
//! end with the period in which it ends: at 1,921 r/min and a tenth of the torque, averages over 1.1 sixths moved the mean torque by 6 N·m every five sixths,
//! where it now moves by 1.

use crate::frames::{limit, limit_magnitude};
use crate::machine::Tables;

/// Bandwidth, in rad/s: the torque ripple at six times the stator frequency must not come through.
const BANDWIDTH_RAD_S: f32 = 60.0;
/// Largest trim either way, as a share of the demand, beyond the foreseen one: that may have to be taken back whole, if a sensor's filter smooths the ripple.
const MOST: f32 = 0.06;
/// Share of the largest torque below which the trim no longer shrinks with the demand.
const CONSTANT_BELOW: f32 = 0.4;
/// Rate of change of the demand that counts as a change, as a share of the largest torque, in 1/s.
const STEADY_RATE: f32 = 1.0;
/// Time after a change of the demand during which the current loop is still at work, in s.
const HOLD_S: f32 = 0.01;

/// Most of a demand that a ripple may add or take: for a rotor just stopped, a locked pattern's would have no end. Of sixty random machines 0.14 is the most.
const MOST_RIPPLE: f32 = 0.17;
/// Excess of the MTPA point's voltage over six-step, as a part of it, at which no curvature is left: the iron of a machine that weakens saturates less. By the
/// map of the 180 kW machine, from a quarter of its torque on, 0.83 to 0.56 of the MTPA point's is left at 0.06 to 0.18 beyond, and a tenth at 0.41; with the
/// ripple that is assumed to grow along, this has 0.90, 0.56 and nothing there.
const CURVED_UNTIL: f32 = 0.3;

/// The torque that a flux ripple adds to the magnitude of a demand, in N·m, on a link of `udc_v`, where the MTPA point asks for `modulation_index`; `ripple_s2` as in
/// [`ModeLimits`](super::ModeLimits).
#[inline(always)]
pub fn ripple_nm(
    demand_nm: f32,
    ripple_s2: Option<[f32; 2]>,
    (udc_v, modulation_index): (f32, f32),
    tables: &Tables,
) -> f32 {
    let Some([along_s2, across_s2]) = ripple_s2 else { return 0.0 };
    let beyond = if modulation_index > 1.0 { limit(modulation_index - 1.0, 0.0, CURVED_UNTIL) } else { 0.0 };
    let [along, across] = tables.mtpa.curvature.at(demand_nm.abs());
    let left = (udc_v * udc_v) * (1.0 - beyond * (1.0 / CURVED_UNTIL));
    limit_magnitude((along * along_s2 + across * across_s2) * left, MOST_RIPPLE * demand_nm.abs())
}

#[derive(Clone, Copy, Debug)]
pub struct TorqueTrim {
    /// Trim over [`scale`] and over the square of the ripple's share.
    curvature: f32,
    last_demand_nm: f32,
    hold_s: f32,
    #[cfg(feature = "optimal")]
    sixth: Sixth,
}

/// The part of a sixth of a turn that has passed.
#[cfg(feature = "optimal")]
#[derive(Clone, Copy, Debug)]
struct Sixth {
    passed_s: f32,
    /// Missing torque, integrated, in N·m·s.
    missing_nms: f32,
}

#[cfg(feature = "optimal")]
impl Sixth {
    const NONE: Self = Self { passed_s: 0.0, missing_nms: 0.0 };

    /// Takes a period in which so much torque has been missing, in N·m; returns the mean and the time of the sixth that it ends. The rest of the period belongs to
    /// the next sixth.
    fn step(&mut self, missing_nm: f32, period_s: f32, omega: f32) -> Option<(f32, f32)> {
        let passed_s = self.passed_s + period_s;
        let missing_nms = self.missing_nms + missing_nm * period_s;
        if passed_s * omega.abs() < core::f32::consts::FRAC_PI_3 {
            *self = Self { passed_s, missing_nms };
            return None;
        }
        let sixth_s = core::f32::consts::FRAC_PI_3 / omega.abs();
        let next_s = passed_s - sixth_s;
        *self = Self { passed_s: next_s, missing_nms: missing_nm * next_s };
        Some(((missing_nms - self.missing_nms) / sixth_s, sixth_s))
    }
}

/// The inputs of a step of the trim.
pub struct Input {
    /// Demanded torque, in N·m.
    pub demand_nm: f32,
    /// Torque of the measured currents, in N·m.
    pub measured_nm: f32,
    /// Torque of the ripple, as far as it is foreseen, in N·m.
    pub foreseen_nm: f32,
    /// `true` if the demand with its trim is beyond what current and voltage allow.
    pub limited: bool,
    /// `true` if the demand itself is beyond that.
    pub short: bool,
    /// Flux ripple over fundamental flux; zero if the samples do not show its effect.
    pub ripple_share: f32,
    pub largest_nm: f32,
    pub period_s: f32,
    /// Electrical angular speed, in rad/s, if whole sixths of a turn are averaged.
    #[cfg(feature = "optimal")]
    pub by_sixths: Option<f32>,
}

impl TorqueTrim {
    pub const fn new() -> Self {
        Self {
            curvature: 0.0,
            last_demand_nm: 0.0,
            hold_s: HOLD_S,
            #[cfg(feature = "optimal")]
            sixth: Sixth::NONE,
        }
    }

    /// Growth of the demand's magnitude, in N·m, beyond the foreseen torque of the ripple.
    pub fn trim_nm(&self, demand_nm: f32, foreseen_nm: f32, ripple_share: f32, largest_nm: f32) -> f32 {
        let most = MOST * demand_nm.abs() + foreseen_nm.abs();
        limit_magnitude(self.curvature * ripple_share * ripple_share * scale(demand_nm, largest_nm), most)
    }

    pub fn step(&mut self, input: &Input) {
        let change = (input.demand_nm - self.last_demand_nm).abs();
        self.last_demand_nm = input.demand_nm;
        if change > STEADY_RATE * input.largest_nm * input.period_s {
            self.hold_s = HOLD_S;
            #[cfg(feature = "optimal")]
            {
                self.sixth = Sixth::NONE;
            }
            return;
        }
        if self.hold_s > 0.0 {
            self.hold_s -= input.period_s;
            return;
        }
        if input.ripple_share == 0.0 {
            return;
        }
        let missing = input.demand_nm - input.measured_nm;
        let missing = if input.demand_nm < 0.0 { -missing } else { missing };
        // More trim would be of no use. Nor would less, if the demand is beyond the limit: the crests of the ripple alone would
        // take the trim down until the limit seemed kept.
        if input.limited && (input.short || missing > 0.0) {
            return;
        }
        let Some((missing, passed_s)) = self.averaged(missing, input) else { return };
        let scale = scale(input.demand_nm, input.largest_nm);
        let step = BANDWIDTH_RAD_S * passed_s * missing / scale;
        let square = input.ripple_share * input.ripple_share;
        let most = MOST + input.foreseen_nm.abs() / scale;
        self.curvature = limit_magnitude(self.curvature * square + step, most) / square;
    }

    /// The missing torque that is to be learnt from, in N·m, and its time, in s.
    #[inline(always)]
    fn averaged(&mut self, missing_nm: f32, input: &Input) -> Option<(f32, f32)> {
        #[cfg(feature = "optimal")]
        match input.by_sixths {
            Some(omega) => return self.sixth.step(missing_nm, input.period_s, omega),
            None => self.sixth = Sixth::NONE,
        }
        Some((missing_nm, input.period_s))
    }
}

/// Torque that the trim is proportional to, in N·m, greater than zero.
fn scale(demand_nm: f32, largest_nm: f32) -> f32 {
    let (magnitude, least) = (demand_nm.abs(), CONSTANT_BELOW * largest_nm);
    if magnitude > least { magnitude } else { least }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;

    const LARGEST_NM: f32 = 1_000.0;
    const RIPPLE_SHARE: f32 = 0.05;

    /// A large torque that is just what is asked for, in control periods of 10 kHz.
    const HELD: Input = Input {
        demand_nm: 900.0,
        measured_nm: 900.0,
        foreseen_nm: 0.0,
        limited: false,
        short: false,
        ripple_share: RIPPLE_SHARE,
        largest_nm: LARGEST_NM,
        period_s: 1e-4,
        #[cfg(feature = "optimal")]
        by_sixths: None,
    };

    /// Trim after 10 ms of holding and 100 ms of a constant error of torque.
    fn learned_nm(measured_nm: f32, limited: bool, short: bool) -> f32 {
        learned_beyond_nm(0.0, measured_nm, limited, short)
    }

    fn learned_beyond_nm(foreseen_nm: f32, measured_nm: f32, limited: bool, short: bool) -> f32 {
        let mut trim = TorqueTrim::new();
        for _ in 0..1_100 {
            trim.step(&Input { measured_nm, foreseen_nm, limited, short, ..HELD });
        }
        trim.trim_nm(HELD.demand_nm, foreseen_nm, RIPPLE_SHARE, LARGEST_NM)
    }

    #[test]
    fn what_is_missing_is_added() {
        assert!((learned_nm(890.0, false, false) - 54.0).abs() < 0.01, "all that is allowed");
        assert!((learned_nm(910.0, false, false) + 54.0).abs() < 0.01);
        for foreseen_nm in [-30.0, 30.0] {
            let learnt_nm = learned_beyond_nm(foreseen_nm, 920.0, false, false);
            assert!((learnt_nm + 84.0).abs() < 0.01, "as much more as is foreseen, either way: {learnt_nm}");
        }
    }

    #[test]
    fn nothing_is_wound_up_at_a_limit() {
        assert_eq!(learned_nm(890.0, true, false), 0.0, "more would be of no use");
        assert!(learned_nm(910.0, true, false) < -10.0, "less is possible");
        assert_eq!(learned_nm(910.0, true, true), 0.0, "crests of the ripple");
    }

    /// A carrier whose torque the samples do not show.
    #[test]
    fn no_ripple_teaches_nothing_and_has_no_trim() {
        let mut trim = TorqueTrim::new();
        let mut learn = |ripple_share: f32| {
            for _ in 0..1_100 {
                trim.step(&Input { measured_nm: 890.0, ripple_share, ..HELD });
            }
            [0.0, RIPPLE_SHARE].map(|share| trim.trim_nm(900.0, 0.0, share, LARGEST_NM))
        };
        assert_eq!(learn(0.0), [0.0, 0.0]);
        let learnt = learn(RIPPLE_SHARE);
        assert!(learnt[0] == 0.0 && learnt[1] > 10.0, "{learnt:?}");
        assert_eq!(learn(0.0), learnt);
    }

    /// After a demand that changes by more than the largest torque in a second, the loop is still at work.
    #[test]
    fn a_steep_ramp_teaches_nothing() {
        for (largest_nm, slope_nm_s, learns) in
            [(1_000.0, 990.0, true), (1_000.0, 1_010.0, false), (2.0, 1.9, true), (2.0, 2.1, false)]
        {
            let (mut trim, period_s) = (TorqueTrim::new(), 1e-3);
            for period in 0..200_u8 {
                let demand_nm = slope_nm_s * period_s * f32::from(period);
                let measured_nm = 0.99 * demand_nm;
                trim.step(&Input { demand_nm, measured_nm, largest_nm, period_s, ..HELD });
            }
            assert_eq!(
                trim.trim_nm(largest_nm, 0.0, RIPPLE_SHARE, largest_nm) > 0.0,
                learns,
                "{largest_nm} {slope_nm_s}"
            );
        }
    }

    /// A demand that changes by exactly the largest torque in a second is not yet steep.
    #[test]
    fn the_border_of_a_steep_ramp_is_not_steep() {
        let mut trim = TorqueTrim::new();
        for period in 0..64_u8 {
            let demand_nm = f32::from(period);
            let (measured_nm, largest_nm, period_s) = (0.0, 1_024.0, 1.0 / 1_024.0);
            trim.step(&Input { demand_nm, measured_nm, largest_nm, period_s, ..HELD });
        }
        assert!(trim.curvature > 0.0);
    }

    /// A torque whose ripple repeats every sixth of a turn moves the trim by its mean alone, once a sixth, although sixths end within periods: by 0.5 N·m at most
    /// beside it, where it was 2.6 when a sixth ended with its last period.
    #[cfg(feature = "optimal")]
    #[test]
    fn a_ripple_of_torque_does_not_shake_the_trim() {
        const PERIODS: f32 = 7.4;
        let (mut trim, omega) = (TorqueTrim::new(), -800.0_f32);
        let sixth_s = core::f32::consts::FRAC_PI_3 / omega.abs();
        let period_s = sixth_s / PERIODS;
        // Integral of the ripple, two waves of 200 N·m a sixth, in N·m and periods.
        let ripple = |period: f32| {
            let wave_rad = 2.0 * core::f32::consts::TAU / PERIODS;
            200.0 / wave_rad * (1.0 - (wave_rad * period).cos())
        };
        let mut step = |period: f32| {
            let measured_nm = 899.0 + ripple(period + 1.0) - ripple(period);
            trim.step(&Input { measured_nm, period_s, by_sixths: Some(omega), ..HELD });
            trim.trim_nm(900.0, 0.0, RIPPLE_SHARE, LARGEST_NM)
        };
        let held = (HOLD_S / period_s).ceil() as u16 + 1;
        assert_eq!((0..held).map(|_| step(0.0)).fold(0.0, f32::max), 0.0);
        let mut worst_nm = 0.0_f32;
        for period in 0..500_u16 {
            let sixths = (f32::from(period + 1) / PERIODS + 1e-4).floor();
            let mean_nm = BANDWIDTH_RAD_S * sixth_s * sixths;
            worst_nm = worst_nm.max((step(f32::from(period)) - mean_nm).abs());
        }
        assert!(worst_nm < 0.5, "{worst_nm} N·m");
    }
}
