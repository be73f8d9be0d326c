//! The seam between a drive and its control law: the stages that a drive's control task calls, whichever law it runs.

use super::speed::SpeedTracker;
use super::{
    AimInput, Boundary, Committed, DeadTime, Law, ModeLimits, Regulated, RotorSample, Target, VoltageVector,
    Warmth,
};
use crate::frames::{Angle, Dq};
use crate::machine::Tables;
use crate::time::Clock;

/// A control law, which decides the voltage from the measurements. Protection, the choice of the mode and the safe state belong to the
/// drive.
///
/// Each control period follows the angle. While pulses are made, it then observes its sample, and learns if a boundary has passed. The
/// operating point is made once for each command or once for several that are close together; the voltage is made once for each command.
pub trait ControlLaw {
    /// `true` if a controlled link, such as a Z-source's, is told the motors' power beforehand; otherwise its control only sees what that power has
    /// done to the voltage.
    const FEEDS_POWER_FORWARD: bool = true;

    /// `true` if an operating point may serve several boundaries within three control periods; `false` if each needs its own, as with a law whose
    /// [`ControlLaw::aim`] takes a step each time.
    const POINT_SERVES: bool = true;

    /// The follower of the angle.
    fn tracker(&self) -> &SpeedTracker;

    /// The same, mutable.
    fn tracker_mut(&mut self) -> &mut SpeedTracker;

    /// Follows the angle; call once per control period, before the other stages and also while the gates are off.
    /// Returns the electrical angular speed, in rad/s.
    fn track(&mut self, angle: Angle, clock: &Clock) -> f32 {
        self.tracker_mut().step(angle, clock.control_s())
    }

    /// Difference of a measured angle from the one expected from the speed and the angle before.
    fn innovation(&self, angle: Angle, clock: &Clock) -> Angle {
        angle - self.tracker().predicted(clock.control_s())
    }

    /// As [`ControlLaw::track`], with this angle's innovation given.
    fn follow(&mut self, angle: Angle, innovation: Angle, clock: &Clock) -> f32 {
        self.tracker_mut().follow(angle, innovation, clock.control_s())
    }

    /// Notes that the angle cannot be followed: it is unknown or far off. The speed stays as it was.
    fn lose_angle(&mut self) {
        self.tracker_mut().lose();
    }

    /// Follows the angle anew after it was lost; call once its fault is acknowledged. The speed is not known until it has settled again.
    fn recover_angle(&mut self) {
        self.tracker_mut().recover();
    }

    /// `true` once an angle has been followed since the start, or since it was recovered.
    fn is_following(&self) -> bool {
        self.tracker().is_following()
    }

    /// `true` once the speed has been followed long enough to be used.
    fn speed_is_known(&self) -> bool {
        self.tracker().is_settled()
    }

    /// Electrical angular speed, in rad/s, signed.
    fn omega(&self) -> f32 {
        self.tracker().omega()
    }

    /// Torque of the machine by its currents and the map, smoothed, in N·m: 0 while no pulses are made; NaN for a law that
    /// does not tell it.
    fn flowing_nm(&self) -> f32 {
        f32::NAN
    }

    /// The link's voltage over its sensor's reading, as far as it is known: all volt-seconds are made and counted with it.
    fn link_scale(&self) -> f32 {
        1.0
    }

    /// Excess of the machine's flux linkage over the map's, along itself, as a share: at the operating point, or of the magnets while the gates are off;
    /// 0 until something has shown it, and for a law that does not estimate it.
    fn map_error(&self) -> f32 {
        0.0
    }

    /// Voltage that the law leaves unexplained, in V, rotor frame: the difference from what currents, angle and map imply; `None` for a law
    /// that does not look.
    fn unexplained_v(&self) -> Option<Dq> {
        None
    }

    /// Time since the last operating point, in s.
    fn passed_s(&self, clock: &Clock) -> f32;

    /// The target of the current loop by the newest operating point; no target while no pulses are made.
    fn target(&self) -> &Target;

    /// Takes the machine's warmth into account from now on. A law that knows nothing of temperatures continues with rated values.
    fn warm(&mut self, _warmth: Warmth) {}

    /// From the unexplained voltage, estimates how machine and link differ from what is assumed, and the use of this for the operating point: one part of it a
    /// call; call while pulses are made, at most once in a control period, when there is time. A law without such an estimate does nothing.
    fn explain(&mut self, _dead: DeadTime, _law: &Law) {}

    /// Forgets everything it has learnt except the speed, as the gates are off.
    fn idle(&mut self);

    /// After [`ControlLaw::idle`]: the next torque starts from zero, whatever flows.
    fn begin_without_torque(&mut self);

    /// Takes the sample of a control period; call in each one while pulses are made.
    fn observe(&mut self, sample: &RotorSample, tables: &Tables);

    /// Takes what was sampled at a carrier boundary that has passed, and what acted until then.
    fn learn(&mut self, boundary: &Boundary, sample: &RotorSample, follows: Regulated, law: &Law);

    /// Passes a carrier boundary without learning, as the next one learns for both.
    fn pass(&mut self, _sample: &RotorSample) {}

    /// Makes the operating point before the first command that it serves: one for each command, or for several if [`ControlLaw::POINT_SERVES`]; call after
    /// [`ControlLaw::observe`].
    fn aim(&mut self, input: &AimInput, law: &Law);

    /// The voltage for the carrier half that begins at the horizon, from the newest sample.
    fn regulate(
        &mut self,
        sample: &RotorSample,
        committed: &Committed,
        limits: &ModeLimits,
        law: &Law,
    ) -> VoltageVector;
}
