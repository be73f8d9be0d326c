//! The drive's own two tasks on the board in memory.

use super::bridge::Rig;
use super::ports::{UNEXPLAINED, control, converted, make_ready, permitted};
use crate::bench::control_update;
use nucleo_g474re::built_in::zs9::BUILT_IN;
use nucleo_g474re::position::PositionState;
use nucleo_g474re::zs9::feedback::encoded;
use nucleo_g474re::zs9::{CARRIER_TICKS, CLOCK, CYCLES_PER_TICK, settings};
use tractive::drive::dual::{ControlTask, PwmTask, Shared};
use tractive::ports::{Dual, GateFeedback, PlayedPeriod, PowerSample, PwmPort};
use tractive::protection::SafeState;
use tractive::time::Instant;

/// The board's port, with the driver board's latches in place of the serial words, which memory cannot shift.
struct Port<'a> {
    pwm: &'a mut nucleo_g474re::zs9::Pwm,
    seen: GateFeedback,
}

impl PwmPort<Dual> for Port<'_> {
    fn sample(&mut self, now: Instant) -> PowerSample {
        assert_eq!(nucleo_g474re::zs9::feedback::decoded(encoded(self.seen).map(Some)), self.seen);
        PowerSample { gates: self.seen, ..self.pwm.sample(now) }
    }

    fn play(&mut self, now: Instant, next: &PlayedPeriod) {
        self.pwm.play(now, next);
    }

    fn enter(&mut self, safe: SafeState, now: Instant) {
        self.pwm.enter(safe, now);
    }

    fn leave(&mut self, now: Instant) -> bool {
        self.pwm.leave(now)
    }
}

#[test]
fn the_drive_pulses_two_turning_motors_through_the_registers() {
    let mut rig = Rig::new();
    rig.pwm = nucleo_g474re::zs9::Pwm::new(rig.model.registers, super::ports::zeros());
    let registers = rig.model.registers;
    let (shared, state) = (Shared::new(), PositionState::new());
    let mut control = control(registers, &state);
    let mut control_task = ControlTask::new(&BUILT_IN, settings()).without(UNEXPLAINED);
    let mut pwm_task = PwmTask::new(&BUILT_IN, settings());
    make_ready(&registers);
    let mut enabled = false;
    // 500 V of link from 400 V of source.
    let codes = [(6, 1_843), (9, 1_638)];
    let control_cycles = u64::from(CLOCK.control_ticks * CYCLES_PER_TICK);
    let (mut seen, mut on, mut shorted) = (GateFeedback::default(), 0_u64, 0_u64);
    for cycle in 1..=control_cycles * 400 {
        let beat = rig.model.tick();
        for (gate, is_on) in rig.model.devices().into_iter().enumerate() {
            let latch = if is_on { &mut seen.on } else { &mut seen.off };
            *latch |= 1 << gate;
            on += u64::from(is_on);
        }
        if beat && rig.serve() {
            let nominal = Instant((cycle / u64::from(CYCLES_PER_TICK)) as u32);
            assert_eq!(pwm_task.next_call(), nominal, "the timers keep the drive's time");
            converted(&codes, registers);
            let mut port = Port { pwm: &mut rig.pwm, seen: core::mem::take(&mut seen) };
            pwm_task.run(&mut port, &shared);
            rig.model.settle();
        } else if beat && cycle % control_cycles == 0 {
            assert_eq!(control_task.next_call(), Instant((cycle / u64::from(CYCLES_PER_TICK)) as u32));
            // 600 r/min and 300 r/min of 4,096 counts.
            let counts = cycle * 4_096 / 17_000_000;
            registers.tim4.cnt().write(|w| w.set_cnt((counts % 4_096) as u16));
            registers.tim3.cnt().write(|w| w.set_cnt((counts / 2 % 4_096) as u16));
            control_update(&registers);
            converted(&codes, registers);
            control_task.run(&mut control, &shared);
            rig.model.settle();
            if state.is_known() && !enabled {
                shared.operator.publish(permitted([10.0, 10.0], 500.0), control_task.next_call());
                enabled = true;
            }
        }
        shorted = rig.model.shorted[1];
    }
    assert_eq!(control_task.trip().or(pwm_task.trip()), None);
    assert_eq!(shared.operator.observed().unwrap().report.trip, None);
    let beats = 400 * CLOCK.control_ticks / CARRIER_TICKS;
    assert!(on > 100 * control_cycles && shorted > 1_000, "{beats} periods: {on} {shorted}");
}

#[test]
fn the_firmwares_settings_are_accepted() {
    assert_eq!(settings().check(&BUILT_IN), Ok(()));
}
