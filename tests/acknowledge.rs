//! The acknowledge of a fault, in every order of acknowledge, fault, carrier boundary and control period, for both drives: the safe
//! state is never entered unless a side holds its fault, no pulses are made in it, and the drive forgets a fault only by an
//! acknowledge that was given after the fault was reported.

use std::cell::Cell;
use tractive::built_in::{traction::BUILT_IN, zs9};
use tractive::control::Demand;
use tractive::drive::dual::{self};
use tractive::drive::traction;
use tractive::frames::{Abc, Angle, Dq};
use tractive::modulation::{CarrierHalf, Mode, SwitchLimits};
use tractive::ports::DualReport;
use tractive::ports::Report;
use tractive::ports::{
    ControlPort, DriveCommand, Dual, DualDriveCommand, DualSample, GateFeedback, HardwareBreak, MotorDemand,
    PlayedPeriod, PowerSample, PwmPort, Sample,
};
use tractive::protection::{Fault, SafeState, Trip};
use tractive::time::{Clock, Instant};

const CLOCK: Clock = Clock::new(25_000_000, 2_500);
/// Electrical speed, in rad/s.
const OMEGA: f32 = 300.0;
/// Control periods before anything happens: the speed is known and pulses are made.
const SETTLED: u32 = 200;
/// Control periods within which acknowledge and fault fall: more than a command needs to reach a boundary and its answer to come back.
const WINDOW: u32 = 16;
/// Control periods after that: both interrupts have agreed.
const AGREED: u32 = 20;

/// The finder of a fault that lasts for one sample.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Finder {
    Control,
    Pwm,
    Hardware,
}

/// Events in control periods after [`SETTLED`].
#[derive(Clone, Copy, Debug)]
struct Case {
    /// By how much the PWM timer begins later than the control timer.
    phase_ticks: u32,
    finder: Finder,
    fault_in: u32,
    acknowledge_in: u32,
    /// Another fault, of control, if it holds none by then.
    again_in: Option<u32>,
}

impl Case {
    /// Runs every order within the window, for so many phases between the timers, which span one control period in all.
    fn each(phases: u32, mut run: impl FnMut(&Self)) {
        let finders = [Finder::Control, Finder::Pwm, Finder::Hardware];
        for (phase, finder) in (0..phases).flat_map(|phase| finders.map(|finder| (phase, finder))) {
            let phase_ticks = phase * CLOCK.control_ticks / phases;
            for (fault_in, acknowledge_in) in (0..WINDOW * WINDOW).map(|both| (both / WINDOW, both % WINDOW))
            {
                let again = |ahead: u32| (ahead > 0).then_some(acknowledge_in + ahead);
                for again_in in (0..4).map(again) {
                    run(&Self { phase_ticks, finder, fault_in, acknowledge_in, again_in });
                }
            }
        }
    }

    fn at(&self, period: u32) -> u32 {
        (SETTLED + period) * CLOCK.control_ticks
    }

    fn is_in(&self, period: u32, now: Instant) -> bool {
        let from = self.at(period);
        (from..from + CLOCK.control_ticks).contains(&now.0)
    }

    fn control_finds(&self, now: Instant) -> bool {
        self.finder == Finder::Control && self.is_in(self.fault_in, now) || self.is_again(now)
    }

    fn is_again(&self, now: Instant) -> bool {
        self.again_in.is_some_and(|period| self.is_in(period, now))
    }

    fn hardware(&self, now: Instant) -> bool {
        self.finder == Finder::Hardware && self.is_in(self.fault_in, now)
    }

    /// The fault is there at the one boundary that comes first in its period.
    fn pwm_finds(&self, now: Instant, found: &Cell<bool>) -> bool {
        self.finder == Finder::Pwm && now.0 >= self.at(self.fault_in) && !found.replace(true)
    }

    fn acknowledge(&self, now: Instant) -> u8 {
        u8::from(now.0 >= self.at(self.acknowledge_in))
    }
}

/// Converters and gates of either drive.
struct Board<'a> {
    case: &'a Case,
    found: Cell<bool>,
    /// The safe state.
    entered: bool,
    pulses: bool,
    /// The fault that was told last, and since when it has been told.
    told: Option<(Trip, Instant)>,
    acknowledged_at: Option<Instant>,
    /// `true` if there was a fault after the drive had forgotten the first one, or before it knew one.
    again: bool,
    /// The states of the ZS9's gates before and after the last valley.
    periods: Option<[PlayedPeriod; 2]>,
    half_steps: u32,
    wrong: Option<String>,
}

fn angle(at: Instant) -> Angle {
    let turns = f64::from(OMEGA) * f64::from(at.0) / 25e6 / std::f64::consts::TAU;
    Angle((turns.rem_euclid(1.0) * 4_294_967_296.0) as u64 as u32)
}

fn currents(at: Instant, scale: f32) -> Abc {
    let ripple = (at.0 % 7919) as f32 * 1e-4;
    (Dq { d: -5.0 * scale + ripple, q: 10.0 * scale }).unpark(angle(at).sin_cos()).abc()
}

impl<'a> Board<'a> {
    fn new(case: &'a Case) -> Self {
        Self {
            case,
            found: Cell::new(false),
            entered: false,
            pulses: false,
            told: None,
            acknowledged_at: None,
            again: false,
            periods: None,
            half_steps: 0,
            wrong: None,
        }
    }

    fn acknowledge(&mut self, now: Instant) -> u8 {
        let number = self.case.acknowledge(now);
        if number != 0 && self.acknowledged_at.is_none() {
            self.acknowledged_at = Some(now);
        }
        self.again |= self.case.is_again(now) && self.told.is_none();
        number
    }

    /// The latches at a peak: a gate was on, a gate was off.
    fn feedback(&self) -> GateFeedback {
        let mut seen = GateFeedback { on: 0, off: 0x1FF };
        let half = self.half_steps;
        let Some([before, running]) = self.periods.filter(|_| !self.entered) else { return seen };
        seen.off = 0;
        for period in [before, running] {
            for (bit, gate) in period.gates.iter().enumerate() {
                seen.on |= u16::from(gate.off_from > 0 || gate.off_to < half) << bit;
                seen.off |= u16::from(gate.off_from < gate.off_to) << bit;
            }
        }
        seen
    }

    fn see(&mut self, trip: Option<Trip>, now: Instant) {
        if let (Some((told, since)), None) = (self.told, trip) {
            let acknowledged = self.acknowledged_at.is_some_and(|at| at.since(since) > 0);
            if !acknowledged {
                self.wrong = Some(format!("{told:?}, told at {since:?}, is forgotten at {now:?}"));
            }
        }
        self.told = trip.map(|trip| match self.told {
            Some((told, since)) if told == trip => (told, since),
            _ => (trip, now),
        });
    }

    /// After either interrupt.
    fn check(&self, trips: [Option<Trip>; 2]) {
        let Self { case, told, .. } = self;
        assert!(self.wrong.is_none(), "{case:?}: {:?}", self.wrong);
        let held = trips.iter().any(Option::is_some);
        assert!(!self.entered || held, "{case:?}: safe state without a fault, told {told:?}");
        assert!(!self.entered || !self.pulses || held, "{case:?}: pulses in the safe state");
    }

    /// The end, once both have agreed: the last fault is told unless it was acknowledged.
    fn check_end(&self, trips: [Option<Trip>; 2]) {
        let Self { case, .. } = self;
        let [control, pwm] = trips;
        match control {
            Some(_) => assert!(!self.pulses, "{case:?}"),
            None => assert!(pwm.is_none() && !self.entered && self.pulses, "{case:?}: {pwm:?}"),
        }
        if case.acknowledge_in <= case.fault_in || self.again {
            assert!(control.is_some(), "{case:?}: a fault is forgotten");
        }
        // A boundary or two later, and told a period after that.
        if case.acknowledge_in > case.fault_in + 14 && case.again_in.is_none() {
            assert!(control.is_none(), "{case:?}: {control:?} is not forgotten");
        }
    }
}

impl ControlPort for Board<'_> {
    fn sample(&mut self, now: Instant) -> Sample {
        let udc_v = if self.case.control_finds(now) { 5_000.0 } else { 1_500.0 };
        Sample {
            currents_a: currents(now, 1.0),
            udc_v,
            angle: Some(angle(now)),
            may_pulse: true,
            hardware: self.case.hardware(now).then_some(Fault::HardwareOvercurrent),
        }
    }

    fn command(&mut self, now: Instant, _operator: impl FnOnce() -> DriveCommand) -> DriveCommand {
        let demand = Demand { torque_nm: 100.0, slew_limited: false };
        DriveCommand { enable: true, demand, acknowledge: self.acknowledge(now), ..DriveCommand::NONE }
    }

    fn enter(&mut self, _safe: SafeState, _now: Instant) {
        self.entered = true;
    }

    fn overrun_ticks(&mut self, _now: Instant, _deadline_ticks: u32) -> u32 {
        0
    }

    fn report(&mut self, now: Instant, report: impl FnOnce() -> Report) {
        self.see(report().trip, now);
    }
}

impl PwmPort for Board<'_> {
    fn sample(&mut self, now: Instant) -> Abc {
        currents(now, if self.case.pwm_finds(now, &self.found) { 100.0 } else { 1.0 })
    }

    fn play(&mut self, _now: Instant, next: &CarrierHalf) {
        self.pulses = next.mode != Mode::Off;
    }

    fn enter(&mut self, _safe: SafeState, _now: Instant) {
        self.entered = true;
    }

    fn leave(&mut self, _now: Instant) -> bool {
        self.entered = false;
        true
    }
}

impl ControlPort<Dual> for Board<'_> {
    fn sample(&mut self, now: Instant) -> DualSample {
        let hardware = self.case.hardware(now);
        DualSample {
            currents_a: [currents(now, 1.0); 2],
            angles: [Some(angle(now)); 2],
            capacitor_v: if self.case.control_finds(now) { 5_000.0 } else { 533.5 },
            inductor_a: 20.0,
            source_v: 400.0,
            may_pulse: true,
            hardware: hardware.then_some(HardwareBreak { fault: Fault::HardwareOvercurrent, seen: 1 }),
        }
    }

    fn command(&mut self, now: Instant, _operator: impl FnOnce() -> DualDriveCommand) -> DualDriveCommand {
        DualDriveCommand {
            enable: true,
            demands: [MotorDemand::Torque(Demand { torque_nm: 20.0, slew_limited: true }); 2],
            speed_torque_nm: DualDriveCommand::UNLIMITED_NM,
            link_ref_v: 667.0,
            acknowledge: self.acknowledge(now),
            ..DualDriveCommand::NONE
        }
    }

    fn enter(&mut self, _safe: SafeState, _now: Instant) {
        self.entered = true;
    }

    fn overrun_ticks(&mut self, _now: Instant, _deadline_ticks: u32) -> u32 {
        0
    }

    fn report(&mut self, now: Instant, report: impl FnOnce() -> DualReport) {
        self.see(report().trip, now);
    }
}

impl PwmPort<Dual> for Board<'_> {
    fn sample(&mut self, now: Instant) -> PowerSample {
        let scale = if self.case.pwm_finds(now, &self.found) { 100.0 } else { 1.0 };
        PowerSample {
            currents_a: [currents(now, scale), currents(now, 1.0)],
            capacitor_v: 533.5,
            source_v: 400.0,
            gates: self.feedback(),
        }
    }

    fn play(&mut self, _now: Instant, next: &PlayedPeriod) {
        self.pulses = *next != PlayedPeriod::off(self.half_steps);
        self.periods = Some([self.periods.map_or(*next, |[_, running]| running), *next]);
    }

    fn enter(&mut self, _safe: SafeState, _now: Instant) {
        self.entered = true;
    }

    fn leave(&mut self, _now: Instant) -> bool {
        self.entered = false;
        true
    }
}

const LAST: u32 = (SETTLED + WINDOW + AGREED) * CLOCK.control_ticks;

#[test]
fn the_traction_drive_forgets_no_fault() {
    let devices = SwitchLimits::new(250, 0, 900.0, &CLOCK);
    let settings = traction::Settings::new(CLOCK, devices);
    let mut cases = 0;
    Case::each(12, |case| {
        let shared = traction::Shared::new();
        let mut control = traction::ControlTask::new(&BUILT_IN, settings, Instant(CLOCK.control_ticks));
        let first = Instant(devices.shortest_half_ticks + case.phase_ticks);
        let mut pwm = traction::PwmTask::new(&BUILT_IN, settings, first);
        let mut board = Board::new(case);
        while control.next_call().0 < LAST {
            if control.next_call().reached(pwm.next_call()) {
                pwm.run(&mut board, &shared);
            } else {
                control.run(&mut board, &shared);
            }
            board.check([control.trip(), pwm.trip()]);
        }
        board.check_end([control.trip(), pwm.trip()]);
        cases += 1;
    });
    println!("{cases} orders");
}

#[test]
fn the_zs9_forgets_no_fault() {
    // The peaks keep their distance from the valleys; two carriers a control period are another order.
    for carrier_ticks in [2_500, 1_250] {
        let settings = dual::Settings::new(CLOCK, carrier_ticks, &zs9::BUILT_IN);
        Case::each(1, |case| {
            let shared = dual::Shared::new();
            let mut control = dual::ControlTask::new(&zs9::BUILT_IN, settings);
            let mut pwm = dual::PwmTask::new(&zs9::BUILT_IN, settings);
            let mut board = Board { half_steps: settings.half_steps(), ..Board::new(case) };
            while control.next_call().0 < LAST {
                if control.next_call().reached(pwm.next_call()) {
                    pwm.run(&mut board, &shared);
                } else {
                    control.run(&mut board, &shared);
                }
                board.check([control.trip(), pwm.trip()]);
            }
            board.check_end([control.trip(), pwm.trip()]);
        });
    }
}
