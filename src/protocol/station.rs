//! The protocol as the operator's counterpart: whatever carries the frames, a bus or the link to the rig.

use super::frame::Frame;
use super::parameters::{Parameters, RPM_PER_RAD_S};
use super::session::{Session, Told};
use super::telemetry::Measured;
use crate::machine::Ratings;
use crate::operator::{Desk, Feedback, Observation, OperatorPort, Request, Settings, Status, Switches};
use crate::time::Instant;

/// What carries frames, and what else the idle loop asks of a board.
pub trait Carrier {
    /// A frame that has come, and what the board says, in the slot that began at `at`.
    fn receive(&mut self, at: Instant) -> (Option<Frame>, Feedback);
    /// A frame to send, and what is to be switched, from `from` on.
    fn send(&mut self, from: Instant, frame: Option<Frame>, switches: &Switches);
}

/// The drive's end of the protocol, at a carrier.
pub struct Station<'a, C> {
    session: Session,
    ratings: &'static Ratings,
    desk: &'a Desk,
    /// The slot's observation.
    observed: Option<Observation>,
    /// The carrier.
    pub carrier: C,
}

impl<'a, C: Carrier> Station<'a, C> {
    /// At power-up.
    pub const fn new(ratings: &'static Ratings, desk: &'a Desk, carrier: C) -> Self {
        Self { session: Session::new(ratings), ratings, desk, observed: None, carrier }
    }

    /// The operator's settings with the parameters that are in force.
    pub fn settings(&self, settings: &Settings<'static>) -> Settings<'static> {
        let Parameters { torque_slew_nm_s, torque_jerk_nm_s2, .. } = *self.session.parameters();
        Settings { slew_nm_s: torque_slew_nm_s, jerk_nm_s2: torque_jerk_nm_s2, ..*settings }
    }
}

impl<C: Carrier> OperatorPort for Station<'_, C> {
    fn ask(&mut self, at: Instant) -> (Request, Feedback) {
        self.observed = self.desk.observed();
        let (frame, feedback) = self.carrier.receive(at);
        (self.session.listen(frame.as_ref()), feedback)
    }

    fn tell(&mut self, from: Instant, status: &Status) {
        let measured =
            self.observed.map_or(Measured::default(), |observed| measured(&observed, self.ratings));
        let mode = self.observed.map_or(crate::modulation::Mode::Off, |observed| observed.mode);
        let frame = self.session.tell(&Told { status, measured: &measured, mode });
        self.carrier.send(from, frame, &status.switches);
    }
}

fn measured(observed: &Observation, ratings: &Ratings) -> Measured {
    Measured {
        speed_rpm: observed.speed_known.then_some(observed.omega / ratings.pole_pairs * RPM_PER_RAD_S),
        torque_nm: Some(observed.torque_nm),
        link_v: Some(observed.udc_v),
        current_a: Some(observed.current_a),
        id_ref_a: Some(observed.id_ref_a),
        iq_ref_a: Some(observed.iq_ref_a),
        voltage_v: Some(observed.voltage_v),
        frequency_hz: Some(observed.omega / core::f32::consts::TAU),
        temperature_c: None,
    }
}
