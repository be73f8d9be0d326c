//! The drive's own two tasks on the board in memory.

use crate::bench::{Bench, control_update, write_input};
use crate::devices;
use nucleo_g474re::built_in::traction::BUILT_IN;
use nucleo_g474re::position::{Encoder, PositionState};
use nucleo_g474re::power_stage::{AdcCode, POWER_STAGE};
use nucleo_g474re::{CLOCK, Control, Pwm};
use tractive::drive::traction::{ControlTask, PwmTask, Settings, Shared};
use tractive::frames::Abc;
use tractive::modulation::CarrierHalf;
use tractive::ports::{DriveCommand, PwmPort};
use tractive::protection::SafeState;
use tractive::time::Instant;

/// Ticks from one encoder count to the next at 200 r/min.
const TICKS_PER_COUNT: u64 = 1_556;

/// The board's side of an interrupt whose first instructions have been executed already.
struct Served<'a>(&'a mut Pwm);

impl PwmPort for Served<'_> {
    fn sample(&mut self, now: Instant) -> Abc {
        self.0.sample(now)
    }

    fn play(&mut self, now: Instant, next: &CarrierHalf) {
        self.0.play(now, next);
    }

    fn enter(&mut self, safe: SafeState, now: Instant) {
        self.0.enter(safe, now);
    }
}

#[test]
fn the_drive_pulses_a_turning_machine_through_the_registers() {
    let mut bench = Bench::started(devices());
    bench.codes[6] = (1_500.0 / POWER_STAGE.udc_v_per_code) as u16;
    let registers = bench.registers;
    let (shared, state) = (Shared::new(), PositionState::new());
    let settings = Settings::new(CLOCK, devices());
    let zeros = [AdcCode(2_048); 3];
    let encoder = Encoder::new(registers.tim4, &POWER_STAGE, &BUILT_IN.ratings);
    let mut control = Control::new(registers, zeros, encoder, &state);
    let mut pwm = Pwm::new(registers, zeros);
    let first_half = Instant(devices().shortest_half_ticks);
    let mut control_task = ControlTask::new(&BUILT_IN, settings, Instant(CLOCK.control_ticks));
    let mut pwm_task = PwmTask::new(&BUILT_IN, settings, first_half);
    registers.tim4.sr().write(|w| w.set_idxif(true));
    // The enable input.
    write_input(registers.gpioc, 1 << 2);
    let mut enabled = false;
    let (mut changes, mut gates) = (0, bench.legs.map(|leg| leg.gates()));
    for tick in 1..=700_000_u64 {
        if bench.tick() {
            assert_eq!(pwm_task.next_call(), Instant(tick as u32), "the timer keeps the drive's time");
            pwm.acknowledge();
            bench.settle();
            pwm.begin_half();
            bench.finish_sequence(registers.adc2);
            pwm_task.run(&mut Served(&mut pwm), &shared);
        }
        if tick.is_multiple_of(u64::from(CLOCK.control_ticks)) {
            registers.tim4.cnt().write(|w| w.set_cnt((tick / TICKS_PER_COUNT % 4_096) as u16));
            control_update(&registers);
            bench.finish_sequence(registers.adc1);
            control_task.run(&mut control, &shared);
            if state.is_known() && !enabled {
                shared
                    .operator
                    .publish(DriveCommand { enable: true, ..DriveCommand::NONE }, control_task.next_call());
                enabled = true;
            }
        }
        bench.settle();
        let now = bench.legs.map(|leg| leg.gates());
        changes += u32::from(now != gates);
        gates = now;
    }
    assert_eq!(shared.operator.observed().unwrap().report.trip, None);
    assert_eq!(pwm_task.trip(), None);
    // 20 ms pass until the speed is known, 13 ms remain: 23 halves, in each of which three legs toggle once, one device going
    // off and, the dead time later, the other on.
    assert!((100..=23 * 6 + 6).contains(&changes), "{changes}");
}
