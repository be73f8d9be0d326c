//! Gaps in the plan of the PWM interrupt: where pulses run or are planned, control must have come, and planned the next half.

use std::sync::atomic::Ordering;
use tractive::built_in::traction::BUILT_IN;
use tractive::drive::PlannedHalf;
use tractive::drive::traction::{PwmTask, Settings, Shared};
use tractive::frames::{Abc, Angle};
use tractive::modulation::{CarrierHalf, Mode, Modulator, Reference, Schedule, SwitchLimits};
use tractive::ports::PwmPort;
use tractive::protection::{Fault, SafeState};
use tractive::time::{Clock, Instant};

const CLOCK: Clock = Clock::new(25_000_000, 2_500);
/// Control periods of a half, and a bit.
const HALF_TICKS: u32 = 13_889;

#[derive(Default)]
struct Gates {
    mode: Mode,
    entered: u32,
}

impl PwmPort for Gates {
    fn sample(&mut self, _now: Instant) -> Abc {
        Abc::default()
    }

    fn play(&mut self, _now: Instant, next: &CarrierHalf) {
        self.mode = next.mode;
    }

    fn enter(&mut self, _safe: SafeState, _now: Instant) {
        self.entered += 1;
    }
}

/// A half that is planned for so many ticks after the first boundary, with or without pulses; control began so many ticks before that.
struct Planned {
    after: u32,
    pulses: bool,
    age: u32,
}

/// The fault at the last of so many boundaries, for each of which one half is planned beforehand.
fn fault(plan: &[Planned]) -> Option<Fault> {
    let devices = SwitchLimits::new(250, 0, 900.0, &CLOCK);
    assert_eq!(devices.shortest_half_ticks, HALF_TICKS);
    let mut modulator = Modulator::new(devices, Schedule::new(&CLOCK));
    let (mut pwm, shared) =
        (PwmTask::new(&BUILT_IN, Settings::new(CLOCK, devices), Instant(HALF_TICKS)), Shared::new());
    let mut gates = Gates::default();
    for Planned { after, pulses, age } in plan {
        assert_eq!((pwm.trip(), gates.entered), (None, 0));
        let at = Instant(HALF_TICKS + after);
        let reference = Reference::turning(100.0, Angle::ZERO, 0.0, at, 1_500.0);
        let half = if *pulses { modulator.step(at, Some(&reference)) } else { CarrierHalf::off(HALF_TICKS) };
        shared.planned.publish(PlannedHalf { at, half, release: 0, rate: 0.0, udc_v: 1_500.0 });
        shared.began.store(pwm.next_call().0 - age, Ordering::Relaxed);
        pwm.run(&mut gates, &shared);
    }
    let found = pwm.trip().map(|trip| trip.fault);
    assert_eq!(gates.entered, u32::from(found.is_some()));
    assert!(found.is_none() || gates.mode == Mode::Off);
    found
}

#[test]
fn control_that_has_gone_is_missed_where_pulses_run_or_are_planned() {
    let half = |boundary, pulses, age| Planned { after: boundary * HALF_TICKS, pulses, age };
    let gone = 3 * CLOCK.control_ticks;
    for (pulses, found) in [(false, None), (true, Some(Fault::StaleCommand))] {
        // No pulses run yet.
        assert_eq!(fault(&[half(0, pulses, gone)]), found, "planned: {pulses}");
        // Before the second boundary, and not for it, the newest plan is one without pulses.
        let gap = Planned { after: HALF_TICKS - 1, pulses: false, age: 0 };
        assert_eq!(fault(&[half(0, pulses, 0), gap]), found, "running: {pulses}");
    }
    assert_eq!(fault(&[half(0, true, 0), half(1, true, 0), half(2, false, gone)]), None);
}
