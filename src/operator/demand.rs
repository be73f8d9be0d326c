//! From a request to demands: its values are checked and its torque is kept within its limits on its way to the drive.

use super::ahead::{Ahead, limited_nm};
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
    /// `true` if a torque is asked for, or a speed that takes one.
    fn asks_torque(request: &Self::Request, report: &Self::Report, ratings: &Ratings) -> bool;
    /// Adopts those limits that are valid, each message's by themselves.
    fn take_limits(&mut self, request: &Self::Request, settings: &Settings);
    /// Adopts the share of the limits that the temperatures leave, 0 ..= 1, and the machine's warmth.
    #[inline]
    fn derate(&mut self, _share: f32, _warmth: Warmth) {}
    /// `true` if there is no demand any more.
    fn are_at_rest(&self) -> bool;
    /// Brings the demands to rest at once.
    fn drop(&mut self);
    /// One slot at rest; `connected` if the main contactor has connected the link to its line.
    fn rest(&mut self, _report: &Self::Report, _connected: bool) {
        self.drop();
    }
    /// One slot towards an aim.
    fn step(&mut self, aim: Aim<Self::Request>, report: &Self::Report, settings: &Settings);
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

/// The aim of the demands in a slot.
#[derive(Clone, Copy, Debug)]
pub enum Aim<'a, Q> {
    /// The request's values, with the slew and the jerk of the settings.
    Request(&'a Q),
    /// Zero, likewise.
    Coast,
    /// Zero, as fast as the machine is rated: slew and jerk of the settings are for comfort.
    Stop,
}

impl<'a, Q> Aim<'a, Q> {
    /// The request, if its values count.
    pub(super) const fn request(self) -> Option<&'a Q> {
        match self {
            Self::Request(request) => Some(request),
            Self::Coast | Self::Stop => None,
        }
    }

    /// The rates of a demand on its way.
    pub(super) const fn rates(self, settings: &Settings) -> Rates {
        match self {
            Self::Request(_) | Self::Coast => Rates::of(settings),
            Self::Stop => Rates::of(&Settings::rated(settings.ratings, settings.slot_s, None)),
        }
    }
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
    ahead: Ahead,
    grip: Grip,
}

impl TorqueDemand {
    fn limits(&self, settings: &Settings) -> Limits {
        let limits = self.limits.unwrap_or(Limits::rated(settings.ratings));
        let (motoring_nm, braking_nm) = (self.share * limits.motoring_nm, self.share * limits.braking_nm);
        Limits { motoring_nm, braking_nm, ..limits }
    }

    /// The largest motoring torque that the link allows, in N·m, below 0 if it has lost its line; and what the line allows.
    fn link_and_line(&self, udc_v: f32, speed: f32, limits: &Limits, settings: &Settings) -> (f32, Most) {
        let ratings = settings.ratings;
        let share = |limits: &Limits| left_share(udc_v, &self.line.window(limits, ratings));
        // A window that was asked for ends motoring as well, but only what is below the line has lost it.
        let (asked, line) = (share(limits), share(&Limits::rated(ratings)));
        let giving_nm = self.drawn.giving_nm(limit(line, 0.0, 1.0), speed, ratings);
        let most = self
            .drawn
            .most(self.ahead.speed(speed, 0.0), ratings, &settings.train)
            .braking_at_most(giving_nm);
        if line >= 0.0 {
            return (ratings.max_torque_nm * limit(asked, 0.0, 1.0), most);
        }
        let holding_nm = lower(lower(HOLDING_SHARE * ratings.max_torque_nm, giving_nm), limits.braking_nm);
        (limit(ratings.max_torque_nm * line, -holding_nm, 0.0), most.without_braking_power())
    }

    /// The torque demand, in N·m.
    fn torque_nm(&self) -> f32 {
        self.grip.share() * self.given_nm
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
        ahead: Ahead::UNKNOWN,
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
        let Report {
            udc_v, current_a, squares_a2, map_error, omega, speed_known, trip, acknowledged, ..
        } = observed.report;
        let (at, emf_omega) = (observed.at, omega);
        let reference_a = Dq { d: observed.report.id_a, q: observed.report.iq_a }.length();
        Seen {
            at,
            udc_v,
            current_a,
            squares_a2,
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
    fn asks_torque(request: &Request, _report: &Report, _ratings: &Ratings) -> bool {
        request.torque_nm != 0.0
    }

    #[inline]
    fn take_limits(&mut self, request: &Request, settings: &Settings) {
        let rated = Limits::rated(settings.ratings);
        let (asked, before) = (request.limits, self.limits.unwrap_or(rated));
        let motor = if asked.motor_is_within(&rated) { asked } else { before };
        let link = if asked.link_is_within(&rated) { asked } else { before };
        self.limits = Some(Limits { link_low_v: link.link_low_v, link_high_v: link.link_high_v, ..motor });
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
        let Self { limits, share, warmth, line, .. } = *self;
        *self = Self { limits, share, warmth, line, ..Self::AT_REST };
    }

    /// A line that is connected is still known after a rest: its link may be above it then, from braking.
    #[inline]
    fn rest(&mut self, report: &Report, connected: bool) {
        self.drop();
        self.line = if connected { self.line.at_rest(report) } else { LineVoltage::UNKNOWN };
    }

    #[inline]
    fn step(&mut self, aim: Aim<Request>, report: &Report, settings: &Settings) {
        let Settings { ratings, slot_s, .. } = *settings;
        let (speed, limits) = (report.omega / ratings.pole_pairs, self.limits(settings));
        self.line.step(report, slot_s);
        self.drawn.step(report, settings);
        self.ahead.step(speed, slot_s);
        let Limits { motoring_nm, braking_nm, speed_rad_s, .. } = limits;
        let motor = MotorLimits { motoring_nm, braking_nm, speed_rad_s };
        let left = self.ahead.left_share(speed, self.given_nm, &motor, ratings);
        let asked_nm = aim.request().map_or(0.0, |request| request.torque_nm);
        let target_nm = limited_nm(asked_nm, speed, left, &motor, ratings);
        let (link_nm, most) = self.link_and_line(report.udc_v, speed, &limits, settings);
        let held_nm = most.motoring_at_most(link_nm).within(target_nm, speed);
        // What falls with a rising speed falls faster than slew and jerk let the ramp follow.
        let now = most.motoring_at_most(left * ratings.max_torque_nm);
        self.given_nm = now.within(self.ramp.step(held_nm, &aim.rates(settings)), speed);
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
    let inside = request.limits.motor_is_within(&rated) && request.limits.link_is_within(&rated);
    (!inside).then_some(Refusal::LimitOutOfRange)
}

/// Share of the largest torque with which a turning machine holds a link that has lost its line, whatever is asked for: by no more than what gives
/// the link power.
const HOLDING_SHARE: f32 = 0.1;

/// The share of motoring torque that a window leaves at a link voltage: 1 at its upper end, below 0 under its lower one.
fn left_share(udc_v: f32, window: &LinkWindow) -> f32 {
    (udc_v - window.motoring_none_v) / (window.motoring_full_v - window.motoring_none_v)
}

fn lower(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The line's voltage as the link has shown it, in V; 0 while it is not known.
///
/// When the line is lost the link falls with it in milliseconds; when it sags, in seconds. So motoring ends a little below the voltage that the line
/// gave some seconds ago: the drive then holds the link near that voltage, and a returning line finds little to charge.
#[derive(Clone, Copy, Debug)]
struct LineVoltage {
    line_v: f32,
    /// The time for which the drive has taken power from it, in s, [`PROVEN_S`] at most.
    taken_s: f32,
}

/// Time of taking power after which a line is no longer doubted, in s: what lies on an unloaded link may be its capacitor's own voltage, which the first
/// torque takes down to the line's.
const PROVEN_S: f32 = 0.2;

/// Time constant with which the line's voltage is learned, in s.
const LINE_S: f32 = 3.0;
/// Shares of the line's voltage between which motoring ends.
const MOTORING_FULL: f32 = 0.95;
const MOTORING_NONE: f32 = 0.85;

impl LineVoltage {
    const UNKNOWN: Self = Self { line_v: 0.0, taken_s: 0.0 };

    /// One slot. Braking lifts the link above the line, and behind a rectifier it stays there: only a drive that takes power can see the line's
    /// voltage rise.
    fn step(&mut self, report: &Report, slot_s: f32) {
        let Self { line_v, taken_s } = self;
        // At rest, for its copper loss.
        let takes = report.torque_nm != 0.0 && report.torque_nm * report.omega >= 0.0;
        let doubted = *taken_s < PROVEN_S;
        if *line_v == 0.0 || doubted && report.udc_v < *line_v {
            *line_v = report.udc_v;
        } else if takes || report.udc_v < *line_v {
            *line_v += slot_s / LINE_S * (report.udc_v - *line_v);
        }
        *taken_s += if takes && doubted { slot_s } else { 0.0 };
    }

    /// The voltage known after a slot in which the drive neither takes nor gives power: the link is not below its line then.
    fn at_rest(self, report: &Report) -> Self {
        let line_v =
            if self.line_v == 0.0 || report.udc_v < self.line_v { report.udc_v } else { self.line_v };
        Self { line_v, ..self }
    }

    /// The window of link voltage in which torque ends, for the control interrupt.
    fn window(self, limits: &Limits, ratings: &Ratings) -> LinkWindow {
        let (ends, line_v) = (Ends::rated(ratings), self.line_v);
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

    /// A link that braking has lifted is no line that has risen, whether the drive rests in between or not; with the contactor open, nothing is known.
    #[test]
    fn a_connected_line_is_known_after_a_rest() {
        let settings = Settings::rated(&BUILT_IN.ratings, 1e-3, None);
        let lifted = Report { udc_v: 1_800.0, ..Report::default() };
        for (connected, wanted_v) in [(true, 1_500.0), (false, 1_800.0)] {
            let mut demand = TorqueDemand::AT_REST;
            demand.step(Aim::Coast, &Report { udc_v: 1_500.0, ..Report::default() }, &settings);
            demand.rest(&lifted, connected);
            demand.step(Aim::Coast, &lifted, &settings);
            assert_eq!(demand.line.line_v, wanted_v);
            demand.rest(&Report { udc_v: 1_200.0, ..Report::default() }, connected);
            assert_eq!(demand.line.line_v, if connected { 1_200.0 } else { 0.0 });
        }
        let mut charged = TorqueDemand::AT_REST;
        for (udc_v, known_v) in [(1_700.0, 1_700.0), (1_510.0, 1_510.0), (1_520.0, 1_510.0)] {
            charged.rest(&Report { udc_v, ..Report::default() }, true);
            assert_eq!(charged.line.line_v, known_v, "a link that swings when its contactor closes");
        }
    }

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

    /// On a link that has lost its line a turning machine brakes with a tenth of its largest torque, in its window with what is asked; one that its
    /// copper loss exceeds, and one at rest, with less.
    #[test]
    fn a_link_without_a_line_is_held_by_what_gives_it_power() {
        let settings = Settings::rated(&BUILT_IN.ratings, 1e-3, None);
        let ratings = settings.ratings;
        let tenth_nm = 0.1 * ratings.max_torque_nm;
        let held_nm = |speed: f32, current_a: f32, lost: bool| {
            let mut demand = TorqueDemand::AT_REST;
            let report = |udc_v| Report {
                udc_v,
                squares_a2: 1.5 * current_a * current_a,
                omega: speed * ratings.pole_pairs,
                torque_nm: tenth_nm,
                ..Report::default()
            };
            demand.step(Aim::Coast, &report(1_500.0), &settings);
            for _ in 0..2_000 {
                demand.step(Aim::Coast, &report(if lost { 1_000.0 } else { 1_500.0 }), &settings);
                demand.line = LineVoltage { line_v: 1_500.0, taken_s: PROVEN_S };
            }
            demand.given_nm
        };
        for (speed, current_a, lost, wanted_nm) in [
            (100.0, 50.0, true, -tenth_nm),
            (-100.0, 50.0, true, tenth_nm),
            (100.0, 50.0, false, 0.0),
            (0.0, 50.0, true, 0.0),
            (1.0, 50.0, true, -tenth_nm * tenth_nm / (3.0 * 50.0 * 50.0 * ratings.stator_resistance_ohm)),
        ] {
            let found_nm = held_nm(speed, current_a, lost);
            assert!(
                (found_nm - wanted_nm).abs() < 1e-3 * tenth_nm,
                "{speed} rad/s, {lost}: {found_nm}, not {wanted_nm}"
            );
        }
    }

    /// Just below the window of a line that is lost, holding begins in proportion.
    #[test]
    fn holding_begins_gently() {
        let settings = Settings::rated(&BUILT_IN.ratings, 1e-3, None);
        let line = LineVoltage { line_v: 1_500.0, taken_s: PROVEN_S };
        let demand = TorqueDemand { line, ..TorqueDemand::AT_REST };
        let limits = Limits::rated(settings.ratings);
        let (link_nm, _) = demand.link_and_line(1_275.0 - 0.05 * 150.0, 100.0, &limits, &settings);
        assert!((link_nm / (-0.05 * settings.ratings.max_torque_nm) - 1.0).abs() < 1e-2, "{link_nm}");
    }

    /// The line's voltage is taken from the link, falls with it, and rises with it while power is taken.
    #[test]
    fn the_line_is_known_by_the_link() {
        let report = |udc_v, omega| Report { udc_v, torque_nm: 100.0, omega, ..Report::default() };
        let mut line = LineVoltage { taken_s: PROVEN_S, ..LineVoltage::UNKNOWN };
        for (udc_v, omega, wanted_v) in [
            (1_500.0, 0.0, 1_500.0),
            (1_800.0, -50.0, 1_500.0),
            (1_800.0, 0.0, 1_600.0),
            (1_900.0, 50.0, 1_700.0),
            (1_400.0, -50.0, 1_600.0),
        ] {
            line.step(&report(udc_v, omega), 1.0);
            assert!((line.line_v - wanted_v).abs() < 1e-2, "{udc_v} V: {}, not {wanted_v}", line.line_v);
        }
        // However long nothing is taken, a line stays doubted.
        let idle = |udc_v| Report { udc_v, omega: 50.0, ..Report::default() };
        let mut line = LineVoltage::UNKNOWN;
        (0..500).for_each(|_| line.step(&idle(1_795.0), 1e-3));
        line.step(&idle(1_600.0), 1e-3);
        assert_eq!(line.line_v, 1_600.0);
        // A capacitor that was left at 1,795 V: the first fifth of a second of torque shows the line.
        let mut line = LineVoltage::UNKNOWN.at_rest(&report(1_795.0, 0.0));
        for (slots, udc_v, wanted_v) in
            [(100, 1_600.0, 1_600.0), (100, 1_500.0, 1_500.0), (30, 1_200.0, 1_497.0)]
        {
            (0..slots).for_each(|_| line.step(&report(udc_v, 50.0), 1e-3));
            assert!((line.line_v - wanted_v).abs() < 0.1, "{udc_v} V: {}, not {wanted_v}", line.line_v);
        }
    }
}
