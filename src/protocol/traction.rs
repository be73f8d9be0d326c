//! The PMaSynRM drive's messages.

use super::commands::{
    COMMAND, Command, LIMITS, LINK_LIMITS, LinkLimits, PARAMETER_REQUEST, ParameterRequest, TorqueLimits,
};
use super::message::Message;
use super::message_set::{MessageSet, Taken, motor_limits};
use super::parameters::{Parameters, RPM_PER_RAD_S};
use super::scales::Scales;
use super::signal::Payload;
use super::telemetry::Measured;
use super::{FROM_DRIVE, TO_DRIVE};
use crate::machine::Ratings;
use crate::modulation::Mode;
use crate::operator::{Limits, MotorLimits, Request, TorqueDemand};
use crate::ports::Report;
use crate::thermal::Temperatures;

/// The content of an accepted frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Content {
    /// The first frame of its message, or the first after a silence: it only set the counter.
    Greeting,
    /// A command.
    Command(Command),
    /// Limits of torque and speed.
    Limits(TorqueLimits),
    /// Limits of the link.
    LinkLimits(LinkLimits),
    /// A parameter is to be read or written.
    Parameter(ParameterRequest),
}

/// The contents that the PMaSynRM drive received last.
#[derive(Clone, Copy, Debug)]
pub struct Traction {
    command: Command,
    torque_limits: Option<TorqueLimits>,
    link_limits: Option<LinkLimits>,
}

impl Traction {
    /// The lower of the sender's limits and the parameters; the rated ones if nothing was sent.
    fn limits(&self, parameters: &Parameters, ratings: &Ratings) -> Limits {
        let motor = motor_limits(self.torque_limits.as_ref(), parameters, ratings);
        let MotorLimits { motoring_nm, braking_nm, speed_rad_s } = motor;
        let mut limits = Limits { motoring_nm, braking_nm, speed_rad_s, ..Limits::rated(ratings) };
        if let Some(sent) = &self.link_limits {
            limits.link_low_v = sent.low_v;
            limits.link_high_v = sent.high_v;
        }
        limits
    }
}

impl MessageSet for Traction {
    type Demands = TorqueDemand;
    type Content = Content;
    type Measured = Measured;
    type Pattern = Mode;

    const TO_DRIVE: &'static [&'static Message] = &TO_DRIVE;
    const FROM_DRIVE: &'static [&'static Message] = &FROM_DRIVE;
    const IS_ZS9: bool = false;
    const GREETING: Content = Content::Greeting;
    const SILENT: Self = Self { command: Command::AT_REST, torque_limits: None, link_limits: None };

    fn decode(id: u16, payload: Payload, scales: Scales) -> Option<Content> {
        Some(match id {
            id if id == COMMAND.id => Content::Command(Command::decode(payload, scales)?),
            id if id == LIMITS.id => Content::Limits(TorqueLimits::decode(payload, scales)?),
            id if id == LINK_LIMITS.id => Content::LinkLimits(LinkLimits::decode(payload, scales)?),
            id if id == PARAMETER_REQUEST.id => Content::Parameter(ParameterRequest::decode(payload)?),
            _ => return None,
        })
    }

    fn take(&mut self, content: Content) -> Taken {
        match content {
            Content::Greeting => {}
            Content::Command(command) => {
                self.command = command;
                let at_rest = Command { torque_nm: 0.0, off: false, ..command } == Command::AT_REST;
                return Taken::Command { at_rest };
            }
            Content::Limits(limits) => self.torque_limits = Some(limits),
            Content::LinkLimits(limits) => self.link_limits = Some(limits),
            Content::Parameter(request) => return Taken::Parameter(request),
        }
        Taken::Kept
    }

    fn rest(&mut self) {
        self.command = Command::AT_REST;
    }

    fn request(&self, armed: bool, fresh: bool, parameters: &Parameters, ratings: &Ratings) -> Request {
        let idle = Request { limits: self.limits(parameters, ratings), ..Request::idle(ratings) };
        let command = &self.command;
        if !armed {
            return Request { off: command.off, ..idle };
        }
        Request {
            enable: command.enable,
            with_torque: command.with_torque,
            off: command.off,
            coast: command.coast,
            charge: command.charge,
            discharge: command.discharge,
            acknowledge: command.acknowledge,
            calibrate: fresh && command.calibrate,
            torque_nm: if fresh { command.torque_nm } else { 0.0 },
            ..idle
        }
    }

    fn observed(
        report: Option<&Report>,
        temperatures: Option<&Temperatures>,
        ratings: &Ratings,
    ) -> (Measured, Mode) {
        let Some(report) = report else {
            return (Measured::default(), Mode::Off);
        };
        let measured = Measured {
            speed_rpm: report.speed_known.then_some(report.omega / ratings.pole_pairs * RPM_PER_RAD_S),
            torque_nm: Some(report.torque_nm),
            torque_estimate_nm: Some(report.flowing_nm),
            link_v: Some(report.udc_v),
            current_a: Some(report.current_a),
            id_ref_a: Some(report.id_a),
            iq_ref_a: Some(report.iq_a),
            voltage_v: Some(report.voltage_v),
            frequency_hz: Some(report.omega / core::f32::consts::TAU),
            temperature_c: temperatures.map(|temperatures| temperatures.winding_c),
            angle_zero_deg: Some(report.angle_zero.signed_radians().to_degrees()),
            calibrating: report.calibrating,
        };
        (measured, report.mode)
    }

    fn measured(measured: &Measured, message: usize, scales: Scales) -> Payload {
        match message {
            0 => measured.motion(scales),
            1 => measured.currents(scales),
            3 => measured.torque_estimate(scales),
            4 => measured.angle_zero(),
            _ => measured.voltages(scales),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::built_in::traction::BUILT_IN;
    use crate::frames::Angle;

    fn told(report: Option<&Report>) -> (Measured, Mode) {
        Traction::observed(report, None, &BUILT_IN.ratings)
    }

    #[test]
    fn what_is_reported_is_told_in_its_units() {
        let omega = 20.0 * core::f32::consts::TAU;
        let [torque_nm, flowing_nm, udc_v, current_a] = [1.0, 2.0, 3.0, 4.0];
        let [id_a, iq_a, voltage_v] = [5.0, 6.0, 7.0];
        let mode = Mode::Square;
        let known = Report { speed_known: true, omega, torque_nm, flowing_nm, ..Report::default() };
        let (angle_zero, calibrating) = (Angle::DEG_90, true);
        let known = Report { angle_zero, calibrating, ..known };
        let report = Report { udc_v, current_a, id_a, iq_a, voltage_v, mode, ..known };
        let (measured, told_mode) = told(Some(&report));
        let rpm = measured.speed_rpm.unwrap();
        assert!((rpm * BUILT_IN.ratings.pole_pairs / 1_200.0 - 1.0).abs() < 1e-5, "{rpm}");
        assert!((measured.frequency_hz.unwrap() / 20.0 - 1.0).abs() < 1e-5);
        let rest = Measured { speed_rpm: None, frequency_hz: None, ..measured };
        let expected = Measured {
            torque_nm: Some(1.0),
            torque_estimate_nm: Some(2.0),
            link_v: Some(3.0),
            current_a: Some(4.0),
            id_ref_a: Some(5.0),
            iq_ref_a: Some(6.0),
            voltage_v: Some(7.0),
            angle_zero_deg: Some(90.0),
            calibrating: true,
            ..Measured::default()
        };
        assert_eq!((rest, told_mode), (expected, mode));
        let unknown = Report { speed_known: false, ..report };
        assert_eq!(told(Some(&unknown)).0.speed_rpm, None);
        assert_eq!(told(None), (Measured::default(), Mode::Off));
    }

    #[test]
    fn a_command_is_at_rest_with_no_level_but_off() {
        let mut said = Traction::SILENT;
        let at_rest = Command { torque_nm: 5.0, off: true, ..Command::AT_REST };
        let others = [
            Command { enable: true, ..at_rest },
            Command { with_torque: true, ..at_rest },
            Command { coast: true, ..at_rest },
            Command { charge: true, ..at_rest },
            Command { discharge: true, ..at_rest },
            Command { calibrate: true, ..at_rest },
        ];
        assert_eq!(said.take(Content::Command(at_rest)), Taken::Command { at_rest: true });
        for command in others {
            assert_eq!(said.take(Content::Command(command)), Taken::Command { at_rest: false });
        }
        assert_eq!(said.command, others[5]);
        said.rest();
        assert_eq!(said.command, Command::AT_REST);
    }

    #[test]
    fn each_frame_has_its_content() {
        let decoded = |id, payload| Traction::decode(id, payload, Scales::USUAL);
        let limits = TorqueLimits { motoring_nm: 1.0, braking_nm: 2.0, speed_rpm: 100.0 };
        let payload = limits.encode(Scales::USUAL).unwrap();
        assert_eq!(decoded(LIMITS.id, payload), Some(Content::Limits(limits)));
        let nothing = Payload::default();
        assert_eq!(decoded(COMMAND.id, nothing), Some(Content::Command(Command::AT_REST)));
        assert_eq!(decoded(0x7FF, nothing), None);
    }
}
