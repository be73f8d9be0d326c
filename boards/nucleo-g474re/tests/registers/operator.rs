//! The exchange between the operator and the board, and the end of a fault.

use crate::bench::{Bench, drivers_ready, take_written, write_input};
use crate::devices;
use crate::temperatures::done;
use nucleo_g474re::built_in::traction::BUILT_IN;
use nucleo_g474re::can::Can;
use nucleo_g474re::pins::{Function, PINS};
use nucleo_g474re::position::{Encoder, PositionState};
use nucleo_g474re::power_stage::{AdcCode, POWER_STAGE};
use nucleo_g474re::registers::Registers;
use nucleo_g474re::serve::{Identifying, Serve, Station};
use nucleo_g474re::{Control, Pwm, hardware, switchgear};
use stm32_metapac::gpio;
use stm32_metapac::timer::regs::Sr1chCmp;
use tractive::experiment::Memory;
use tractive::modulation::{CarrierHalf, Mode};
use tractive::operator::{Configuration, Feedback, State, Status, Switches};
use tractive::ports::{ControlPort, PwmPort};
use tractive::protection::{Fault, SafeState, Trip};
use tractive::protocol::{CanEndpoint, EXPERIMENT};
use tractive::thermal::Ratios;
use tractive::time::Instant;

const NOW: Instant = Instant(0);

/// The level at either break input.
fn ready_at(registers: &Registers, [b, a]: [bool; 2]) {
    write_input(registers.gpiob, u32::from(b) << 12);
    write_input(registers.gpioa, u32::from(a) << 6);
}

/// The last write to a set-and-reset register, as (set, reset); the memory is emptied.
fn bits_written(port: gpio::Gpio) -> (u32, u32) {
    let word = take_written(port);
    (word & 0xFFFF, word >> 16)
}

#[test]
fn the_switchgear_is_off_before_its_pins_are_outputs() {
    let mut bench = Bench::new();
    let registers = bench.registers;
    bench.watch = |registers| {
        // Nothing is ever set on the way through the start.
        assert_eq!(bits_written(registers.gpioc).0, 0);
    };
    nucleo_g474re::start::prepare(&registers, &mut bench, devices()).unwrap();
    assert_eq!(bits_written(registers.gpioc).0, 0);
    let switches: Vec<_> = PINS.iter().filter(|pin| pin.function == Function::Switch).collect();
    assert_eq!(switches.len(), 3);
    for pin in switches {
        let mode = registers.gpioc.moder().read().moder(usize::from(pin.number));
        assert_eq!(mode, gpio::vals::Moder::OUTPUT, "{}", pin.purpose);
    }
    let chopper = registers.tim17;
    assert_eq!(chopper.ccr(0).read().ccr(), 0);
    assert!(chopper.ccmr_output(0).read().ocpe(0) && chopper.cr1().read().cen());
    // 170 MHz / 170 / 1,000 counts = 1 kHz.
    assert_eq!((chopper.psc().read(), chopper.arr().read().arr()), (169, 999));
    assert!(registers.rcc.apb2enr().read().tim17en());
}

#[test]
fn each_switch_has_its_pin_and_the_chopper_its_duty() {
    let registers = Bench::started(devices()).registers;
    for (switches, last) in [
        (Switches { precharge: true, ..Switches::default() }, (1 << 8, 0)),
        (Switches { main: true, ..Switches::default() }, (1 << 9, 0)),
        (Switches { discharge: true, ..Switches::default() }, (1 << 11, 0)),
        (Switches::default(), (0, 1 << 11)),
    ] {
        bits_written(registers.gpioc);
        switchgear::set(&registers, &switches);
        assert_eq!(bits_written(registers.gpioc), last, "{switches:?}");
    }
    for (chopper, counts) in [(0.25, 250), (1.0, 1_000), (0.0, 0)] {
        switchgear::set(&registers, &Switches { chopper, ..Switches::default() });
        assert_eq!(registers.tim17.ccr(0).read().ccr(), counts);
    }
}

/// The chip's own break, of a supply that dips, takes TIM17's main output: it comes back with the acknowledge, not before, and not in a drive that has
/// refused to start.
#[test]
fn the_chopper_is_on_again_once_no_fault_is_left() {
    let registers = Bench::started(devices()).registers;
    let state = PositionState::new();
    let station = CanEndpoint::new(&BUILT_IN.ratings);
    let serve = Serve::new(registers, Can::CHIP, station, &state, Configuration::Good);
    let status = |trip| Status {
        state: State::Ready,
        trip,
        refusal: None,
        refusals: 0,
        torque_nm: 0.0,
        switches: Switches::default(),
        temperatures: None,
    };
    let timer = registers.tim17;
    timer.bdtr().modify(|w| w.set_moe(false));
    let trip = Trip {
        fault: Fault::ClockFailure,
        value: 0.0,
        limit: 0.0,
        at: Instant(0),
        safe: SafeState::GatesOff,
    };
    for (trip, started, on) in [(Some(trip), true, false), (None, false, false), (None, true, true)] {
        timer.sr().write_value(Sr1chCmp(u32::MAX));
        serve.switch(&status(trip), started);
        assert_eq!((timer.bdtr().read().moe(), !timer.sr().read().bif(0)), (on, on), "{trip:?} {started}");
    }
}

#[test]
fn the_operator_hears_of_contacts_drivers_and_inputs() {
    let registers = Bench::started(devices()).registers;
    let state = PositionState::new();
    let station = CanEndpoint::new(&BUILT_IN.ratings);
    // The bus is not touched by what is tested here.
    let serve = Serve::new(registers, Can::CHIP, station, &state, Configuration::Good);
    drivers_ready(&registers, true);
    let healthy = Feedback {
        driver_ready: true,
        sensor_alive: true,
        configuration: Configuration::Good,
        ..Feedback::default()
    };
    for (levels, wanted) in [
        (0, healthy),
        (1 << 2, Feedback { enable_input: true, ..healthy }),
        (1 << 4, Feedback { precharge_closed: true, ..healthy }),
        (1 << 5, Feedback { main_closed: true, ..healthy }),
    ] {
        write_input(registers.gpioc, levels);
        assert_eq!(serve.feedback(), wanted, "{levels:#b}");
    }
    for inputs in [[false; 2], [true, false], [false, true]] {
        ready_at(&registers, inputs);
        let feedback = serve.feedback();
        assert_eq!((feedback.driver_ready, feedback.hardware), (false, Some(Fault::GateDriver)));
    }
}

/// An angle that is not known and that the drive can find, and the voltages of the temperature sensors.
#[test]
fn the_operator_hears_of_a_count_and_of_the_temperature_sensors() {
    let registers = Bench::started(devices()).registers;
    let state = PositionState::new();
    let station = CanEndpoint::new(&BUILT_IN.ratings);
    let mut serve = Serve::new(registers, Can::CHIP, station, &state, Configuration::Good);
    assert!(!serve.feedback().position_counted);
    let encoder = Encoder::new(registers.tim4, &POWER_STAGE, &BUILT_IN.ratings);
    Control::new(registers, [AdcCode(2_048); 3], encoder, &state).sample(NOW);
    assert!(serve.feedback().position_counted);
    for code in [1_000, 1_001, 1_002] {
        serve.temperatures.step(registers.adc1);
        done(registers.adc1, code);
    }
    assert_eq!(serve.feedback().temperatures, Ratios { winding: 1_000 << 4, heat_sink: 1_001 << 4 });
}

/// The drive's frames as they are without an identification, and its own in the slots between.
#[test]
fn an_identification_tells_of_itself_where_the_drives_frames_leave_room() {
    let memory = Memory::new();
    let mut alone = CanEndpoint::new(&BUILT_IN.ratings);
    let mut station = Identifying::new(CanEndpoint::new(&BUILT_IN.ratings), &memory);
    let status = Status {
        state: State::SelfTest,
        trip: None,
        refusal: None,
        refusals: 0,
        torque_nm: 0.0,
        switches: Switches::default(),
        temperatures: None,
    };
    let (mut of_drive, mut own) = (0, 0);
    for _ in 0..1_000 {
        match (alone.tell(&status, None), station.tell(&status, None)) {
            (Some(wanted), told) => {
                assert_eq!(told, Some(wanted));
                of_drive += 1;
            }
            (None, Some(told)) => {
                assert_eq!(told.id, EXPERIMENT.id);
                own += 1;
            }
            (None, None) => {}
        }
    }
    assert!(of_drive > 100 && own > 10, "{of_drive} {own}");
}

#[test]
fn a_break_has_the_name_of_its_cause() {
    let mut bench = Bench::started(devices());
    let registers = bench.registers;
    drivers_ready(&registers, true);
    assert_eq!(hardware::latched_by(&registers), None);
    bench.fault[0] = true;
    bench.settle();
    // A comparator that has seen its overcurrent end.
    assert_eq!(hardware::latched_by(&registers), Some(Fault::HardwareOvercurrent));
    drivers_ready(&registers, false);
    assert_eq!(hardware::latched_by(&registers), Some(Fault::GateDriver));
    drivers_ready(&registers, true);
    registers.legs.tim8.sr().modify(|w| w.set_sbif(true));
    assert_eq!(hardware::latched_by(&registers), Some(Fault::ClockFailure));
}

/// A half in which every leg stands high.
fn high() -> CarrierHalf {
    let mut half = CarrierHalf::off(devices().shortest_half_ticks);
    (half.mode, half.start_levels, half.compare_ticks) = (Mode::Async, [true; 3], [u32::MAX; 3]);
    half
}

/// Plays a half and lets it begin: whether any gate is on then.
fn pulses(bench: &mut Bench, pwm: &mut Pwm) -> bool {
    for _ in 0..2 {
        while !bench.tick() {}
        pwm.acknowledge();
        bench.settle();
        pwm.begin_half();
        bench.settle();
        pwm.play(NOW, &high());
        bench.settle();
    }
    for _ in 0..1_000 {
        bench.tick();
    }
    bench.legs.iter().any(|leg| leg.gates() != (false, false))
}

#[test]
fn a_safe_state_is_left_with_the_gates_off_and_pulses_follow() {
    for safe in [SafeState::GatesOff, SafeState::ShortCircuit] {
        let mut bench = Bench::started(devices());
        let mut pwm = Pwm::new(bench.registers, [AdcCode(2_048); 3]);
        assert!(pulses(&mut bench, &mut pwm), "before");
        pwm.enter(safe, NOW);
        bench.settle();
        let shorted = pulses(&mut bench, &mut pwm);
        assert_eq!(shorted, safe == SafeState::ShortCircuit);
        assert!(bench.legs.iter().all(|leg| !leg.gates().0), "no upper device");
        assert!(pwm.leave(NOW));
        bench.settle();
        assert!(bench.legs.iter().all(|leg| leg.gates() == (false, false)), "off at once");
        assert!(pulses(&mut bench, &mut pwm), "after");
        assert!(bench.legs.iter().all(|leg| leg.gates().0), "and the legs follow again");
    }
}

/// The interrupt of a boundary that comes meanwhile is not lost.
#[test]
fn a_break_is_forgotten_and_a_boundary_is_not() {
    let mut bench = Bench::started(devices());
    let legs = bench.registers.legs;
    legs.trip();
    while !bench.tick() {}
    assert!(legs.is_tripped() && legs.has_updated());
    assert!(legs.leave());
    bench.settle();
    assert!(!legs.is_tripped() && legs.has_updated());
}

#[test]
fn a_break_whose_cause_lasts_holds_the_gates() {
    let mut bench = Bench::started(devices());
    let mut pwm = Pwm::new(bench.registers, [AdcCode(2_048); 3]);
    bench.fault = [true; 2];
    bench.settle();
    pwm.leave(NOW);
    bench.settle();
    assert!(bench.registers.legs.is_tripped(), "its flag is set again");
    assert!(!pulses(&mut bench, &mut pwm));
    bench.fault = [false; 2];
    assert!(pwm.leave(NOW));
    bench.settle();
    assert!(pulses(&mut bench, &mut pwm));
}

#[test]
fn a_half_that_is_loaded_too_late_is_told() {
    let mut bench = Bench::started(devices());
    let mut pwm = Pwm::new(bench.registers, [AdcCode(2_048); 3]);
    while !bench.tick() {}
    pwm.acknowledge();
    bench.settle();
    pwm.play(NOW, &high());
    assert!(!pwm.is_late());
    while !bench.tick() {}
    pwm.play(NOW, &high());
    assert!(pwm.is_late());
    bench.settle();
    assert!(bench.registers.legs.is_tripped());
    // It stays known until the safe state is left.
    pwm.acknowledge();
    bench.settle();
    pwm.play(NOW, &high());
    assert!(pwm.is_late());
    pwm.leave(NOW);
    assert!(!pwm.is_late());
}
