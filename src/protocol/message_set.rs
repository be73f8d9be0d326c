//! A drive's set of messages: the rest of the protocol is the same for all.

use super::commands::ParameterRequest;
use super::commands::TorqueLimits;
use super::message::Message;
use super::parameters::{Parameters, RPM_PER_RAD_S};
use super::scales::Scales;
use super::signal::Payload;
use super::telemetry::Pattern;
use crate::machine::Ratings;
use crate::operator::{Demands, MotorLimits};
use crate::thermal::Temperatures;

/// A drive's messages; a value of the type is the content received last.
pub trait MessageSet: Copy + 'static {
    /// The demands of its operator.
    type Demands: Demands;
    /// The content of an accepted frame.
    type Content: Copy;
    /// Measurements of its telemetry.
    type Measured: Copy;
    /// The pulse pattern of its gates.
    type Pattern: Pattern;

    /// The messages to it: the command first.
    const TO_DRIVE: &'static [&'static Message];
    /// The messages from it: status, three of measurements, the fault's value and limit, counters, the answer about a parameter; for a drive
    /// that has them, a fourth of measurements and the temperatures; and that of the angle's zero.
    const FROM_DRIVE: &'static [&'static Message];
    /// The place of the last one.
    const ANGLE_ZERO: usize = Self::FROM_DRIVE.len() - 1;
    /// The first frame of a message, or the first after a silence: it only sets the counter.
    const GREETING: Self::Content;
    /// `true` for the ZS9, whose ratings are its operator's.
    const IS_ZS9: bool;
    /// The state before anything was received.
    const SILENT: Self;

    /// The content of a frame of [`Self::TO_DRIVE`] without its mark; `None` if a value is out of its range or an unused bit is set.
    fn decode(id: u16, payload: Payload, scales: Scales) -> Option<Self::Content>;
    /// Keeps a content.
    fn take(&mut self, content: Self::Content) -> Taken;
    /// Forgets the command, as if nothing were asked.
    fn rest(&mut self);
    /// The request to the operator: only off before it is `armed`, no torque unless the command is `fresh`.
    fn request(&self, armed: bool, fresh: bool, parameters: &Parameters, ratings: &Ratings) -> Request<Self>;
    /// The measurements and the pattern to be sent for a report and the temperatures.
    fn observed(
        report: Option<&Report<Self>>,
        temperatures: Option<&Temperatures>,
        ratings: &Ratings,
    ) -> (Self::Measured, Self::Pattern);
    /// Content of one of the messages of measurements, without its mark.
    fn measured(measured: &Self::Measured, message: usize, scales: Scales) -> Payload;
}

/// The request to a drive.
pub type Request<D> = <<D as MessageSet>::Demands as Demands>::Request;
/// The drive's report of itself.
pub type Report<D> = <<D as MessageSet>::Demands as Demands>::Report;
/// The operator's status of the demands.
pub type DemandStatus<D> = <<D as MessageSet>::Demands as Demands>::Status;

/// The further action that a frame's content requires.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Taken {
    /// No further action.
    Kept,
    /// A command has come; the field is `true` if it asks for nothing.
    Command {
        /// All levels but off are low.
        at_rest: bool,
    },
    /// A parameter is to be read or written.
    Parameter(ParameterRequest),
}

/// Rounding that is tolerated at a rating, as a share of it.
const STEP_SHARE: f32 = 1e-4;

/// The value in force: a value sent beyond the rating is kept, so that it is refused with a reason; within the rating the parameter limits it.
fn beyond(sent: f32, parameter: f32, rated: f32) -> f32 {
    if sent > rated * (1.0 + STEP_SHARE) || sent < parameter { sent } else { parameter }
}

/// The lower of the sender's limits and the parameters, for one motor.
#[inline(never)]
pub(super) fn motor_limits(
    sent: Option<&TorqueLimits>,
    parameters: &Parameters,
    ratings: &Ratings,
) -> MotorLimits {
    let mut limits = MotorLimits {
        motoring_nm: parameters.torque_limit_nm,
        braking_nm: parameters.torque_limit_nm,
        speed_rad_s: parameters.speed_limit_rpm / RPM_PER_RAD_S,
    };
    if let Some(sent) = sent {
        limits.motoring_nm = beyond(sent.motoring_nm, parameters.torque_limit_nm, ratings.max_torque_nm);
        limits.braking_nm = beyond(sent.braking_nm, parameters.torque_limit_nm, ratings.max_torque_nm);
        let rated_rpm = ratings.max_speed_rad_s * RPM_PER_RAD_S;
        limits.speed_rad_s = beyond(sent.speed_rpm, parameters.speed_limit_rpm, rated_rpm) / RPM_PER_RAD_S;
    }
    // Rounding to the signal's step and back must not make the rating itself look higher than it is.
    if limits.speed_rad_s > ratings.max_speed_rad_s
        && limits.speed_rad_s < ratings.max_speed_rad_s * (1.0 + STEP_SHARE)
    {
        limits.speed_rad_s = ratings.max_speed_rad_s;
    }
    limits
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::built_in::traction::BUILT_IN;

    /// Limits with parameters at three quarters of the ratings, for a sender that asks for shares of the ratings.
    fn limits(torque: f32, speed: f32) -> MotorLimits {
        let mut parameters = Parameters::rated(&BUILT_IN.ratings);
        parameters.torque_limit_nm *= 0.75;
        parameters.speed_limit_rpm *= 0.75;
        let sent = TorqueLimits {
            motoring_nm: torque * BUILT_IN.ratings.max_torque_nm,
            braking_nm: torque * BUILT_IN.ratings.max_torque_nm,
            speed_rpm: speed * BUILT_IN.ratings.max_speed_rad_s * RPM_PER_RAD_S,
        };
        motor_limits(Some(&sent), &parameters, &BUILT_IN.ratings)
    }

    fn shares(limits: MotorLimits) -> [f32; 3] {
        let torque = BUILT_IN.ratings.max_torque_nm;
        [
            limits.motoring_nm / torque,
            limits.braking_nm / torque,
            limits.speed_rad_s / BUILT_IN.ratings.max_speed_rad_s,
        ]
    }

    #[test]
    fn the_lower_of_sender_and_parameter_holds_and_what_exceeds_a_rating_stays_to_be_refused() {
        // The value sent, and the one in force: a rating raised by rounding does not count as exceeded.
        for (sent, holds) in [
            (0.0, 0.0),
            (0.5, 0.5),
            (0.74, 0.74),
            (0.8, 0.75),
            (1.0, 0.75),
            (1.000_05, 0.75),
            (1.000_2, 1.000_2),
        ] {
            for share in shares(limits(sent, sent)) {
                assert!((share - holds).abs() < 1e-6, "{sent}: {share}, not {holds}");
            }
        }
        let negative = limits(-0.5, -0.5);
        assert!(shares(negative).iter().all(|share| (share + 0.5).abs() < 1e-6));
    }

    #[test]
    fn a_rating_that_rounding_raised_is_the_rating() {
        let mut parameters = Parameters::rated(&BUILT_IN.ratings);
        for (share, holds) in
            [(0.999_95, 0.999_95), (1.0, 1.0), (1.000_05, 1.0), (1.000_15, 1.000_15), (1.5, 1.5)]
        {
            parameters.speed_limit_rpm = share * BUILT_IN.ratings.max_speed_rad_s * RPM_PER_RAD_S;
            let [.., speed] = shares(motor_limits(None, &parameters, &BUILT_IN.ratings));
            assert!((speed - holds).abs() < 2e-6, "{share}: {speed}, not {holds}");
            if holds == 1.0 {
                let limits = motor_limits(None, &parameters, &BUILT_IN.ratings);
                assert!(limits.speed_rad_s <= BUILT_IN.ratings.max_speed_rad_s, "{share}");
            }
        }
    }

    /// A rounded rating counts as the rating, up to the tolerance and no further.
    #[test]
    fn rounding_is_forgiven_up_to_its_border() {
        let border = 1_000.0 * (1.0 + STEP_SHARE);
        assert_eq!([beyond(border, 750.0, 1_000.0), beyond(1_000.2, 750.0, 1_000.0)], [750.0, 1_000.2]);
        let ratings = &BUILT_IN.ratings;
        let border = ratings.max_speed_rad_s * (1.0 + STEP_SHARE);
        let near = (border * RPM_PER_RAD_S).to_bits();
        let rpm = (near - 8..near + 8).map(f32::from_bits).find(|rpm| rpm / RPM_PER_RAD_S == border);
        for (speed_limit_rpm, told) in
            [(rpm.unwrap(), border), (0.999_97 * rpm.unwrap(), ratings.max_speed_rad_s)]
        {
            let parameters = Parameters { speed_limit_rpm, ..Parameters::rated(ratings) };
            assert_eq!(motor_limits(None, &parameters, ratings).speed_rad_s, told);
        }
    }
}
