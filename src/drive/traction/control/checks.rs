//! The checks of a period, and the trip that follows from them.

use super::ControlTask;
use crate::control::{ControlLaw, Measurements};
use crate::frames::Angle;
use crate::machine::Machine;
use crate::ports::{ControlPort, DriveCommand, Sample};
use crate::protection::{self, FailedCheck, OpenGates, SafeState, Trip};

impl<M: Machine, L: ControlLaw> ControlTask<M, L> {
    /// Follows the angle; returns the electrical speed, in rad/s. An impossible or unknown angle leaves the speed as it was. Before it is known for
    /// the first time, the angle may be unknown while nobody wants pulses or if the sensor counts. After a trip the angle is followed anew, and its
    /// speed reported, for leaving the safe state; the choice of a safe state uses the speed at which the angle was lost.
    pub(super) fn track(
        &mut self,
        angle: Option<Angle>,
        enable: bool,
        port: &mut impl ControlPort,
    ) -> (f32, Option<FailedCheck>) {
        let clock = self.settings.clock;
        let followed = angle.map(|angle| (angle, self.controller.innovation(angle, &clock)));
        if let Some((_, innovation)) = followed {
            self.innovation_rad = innovation.signed_radians();
        }
        let lost = match followed {
            Some(_) if self.controller.speed_is_known() => protection::check_angle(self.innovation_rad),
            Some(_) => {
                let fastest = self.machine.tables().ratings.max_acceleration_rad_s2;
                self.controller.tracker_mut().quicken(fastest, clock.control_s());
                None
            }
            None => {
                let needed = self.controller.is_following() || (enable && port.turned().is_none());
                protection::check_known(needed)
            }
        };
        let lost = self.armed(lost);
        if lost.is_some() {
            self.lost_at.get_or_insert(self.controller.omega());
            self.controller.lose_angle();
        }
        if self.trip.is_some() {
            self.controller.recover_angle();
        }
        if let Some((angle, innovation)) = followed.filter(|_| lost.is_none() || self.trip.is_some()) {
            self.controller.follow(angle, innovation, &clock);
        }
        (self.lost_at.unwrap_or(self.controller.omega()), lost)
    }

    /// The fault of a single period's input.
    #[inline(always)]
    pub(super) fn judge(
        &self,
        command: &DriveCommand,
        measured: &Measurements,
        omega: f32,
    ) -> Option<FailedCheck> {
        if protection::is_sound(measured, omega, &command.demand, &self.machine.tables().ratings) {
            return None;
        }
        // Copies: a value behind a reference would be in memory in every period.
        let (command, measured) = (*command, *measured);
        self.find_fault(&command, &measured, omega)
    }

    /// The same for an input that may have a fault.
    #[cold]
    #[inline(never)]
    fn find_fault(&self, command: &DriveCommand, measured: &Measurements, omega: f32) -> Option<FailedCheck> {
        let ratings = &self.machine.tables().ratings;
        let empty =
            || if command.enable { protection::check_undervoltage(measured.udc_v, ratings) } else { None };
        self.armed(protection::check_measurements(measured, omega, ratings))
            .or_else(|| self.armed(empty()))
            .or_else(|| protection::check_demand(&command.demand))
    }

    /// The failed check, unless it is switched off.
    pub(super) fn armed(&self, failed: Option<FailedCheck>) -> Option<FailedCheck> {
        failed.filter(|(fault, _, _)| !self.masked.has(*fault))
    }

    pub(super) fn check(
        &mut self,
        failed: Option<FailedCheck>,
        sample: &Sample,
        port: &mut impl ControlPort,
    ) {
        if let (Some(failed), None) = (failed, self.trip) {
            self.trip_on(failed, sample, port);
        }
    }

    /// Out of line: it happens once, and there are many checks.
    #[cold]
    #[inline(never)]
    pub(super) fn trip_on(
        &mut self,
        (fault, value, limit): FailedCheck,
        sample: &Sample,
        port: &mut impl ControlPort,
    ) {
        if self.masked.has(fault) {
            return;
        }
        let at = self.now.before(self.settings.clock.control_ticks);
        let safe =
            protection::safe_state(self.controller.omega(), sample.udc_v, &self.machine.tables().ratings);
        self.enter(Trip { fault, value, limit, at, safe }, port);
    }

    /// A period without the control law's pulses: gates that are off become the short circuit if the machine keeps generating through the diodes. If
    /// there is no trip yet, this is one: an operator takes the gates off at such a speed only for a fault of his own or for `off`; otherwise he
    /// waits.
    #[cold]
    #[inline(never)]
    pub(super) fn stay_safe(&mut self, sample: &Sample, omega: f32, port: &mut impl ControlPort) {
        let Sample { currents_a, udc_v, .. } = *sample;
        let open = OpenGates { currents_a, udc_v, omega, period_s: self.settings.clock.control_s() };
        let ratings = &self.machine.tables().ratings;
        let safe = self.trip.map_or(SafeState::GatesOff, |trip| trip.safe);
        let Some(safe) = self.diodes.step(safe, &open, &port.leg_faults(), ratings) else { return };
        let (fault, value, limit) = protection::generating(&open, ratings);
        let at = self.now.before(self.settings.clock.control_ticks);
        let trip = self.trip.unwrap_or(Trip { fault, value, limit, at, safe });
        self.enter(Trip { safe, ..trip }, port);
    }

    /// The safe state that a fault asks for.
    fn enter(&mut self, trip: Trip, port: &mut impl ControlPort) {
        port.enter(trip.safe, self.now.before(self.settings.clock.control_ticks));
        self.trip = Some(trip);
        self.acknowledge.entered();
    }

    /// The first of all checks: a stuck leg decides on the safe state.
    pub(super) fn check_legs(&mut self, sample: &Sample, port: &mut impl ControlPort) {
        let found = port.leg_faults();
        if let (Some((fault, value, limit)), None) = (found.check(), self.trip) {
            let at = self.now.before(self.settings.clock.control_ticks);
            let (omega, ratings) = (self.controller.omega(), &self.machine.tables().ratings);
            let safe = found.safe_state(omega, sample.udc_v, ratings);
            self.enter(Trip { fault, value, limit, at, safe }, port);
        }
    }
}
