//! The ZS9's request: a torque or a speed for each motor, and a voltage for the link. Both motors share one state machine, so a fault, a stop and an
//! enabling edge each apply to both.

use super::Orders;
use super::ahead::{Ahead, limited_nm};
use super::demand::Aim;
use super::set_point::SetPoint;
use super::{Demands, Levels, Ramp, Rates, Refusal, Seen, Settings};
use crate::control::Demand;
use crate::drive::{Observation, dual};
use crate::frames::limit;
use crate::machine::Ratings;
use crate::ports::{DualDriveCommand, DualReport, MotorDemand};
use crate::protection::Trip;

/// Share of the source's voltage by which the link may exceed it when the gates go off at the end of a stop: any more swings back into the source
/// through the inductors.
const RESTING_SHARE: f32 = 0.05;

/// Averaging time of the torque that holds a speed, in s. The instantaneous torque of the speed loop is full of the speed's noise: with an encoder of
/// 4,096 counts up to 90 N·m of 120, which, ramped down from there, spun the ZS9's free motor to 390 r/min.
const HOLDING_S: f32 = 0.05;

/// The demand on one motor.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Wanted {
    /// A torque, in N·m; positive turns the rotor forward.
    Torque(f32),
    /// A mechanical speed, in rad/s.
    Speed(f32),
}

impl Wanted {
    const fn value(self) -> f32 {
        match self {
            Self::Torque(value) | Self::Speed(value) => value,
        }
    }
}

/// Limits of one motor, each within its ratings.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MotorLimits {
    /// Largest motoring torque, in N·m, 0 ..= the rated largest.
    pub motoring_nm: f32,
    /// Largest braking torque, in N·m, 0 ..= the rated largest. For a speed demand the smaller of both holds.
    pub braking_nm: f32,
    /// Mechanical speed at which torque that would raise it further is zero, and the largest speed demand, in rad/s, above 0, at
    /// most the rated largest.
    pub speed_rad_s: f32,
}

impl MotorLimits {
    /// The limits as the machine is rated.
    pub const fn rated(ratings: &Ratings) -> Self {
        let Ratings { max_torque_nm, max_speed_rad_s, .. } = *ratings;
        Self { motoring_nm: max_torque_nm, braking_nm: max_torque_nm, speed_rad_s: max_speed_rad_s }
    }

    fn are_within(&self, ratings: &Ratings) -> bool {
        let rated = Self::rated(ratings);
        (0.0..=rated.motoring_nm).contains(&self.motoring_nm)
            && (0.0..=rated.braking_nm).contains(&self.braking_nm)
            && (0.0..=rated.speed_rad_s).contains(&self.speed_rad_s)
            && self.speed_rad_s > 0.0
    }
}

/// The request to one motor.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MotorRequest {
    /// The demand.
    pub wanted: Wanted,
    /// Its limits.
    pub limits: MotorLimits,
}

/// The request to the ZS9, as levels; see [`super::Request`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DualRequest {
    /// Levels.
    pub levels: Levels,
    /// Upper motor, lower motor.
    pub motors: [MotorRequest; 2],
    /// Desired link voltage outside shoot-through, in V, from the lowest to what the network's highest voltage gives.
    pub link_ref_v: f32,
}

impl DualRequest {
    /// A request for nothing, with limits as rated and the link at this voltage.
    pub const fn idle(ratings: &Ratings, link_ref_v: f32) -> Self {
        let motor = MotorRequest { wanted: Wanted::Torque(0.0), limits: MotorLimits::rated(ratings) };
        Self { levels: Levels::NONE, motors: [motor; 2], link_ref_v }
    }
}

/// One motor's demand on its way.
#[derive(Clone, Copy, Debug)]
enum DemandRamp {
    /// The ramp, and the torque of it that the speed limit leaves, in N·m.
    Torque(Ramp, f32),
    /// The speed's reference, and the torque that holds the speed, in N·m.
    Speed(SetPoint, f32),
}

/// One motor's measurements in a slot.
struct Motor {
    /// Mechanical speed, in rad/s.
    speed: f32,
    ahead: Ahead,
    /// Torque reference, in N·m.
    torque_nm: f32,
}

impl DemandRamp {
    const AT_REST: Self = Self::Torque(Ramp::new(), 0.0);

    fn is_at_rest(&self) -> bool {
        matches!(self, Self::Torque(ramp, _) if ramp.torque_nm() == 0.0)
    }

    /// One slot. A demand of the other kind begins at the motor's present state: torque at the value that has held the speed, speed at the motor's
    /// speed.
    fn step(
        &mut self,
        wanted: Wanted,
        motor: &Motor,
        limits: &MotorLimits,
        (settings, rates): (&Settings, &Rates),
    ) {
        let ratings = settings.ratings;
        *self = match (wanted, *self) {
            (Wanted::Torque(torque_nm), ramp) => {
                let (mut ramp, given_nm) = match ramp {
                    Self::Torque(ramp, given_nm) => (ramp, given_nm),
                    Self::Speed(_, holding_nm) => (Ramp::at(holding_nm), holding_nm),
                };
                let left = motor.ahead.left_share(motor.speed, given_nm, limits, ratings);
                ramp.step(limited_nm(torque_nm, motor.speed, left, limits, ratings), rates);
                // What falls with a rising speed falls faster than slew and jerk let the ramp follow.
                let rated = MotorLimits::rated(ratings);
                Self::Torque(ramp, limited_nm(ramp.torque_nm(), motor.speed, left, &rated, ratings))
            }
            (Wanted::Speed(target), ramp) => {
                let (mut point, holding_nm) = match ramp {
                    Self::Speed(point, holding_nm) => (point, holding_nm),
                    Self::Torque(_, given_nm) => (SetPoint::at(motor.speed), given_nm),
                };
                let target = limit(target, -limits.speed_rad_s, limits.speed_rad_s);
                point.step(target, settings);
                let share = settings.slot_s / (settings.slot_s + HOLDING_S);
                Self::Speed(point, holding_nm + share * (motor.torque_nm - holding_nm))
            }
        };
    }

    fn demand(&self) -> MotorDemand {
        match self {
            Self::Torque(_, torque_nm) => {
                MotorDemand::Torque(Demand { torque_nm: *torque_nm, slew_limited: true })
            }
            Self::Speed(point, _) => MotorDemand::Speed(point.speed()),
        }
    }
}

/// The ZS9's demands: a torque or a speed of each motor, and the link's voltage.
#[derive(Clone, Copy, Debug)]
pub struct DualDemands {
    ramps: [DemandRamp; 2],
    ahead: [Ahead; 2],
    /// The limits in force; `None`: as rated.
    limits: Option<[MotorLimits; 2]>,
    link_ref_v: f32,
    /// The link voltage that goes down to the source's during a stop.
    resting_v: Option<f32>,
}

impl DualDemands {
    fn limits(&self, settings: &Settings) -> [MotorLimits; 2] {
        self.limits.unwrap_or([MotorLimits::rated(settings.ratings); 2])
    }
}

impl Demands for DualDemands {
    type Request = DualRequest;
    type Report = DualReport;
    type DriveCommand = DualDriveCommand;
    type Status = [MotorDemand; 2];

    const AT_REST: Self = Self {
        ramps: [DemandRamp::AT_REST; 2],
        ahead: [Ahead::UNKNOWN; 2],
        limits: None,
        link_ref_v: 0.0,
        resting_v: None,
    };

    fn levels(request: &DualRequest) -> Levels {
        request.levels
    }

    fn seen(observed: &Observation<DualReport>) -> Seen {
        let Observation { at, report } = observed;
        let ([w1, w2], [i1, i2]) = (report.omega, report.current_a);
        Seen {
            at: *at,
            udc_v: report.capacitor_v,
            current_a: larger(i1, i2),
            squares_a2: 0.0,
            reference_a: 0.0,
            map_error: 0.0,
            omega: larger(w1.abs(), w2.abs()),
            emf_omega: w1.abs() + w2.abs(),
            speed_known: report.speed_known,
            trip: report.trip,
            acknowledged: report.acknowledged,
        }
    }

    fn refused(trip: Trip) -> DualReport {
        DualReport::refused(trip)
    }

    fn wrong_with(request: &DualRequest, settings: &Settings) -> Option<Refusal> {
        let ratings = settings.ratings;
        let [m1, m2] = &request.motors;
        let sum = |motor: &MotorRequest| -> f32 {
            let MotorLimits { motoring_nm, braking_nm, speed_rad_s } = motor.limits;
            [motor.wanted.value(), motoring_nm, braking_nm, speed_rad_s].iter().sum()
        };
        // The sum is not finite if one term is not.
        if ![sum(m1), sum(m2), request.link_ref_v].iter().sum::<f32>().is_finite() {
            return Some(Refusal::RequestNotFinite);
        }
        let inside = m1.limits.are_within(ratings)
            && m2.limits.are_within(ratings)
            && link_is_within(request, ratings);
        (!inside).then_some(Refusal::LimitOutOfRange)
    }

    /// A speed of zero takes a torque while the rotor turns.
    fn asks_torque(request: &DualRequest, report: &DualReport, ratings: &Ratings) -> bool {
        let turning = ratings.standing_rad_s() * ratings.pole_pairs;
        request.motors.iter().zip(report.omega).any(|(motor, omega)| match motor.wanted {
            Wanted::Torque(torque_nm) => torque_nm != 0.0,
            Wanted::Speed(speed) => speed != 0.0 || omega.abs() > turning,
        })
    }

    fn take_limits(&mut self, request: &DualRequest, settings: &Settings) {
        let ratings = settings.ratings;
        let mut limits = self.limits(settings);
        for (own, MotorRequest { limits: asked, .. }) in limits.iter_mut().zip(&request.motors) {
            *own = if asked.are_within(ratings) { *asked } else { *own };
        }
        self.limits = Some(limits);
        if link_is_within(request, ratings) {
            self.link_ref_v = request.link_ref_v;
        }
    }

    fn are_at_rest(&self) -> bool {
        self.ramps.iter().all(DemandRamp::is_at_rest)
    }

    fn drop(&mut self) {
        self.ramps = [DemandRamp::AT_REST; 2];
        self.ahead = [Ahead::UNKNOWN; 2];
    }

    fn step(&mut self, aim: Aim<DualRequest>, report: &DualReport, settings: &Settings) {
        let (limits, request) = (self.limits(settings), aim.request());
        let wanted = request.map_or([Wanted::Torque(0.0); 2], |request| request.motors.map(|m| m.wanted));
        let DualReport { omega, torque_nm, source_v, .. } = *report;
        self.resting_v = if request.is_none() { Some(source_v) } else { None };
        let motors = omega.into_iter().zip(torque_nm);
        let ways = self.ramps.iter_mut().zip(&mut self.ahead);
        for ((((way, ahead), wanted), limits), (omega, torque_nm)) in
            ways.zip(wanted).zip(&limits).zip(motors)
        {
            let speed = omega / settings.ratings.pole_pairs;
            ahead.step(speed, settings.slot_s);
            let motor = Motor { speed, ahead: *ahead, torque_nm };
            way.step(wanted, &motor, limits, (settings, &aim.rates(settings)));
        }
    }

    fn link_may_rest(report: &DualReport) -> bool {
        report.link_v() < (1.0 + RESTING_SHARE) * report.source_v
    }

    fn told(&self) -> [MotorDemand; 2] {
        self.ramps.each_ref().map(DemandRamp::demand)
    }

    fn command(&self, orders: &Orders, settings: &Settings) -> DualDriveCommand {
        let Orders { enable, acknowledge, calibrate } = *orders;
        let smaller = |limits: MotorLimits| {
            if limits.motoring_nm < limits.braking_nm { limits.motoring_nm } else { limits.braking_nm }
        };
        DualDriveCommand {
            enable,
            demands: self.told(),
            speed_torque_nm: self.limits(settings).map(smaller),
            link_ref_v: self.resting_v.unwrap_or(self.link_ref_v),
            scheme: DualDriveCommand::NONE.scheme,
            acknowledge,
            calibrate,
        }
    }
}

/// `true` for a link voltage that the network can make.
fn link_is_within(request: &DualRequest, ratings: &Ratings) -> bool {
    let [low_v, high_v, _] = dual::Settings::link_range_v(ratings);
    (low_v..=high_v).contains(&request.link_ref_v)
}

/// The larger of two magnitudes; NaN counts as larger than everything.
fn larger(a: f32, b: f32) -> f32 {
    if a > b || a.is_nan() { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::built_in::zs9::BUILT_IN;
    use crate::protection::{Fault, SafeState};
    use crate::time::Instant;

    #[test]
    fn the_quicker_motor_and_both_emfs_are_seen() {
        let report = DualReport { omega: [3.0, -4.0], current_a: [7.0, 5.0], ..DualReport::default() };
        let seen = DualDemands::seen(&Observation { at: Instant(9), report });
        assert_eq!((seen.at, seen.omega, seen.emf_omega, seen.current_a), (Instant(9), 4.0, 7.0, 7.0));
        let trip = Trip {
            fault: Fault::Configuration,
            value: 2.0,
            limit: 1.0,
            at: Instant(3),
            safe: SafeState::GatesOff,
        };
        assert_eq!(DualDemands::refused(trip).trip, Some(trip));
    }

    /// A torque on its way is dropped where the gates are off.
    #[test]
    fn demands_at_rest_are_none() {
        let settings = Settings::rated(&BUILT_IN.ratings, 1e-3, None);
        let mut request = DualRequest::idle(&BUILT_IN.ratings, 600.0);
        request.motors[1].wanted = Wanted::Torque(10.0);
        let mut demands = DualDemands::AT_REST;
        (0..100).for_each(|_| demands.step(Aim::Request(&request), &DualReport::default(), &settings));
        assert!(!demands.are_at_rest());
        demands.rest(&DualReport::default(), true);
        assert!(demands.are_at_rest());
    }

    #[test]
    fn either_motor_asks_for_torque() {
        let ratings = &BUILT_IN.ratings;
        let idle = DualRequest::idle(ratings, 600.0);
        let turning = ratings.standing_rad_s() * ratings.pole_pairs;
        let asks = |motor: usize, wanted, omega| {
            let mut request = idle;
            request.motors[motor].wanted = wanted;
            let mut report = DualReport::default();
            report.omega[motor] = omega;
            DualDemands::asks_torque(&request, &report, ratings)
        };
        for motor in [0, 1] {
            for (wanted, omega, asked) in [
                (Wanted::Torque(0.0), 10.0 * turning, false),
                (Wanted::Torque(-1.0), 0.0, true),
                (Wanted::Speed(20.0), 0.0, true),
                (Wanted::Speed(0.0), 0.99 * turning, false),
                (Wanted::Speed(0.0), 1.01 * turning, true),
                (Wanted::Speed(0.0), -1.01 * turning, true),
            ] {
                assert_eq!(asks(motor, wanted, omega), asked, "{motor} {wanted:?} {omega}");
            }
        }
    }
}
