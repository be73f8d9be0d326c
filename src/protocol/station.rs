//! The drive's end of the protocol beside the operator: what the observations become in telemetry, the parameters in settings.

use super::frame::Frame;
use super::parameters::{Parameters, RPM_PER_RAD_S};
use super::session::{Session, Told};
use super::telemetry::Measured;
use crate::machine::Ratings;
use crate::modulation::Mode;
use crate::operator::{Observation, Request, Settings, Status};

/// The drive's end of the protocol. A board calls [`Station::listen`] where the operator asks, [`Station::tell`] where it tells.
#[derive(Clone, Copy, Debug)]
pub struct Station {
    session: Session,
    ratings: &'static Ratings,
    /// The slot's observation.
    observed: Option<Observation>,
}

impl Station {
    /// At power-up.
    pub const fn new(ratings: &'static Ratings) -> Self {
        Self { session: Session::new(ratings), ratings, observed: None }
    }

    /// The operator's settings with the parameters that are in force.
    pub fn settings<'a>(&self, settings: &Settings<'a>) -> Settings<'a> {
        let Parameters { torque_slew_nm_s, torque_jerk_nm_s2, .. } = *self.session.parameters();
        Settings { slew_nm_s: torque_slew_nm_s, jerk_nm_s2: torque_jerk_nm_s2, ..*settings }
    }

    /// What is asked in a slot, after a frame that may have come; and what the drive said of itself at the slot's beginning.
    pub fn listen(&mut self, observed: Option<Observation>, frame: Option<&Frame>) -> Request {
        self.observed = observed;
        self.session.listen(frame)
    }

    /// The frame to send after the slot, if one is due.
    pub fn tell(&mut self, status: &Status) -> Option<Frame> {
        let (measured, mode) = match &self.observed {
            Some(observed) => (measured(observed, self.ratings), observed.mode),
            None => (Measured::default(), Mode::Off),
        };
        self.session.tell(&Told { status, measured: &measured, mode })
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
