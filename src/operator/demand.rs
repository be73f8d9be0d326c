//! What a request comes to: its values checked, its torque within its limits.

use super::settings::Ends;
use super::{Input, Limits, Refusal, Request, Settings};
use crate::control::LinkWindow;
use crate::frames::{SQRT_3, limit};
use crate::machine::Ratings;
use crate::protection::{self, Violation};

/// Share of the speed limit below it over which torque that raises the speed fades.
const SPEED_SPAN: f32 = 0.05;

/// Why the request's values cannot be used as they are.
pub(super) fn wrong_with(request: &Request, ratings: &Ratings) -> Option<Refusal> {
    let Limits { motoring_nm, braking_nm, speed_rad_s, link_low_v, link_high_v } = request.limits;
    let sum = request.torque_nm + motoring_nm + braking_nm + speed_rad_s + link_low_v + link_high_v;
    if !sum.is_finite() {
        return Some(Refusal::RequestNotFinite);
    }
    let rated = Limits::rated(ratings);
    let inside = (0.0..=rated.motoring_nm).contains(&motoring_nm)
        && (0.0..=rated.braking_nm).contains(&braking_nm)
        && (0.0..=rated.speed_rad_s).contains(&speed_rad_s)
        && speed_rad_s > 0.0
        && (rated.link_low_v..=rated.link_high_v).contains(&link_low_v)
        && (rated.link_low_v..=rated.link_high_v).contains(&link_high_v)
        && link_low_v < link_high_v;
    (!inside).then_some(Refusal::LimitOutOfRange)
}

/// The torque that is asked for, within the limits at this speed, in N·m.
pub(super) fn wanted_nm(input: &Input, limits: &Limits, ratings: &Ratings) -> f32 {
    let speed = input.observed.omega / ratings.pole_pairs;
    let fade = limit((limits.speed_rad_s - speed.abs()) / (SPEED_SPAN * limits.speed_rad_s), 0.0, 1.0);
    let motoring_nm = fade * limits.motoring_nm;
    let (lowest, highest) =
        if speed < 0.0 { (-motoring_nm, limits.braking_nm) } else { (-limits.braking_nm, motoring_nm) };
    limit(input.request.torque_nm, lowest, highest)
}

/// Where the link ends torque, for the control interrupt.
pub(super) fn window(limits: &Limits, ratings: &Ratings) -> LinkWindow {
    let ends = Ends::rated(ratings);
    LinkWindow {
        motoring_none_v: limits.link_low_v,
        motoring_full_v: limits.link_low_v + ends.motoring_span_v,
        braking_full_v: limits.link_high_v - ends.braking_span_v,
        braking_none_v: limits.link_high_v,
    }
}

/// A link that has lost its source while the main contactor is closed: it must not come back without precharge.
pub(super) fn link_lost(input: &Input, settings: &Settings) -> Option<Violation> {
    if settings.line.is_none() {
        return None;
    }
    protection::check_undervoltage(input.observed.udc_v, settings.ratings)
}

/// The machine's EMF between two lines, peak, in V.
pub(super) fn emf_v(input: &Input, ratings: &Ratings) -> f32 {
    SQRT_3 * input.observed.omega.abs() * ratings.magnet_flux_wb
}
