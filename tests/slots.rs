//! The operator in the idle loop beside the control interrupt: a step for each slot, told and commanded at the slots' instants, however often it looks.

use tractive::built_in::traction::BUILT_IN;
use tractive::drive::traction::{ControlTask, Settings as DriveSettings, Shared};
use tractive::frames::{Abc, Angle};
use tractive::modulation::SwitchLimits;
use tractive::operator::{Feedback, OperatorPort, Request, Settings, Slot, Status};
use tractive::ports::{ControlPort, DriveCommand, Report, Sample};
use tractive::protection::{Fault, SafeState};
use tractive::time::{Clock, Instant};

const CLOCK: Clock = Clock::new(25_000_000, 2_500);
/// A millisecond.
const SLOT_TICKS: u32 = 25_000;
const FIRST: u32 = 2_500;

/// A control interrupt that samples a link which rises by a volt a period, and notes what it is commanded.
#[derive(Default)]
struct Drive {
    udc_v: f32,
    commanded: Vec<DriveCommand>,
    tripped: Option<Fault>,
}

impl ControlPort for Drive {
    fn sample(&mut self, _now: Instant) -> Sample {
        self.udc_v += 1.0;
        let (currents_a, angle) = (Abc::default(), Some(Angle::ZERO));
        Sample { currents_a, udc_v: self.udc_v, angle, may_pulse: true, hardware: None }
    }

    fn command(&mut self, _now: Instant, operator: impl FnOnce() -> DriveCommand) -> DriveCommand {
        let command = operator();
        self.commanded.push(command);
        command
    }

    fn enter(&mut self, _safe: SafeState, _now: Instant) {}

    fn overrun_ticks(&mut self, _now: Instant, _deadline_ticks: u32) -> u32 {
        0
    }

    fn report(&mut self, _now: Instant, report: impl FnOnce() -> Report) {
        self.tripped = report().trip.map(|trip| trip.fault);
    }
}

/// The instants that an idle loop was asked for and told, with the slots since the last one and the link's voltage that was reported.
#[derive(Default)]
struct Idle {
    asked: Vec<(u32, u32)>,
    told: Vec<(u32, Option<f32>)>,
    fault: Option<Fault>,
}

impl OperatorPort for Idle {
    fn ask(&mut self, at: Instant, slots: u32) -> (Request, Feedback) {
        self.asked.push((at.0, slots));
        (Request::idle(&BUILT_IN.ratings), Feedback::default())
    }

    fn tell(&mut self, from: Instant, status: &Status, report: Option<&Report>) {
        self.told.push((from.0, report.map(|report| report.udc_v)));
        self.fault = status.trip.map(|trip| trip.fault);
    }
}

/// Control for so many periods, after each of which the idle loop looks twice if it is not away.
fn driven(periods: u32, away: core::ops::Range<u32>) -> (Drive, Idle) {
    let devices = SwitchLimits::new(250, 0, 900.0, &CLOCK);
    let mut control = ControlTask::new(&BUILT_IN, DriveSettings::new(CLOCK, devices), Instant(FIRST));
    let settings = Settings::rated(&BUILT_IN.ratings, 1e-3, None);
    let (shared, mut slot) = (Shared::new(), Slot::new());
    let (mut drive, mut idle, mut done) = (Drive::default(), Idle::default(), 0);
    for period in 0..periods {
        control.run(&mut drive, &shared);
        for _ in 0..2 * u32::from(!away.contains(&period)) {
            done += usize::from(slot.run(&shared.operator, &mut idle, &settings, &CLOCK));
        }
    }
    assert_eq!((done, done), (idle.asked.len(), idle.told.len()));
    (drive, idle)
}

#[test]
fn a_slot_is_done_once_and_commands_from_the_next_one_on() {
    let (drive, idle) = driven(31, 0..0);
    let begins = |slot: u32| FIRST + slot * SLOT_TICKS;
    assert_eq!(idle.asked, [0, 1, 2, 3].map(|slot| (begins(slot), 1)));
    let told = |slot: u32| (begins(slot + 1), Some((1 + 10 * slot) as f32));
    assert_eq!(idle.told, [0, 1, 2, 3].map(told));
    let commanded = drive.commanded.iter().position(|command| *command != DriveCommand::NONE);
    assert_eq!((commanded, drive.tripped), (Some(10), None));
}

#[test]
fn slots_that_nobody_has_looked_at_are_counted() {
    let (_, idle) = driven(42, 1..35);
    assert_eq!(idle.asked, [(FIRST, 1), (FIRST + 3 * SLOT_TICKS, 3), (FIRST + 4 * SLOT_TICKS, 1)]);
}

/// A drive that has not started has no report; its operator says why.
#[test]
fn a_drive_that_has_not_started_answers_in_every_slot() {
    let settings = Settings::rated(&BUILT_IN.ratings, 1e-3, None);
    let (mut slot, mut idle) = (Slot::new(), Idle::default());
    for _ in 0..3 {
        slot.refuse((Fault::Configuration, 2.0, 1.0), &mut idle, &settings, &CLOCK);
    }
    assert_eq!(idle.asked, [0, 1, 2].map(|slot| (slot * SLOT_TICKS, 1)));
    assert_eq!(idle.told, [1, 2, 3].map(|slot| (slot * SLOT_TICKS, None)));
    assert_eq!(idle.fault, Some(Fault::Configuration));
}
