//! The drive's end of the protocol beside the operator: it turns reports into telemetry and parameters into settings.

use super::frame::Frame;
use super::message_set::{DemandStatus, MessageSet, Report, Request};
use super::parameters::Parameters;
use super::session::{Session, TelemetrySource};
use super::telemetry::Counts;
use crate::machine::Ratings;
use crate::operator::{Settings, Status};
use core::borrow::Borrow;

/// The drive's end of the protocol. A board calls [`CanEndpoint::listen`] when the operator asks, and [`CanEndpoint::tell`] when it reports.
#[derive(Clone, Copy, Debug)]
pub struct CanEndpoint<D: MessageSet> {
    session: Session<D>,
    ratings: &'static Ratings,
}

impl<D: MessageSet> CanEndpoint<D> {
    /// The state at power-up.
    pub const fn new(ratings: &'static Ratings) -> Self {
        Self { session: Session::new(ratings), ratings }
    }

    /// The operator's settings with the parameters in force.
    pub fn settings<'a>(&self, settings: &Settings<'a>) -> Settings<'a> {
        let parameters = self.session.parameters();
        let Parameters { torque_slew_nm_s, torque_jerk_nm_s2, .. } = *parameters;
        let train = parameters.train();
        Settings { slew_nm_s: torque_slew_nm_s, jerk_nm_s2: torque_jerk_nm_s2, train, ..*settings }
    }

    /// The request in a slot, `slots` after the last one, given the frames that have come since.
    pub fn listen<F: Borrow<Frame>>(
        &mut self,
        slots: u32,
        frames: impl IntoIterator<Item = F>,
    ) -> Request<D> {
        self.session.listen(slots, frames)
    }

    /// The counts of the received frames by outcome.
    pub fn counts(&self) -> &Counts {
        self.session.counts()
    }

    /// The frame to send after the slot, if one is due; the report is the drive's at the slot's beginning.
    pub fn tell(&mut self, status: &Status<DemandStatus<D>>, report: Option<&Report<D>>) -> Option<Frame> {
        let (measured, mode) = D::observed(report, status.temperatures.as_ref(), self.ratings);
        self.session.tell(&TelemetrySource { status, measured: &measured, mode })
    }
}
