//! The checks of measurements and of demands.

use super::{FailedCheck, Fault};
use crate::control::{Demand, Measurements};
use crate::frames::Abc;
use crate::machine::Ratings;

/// The largest error of an angle against the speed's prediction, in electrical rad. The tracker's lag behind a rotor that accelerates by itself is a
/// quarter of it, or up to four fifths with the lightest rotors.
pub const INNOVATION_RAD: f32 = 0.05;

/// The check of the angle, which is `innovation_rad` away from the expected one.
pub fn check_angle(innovation_rad: f32) -> Option<FailedCheck> {
    let off_rad = innovation_rad.abs();
    (off_rad > INNOVATION_RAD).then_some((Fault::AngleLost, off_rad, INNOVATION_RAD))
}

/// The check for an unknown angle that is `needed`.
pub fn check_known(needed: bool) -> Option<FailedCheck> {
    needed.then_some((Fault::PositionSensor, 0.0, 1.0))
}

/// Share of the largest current that the sum of the phases may reach.
const PHASE_SUM_SHARE: f32 = 0.1;

/// `true` if [`check_currents`] finds nothing.
#[inline(always)]
pub fn are_sound(currents_a: &Abc, ratings: &Ratings) -> bool {
    let Abc { a, b, c } = *currents_a;
    let flows = |current_a: f32| current_a.abs() <= ratings.trip_current_a;
    // Every comparison with NaN is false.
    (a + b + c).abs() <= PHASE_SUM_SHARE * ratings.max_current_a && flows(a) && flows(b) && flows(c)
}

/// The check of phase currents alone, as both interrupts sample them.
#[inline]
pub fn check_currents(currents_a: &Abc, ratings: &Ratings) -> Option<FailedCheck> {
    if are_sound(currents_a, ratings) { None } else { find_in_currents(currents_a, ratings) }
}

/// The same check for currents that are not sound.
#[inline]
fn find_in_currents(currents_a: &Abc, ratings: &Ratings) -> Option<FailedCheck> {
    let sum = currents_a.a + currents_a.b + currents_a.c;
    if !sum.is_finite() {
        return Some((Fault::NotFinite, sum, f32::MAX));
    }
    let peak = currents_a.peak();
    if peak > ratings.trip_current_a {
        return Some((Fault::Overcurrent, peak, ratings.trip_current_a));
    }
    let sum_limit = PHASE_SUM_SHARE * ratings.max_current_a;
    if sum.abs() > sum_limit {
        return Some((Fault::PhaseSum, sum, sum_limit));
    }
    None
}

/// The check of everything that the control interrupt measures; `omega` electrical, in rad/s.
pub fn check_measurements(measured: &Measurements, omega: f32, ratings: &Ratings) -> Option<FailedCheck> {
    let udc = measured.udc_v;
    if !udc.is_finite() {
        return Some((Fault::NotFinite, udc, f32::MAX));
    }
    if udc > ratings.trip_dc_over_v {
        return Some((Fault::DcOvervoltage, udc, ratings.trip_dc_over_v));
    }
    check_speed(omega, ratings).or_else(|| check_currents(&measured.currents_a, ratings))
}

/// `true` if neither [`check_measurements`] nor [`check_undervoltage`] nor [`check_demand`] finds anything: one test for the ordinary period. `false`
/// if one of them may find something.
#[inline(always)]
pub fn is_sound(measured: &Measurements, omega: f32, demand: &Demand, ratings: &Ratings) -> bool {
    let udc_v = measured.udc_v;
    are_sound(&measured.currents_a, ratings)
        && udc_v <= ratings.trip_dc_over_v
        && udc_v >= ratings.trip_dc_under_v
        && omega.abs() <= ratings.trip_speed_rad_s * ratings.pole_pairs
        && demand.torque_nm.is_finite()
}

/// The check of the link while the gates may be on: with the gates off it may be empty.
pub fn check_undervoltage(udc_v: f32, ratings: &Ratings) -> Option<FailedCheck> {
    (udc_v < ratings.trip_dc_under_v).then_some((Fault::DcUndervoltage, udc_v, ratings.trip_dc_under_v))
}

/// The check of the operator's demand: any finite number is a demand, which the envelope limits.
pub fn check_demand(demand: &Demand) -> Option<FailedCheck> {
    let torque = demand.torque_nm;
    if torque.is_finite() { None } else { Some((Fault::NotFinite, torque, f32::MAX)) }
}

/// The check for mechanical overspeed, from an electrical speed in rad/s.
pub fn check_speed(omega: f32, ratings: &Ratings) -> Option<FailedCheck> {
    if omega.abs() > ratings.trip_speed_rad_s * ratings.pole_pairs {
        return Some((Fault::Overspeed, omega.abs() / ratings.pole_pairs, ratings.trip_speed_rad_s));
    }
    None
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use crate::built_in;
    use crate::frames::Angle;

    /// For every combination of values inside, at and beyond the limits, and of NaN, the one test agrees with the checks.
    #[test]
    fn what_is_sound_is_what_no_check_finds() {
        let ratings = &built_in::traction::BUILT_IN.ratings;
        let (trip_a, sum_a) = (ratings.trip_current_a, PHASE_SUM_SHARE * ratings.max_current_a);
        let fastest = ratings.trip_speed_rad_s * ratings.pole_pairs;
        let around =
            |limit: f32| [0.0, limit, limit.next_up(), -limit, (-limit).next_down(), f32::NAN, f32::INFINITY];
        let phases = around(trip_a)
            .map(|a| around(trip_a).map(|b| around(sum_a).map(|sum| Abc { a, b, c: sum - a - b })));
        let links_v = [around(ratings.trip_dc_over_v), around(ratings.trip_dc_under_v)].concat();
        let others = around(fastest).into_iter().zip([0.0, f32::MAX, f32::NAN, 1.0, 0.0, 2.0, f32::INFINITY]);
        for currents_a in phases.into_iter().flatten().flatten() {
            for (udc_v, (omega, torque_nm)) in
                links_v.iter().flat_map(|udc_v| others.clone().map(|other| (*udc_v, other)))
            {
                let measured = Measurements { currents_a, udc_v, angle: Angle::ZERO };
                let demand = Demand { torque_nm, slew_limited: true };
                let found = check_measurements(&measured, omega, ratings)
                    .or_else(|| check_undervoltage(udc_v, ratings))
                    .or_else(|| check_demand(&demand));
                // A NaN speed is found elsewhere, by its consequences.
                let expected = found.is_none() && !omega.is_nan();
                let sound = is_sound(&measured, omega, &demand, ratings);
                assert_eq!(sound, expected, "{measured:?} {omega} {torque_nm}: {found:?}");
            }
        }
    }
}
