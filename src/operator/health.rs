//! The conditions for turning the gates on, and for leaving a fault: sensors, gate drivers, link, configuration, contactors.

use super::{Configuration, Settings, Situation};
use crate::protection::{self, FailedCheck, Fault, SafeState};

/// Share of the largest current that a current sensor may show when no current flows.
const OFFSET_SHARE: f32 = 0.02;
/// Share of the largest current that may flow while the gates are off.
const RESTING_SHARE: f32 = 0.05;
/// Share of the nominal voltage by which an empty link may be measured as negative.
const NEGATIVE_LINK_SHARE: f32 = 0.02;

/// The first thing that is not in order while the gates are off; `main_closed` is the order given to the main contactor.
#[inline(never)]
pub(super) fn cause(input: &Situation, main_closed: bool, settings: &Settings) -> Option<FailedCheck> {
    hardware(input)
        .or_else(|| configuration(input))
        .or_else(|| current_sensors(input, settings))
        .or_else(|| link(input, settings))
        .or_else(|| position(input))
        .or_else(|| speed(input, settings))
        .or_else(|| if settings.line.is_some() { contactors(input, main_closed, false) } else { None })
}

/// Gate drivers, any other cause that holds the gates off, and temperatures.
pub(super) fn hardware(input: &Situation) -> Option<FailedCheck> {
    let feedback = input.feedback;
    if let Some(fault) = feedback.hardware {
        return Some((fault, 1.0, 0.0));
    }
    if !feedback.driver_ready {
        return Some((Fault::GateDriver, 1.0, 0.0));
    }
    input.thermal
}

fn configuration(input: &Situation) -> Option<FailedCheck> {
    let found = input.feedback.configuration;
    let (value, wanted) = (f32::from(found as u8), f32::from(Configuration::Good as u8));
    (found != Configuration::Good).then_some((Fault::Configuration, value, wanted))
}

fn current_sensors(input: &Situation, settings: &Settings) -> Option<FailedCheck> {
    let offsets = input.feedback.offsets_a;
    let offset_a = OFFSET_SHARE * settings.ratings.max_current_a;
    let offset =
        [offsets.a, offsets.b, offsets.c].into_iter().find(|offset| is_beyond(offset.abs(), offset_a));
    if let Some(offset) = offset {
        return Some((Fault::CurrentOffset, offset.abs(), offset_a));
    }
    None
}

/// The check that no current flows, for use after the gates have been off for a while.
#[inline(never)]
pub(super) fn resting_current(input: &Situation, settings: &Settings) -> Option<FailedCheck> {
    let (ratings, observed) = (settings.ratings, input.observed);
    // A machine that turns fast, or whose link is empty, lets current flow through the diodes.
    let open = protection::safe_state(observed.emf_omega, observed.udc_v, ratings) == SafeState::GatesOff;
    let resting_a = if open { RESTING_SHARE * ratings.max_current_a } else { ratings.trip_current_a };
    let current = observed.current_a;
    is_beyond(current, resting_a).then_some((Fault::CurrentOffset, current, resting_a))
}

/// The check of a shorted machine: its current is the one that its EMF drives through its resistance; otherwise the machine turns faster than its
/// sensor says.
pub(super) fn shorted_current(input: &Situation, settings: &Settings) -> Option<FailedCheck> {
    let (ratings, observed) = (settings.ratings, input.observed);
    let driven_a = observed.emf_omega.abs() * ratings.magnet_flux_wb / ratings.stator_resistance_ohm;
    let limit_a = driven_a + RESTING_SHARE * ratings.max_current_a;
    is_beyond(observed.current_a, limit_a).then_some((Fault::CurrentOffset, observed.current_a, limit_a))
}

/// `true` if a value exceeds a limit or is not a number.
fn is_beyond(value: f32, limit: f32) -> bool {
    value.is_nan() || value > limit
}

fn link(input: &Situation, settings: &Settings) -> Option<FailedCheck> {
    let (udc_v, ratings) = (input.observed.udc_v, settings.ratings);
    let lowest_v = -NEGATIVE_LINK_SHARE * ratings.dc_link_nominal_v;
    if !udc_v.is_finite() || udc_v < lowest_v {
        return Some((Fault::LinkImplausible, udc_v, lowest_v));
    }
    (udc_v > ratings.trip_dc_over_v).then_some((Fault::DcOvervoltage, udc_v, ratings.trip_dc_over_v))
}

/// The check that the sensor answers; at standstill its speed settles at zero, when turning at a speed.
pub(super) fn position(input: &Situation) -> Option<FailedCheck> {
    let alive = input.feedback.sensor_alive && input.observed.omega.is_finite();
    (!alive).then_some((Fault::PositionSensor, 0.0, 1.0))
}

/// The check against the overspeed trip.
fn speed(input: &Situation, settings: &Settings) -> Option<FailedCheck> {
    protection::check_speed(input.observed.omega, settings.ratings)
}

/// `true` if the machine's EMF stays below a link of nominal voltage with the gates off; at a higher speed the diodes would rectify it.
#[inline(never)]
pub(super) fn open_is_safe(input: &Situation, settings: &Settings) -> bool {
    let (emf_omega, nominal_v) = (input.observed.emf_omega, settings.ratings.dc_link_nominal_v);
    protection::safe_state(emf_omega, nominal_v, settings.ratings) == SafeState::GatesOff
}

/// The first condition that is violated while the gates may pulse.
#[inline(never)]
pub(super) fn while_pulsing(input: &Situation, main_closed: bool) -> Option<FailedCheck> {
    hardware(input)
        .or_else(|| position(input))
        .or_else(|| {
            let known = input.feedback.position_known || input.feedback.position_counted;
            (!known).then_some((Fault::PositionSensor, 0.0, 1.0))
        })
        .or_else(|| if main_closed { contactors(input, true, false) } else { None })
}

/// The check that the contactors follow their orders.
#[inline(never)]
pub(super) fn contactors(
    input: &Situation,
    main_closed: bool,
    precharge_closed: bool,
) -> Option<FailedCheck> {
    const MAIN: f32 = 1.0;
    const PRECHARGE: f32 = 2.0;
    let feedback = input.feedback;
    if feedback.main_closed != main_closed {
        return Some((Fault::Contactor, MAIN, 0.0));
    }
    (feedback.precharge_closed != precharge_closed).then_some((Fault::Contactor, PRECHARGE, 0.0))
}
