//! The control law's part of a period: learning from the newest boundary, the operating point, the command.

use super::super::applied::{Ahead, Steady, Wanted, committed, follows, interval_s, limits, passed};
use super::super::current_delay::CurrentDelay;
use super::super::pulses::Half;
use super::super::slot::{Decision, Slot};
use super::super::{Settings, Shared};
use super::{ControlTask, Input};
use crate::control::{
    AimInput, AngleHarmonics, ControlLaw, DeadTime, Demand, Law, LinkDamper, Measurements, Regulated,
    RotorSample, WithoutTorque,
};
use crate::drive::SLOT_S;
use crate::frames::{Angle, SinCos, six_step_v};
use crate::machine::Machine;
use crate::modulation::{Mode, Reference, SwitchLimits};
use crate::ports::{DriveCommand, Sample};
use crate::protection::{DiodeWatch, FrozenWatch, SafeState, UnexplainedWatch, safe_state};
use crate::time::Instant;

/// Share of the largest torque beyond which a jump of the demand is worth revising the next half.
const JUMP_SHARE: f32 = 0.05;

/// Control periods that the running half must still last for the next one to be revised: one until the command is valid, and one in which control
/// sees the result.
const REVISION_PERIODS: u32 = 2;

impl<M: Machine, L: ControlLaw> ControlTask<M, L> {
    /// The stages of the control law that are due in this period, while pulses are made.
    #[inline(always)]
    pub(super) fn pulse(&mut self, input: Input, measured: &Measurements, slot: &Slot, shared: &Shared) {
        let tables = self.machine.tables();
        let here = RotorSample::new(measured.currents_a, measured.angle, tables);
        self.controller.observe(&here, tables);
        self.revises = self.is_to_revise(slot.now, &input.command.demand);
        let commands = slot.commands || self.revises;
        let is_own = |aimed: &Decision| aimed.boundary == slot.key.boundary;
        // After a single short half there was no period left for an operating point.
        let is_short = commands && !slot.folds;
        let serves = |aimed: &Decision| aimed.serves(&slot.key, &self.settings.clock, is_short);
        let served = || self.aimed.filter(|aimed| serves(aimed) && (L::POINT_SERVES || is_own(aimed)));
        // A pattern's last half needs its own operating point, and so does a boundary whose point was made early, after a jump.
        let is_old = |aimed: &Decision| is_own(aimed) || aimed.after != slot.key.after;
        let aims = (slot.aims || commands) && served().is_none_or(|aimed| slot.aims && is_old(&aimed));
        // Not in the longest periods.
        if !aims || slot.folds {
            self.controller.warm(input.command.warmth);
            self.gains.learn(measured.currents_a, tables.ratings.max_current_a, self.delay.scale);
            self.delay = self.delayed();
            let Settings { gains, clock, .. } = &self.settings;
            let SwitchLimits { dead_time_ticks, shortest_half_ticks, .. } = self.settings.devices;
            let dead = DeadTime::of(dead_time_ticks, 2 * shortest_half_ticks, input.sample.udc_v, clock);
            self.controller.explain(dead, &Law { gains, clock, tables });
        }
        if slot.aims || (slot.commands && slot.folds) {
            self.look_ahead(input.sample.udc_v, slot);
        }
        // Once a half, and in the longest periods only if all are.
        if slot.commands && (!aims || slot.folds) {
            self.learn_angle(measured.angle, here.frame);
        }
        if let Some(at) = self.pulses.newest().map(|newest| newest.at)
            && self.boundary != Some(at)
            && (aims || !commands || slot.folds)
        {
            self.learn(input.sample, measured.angle, slot, shared);
            self.boundary = Some(at);
        }
        if aims {
            self.aim(input, slot);
        }
        if commands {
            self.command(input.sample, &here, slot);
        }
    }

    /// Follows the link's ripple, once a half, and predicts it for the halves that the command takes into account and makes.
    #[inline(always)]
    fn look_ahead(&mut self, udc_v: f32, slot: &Slot) {
        let clock = &self.settings.clock;
        self.ripple.step(udc_v, clock.seconds(slot.now.since(self.link_seen)));
        self.link_seen = slot.now;
        if let Some(last) = self.pulses.last() {
            let first_s = if slot.commands { 0.0 } else { clock.control_s };
            let horizon_s = clock.seconds(last.ends().since(slot.now));
            let middles_s = [0.5 * (first_s + horizon_s), horizon_s + 0.5 * self.interval_s(slot)];
            let [committed_v, next_v] = self.ripple.change(first_s, middles_s);
            self.ahead = Ahead { committed_v, next_v };
        }
    }

    /// Expected time for which a command acts.
    #[inline(always)]
    fn interval_s(&self, slot: &Slot) -> f32 {
        let used_ticks = slot.used_ticks(&self.settings.clock);
        interval_s(slot.key.mode, self.controller.omega(), used_ticks, &self.settings)
    }

    /// The delay of the current sensors at the present speed.
    fn delayed(&self) -> CurrentDelay {
        let Settings { current_filter_ticks, clock, .. } = &self.settings;
        CurrentDelay::of(*current_filter_ticks, self.controller.omega(), clock)
    }

    /// Learns the position sensor's errors from an angle and its direction, unless the speed tracker follows them or counts look like errors.
    #[inline(always)]
    fn learn_angle(&mut self, angle: Angle, direction: SinCos) {
        let tracker = self.controller.tracker();
        if self.settings.counts_coarsely() || !AngleHarmonics::can_observe(tracker) {
            self.harmonics.pause();
        } else {
            self.harmonics.observe(angle, direction, self.innovation_rad, tracker);
        }
    }

    /// Learns from the newest boundary.
    pub(super) fn learn(&mut self, sample: &Sample, angle: Angle, slot: &Slot, shared: &Shared) {
        let Settings { gains, clock, .. } = &self.settings;
        let tables = self.machine.tables();
        let boundary =
            passed(&self.pulses, self.boundary, (sample.udc_v * self.link_scale, self.delay.ticks), clock);
        if let Some(currents_a) = self.pulses.currents_a(&shared.loaded) {
            let age_s = clock.seconds(slot.now.since(self.pulses.before(0).at));
            let angle = angle - Angle::within_half_turn(self.controller.omega() * age_s);
            let there = RotorSample::new(self.gains.without(self.zeros.without(currents_a)), angle, tables);
            self.controller.learn(&boundary, &there, follows(slot.key.mode), &Law { gains, clock, tables });
            if let Some(unexplained_v) = self.controller.unexplained_v() {
                let omega = self.controller.omega();
                self.unexplained.step(unexplained_v, 0.0, omega, boundary.length_s, tables);
            }
        }
    }

    /// Calibrates the zero of the position sensor for a slot, if that is possible: without torque, in a mode with a carrier.
    #[cold]
    #[inline(never)]
    pub(super) fn calibrate(&mut self, command: &DriveCommand, pulsing: bool) {
        let ratings = &self.machine.tables().ratings;
        let rests = command.calibrate && pulsing && command.demand.torque_nm == 0.0;
        self.calibrating = rests
            && follows(self.mode) == Regulated::Mean
            && self.controller.unexplained_v().is_some_and(|unexplained_v| {
                self.harmonics.learn_zero(&WithoutTorque {
                    unexplained_v,
                    omega: self.controller.omega(),
                    max_omega: ratings.max_speed_rad_s * ratings.pole_pairs,
                    magnets_wb: ratings.magnet_flux_wb,
                    length_s: SLOT_S,
                })
            });
    }

    /// The operating point of the command that a boundary will use.
    pub(super) fn aim(&mut self, input: Input, slot: &Slot) {
        let Input { sample, command } = input;
        let Settings { gains, clock, .. } = &self.settings;
        let (omega, udc_v) = (self.controller.omega(), sample.udc_v);
        let tables = self.machine.tables();
        let passed_s = self.controller.passed_s(clock);
        self.limits =
            limits(&slot.key, (omega, self.modulation_index), &mut self.exit, &self.settings, passed_s);
        let emf_v = omega.abs() * tables.ratings.magnet_flux_wb;
        let torque_nm = self.exit.one_sided(command.demand.torque_nm, emf_v, udc_v, &tables.ratings);
        let demand = Demand { torque_nm, ..command.demand };
        let damps = gains.link_damping > 0.0;
        let weakened = self.modulation_index > self.limits.steady_limit;
        let swing = damps.then(|| self.damper.step(udc_v, passed_s, omega, (self.limits.follows, weakened)));
        let window = Some(&command.window);
        let aim = AimInput {
            demand: &demand,
            window,
            udc_v,
            change_v: self.ahead.next_v,
            link_scale: self.link_scale,
            swing,
            iron_share: self.settings.iron_share,
            limits: &self.limits,
        };
        self.controller.aim(&aim, &Law { gains, clock, tables });
        let target = self.controller.target();
        self.modulation_index = target.modulation_index;
        self.link_scale = self.controller.link_scale();
        self.exit.drove(target.torque_nm);
        self.aimed = Some(slot.key);
    }

    /// The command itself.
    #[inline(always)]
    pub(super) fn command(&mut self, sample: &Sample, here: &RotorSample, slot: &Slot) {
        let Settings { gains, clock, .. } = &self.settings;
        // The instant of the currents.
        let now = slot.now.before(self.delay.ticks);
        let Ahead { committed_v, next_v } = self.ahead;
        let omega = self.controller.omega();
        let udc_v = (sample.udc_v + next_v) * self.link_scale;
        let steady = Steady { omega, udc_v, voltage_v: self.steady_v };
        let (mode, revises) = (slot.key.mode, self.revises);
        let committed_v = (sample.udc_v + committed_v) * self.link_scale;
        let wanted = Wanted { mode, revises, udc_v: committed_v, interval_s: self.interval_s(slot) };
        let committed = committed(&self.pulses, now, &steady, clock, &wanted);
        let law = Law { gains, clock, tables: self.machine.tables() };
        let voltage = self.controller.regulate(here, &committed, &self.limits, &law);
        self.steady_v = voltage.steady_v;
        self.mode = mode;
        self.diodes = DiodeWatch::new();
        self.watch.command(voltage.vector);
        self.reference = Reference {
            // An optimised pattern is that of the operating point; the vector moves its edges. The same holds for the pattern that another one leads
            // to: the half in between brings the flux linkage there, which regulation would do a second time.
            voltage_v: if mode.is_optimal() || slot.key.leads() {
                voltage.steady_v
            } else {
                voltage.voltage_v
            },
            vector: voltage.vector,
            carrier_angle: voltage.carrier.angle(),
            rate: clock.angle_rate(omega),
            at: now,
            udc_v,
            modulation_index: self.exit.opened(self.modulation_index),
        };
    }

    /// `true` if the demand has jumped and the next half can still be changed: the running half lasts long enough, and the next one belongs to the
    /// free carrier, whose length is always the same. An operating point from before a jump is no longer valid.
    pub(super) fn is_to_revise(&mut self, now: Instant, demand: &Demand) -> bool {
        let change = demand.torque_nm - self.demand_nm;
        self.demand_nm = demand.torque_nm;
        let largest_nm = self.machine.tables().ratings.max_torque_nm;
        if !demand.slew_limited && change.abs() > JUMP_SHARE * largest_nm {
            (self.jumped, self.aimed) = (true, None);
        }
        let latest = now.after(REVISION_PERIODS * self.settings.clock.control_ticks);
        let possible = |newest: &Half| newest.half.is_free() && newest.begins.reached(latest);
        let revises = self.jumped && self.pulses.newest().is_some_and(possible);
        self.jumped &= !revises;
        revises
    }

    /// A period without the control law's pulses: if nothing else makes a current flow either, the sensors show their zeros.
    pub(super) fn rest_currents(&mut self, sample: &Sample, pulses: bool) {
        let ratings = &self.machine.tables().ratings;
        let open = safe_state(self.controller.omega(), sample.udc_v, ratings) == SafeState::GatesOff;
        if open && !pulses && self.trip.is_none() {
            self.zeros.rest(sample.currents_a);
        } else {
            self.zeros.flow();
        }
    }

    /// No pulses: the control law is reset.
    pub(super) fn rest(&mut self, now: Instant, omega: f32, measured: &Measurements) {
        self.controller.idle();
        self.delay = self.delayed();
        if self.exit.crosses() {
            self.controller.begin_without_torque();
        } else {
            self.modulation_index = 0.0;
        }
        self.watch = FrozenWatch::new();
        self.unexplained = UnexplainedWatch::new();
        self.boundary = None;
        self.aimed = None;
        self.steady_v = 0.0;
        self.revises = false;
        self.mode = Mode::Off;
        self.exit.rest(self.settings.clock.control_s());
        self.damper = LinkDamper::at(measured.udc_v);
        self.ripple.step(measured.udc_v, self.settings.clock.seconds(now.since(self.link_seen)));
        (self.link_seen, self.ahead) = (now, Ahead::NONE);
        self.reference = Reference {
            carrier_angle: measured.angle,
            rate: self.settings.clock.angle_rate(omega),
            at: now.before(self.delay.ticks),
            udc_v: measured.udc_v,
            modulation_index: omega.abs() * self.machine.tables().ratings.magnet_flux_wb
                / six_step_v(measured.udc_v),
            ..Reference::NONE
        };
        self.harmonics.pause();
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;
    use crate::built_in::traction::BUILT_IN;
    use crate::frames::Abc;
    use crate::modulation::SwitchLimits;
    use crate::time::Clock;

    /// The zero is calibrated if it is asked for, with pulses, without torque, in a mode with a carrier, and from a twentieth of the largest speed on: 126 rad/s.
    #[test]
    fn a_zero_is_calibrated_where_it_shows() {
        let clock = Clock::new(25_000_000, 2_500);
        let settings = Settings::new(clock, SwitchLimits::new(250, 0, 900.0, &clock));
        let calibrating = |calibrate, pulsing, torque_nm, mode, omega: f32| {
            let mut task = ControlTask::new(&BUILT_IN, settings, Instant(2_500));
            for period in 0..2 {
                let angle = Angle::within_half_turn(omega * clock.control_s() * period as f32);
                task.controller.track(angle, &clock);
            }
            (task.mode, task.calibrating) = (mode, true);
            let demand = Demand { torque_nm, slew_limited: true };
            task.calibrate(&DriveCommand { calibrate, demand, ..DriveCommand::NONE }, pulsing);
            task.calibrating
        };
        assert!(calibrating(true, true, 0.0, Mode::Async, 200.0));
        assert!(calibrating(true, true, 0.0, Mode::Sync15, -200.0));
        assert!(!calibrating(false, true, 0.0, Mode::Async, 200.0));
        assert!(!calibrating(true, false, 0.0, Mode::Async, 200.0));
        assert!(!calibrating(true, true, 1.0, Mode::Async, 200.0));
        assert!(!calibrating(true, true, 0.0, Mode::Square, 200.0));
        assert!(!calibrating(true, true, 0.0, Mode::Async, 100.0));
    }

    /// The mode that pulses would begin with follows from the machine's own EMF, and the start's pulses turn with the machine from the instant of the
    /// currents.
    #[test]
    fn at_rest_the_reference_turns_with_the_machine_without_voltage() {
        let clock = Clock::new(25_000_000, 2_500);
        let devices = SwitchLimits::new(250, 0, 900.0, &clock);
        let settings = Settings { current_filter_ticks: 300, ..Settings::new(clock, devices) };
        let mut task = ControlTask::new(&BUILT_IN, settings, Instant(2_500));
        let (now, omega, angle) = (Instant(1_000_000), -1_000.0, Angle(0x2345_6789));
        task.rest(now, omega, &Measurements { currents_a: Abc::default(), udc_v: 1_500.0, angle });
        let Reference { voltage_v, vector, carrier_angle, rate, at, udc_v, modulation_index } =
            task.reference;
        assert_eq!((voltage_v, vector.squared(), carrier_angle, udc_v), (0.0, 0.0, angle, 1_500.0));
        assert_eq!((rate, at), (clock.angle_rate(omega), now.before(task.delay.ticks)));
        assert!(task.delay.ticks > 250);
        // 1,000 rad/s of the magnets' flux linkage over 2/π of the link.
        let emf = 1_000.0 * BUILT_IN.ratings.magnet_flux_wb / 954.93;
        assert!((modulation_index / emf - 1.0).abs() < 1e-4, "{modulation_index}, not {emf}");
    }
}
