//! From a request to demands: its values are checked and its torque is kept within its limits on its way to the drive.

use super::grip::Grip;
use super::line_limits::{Drawn, Most};
use super::settings::Ends;
use super::{Levels, Limits, MotorLimits, Ramp, Rates, Refusal, Request, Seen, Settings, Situation};
use crate::control::{Demand, LinkWindow, Warmth};
use crate::drive::Observation;
use crate::frames::{Dq, SQRT_3, limit};
use crate::machine::Ratings;
use crate::ports::{DriveCommand, Report};
use crate::protection::{self, FailedCheck, Trip};

/// The drive's part of the state machine: its request, its observation, and its demands on their way.
pub trait Demands: Copy {
    /// The request.
    type Request: Copy;
    /// The drive's report of itself.
    type Report: Copy + core::fmt::Debug;
    /// The command to the drive.
    type DriveCommand: Copy;
    /// The status of the demands.
    type Status: Copy + core::fmt::Debug;

    /// The state without any demand.
    const AT_REST: Self;
    /// `true` if its limits are derated by temperatures; otherwise temperatures are ignored, whatever the settings contain.
    const DERATES: bool = false;

    /// The request's levels.
    fn levels(request: &Self::Request) -> Levels;
    /// The part of the observation that is common to all drives.
    fn seen(observed: &Observation<Self::Report>) -> Seen;
    /// The report of a drive that has not started; `trip` gives the reason.
    fn refused(trip: Trip) -> Self::Report;
    /// The reason why the request's values cannot be used as they are.
    fn wrong_with(request: &Self::Request, settings: &Settings) -> Option<Refusal>;
    /// `true` if a torque or speed other than zero is asked for.
    fn asks_torque(request: &Self::Request) -> bool;
    /// Adopts limits that are valid.
    fn take_limits(&mut self, request: &Self::Request);
    /// Adopts the share of the limits that the temperatures leave, 0 ..= 1, and the machine's warmth.
    #[inline]
    fn derate(&mut self, _share: f32, _warmth: Warmth) {}
    /// `true` if there is no demand any more.
    fn are_at_rest(&self) -> bool;
    /// Brings the demands to rest at once.
    fn drop(&mut self);
    /// One slot towards the requested values; towards zero without a request.
    fn step(&mut self, request: Option<&Self::Request>, report: &Self::Report, settings: &Settings);
    /// `true` if the gates may go off at the end of a stop, as far as the link is concerned.
    #[inline]
    fn link_may_rest(_report: &Self::Report) -> bool {
        true
    }
    /// The present demands.
    fn told(&self) -> Self::Status;
    /// The command to the drive.
    fn command(&self, orders: &Orders, settings: &Settings) -> Self::DriveCommand;
}

/// The operator's orders to the drive, beside the demands.
#[derive(Clone, Copy, Debug)]
pub struct Orders {
    /// Gates may pulse.
    pub enable: bool,
    /// The zero of the position sensor is to be calibrated.
    pub calibrate: bool,
    /// Number of the last acknowledge.
    pub acknowledge: u8,
}

/// The PMaSynRM drive's demand: a torque.
#[derive(Clone, Copy, Debug)]
pub struct TorqueDemand {
    ramp: Ramp,
    /// The ramp's torque within the line's limits, in N·m: they move with the speed, faster than slew and jerk let the ramp follow.
    given_nm: f32,
    /// The limits in force; `None`: as rated.
    limits: Option<Limits>,
    /// The share of them that the temperatures leave.
    share: f32,
    warmth: Warmth,
    line: LineVoltage,
    drawn: Drawn,
    grip: Grip,
}

impl TorqueDemand {
    fn limits(&self, settings: &Settings) -> Limits {
        let limits = self.limits.unwrap_or(Limits::rated(settings.ratings));
        let (motoring_nm, braking_nm) = (self.share * limits.motoring_nm, self.share * limits.braking_nm);
        Limits { motoring_nm, braking_nm, ..limits }
    }

    /// The torque demand, in N·m.
    fn torque_nm(&self) -> f32 {
        self.grip.share() * self.given_nm
    }
}

/// A torque limited to the motoring and braking that remain at a speed.
fn within(torque_nm: f32, speed: f32, most: &Most) -> f32 {
    let Most { motoring_nm, braking_nm } = *most;
    if speed < 0.0 {
        limit(torque_nm, -motoring_nm, braking_nm)
    } else {
        limit(torque_nm, -braking_nm, motoring_nm)
    }
}

impl Demands for TorqueDemand {
    type Request = Request;
    type Report = Report;
    type DriveCommand = DriveCommand;
    type Status = f32;

    const AT_REST: Self = Self {
        ramp: Ramp::new(),
        given_nm: 0.0,
        limits: None,
        share: 1.0,
        warmth: Warmth::NONE,
        line: LineVoltage::UNKNOWN,
        drawn: Drawn::UNKNOWN,
        grip: Grip::FULL,
    };
    const DERATES: bool = true;

    #[inline]
    fn levels(request: &Request) -> Levels {
        let Request { enable, with_torque, off, coast, charge, discharge, acknowledge, calibrate, .. } =
            *request;
        Levels { enable, with_torque, off, coast, charge, discharge, acknowledge, calibrate }
    }

    #[inline]
    fn seen(observed: &Observation) -> Seen {
        let Report { udc_v, current_a, map_error, omega, speed_known, trip, acknowledged, .. } =
            observed.report;
        let (at, emf_omega) = (observed.at, omega);
        let reference_a = Dq { d: observed.report.id_a, q: observed.report.iq_a }.length();
        Seen {
            at,
            udc_v,
            current_a,
            reference_a,
            map_error,
            omega,
            emf_omega,
            speed_known,
            trip,
            acknowledged,
        }
    }

    #[inline]
    fn refused(trip: Trip) -> Report {
        Report::refused(trip)
    }

    #[inline]
    fn wrong_with(request: &Request, settings: &Settings) -> Option<Refusal> {
        wrong_with(request, settings.ratings)
    }

    #[inline]
    fn asks_torque(request: &Request) -> bool {
        request.torque_nm != 0.0
    }

    #[inline]
    fn take_limits(&mut self, request: &Request) {
        self.limits = Some(request.limits);
    }

    #[inline]
    fn derate(&mut self, share: f32, warmth: Warmth) {
        (self.share, self.warmth) = (share, warmth);
    }

    #[inline]
    fn are_at_rest(&self) -> bool {
        self.ramp.torque_nm() == 0.0
    }

    #[inline]
    fn drop(&mut self) {
        *self = Self { limits: self.limits, share: self.share, warmth: self.warmth, ..Self::AT_REST };
    }

    #[inline]
    fn step(&mut self, request: Option<&Request>, report: &Report, settings: &Settings) {
        let ratings = settings.ratings;
        let speed = report.omega / ratings.pole_pairs;
        let target_nm = match request {
            Some(request) => {
                let Limits { motoring_nm, braking_nm, speed_rad_s, .. } = self.limits(settings);
                let limits = MotorLimits { motoring_nm, braking_nm, speed_rad_s };
                wanted_nm(request.torque_nm, speed, &limits)
            }
            None => 0.0,
        };
        self.line.step(report, settings.slot_s);
        let link_nm = motoring_nm(report, &self.line.window(&self.limits(settings), ratings), ratings);
        self.drawn.step(report, settings);
        let line = self.drawn.most(speed, ratings, &settings.train);
        let motoring_nm = if link_nm < line.motoring_nm { link_nm } else { line.motoring_nm };
        let held_nm = within(target_nm, speed, &Most { motoring_nm, ..line });
        self.given_nm = within(self.ramp.step(held_nm, &Rates::of(settings)), speed, &line);
        self.grip.step(self.given_nm, speed, settings);
    }

    #[inline]
    fn told(&self) -> f32 {
        self.torque_nm()
    }

    #[inline]
    fn command(&self, orders: &Orders, settings: &Settings) -> DriveCommand {
        let Orders { enable, calibrate, acknowledge } = *orders;
        DriveCommand {
            enable,
            demand: Demand { torque_nm: self.torque_nm(), slew_limited: true },
            window: self.line.window(&self.limits(settings), settings.ratings),
            acknowledge,
            warmth: self.warmth,
            calibrate,
        }
    }
}

/// Share of the speed limit, below that limit, over which torque that raises the speed fades.
const SPEED_SPAN: f32 = 0.05;

/// The reason why the request's values cannot be used as they are.
#[inline(never)]
fn wrong_with(request: &Request, ratings: &Ratings) -> Option<Refusal> {
    let Limits { motoring_nm, braking_nm, speed_rad_s, link_low_v, link_high_v } = request.limits;
    // The sum is not finite if one term is not.
    let sum: f32 =
        [request.torque_nm, motoring_nm, braking_nm, speed_rad_s, link_low_v, link_high_v].iter().sum();
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

/// The requested torque, within the limits at a mechanical speed in rad/s, in N·m.
pub(super) fn wanted_nm(torque_nm: f32, speed: f32, limits: &MotorLimits) -> f32 {
    let fade = limit((limits.speed_rad_s - speed.abs()) / (SPEED_SPAN * limits.speed_rad_s), 0.0, 1.0);
    let motoring_nm = fade * limits.motoring_nm;
    let (lowest, highest) =
        if speed < 0.0 { (-motoring_nm, limits.braking_nm) } else { (-limits.braking_nm, motoring_nm) };
    limit(torque_nm, lowest, highest)
}

/// Share of the largest torque that holds a link without source, at speeds where it gives the largest power; at lower speeds less in proportion, so
/// that at standstill, where nothing is to be gained, it is zero.
const HOLDING_SHARE: f32 = 0.1;

/// The largest motoring torque that a link in its window is to give, in N·m. Below the window a turning machine brakes a little, whatever is asked
/// for, so that its own energy holds the link while the line is away.
fn motoring_nm(report: &Report, window: &LinkWindow, ratings: &Ratings) -> f32 {
    let share = (report.udc_v - window.motoring_none_v) / (window.motoring_full_v - window.motoring_none_v);
    let power_w = ratings.max_torque_nm * report.omega.abs() / ratings.pole_pairs;
    let holding = HOLDING_SHARE * limit(power_w / ratings.max_power_w, 0.0, 1.0);
    ratings.max_torque_nm * limit(share, -holding, 1.0)
}

/// The line's voltage as the link has shown it, in V; 0 while it is not known.
///
/// When the line is lost the link falls with it in milliseconds; when it sags, in seconds. So motoring ends a little below the voltage that the line
/// gave some seconds ago: the drive then holds the link near that voltage, and a returning line finds little to charge.
#[derive(Clone, Copy, Debug)]
struct LineVoltage(f32);

/// Time constant with which the line's voltage is learned, in s.
const LINE_S: f32 = 3.0;
/// Shares of the line's voltage between which motoring ends.
const MOTORING_FULL: f32 = 0.95;
const MOTORING_NONE: f32 = 0.85;

impl LineVoltage {
    const UNKNOWN: Self = Self(0.0);

    /// One slot. Braking lifts the link above the line, and behind a rectifier it stays there: only a drive that takes power can see the line's
    /// voltage rise.
    fn step(&mut self, report: &Report, slot_s: f32) {
        let Self(line_v) = self;
        let takes = report.torque_nm * report.omega > 0.0;
        if *line_v == 0.0 {
            *line_v = report.udc_v;
        } else if takes || report.udc_v < *line_v {
            *line_v += slot_s / LINE_S * (report.udc_v - *line_v);
        }
    }

    /// The window of link voltage in which torque ends, for the control interrupt.
    fn window(self, limits: &Limits, ratings: &Ratings) -> LinkWindow {
        let (ends, Self(line_v)) = (Ends::rated(ratings), self);
        let low_v = limits.link_low_v;
        let at_least = |share_v: f32, least_v: f32| if share_v > least_v { share_v } else { least_v };
        LinkWindow {
            motoring_none_v: at_least(MOTORING_NONE * line_v, low_v),
            motoring_full_v: at_least(MOTORING_FULL * line_v, low_v + ends.motoring_span_v),
            braking_full_v: limits.link_high_v - ends.braking_span_v,
            braking_none_v: limits.link_high_v,
        }
    }
}

/// The check for a link that has lost its source while the main contactor is closed: the source must not return without precharge.
pub(super) fn link_lost(input: &Situation, settings: &Settings) -> Option<FailedCheck> {
    settings.line.as_ref()?;
    protection::check_undervoltage(input.observed.udc_v, settings.ratings)
}

/// The machine's EMF between two lines, peak, in V.
pub(super) fn emf_v(input: &Situation, ratings: &Ratings) -> f32 {
    SQRT_3 * input.observed.emf_omega.abs() * ratings.magnet_flux_wb
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::built_in::traction::BUILT_IN;

    /// Warmth and limits remain; torque on its way is dropped.
    #[test]
    fn a_demand_that_is_dropped_keeps_its_derating() {
        let settings = Settings::rated(&BUILT_IN.ratings, 1e-3, None);
        let warmth = Warmth::new(1.25);
        let mut demand = TorqueDemand { given_nm: 100.0, ..TorqueDemand::AT_REST };
        demand.derate(0.5, warmth);
        demand.drop();
        let orders = Orders { enable: false, calibrate: false, acknowledge: 0 };
        assert_eq!((demand.given_nm, demand.command(&orders, &settings).warmth), (0.0, warmth));
        let most_nm = demand.limits(&settings).motoring_nm;
        assert_eq!(most_nm, 0.5 * Limits::rated(settings.ratings).motoring_nm);
    }

    /// The line's voltage is taken from the link, falls with it, and rises with it while power is taken.
    #[test]
    fn the_line_is_known_by_the_link() {
        let report = |udc_v, omega| Report { udc_v, torque_nm: 100.0, omega, ..Report::default() };
        let mut line = LineVoltage::UNKNOWN;
        for (udc_v, omega, wanted_v) in [
            (1_500.0, 0.0, 1_500.0),
            (1_800.0, -50.0, 1_500.0),
            (1_800.0, 0.0, 1_500.0),
            (1_800.0, 50.0, 1_600.0),
            (1_300.0, -50.0, 1_500.0),
        ] {
            line.step(&report(udc_v, omega), 1.0);
            assert!((line.0 - wanted_v).abs() < 1e-2, "{udc_v} V: {}, not {wanted_v}", line.0);
        }
    }
}
