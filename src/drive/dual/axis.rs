//! One of the two motors in the control task: a control law as the PMaSynRM's drive runs it, with its own tables.

use super::{MotorCommand, MotorShare, Settings, TURNS};
use crate::control::{
    AimInput, AngleZero, Boundary, Committed, ControlLaw, DeadTime, Demand, Law, Measurements, ModeLimits,
    Region, RotorSample, SpeedInput, SpeedLoop, WithoutTorque,
};
use crate::drive::SLOT_S;
use crate::frames::{AlphaBeta, Angle};
use crate::machine::Tables;
use crate::ports::MotorDemand;
use crate::protection::{self, FailedCheck, Fault, FrozenWatch, UnexplainedWatch};

/// Natural frequency of the speed tracker, in rad/s: the phase of the speed loop requires a fast one.
pub const TRACKING_RAD_S: f32 = 4000.0;
pub use crate::protection::INNOVATION_RAD;
/// Time over which a change of the speed is checked, in s. The check finds a sensor that begins to count the other way at a speed too low for an
/// innovation.
const SLOW_S: f32 = 5e-3;
/// Change of an electrical angle in that time, in rad, below which it cannot be told from noise.
const LEAST_ASTRAY_RAD: f32 = 0.25;
/// The voltage that the loop may ask for, as a share of the largest one that is available at every angle. The modulator gives as much as its hexagon
/// has at the angle, up to 1.155, and reports it.
const LOOP_SHARE: f32 = 1.15;
/// Part of the dead time's possible effect that remains although it is compensated: legs that exchange twice within it, and edges beside a
/// shoot-through. With a fifth of it, as for legs of two gates, a configured dead time of 2 µs costs 4 % of torque.
const LEFT_SHARE: f32 = 0.5;
/// Share of the largest voltage available at every angle that the operating point may use; the rest is for regulation.
const STEADY_SHARE: f32 = 0.98;

/// Change of an electrical angle in [`SLOW_S`] beyond which its sensor has lost the rotor, in rad: that of a rotor with twice the acceleration, in
/// rad/s², that it can reach itself.
const fn astray_rad(most_acceleration_rad_s2: f32) -> f32 {
    let rad = 2.0 * most_acceleration_rad_s2 * (SLOW_S * SLOW_S);
    if rad > LEAST_ASTRAY_RAD { rad } else { LEAST_ASTRAY_RAD }
}

/// Control of one motor.
pub struct Axis<L> {
    controller: L,
    speed_loop: SpeedLoop,
    watch: FrozenWatch,
    unexplained: UnexplainedWatch,
    /// Correction that is added to the sensor's angle, and whether it is just being found.
    pub zero: AngleZero,
    pub calibrating: bool,
    /// Filtered electrical speed, in rad/s.
    slow: f32,
    /// Mean voltage of the period that began at the last sample, per volt of link, and the link's voltage at that sample.
    acting: Option<(AlphaBeta, f32)>,
    /// The volt-seconds of the period that ended at the newest operating point, in V·s.
    ended: Option<AlphaBeta>,
}

/// The inputs of a motor's step.
pub struct AxisInput<'a> {
    pub measured: &'a Measurements,
    pub demand: &'a MotorDemand,
    /// Largest torque that a speed demand may take, in N·m.
    pub speed_torque_nm: f32,
    /// The modulator's share for the carrier period that begins at the sample.
    pub applied: Option<MotorShare>,
    /// Measured link voltage outside shoot-through, in V.
    pub link_v: f32,
    /// `true` if it is this motor's turn for a new operating point; else it learns.
    pub aims: bool,
}

/// The results of a motor's step.
pub struct AxisOutput {
    pub command: MotorCommand,
    /// The torque that is reported for it, as in [`DualReport`](super::DualReport).
    pub torque_nm: f32,
    pub weakening: bool,
    /// Electrical power drawn from now on, in W.
    pub power_w: f32,
}

impl AxisOutput {
    /// The output while no pulses are made.
    pub const NOTHING: Self = Self {
        command: MotorCommand { voltage_v: 0.0, angle: Angle::ZERO, rate: 0.0 },
        torque_nm: 0.0,
        weakening: false,
        power_w: 0.0,
    };
}

impl<L: ControlLaw> Axis<L> {
    /// A motor at rest with its control law.
    pub const fn new(controller: L) -> Self {
        Self {
            controller,
            speed_loop: SpeedLoop::new(),
            watch: FrozenWatch::new(),
            unexplained: UnexplainedWatch::new(),
            zero: AngleZero::NONE,
            calibrating: false,
            slow: 0.0,
            acting: None,
            ended: None,
        }
    }

    /// Follows the angle, whatever it is if it is `trusted`. Returns its error, in rad, if that is too large.
    pub fn track(
        &mut self,
        angle: Angle,
        trusted: bool,
        settings: &Settings,
        tables: &Tables,
    ) -> Option<f32> {
        let innovation = self.controller.innovation(angle, &settings.clock);
        let innovation_rad = innovation.signed_radians();
        let known = self.controller.speed_is_known();
        if known && innovation_rad.abs() > INNOVATION_RAD && !trusted {
            self.controller.lose_angle();
            return Some(innovation_rad);
        }
        self.controller.follow(angle, innovation, &settings.clock);
        let gone_astray = (self.omega() - self.slow) * SLOW_S;
        self.slow += (self.omega() - self.slow) * (settings.clock.control_s() * (1.0 / SLOW_S));
        if !known || trusted {
            self.slow = self.omega();
            return None;
        }
        if gone_astray.abs() > astray_rad(tables.ratings.max_acceleration_rad_s2) {
            self.controller.lose_angle();
            return Some(gone_astray);
        }
        None
    }

    /// The angle is unknown: if it was known before, its sensor has `lost` the rotor; and nobody may ask for pulses.
    #[cold]
    #[inline(never)]
    pub fn lose_angle(&mut self, lost: Fault, enable: bool) -> Option<FailedCheck> {
        self.controller.lose_angle();
        if self.controller.is_following() { Some((lost, 1.0, 0.0)) } else { protection::check_known(enable) }
    }

    /// As [`ControlLaw::recover_angle`].
    pub fn recover_angle(&mut self) {
        self.controller.recover_angle();
    }

    /// Electrical speed, in rad/s.
    pub fn omega(&self) -> f32 {
        self.controller.omega()
    }

    pub fn speed_is_known(&self) -> bool {
        self.controller.speed_is_known()
    }

    /// Resets the state while the gates are off.
    pub fn idle(&mut self) {
        self.controller.idle();
        self.speed_loop = SpeedLoop::new();
        self.watch = FrozenWatch::new();
        self.unexplained = UnexplainedWatch::new();
        self.acting = None;
    }

    /// The check for measurements that no longer move; `lost` is the fault if it is the angle.
    #[inline(always)]
    pub fn check_frozen(
        &mut self,
        measured: &Measurements,
        lost: Fault,
        settings: &Settings,
        tables: &Tables,
    ) -> Option<FailedCheck> {
        let period_s = settings.clock.control_s();
        let failed = self.watch.check(measured, self.omega(), period_s, &tables.ratings)?;
        let (turned_rad, limit_rad) = self.watch.turned_rad();
        if self.watch.angle_stands() { Some((lost, turned_rad, limit_rad)) } else { Some(failed) }
    }

    /// The check for a voltage that nothing explains.
    #[inline(always)]
    pub fn check_voltage(&self, tables: &Tables) -> Option<FailedCheck> {
        self.unexplained.check(tables)
    }

    /// One control period; the results are written in place.
    #[inline(never)]
    pub fn step(&mut self, input: &AxisInput, settings: &Settings, tables: &Tables, output: &mut AxisOutput) {
        let omega = self.controller.omega();
        let period_s = settings.clock.control_s();
        let begins = input.applied.map(|share| self.mean_per_volt(&share, settings));
        let before = core::mem::replace(&mut self.acting, begins.map(|mean| (mean, input.link_v)));
        // The link's voltage moves along a straight line in between.
        let ended = before.map(|(mean, link_v)| mean * (0.5 * (link_v + input.link_v) * period_s));
        let committed = Committed {
            horizon_s: period_s,
            volt_seconds: begins.map(|mean| mean * (input.link_v * period_s)),
            // A period is its own mirror image, so the ripple is zero at its ends.
            ripple_wb: None,
            interval_s: period_s,
        };
        // Linear motors: torque does not depend on the ripple.
        let limits =
            ModeLimits { steady_limit: STEADY_SHARE, ripple_share: 1.0, ..ModeLimits::carrier(LOOP_SHARE) };
        let law = Law { gains: &settings.gains, clock: &settings.clock, tables };
        let sample = RotorSample::new(input.measured.currents_a, input.measured.angle, tables);
        self.controller.observe(&sample, tables);
        if input.aims || before.is_none() {
            self.controller.pass(&sample);
            let demand = self.demand(input, omega, settings, tables);
            self.controller.aim(&AimInput::plain(&demand, input.measured.udc_v, &limits), &law);
            self.ended = ended;
        } else {
            // Since the last learning: the noise of the sample in between drops out.
            let boundary = Boundary {
                volt_seconds: self.ended.zip(ended).map(|(earlier, later)| earlier + later),
                length_s: TURNS as f32 * period_s,
            };
            self.controller.learn(&boundary, &sample, limits.follows, &law);
            let DeadTime { voltage_v, left_share, .. } = dead_time(input.link_v, settings);
            if let Some(unexplained_v) = self.controller.unexplained_v() {
                self.unexplained.step(
                    unexplained_v,
                    left_share * voltage_v,
                    omega,
                    boundary.length_s,
                    tables,
                );
            }
        }
        let voltage = self.controller.regulate(&sample, &committed, &limits, &law);
        let target = self.controller.target();
        self.watch.command(voltage.vector);
        output.command.voltage_v = voltage.voltage_v;
        output.command.angle = voltage.vector.angle();
        output.command.rate = settings.clock.angle_rate(omega);
        output.torque_nm = target.torque_nm;
        output.weakening = target.region != Region::Mtpa;
        // Power of the voltage that begins to act now, as the modulator really gives it, at the measured current.
        output.power_w =
            begins.map_or(0.0, |mean| 1.5 * input.link_v * mean.dot(input.measured.currents_a.clarke()));
    }

    /// Calibrates the zero of the position sensor for an operator's slot, if that is wanted and nothing is demanded.
    pub fn calibrate(&mut self, wanted: bool, demand: &MotorDemand, tables: &Tables) {
        let rests = matches!(demand, MotorDemand::Torque(demand) if demand.torque_nm == 0.0);
        self.calibrating = wanted
            && rests
            && self.controller.unexplained_v().is_some_and(|unexplained_v| {
                self.zero.learn(&WithoutTorque {
                    unexplained_v,
                    omega: self.controller.omega(),
                    max_omega: tables.ratings.max_speed_rad_s * tables.ratings.pole_pairs,
                    magnets_wb: tables.ratings.magnet_flux_wb,
                    length_s: SLOT_S,
                })
            });
    }

    /// Finds the machine's differences from its map in the voltage that nothing explains, while pulses are made on a link of `link_v`.
    pub fn explain(&mut self, link_v: f32, settings: &Settings, tables: &Tables) {
        let law = Law { gains: &settings.gains, clock: &settings.clock, tables };
        self.controller.explain(dead_time(link_v, settings), &law);
    }

    /// The torque that the operator or the speed loop asks for.
    fn demand(&mut self, input: &AxisInput, omega: f32, settings: &Settings, tables: &Tables) -> Demand {
        let rated_nm = tables.ratings.max_torque_nm;
        let largest_nm = if input.speed_torque_nm < rated_nm { input.speed_torque_nm } else { rated_nm };
        match input.demand {
            MotorDemand::Torque(demand) => {
                // A speed loop that takes over later continues from here.
                self.speed_loop = SpeedLoop::at(demand.torque_nm);
                *demand
            }
            MotorDemand::Speed(wanted_rad_s) => {
                let input = SpeedInput {
                    wanted_rad_s: *wanted_rad_s,
                    measured_rad_s: omega / tables.ratings.pole_pairs,
                    largest_nm,
                };
                let torque_nm = self.speed_loop.step(&input, &settings.speed);
                Demand { torque_nm, slew_limited: false }
            }
        }
    }

    /// Mean voltage of a control period per volt of link: that of its carrier periods, of which the first is known and each is turned by one carrier
    /// period from the one before. Together they have the direction of their middle, and the chord's length instead of the arc's: its square term is
    /// short of it by less than 3e-6 at 400 Hz.
    fn mean_per_volt(&self, share: &MotorShare, settings: &Settings) -> AlphaBeta {
        let (omega, control_s) = (self.controller.omega(), settings.clock.control_s());
        let carrier_s = settings.clock.seconds(settings.carrier_ticks as i32);
        let to_middle = 0.5 * (control_s - carrier_s);
        let between = omega * omega * (control_s * control_s - carrier_s * carrier_s);
        let middle = (share.angle + Angle::within_half_turn(omega * to_middle)).sin_cos();
        let length = 0.5 * share.modulation_index * (1.0 - between * (1.0 / 24.0));
        AlphaBeta { alpha: middle.cos, beta: middle.sin } * length
    }
}

/// The configured dead time, on a link of `link_v`.
#[inline]
fn dead_time(link_v: f32, settings: &Settings) -> DeadTime {
    let of_two = DeadTime::of(settings.dead_time_ticks, settings.carrier_ticks, link_v, &settings.clock);
    DeadTime { left_share: LEFT_SHARE, ..of_two }
}

/// `true` if [`check`] finds nothing.
#[inline(always)]
pub fn is_sound(measured: &Measurements, omega: f32, tables: &Tables) -> bool {
    protection::are_sound(&measured.currents_a, &tables.ratings)
        && protection::check_speed(omega, &tables.ratings).is_none()
}

/// Phase currents and speed of one motor.
pub fn check(measured: &Measurements, omega: f32, tables: &Tables) -> Option<FailedCheck> {
    protection::check_currents(&measured.currents_a, &tables.ratings)
        .or_else(|| protection::check_speed(omega, &tables.ratings))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::built_in::zs9::BUILT_IN;
    use crate::control::Controller;
    use crate::frames::Abc;
    use crate::time::Clock;
    use core::f64::consts::TAU;

    const SETTINGS: Settings = Settings::new(Clock::new(25_000_000, 2_500), 2_500, &BUILT_IN);

    /// The time, in s, until it is noticed that a sensor which followed `omega`, electrical in rad/s, follows `then` of that time.
    fn noticed_s(omega: f64, then: impl Fn(f64) -> f64) -> Option<f64> {
        let mut axis = Axis::new(Controller::with_tracking(TRACKING_RAD_S));
        let (period_s, mut radians) = (f64::from(SETTINGS.clock.control_s()), 0.0);
        let mut follow = |omega: f64| {
            radians += omega * period_s;
            let angle = Angle((radians.rem_euclid(TAU) / TAU * 4_294_967_296.0) as u64 as u32);
            axis.track(angle, false, &SETTINGS, &BUILT_IN)
        };
        for _ in 0..1_000 {
            assert_eq!(follow(omega), None, "sound");
        }
        let times_s = (0..1_000).map(|period| f64::from(period) * period_s);
        times_s.into_iter().find(|t_s| follow(then(*t_s)).is_some())
    }

    /// From 250 rad/s on, the very next angle is off; below, a sensor that counts the other way is found by the course of the speed.
    #[test]
    fn a_sensor_that_counts_the_other_way_is_found_at_low_speed_too_and_a_quick_rotor_is_not() {
        for omega in [-240.0, -100.0, -40.0, 40.0, 100.0, 240.0] {
            let found_s = noticed_s(omega, |_| -omega);
            assert!(found_s.is_some_and(|found_s| found_s < 5e-3), "{omega} rad/s: {found_s:?}");
        }
        // Full torque: half of the allowed acceleration.
        for rad_s2 in [-5_000.0, 5_000.0] {
            assert_eq!(noticed_s(100.0, |t_s| 100.0 + rad_s2 * t_s), None, "{rad_s2} rad/s²");
        }
        // A lighter rotor than this machine's.
        assert!(noticed_s(100.0, |t_s| 100.0 + 20_000.0 * t_s).is_some());
        assert_eq!(astray_rad(20_000.0), 1.0);
    }

    /// The zero is calibrated if that is wanted, without torque, and from a twentieth of the largest speed on: 31 rad/s.
    #[test]
    fn a_zero_is_calibrated_where_it_shows() {
        let torque = |torque_nm| MotorDemand::Torque(Demand { torque_nm, slew_limited: true });
        let most = BUILT_IN.ratings.max_speed_rad_s * BUILT_IN.ratings.pole_pairs;
        let calibrating = |wanted, demand, share: f32| {
            let mut axis = Axis::new(Controller::with_tracking(TRACKING_RAD_S));
            axis.calibrating = true;
            for period in 0..300 {
                let turned_rad = share * most * SETTINGS.clock.control_s() * period as f32;
                axis.track(Angle::within_half_turn(turned_rad), true, &SETTINGS, &BUILT_IN);
            }
            axis.calibrate(wanted, &demand, &BUILT_IN);
            axis.calibrating
        };
        assert!(calibrating(true, torque(0.0), 0.06));
        assert!(calibrating(true, torque(0.0), -0.06));
        assert!(!calibrating(false, torque(0.0), 0.06));
        assert!(!calibrating(true, torque(1.0), 0.06));
        assert!(!calibrating(true, MotorDemand::Speed(0.0), 0.06));
        assert!(!calibrating(true, torque(0.0), 0.04));
    }

    /// A jump of the angle is reported with its size, but a trusted sensor may jump; after a lost angle the speed is known again only after a while.
    #[test]
    fn a_jump_of_the_angle_is_told_unless_it_is_trusted() {
        for (jump_rad, trusted, told) in [(1.0, false, true), (-1.0, false, true), (1.0, true, false)] {
            let mut axis = Axis::new(Controller::with_tracking(TRACKING_RAD_S));
            let turn = |period: u16| Angle::within_half_turn(0.01 * f32::from(period % 300));
            for period in 0..300 {
                assert_eq!(axis.track(turn(period), false, &SETTINGS, &BUILT_IN), None);
            }
            let jumped = turn(299) + Angle::within_half_turn(0.01 + jump_rad);
            let got = axis.track(jumped, trusted, &SETTINGS, &BUILT_IN);
            assert_eq!(got.is_some(), told, "{jump_rad} {trusted}: {got:?}");
            assert!(got.is_none_or(|got| (got - jump_rad).abs() < 1e-3), "{got:?}");
            assert!(axis.speed_is_known());
            axis.recover_angle();
            assert_eq!(axis.speed_is_known(), !told, "{jump_rad} {trusted}");
        }
    }

    /// The operating point may use 0.98 of the largest voltage: with an EMF above that the field is weakened.
    #[test]
    fn the_field_is_weakened_above_the_steady_share() {
        for (share, weakens) in [(0.9, false), (1.05, true)] {
            let mut axis = Axis::new(Controller::with_tracking(TRACKING_RAD_S));
            let mut angle = Angle::ZERO;
            for _ in 0..300 {
                angle = angle + Angle::within_half_turn(0.02);
                axis.track(angle, false, &SETTINGS, &BUILT_IN);
            }
            let emf_v = axis.omega() * BUILT_IN.ratings.magnet_flux_wb;
            let udc_v = emf_v / share * core::f32::consts::FRAC_PI_2;
            let measured = Measurements { currents_a: Abc::default(), udc_v, angle };
            let demand = MotorDemand::Torque(Demand { torque_nm: 0.0, slew_limited: false });
            let mut output = AxisOutput::NOTHING;
            let input = AxisInput {
                measured: &measured,
                demand: &demand,
                speed_torque_nm: 0.0,
                applied: None,
                link_v: udc_v,
                aims: true,
            };
            axis.step(&input, &SETTINGS, &BUILT_IN, &mut output);
            assert_eq!(output.weakening, weakens, "{share}");
        }
    }
}
