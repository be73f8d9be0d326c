//! The checks of what is measured and of what is asked for.

use super::{Fault, Violation};
use crate::control::{Demand, Measurements};
use crate::frames::Abc;
use crate::machine::Ratings;

/// The largest error of an angle against the speed's prediction, in electrical rad. The tracker's lag behind a rotor that
/// accelerates by itself is a fifth of it.
pub const INNOVATION_RAD: f32 = 0.05;

/// The angle, `innovation_rad` off what was expected.
pub fn check_angle(innovation_rad: f32) -> Option<Violation> {
    let off_rad = innovation_rad.abs();
    (off_rad > INNOVATION_RAD).then_some((Fault::AngleLost, off_rad, INNOVATION_RAD))
}

/// An angle that is not known, where it is `needed`.
pub fn check_known(needed: bool) -> Option<Violation> {
    needed.then_some((Fault::PositionSensor, 0.0, 1.0))
}

/// Share of the largest current that the sum of the phases may reach.
const PHASE_SUM_SHARE: f32 = 0.1;

/// Phase currents alone, as both interrupts sample them.
pub fn check_currents(currents_a: &Abc, ratings: &Ratings) -> Option<Violation> {
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

/// Everything the control interrupt measures; `omega` electrical, in rad/s.
pub fn check_measurements(measured: &Measurements, omega: f32, ratings: &Ratings) -> Option<Violation> {
    let udc = measured.udc_v;
    if !udc.is_finite() {
        return Some((Fault::NotFinite, udc, f32::MAX));
    }
    if udc > ratings.trip_dc_over_v {
        return Some((Fault::DcOvervoltage, udc, ratings.trip_dc_over_v));
    }
    check_speed(omega, ratings).or_else(|| check_currents(&measured.currents_a, ratings))
}

/// The link while the gates may be on: without them it may be empty.
pub fn check_undervoltage(udc_v: f32, ratings: &Ratings) -> Option<Violation> {
    (udc_v < ratings.trip_dc_under_v).then_some((Fault::DcUndervoltage, udc_v, ratings.trip_dc_under_v))
}

/// The operator's demand: any finite number is a demand, which the envelope limits.
pub fn check_demand(demand: &Demand) -> Option<Violation> {
    let torque = demand.torque_nm;
    if torque.is_finite() { None } else { Some((Fault::NotFinite, torque, f32::MAX)) }
}

/// Mechanical overspeed, for an electrical speed in rad/s.
pub fn check_speed(omega: f32, ratings: &Ratings) -> Option<Violation> {
    if omega.abs() > ratings.trip_speed_rad_s * ratings.pole_pairs {
        return Some((Fault::Overspeed, omega.abs() / ratings.pole_pairs, ratings.trip_speed_rad_s));
    }
    None
}
