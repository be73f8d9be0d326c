//! The Z-source network's control: how long the bridge shorts the link.
//!
//! The link's voltage outside shoot-through is `U_in = v1 + v2 − U_dc`; it is not continuous, so the capacitors' voltage is
//! controlled instead, to `v_C* = (U_in* + U_dc)/2`. A PI gives the inductors' current, in addition to the motors' power over
//! U_dc, which is that current in steady state; an inner loop gives the shoot-through duty.
//!
//! The loop must always be closed: motors fed with constant power make the network unstable at a fixed duty above
//! about `r C U_in²/(2 L)`. Its bandwidth is bounded by the right-half-plane zero at `U_dc/(2 i_L L)` rad/s: energy must
//! go into the inductors, away from the link, before there can be more of it in the capacitors.

use super::source_damper::{CONDUCTANCE, SourceDamper};
use crate::frames::limit;
use crate::machine::{Ratings, ZSourceNetwork};
use core::f32::consts::TAU;

/// The network, the bandwidths and the limits, which determine the gains.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ZSourceDesign {
    /// Inductance of each inductor, in H, above 0.
    pub inductance_h: f32,
    /// Resistance of each inductor, in ohm, from 0.
    pub resistance_ohm: f32,
    /// Capacitance of each capacitor, in F, above 0.
    pub capacitance_f: f32,
    /// Time from one step to the next, in s, above 0; a duty acts in the period that follows its sample.
    pub period_s: f32,
    /// Bandwidth of the inner loop, in Hz; 1.5 periods of delay at 10 kHz leave 600 Hz 58° of phase.
    pub inner_hz: f32,
    /// Bandwidth of the outer loop, in Hz, a few times below that and below the right-half-plane zero.
    pub outer_hz: f32,
    /// The slope of the link's reference, in V/s, above 0.
    pub link_slew_v_s: f32,
    /// Largest shoot-through duty, 0 < x < 0.5.
    pub duty_max: f32,
    /// Largest inductor current that is asked for, either way, in A, above 0.
    pub inductor_max_a: f32,
    /// Conductance that the capacitors are to a swing of the source, in S, from 0: it damps a line filter.
    pub damping_s: f32,
}

/// Largest ratio of the outer loop's bandwidth to the zero in the right half-plane.
const ZERO_SHARE: f32 = 0.15;
/// Slope of the link's reference over the source's voltage, in 1/s: it covers that voltage in 150 ms.
const SLEW_PER_S: f32 = 6.675;

impl ZSourceDesign {
    /// The ZS9's: 0.5 mH, 10 mΩ, 500 µF; a 10 kHz carrier.
    pub const ZS9: Self = Self {
        inductance_h: 0.5e-3,
        resistance_ohm: 10e-3,
        capacitance_f: 500e-6,
        period_s: 100e-6,
        inner_hz: 600.0,
        outer_hz: 80.0,
        // 400 to 667 V in a tenth of a second.
        link_slew_v_s: 2670.0,
        // 0.25 holds 800 V; the rest is to move.
        duty_max: 0.3,
        // The motors' full power takes 60 A.
        inductor_max_a: 90.0,
        damping_s: 0.0,
    };

    /// The design for a network and two identical machines, with the control period in s. The motors' full current is `i = 2 P/U_dc`; the zero in the right
    /// half-plane lies at `U_dc/(2 i L)` in rad/s.
    ///
    /// Quicker than by itself: with the motors' power fed forward the loops only have to correct the remainder. For the paper's network the phase margins are
    /// 52° and about 50°; a load step then moves the link by half as much as with 600 and 80 Hz. For another network the outer loop stays as far below the
    /// zero in the right half-plane at the motors' full power.
    pub const fn of(network: &ZSourceNetwork, ratings: &Ratings, period_s: f32) -> Self {
        let ZSourceNetwork { source_v, inductance_h, resistance_ohm, capacitance_f } = *network;
        let full_a = 2.0 * ratings.max_power_w / source_v;
        let zero_hz = source_v / (2.0 * full_a * inductance_h) / TAU;
        let (quick_hz, lower_hz) = (150.0, ZERO_SHARE * zero_hz);
        Self {
            inductance_h,
            resistance_ohm,
            capacitance_f,
            period_s,
            inner_hz: 700.0,
            outer_hz: if quick_hz < lower_hz { quick_hz } else { lower_hz },
            link_slew_v_s: SLEW_PER_S * source_v,
            inductor_max_a: 1.5 * full_a,
            ..Self::ZS9
        }
    }

    /// Conductance of a line filter's damping, in S: a multiple of `2 P/U²`, that of both motors' full power. It damps every filter of 1 to 8 mH, 2 to 8 mF and
    /// 10 mΩ or more in front of the paper's machines.
    pub const fn line_damping_s(network: &ZSourceNetwork, ratings: &Ratings) -> f32 {
        2.0 * ratings.max_power_w * CONDUCTANCE / (network.source_v * network.source_v)
    }

    /// The gains.
    ///
    /// Inner: `L di/dt = ω_i L (i* − i)`, so ω_i L. Outer: `C dv/dt = (1 − 2d) i_L − (1 − d) i_in`, so ω_v C for the current
    /// that reaches the capacitors, which is `i_L U_dc/U_in`. The integral's corner is a quarter of ω_v: it costs 14° of
    /// the phase that the inner loop leaves.
    pub const fn gains(&self) -> ZSourceGains {
        let outer_rad_s = TAU * self.outer_hz;
        ZSourceGains {
            inner_ohm: TAU * self.inner_hz * self.inductance_h,
            outer_s: outer_rad_s * self.capacitance_f,
            integral_share: 0.25 * outer_rad_s * self.period_s,
        }
    }
}

/// Gains of both loops.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ZSourceGains {
    /// Voltage across an inductor for an error of its current, in V/A.
    pub inner_ohm: f32,
    /// Current into a capacitor for an error of its voltage, in A/V.
    pub outer_s: f32,
    /// Share of that current that goes into the integral in one step.
    pub integral_share: f32,
}

/// The measurements and demands of one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ZSourceInput {
    /// Capacitor voltage v_C, mean of both, in V.
    pub capacitor_v: f32,
    /// Inductor current i_L, mean of both, from source to bridge, in A.
    pub inductor_a: f32,
    /// Source voltage U_dc, in V, above 0.
    pub source_v: f32,
    /// Electrical power of both motors, in W; negative while they brake.
    pub power_w: f32,
    /// Wanted link voltage outside shoot-through, U_in*, in V; a value below U_dc counts as U_dc.
    pub link_ref_v: f32,
    /// The duty that the motors leave room for, 0 ..= 1.
    pub duty_room: f32,
}

/// A step's result; every number is finite.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct ZSourceOutput {
    /// Shoot-through duty D_sh, 0 ..= `duty_max`, for the carrier period that comes next.
    pub duty: f32,
    /// Measured link voltage `2 v_C − U_dc`, in V: what the modulator must divide by.
    pub link_v: f32,
    /// Present link reference, in V: U_in* after the slew.
    pub link_ref_v: f32,
    /// Inductor current reference, in A.
    pub inductor_ref_a: f32,
    /// The limit that holds the duty or the current.
    pub limited: Limited,
}

/// The direction in which the network would go without a limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Limited {
    /// No limit reached.
    Free,
    /// It would store more.
    Above,
    /// It would store less.
    Below,
}

/// The reason why there is no duty. The state stays what it was.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ZSourceError {
    /// A value is NaN or infinite, or so large that the duty would be.
    NotFinite,
    /// The source voltage, in V, is not above 0.
    NoSource(f32),
}

/// The control's state between two steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ZSource {
    /// Link reference after the slew, in V; `None` before the first step.
    link_ref_v: Option<f32>,
    /// Integral part of the inductor current, in A.
    integral_a: f32,
    /// Of a source behind a line filter.
    damper: SourceDamper,
}

/// Least link voltage that is divided by, as a share of the source's.
const LEAST_LINK_SHARE: f32 = 0.25;

impl ZSource {
    /// Before the first step; the link's reference then begins where the link is.
    pub const fn new() -> Self {
        Self { link_ref_v: None, integral_a: 0.0, damper: SourceDamper::at(0.0) }
    }

    /// One period: the duty for the next.
    ///
    /// # Errors
    /// If a number would not be finite, or there is no source; the loops' state then stays as it was.
    pub fn step(
        &mut self,
        input: &ZSourceInput,
        design: &ZSourceDesign,
        gains: &ZSourceGains,
    ) -> Result<ZSourceOutput, ZSourceError> {
        let ZSourceInput { capacitor_v, inductor_a, source_v, power_w, link_ref_v, duty_room } = *input;
        // Not finite if any of them is not.
        if !(capacitor_v + inductor_a + source_v + power_w + link_ref_v + duty_room).is_finite() {
            return Err(ZSourceError::NotFinite);
        }
        if source_v <= 0.0 {
            return Err(ZSourceError::NoSource(source_v));
        }
        let link_v = 2.0 * capacitor_v - source_v;
        let divisor_v =
            if link_v > LEAST_LINK_SHARE * source_v { link_v } else { LEAST_LINK_SHARE * source_v };

        let from_v = self.link_ref_v.unwrap_or(link_v);
        let most_v = design.link_slew_v_s * design.period_s;
        let led_v = at_least(from_v + limit(link_ref_v - from_v, -most_v, most_v), source_v);
        let per_source = 1.0 / source_v;
        let ratio = led_v * per_source;

        // Outer loop. While the reference moves, the capacitors' charging current is known beforehand.
        if design.damping_s > 0.0 {
            self.damp(input, design);
        }
        let SourceDamper { moved_v, moves_v_s, .. } = self.damper;
        let error_v = 0.5 * (led_v + source_v) + moved_v - capacitor_v;
        let moving_v_s = 0.5 * (led_v - at_least(from_v, source_v)) / design.period_s + moves_v_s;
        let charging_a = design.capacitance_f * moving_v_s;
        let into_capacitor_a = gains.outer_s * error_v;
        let wanted_a = power_w * per_source + ratio * (charging_a + into_capacitor_a) + self.integral_a;
        let inductor_ref_a = limit(wanted_a, -design.inductor_max_a, design.inductor_max_a);

        // Inner loop.
        let across_v = gains.inner_ohm * (inductor_ref_a - inductor_a) + design.resistance_ohm * inductor_a;
        let wanted_duty = (capacitor_v - source_v + across_v) / divisor_v;
        let duty = limit(wanted_duty, 0.0, at_least(smaller(duty_room, design.duty_max), 0.0));

        let limited = if wanted_a > inductor_ref_a || wanted_duty > duty {
            Limited::Above
        } else if wanted_a < inductor_ref_a || wanted_duty < duty {
            Limited::Below
        } else {
            Limited::Free
        };
        // The part that a limit holds back must not pile up in the integral.
        let holds_back = match limited {
            Limited::Free => false,
            Limited::Above => error_v > 0.0,
            Limited::Below => error_v < 0.0,
        };
        let step_a = if holds_back { 0.0 } else { gains.integral_share * ratio * into_capacitor_a };
        let integral_a = limit(self.integral_a + step_a, -design.inductor_max_a, design.inductor_max_a);
        if !(duty + link_v + led_v + inductor_ref_a + integral_a).is_finite() {
            return Err(ZSourceError::NotFinite);
        }
        (self.link_ref_v, self.integral_a) = (Some(led_v), integral_a);
        Ok(ZSourceOutput { duty, link_v, link_ref_v: led_v, inductor_ref_a, limited })
    }

    /// Damps the source's swing. Out of line: most sources are stiff.
    #[cold]
    #[inline(never)]
    fn damp(&mut self, input: &ZSourceInput, design: &ZSourceDesign) {
        let ZSourceInput { capacitor_v, source_v, .. } = *input;
        if self.link_ref_v.is_none() {
            self.damper = SourceDamper::at(source_v);
        }
        let capacitors = (design.capacitance_f, at_least(capacitor_v, source_v));
        self.damper.step(source_v, capacitors, design.damping_s, design.period_s);
    }
}

/// The larger of two; NaN in the first stays.
#[inline]
fn at_least(x: f32, least: f32) -> f32 {
    if x < least { least } else { x }
}

/// The smaller of two; NaN in the first stays.
#[inline]
fn smaller(x: f32, most: f32) -> f32 {
    if x > most { most } else { x }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DESIGN: ZSourceDesign = ZSourceDesign::ZS9;
    const GAINS: ZSourceGains = DESIGN.gains();
    /// In steady state at 667 V without load.
    const STEADY: ZSourceInput = ZSourceInput {
        capacitor_v: 533.5,
        inductor_a: 0.0,
        source_v: 400.0,
        power_w: 0.0,
        link_ref_v: 667.0,
        duty_room: 0.4,
    };

    fn step(state: &mut ZSource, input: ZSourceInput) -> Result<ZSourceOutput, ZSourceError> {
        state.step(&input, &DESIGN, &GAINS)
    }

    #[test]
    fn steady_state_asks_for_the_duty_of_the_steady_state() {
        let got = step(&mut ZSource::new(), STEADY).unwrap();
        assert!((got.duty - 133.5 / 667.0).abs() < 1e-6, "{got:?}");
        assert_eq!((got.link_v, got.limited), (667.0, Limited::Free));
        // Power is fed forward as the source's current.
        let loaded = ZSourceInput { inductor_a: 40.0, power_w: 16_000.0, ..STEADY };
        let got = step(&mut ZSource::new(), loaded).unwrap();
        assert!((got.duty - (133.5 + 0.4) / 667.0).abs() < 1e-6, "{got:?}");
    }

    #[test]
    fn what_is_not_finite_is_an_error_and_changes_nothing() {
        let fields: [fn(&mut ZSourceInput) -> &mut f32; 6] = [
            |input| &mut input.capacitor_v,
            |input| &mut input.inductor_a,
            |input| &mut input.source_v,
            |input| &mut input.power_w,
            |input| &mut input.link_ref_v,
            |input| &mut input.duty_room,
        ];
        let mut state = ZSource::new();
        step(&mut state, ZSourceInput { capacitor_v: 530.0, ..STEADY }).unwrap();
        let before = state;
        for field in fields {
            for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                let mut input = STEADY;
                *field(&mut input) = bad;
                assert_eq!(step(&mut state, input), Err(ZSourceError::NotFinite));
                assert_eq!(state, before);
            }
            // Finite, but beyond what can be computed with: an error or a number, never NaN.
            for vast in [f32::MAX, f32::MIN] {
                let mut input = STEADY;
                *field(&mut input) = vast;
                let mut state = before;
                if let Ok(got) = step(&mut state, input) {
                    assert!((0.0..=DESIGN.duty_max).contains(&got.duty), "{got:?}");
                }
            }
        }
        for source_v in [0.0, -0.0, -400.0] {
            assert!(matches!(
                step(&mut state, ZSourceInput { source_v, ..STEADY }),
                Err(ZSourceError::NoSource(_))
            ));
        }
    }

    #[test]
    fn the_reference_begins_where_the_link_is_and_slews() {
        let mut state = ZSource::new();
        let rest = ZSourceInput { capacitor_v: 400.0, ..STEADY };
        let first = step(&mut state, rest).unwrap();
        assert!((first.link_ref_v - 400.267).abs() < 1e-3, "{first:?}");
        let mut steps = 1;
        while step(&mut state, rest).unwrap().link_ref_v < 667.0 {
            steps += 1;
        }
        assert!((999..=1001).contains(&steps), "{steps}");
        let mut below = ZSource::new();
        let got = step(&mut below, ZSourceInput { link_ref_v: 100.0, ..rest }).unwrap();
        assert_eq!(got.link_ref_v, 400.0);
    }

    #[test]
    fn a_limit_does_not_wind_up_the_integral() {
        let mut state = ZSource::new();
        // A link that stays low, whatever is done.
        let starved = ZSourceInput { capacitor_v: 450.0, duty_room: 0.1, ..STEADY };
        for _ in 0..100_000 {
            let got = step(&mut state, starved).unwrap();
            assert!(got.duty <= 0.1, "{got:?}");
        }
        // Before the limit was reached the reference was on its way, so a little is there.
        assert!(state.integral_a.abs() < 5.0, "{state:?}");
        let above = ZSourceInput { capacitor_v: 620.0, inductor_a: 90.0, ..STEADY };
        let above = step(&mut state, above).unwrap();
        assert_eq!((above.duty, above.limited), (0.0, Limited::Below));
    }

    /// A source that has risen by 4 V: the inductors are asked for the charge of both capacitors, and for that of the reference's shift.
    #[test]
    fn a_swing_of_the_source_charges_the_capacitors() {
        let risen = ZSourceInput { source_v: 404.0, ..STEADY };
        let asked_a = |damping_s| {
            let (mut state, design) = (ZSource::new(), ZSourceDesign { damping_s, ..DESIGN });
            state.step(&STEADY, &design, &GAINS).unwrap();
            assert_eq!(
                (state.damper.moved_v, state.damper.moves_v_s),
                (0.0, 0.0),
                "it begins where the source is"
            );
            let asked = state.step(&risen, &design, &GAINS).unwrap().inductor_ref_a;
            (asked, state.damper)
        };
        let ((still_a, none), (damped_a, damper)) = (asked_a(0.0), asked_a(0.3));
        assert_eq!(none, SourceDamper::at(0.0), "a stiff source");
        let ratio = 667.0 / 404.0;
        let charging_a = ratio * (DESIGN.capacitance_f * damper.moves_v_s + GAINS.outer_s * damper.moved_v);
        assert!(
            charging_a > 0.5 && ((damped_a - still_a) / charging_a - 1.0).abs() < 0.05,
            "{still_a} {damped_a}"
        );
    }

    #[test]
    fn no_room_is_no_duty() {
        for duty_room in [0.0, -1.0] {
            assert_eq!(step(&mut ZSource::new(), ZSourceInput { duty_room, ..STEADY }).unwrap().duty, 0.0);
        }
    }
}
