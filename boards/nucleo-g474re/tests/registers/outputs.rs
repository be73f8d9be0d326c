//! Every output that switches something on: off from reset on, in every refusal, halt and death.

use crate::bench::{Bench, written};
use crate::devices;
use nucleo_g474re::pins::{Function, PINS, Pin};
use nucleo_g474re::registers::Registers;
use nucleo_g474re::start::{StartError, prepare, switch_off};
use nucleo_g474re::{switchgear, zs9};
use stm32_metapac::gpio::vals::{Moder, Pupdr};
use tractive::operator::Switches;

/// The level of an output's pin: an analog pin is low by the external pull-down that the wiring asks for; a switch has the level
/// that was written last.
fn is_high(registers: &Registers, pin: &Pin) -> bool {
    let (port, number) = (pin.port.of(registers), usize::from(pin.number));
    match port.moder().read().moder(number) {
        Moder::ANALOG => false,
        Moder::INPUT => port.pupdr().read().pupdr(number) == Pupdr::PULL_UP,
        Moder::OUTPUT => written(port) >> number & 1 != 0,
        Moder::ALTERNATE => drives_high(registers, pin),
    }
}

/// `true` if the peripheral on the pin may drive it high.
fn drives_high(registers: &Registers, pin: &Pin) -> bool {
    let (port, number) = (pin.port.of(registers), usize::from(pin.number));
    if port.afr(number / 8).read().afr(number % 8) == 0 {
        return port.pupdr().read().pupdr(number) == Pupdr::PULL_UP;
    }
    let (timer, _) = pin.signals[0].split_once('_').unwrap();
    let legs = registers.legs;
    match timer {
        "TIM1" => legs.tim1.bdtr().read().moe(),
        "TIM8" => legs.tim8.bdtr().read().moe(),
        "TIM20" => registers.tim20.bdtr().read().moe(),
        "TIM17" => registers.tim17.bdtr().read().moe() && registers.tim17.ccr(0).read().ccr() > 0,
        other => panic!("{other}"),
    }
}

fn high<'a>(registers: &Registers, pins: &'a [Pin]) -> Vec<&'a str> {
    let outputs = pins.iter().filter(|pin| matches!(pin.function, Function::Gate(_) | Function::Switch));
    outputs.filter(|pin| is_high(registers, pin)).map(|pin| pin.purpose).collect()
}

const NONE: [&str; 0] = [];

fn first_is_off(registers: &Registers) {
    assert_eq!(high(registers, &PINS), NONE);
}

fn second_is_off(registers: &Registers) {
    assert_eq!(high(registers, &zs9::pins::PINS), NONE);
}

/// Commands everything, one after the other; tells what was high.
fn command_all(registers: &Registers) -> Vec<&'static str> {
    let none = Switches::default();
    let mut found = Vec::new();
    for switches in [
        Switches { precharge: true, ..none },
        Switches { main: true, ..none },
        Switches { discharge: true, ..none },
        Switches { chopper: 1.0, ..none },
    ] {
        switchgear::set(registers, &switches);
        found.extend(high(registers, &PINS));
        switchgear::set(registers, &none);
    }
    found
}

fn command_all_second(registers: &Registers) -> Vec<&'static str> {
    let none = Switches::default();
    let mut found = Vec::new();
    for switches in [
        Switches { precharge: true, ..none },
        Switches { main: true, ..none },
        Switches { discharge: true, ..none },
    ] {
        switchgear::set_wires(registers, &zs9::pins::SWITCHGEAR, &switches);
        found.extend(high(registers, &zs9::pins::PINS));
        switchgear::set_wires(registers, &zs9::pins::SWITCHGEAR, &none);
    }
    found
}

type Spoil = fn(&mut Bench);

/// The spoils that refuse a start, early and late.
const REFUSALS: [(Spoil, StartError); 3] = [
    (|bench| bench.registers.rcc.csr().write(|w| w.set_iwdgrstf(true)), StartError::WatchdogReset),
    (|bench| bench.broken = true, StartError::FlashLatency),
    (|bench| bench.codes = [3_000; 19], StartError::CurrentSensor { code: 3_000 }),
];

#[test]
fn every_output_is_off_from_reset_to_the_end_of_the_start() {
    let mut bench = Bench::new();
    first_is_off(&bench.registers);
    bench.watch = first_is_off;
    let registers = bench.registers;
    prepare(&registers, &mut bench, devices()).unwrap();
    first_is_off(&registers);
    let all = ["precharge relay", "main contactor", "discharge resistor", "braking chopper"];
    let commanded = command_all(&registers);
    assert_eq!(commanded.len(), all.len(), "the pins work: {commanded:?}");

    let mut bench = Bench::of_other_inverter();
    second_is_off(&bench.registers);
    bench.watch = second_is_off;
    let registers = bench.registers;
    zs9::start::prepare(&registers, &mut bench).unwrap();
    second_is_off(&registers);
    assert_eq!(command_all_second(&registers).len(), 3);
}

#[test]
fn a_start_that_is_refused_leaves_every_output_off_whatever_is_commanded() {
    for (spoil, error) in REFUSALS {
        let mut bench = Bench::new();
        spoil(&mut bench);
        bench.watch = first_is_off;
        let registers = bench.registers;
        assert_eq!(prepare(&registers, &mut bench, devices()), Err(error));
        bench.settle();
        first_is_off(&registers);
        assert_eq!(command_all(&registers), NONE, "{error:?}");

        let mut bench = Bench::of_other_inverter();
        spoil(&mut bench);
        let registers = bench.registers;
        assert_eq!(zs9::start::prepare(&registers, &mut bench), Err(error));
        second_is_off(&registers);
        assert_eq!(command_all_second(&registers), NONE, "{error:?}");
    }
}

#[test]
fn a_death_switches_every_output_off() {
    let mut bench = Bench::started(devices());
    let registers = bench.registers;
    let legs = registers.legs;
    legs.switch_on();
    bench.settle();
    for switches in
        [Switches { main: true, ..Switches::default() }, Switches { chopper: 0.5, ..Switches::default() }]
    {
        switchgear::set(&registers, &switches);
        assert!(!high(&registers, &PINS).is_empty());
    }
    // As the chip's `die` does.
    switch_off(&registers, &PINS);
    switch_off(&registers, &zs9::pins::PINS);
    bench.settle();
    first_is_off(&registers);
    assert_eq!(command_all(&registers), NONE);
}

/// A timer that is stopped with the processor has its outputs off, as if MOE were cleared, and a driven low level by OSSI (RM0440, the
/// timers' debug mode). A contactor's pin has no timer: there the watchdog, which must not stop, resets the chip.
#[test]
fn a_halt_by_a_debugger_ends_with_every_output_off() {
    let registers = Bench::started(devices()).registers;
    let frozen = registers.dbgmcu.apb2fzr().read();
    assert!(frozen.tim1() && frozen.tim8() && frozen.tim17() && frozen.tim20());
    assert!(!registers.dbgmcu.apb1lfzr().read().iwdg(), "a halted chip has no watchdog");
    let chopper = registers.tim17.bdtr().read();
    assert_eq!(chopper.ossi(), stm32_metapac::timer::vals::Ossi::IDLE_LEVEL);
    assert!(!registers.tim17.cr2().read().ois(0), "its off level");
    assert!(chopper.bke(0) && !registers.tim17.af1().read().bkine(), "the chip's own break stops it too");
}

/// PB4 and PB6 are encoder tracks, PA9 and PA10 are gates: these would switch pull-downs of 5.1 kΩ on those.
#[test]
fn the_dead_battery_pull_downs_go_before_anything_else_and_in_a_refusal_too() {
    let off = |registers: &Registers| {
        registers.rcc.apb1enr1().read().pwren() && registers.pwr.cr3().read().ucpd1_dbdis()
    };
    for (spoil, error) in REFUSALS {
        let mut bench = Bench::new();
        spoil(&mut bench);
        let registers = bench.registers;
        assert_eq!(prepare(&registers, &mut bench, devices()), Err(error));
        assert!(off(&registers), "{error:?}");
        let mut bench = Bench::of_other_inverter();
        spoil(&mut bench);
        let registers = bench.registers;
        assert_eq!(zs9::start::prepare(&registers, &mut bench), Err(error));
        assert!(off(&registers), "{error:?}");
    }
}
