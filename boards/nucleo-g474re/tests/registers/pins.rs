//! The pin table against the chip's own data and against the documentation.

use crate::bench::{Bench, written};
use nucleo_g474re::pins::{Function, PINS, Pin, Port};
use nucleo_g474re::position::{Absolute, Encoder, Position, Resolver};
use nucleo_g474re::registers::Registers;
use nucleo_g474re::sampling::{CONTROL, PWM};
use nucleo_g474re::zs9;
use std::collections::BTreeSet;
use std::path::Path;
use stm32_metapac::gpio::vals::Moder;
use stm32_metapac::metadata::METADATA;

/// The pins of each position sensor.
type Sensors = &'static [&'static [Pin]];

/// The wiring of each drive, with its page: what is always there, and position sensors of which it has one.
const TABLES: [(&str, &[Pin], Sensors); 2] = [
    (
        "../../docs/nucleo-g474re.md",
        &PINS,
        &[Encoder::PINS, <Absolute<8, false>>::PINS, <Resolver<1, 1, 1>>::PINS],
    ),
    ("../../docs/nucleo-g474re-zs9.md", &zs9::pins::PINS, &[&[]]),
];

fn every_pin() -> impl Iterator<Item = &'static Pin> {
    TABLES.iter().flat_map(|(_, pins, sensors)| pins.iter().chain(sensors.iter().copied().flatten()))
}

fn name(pin: &Pin) -> String {
    format!("P{:?}{}", pin.port, pin.number)
}

#[test]
fn the_chip_has_every_signal_on_its_pin() {
    for pin in every_pin() {
        let function = match pin.function {
            Function::Gate(number) | Function::Alternate(number) | Function::Bus(number) => Some(number),
            Function::Analog | Function::Input | Function::Output | Function::Switch => None,
        };
        for signal in pin.signals {
            let (peripheral, signal) = signal.split_once('_').unwrap();
            let peripheral = METADATA.peripherals.iter().find(|found| found.name == peripheral).unwrap();
            let there = peripheral
                .pins
                .iter()
                .any(|found| found.pin == name(pin) && found.signal == signal && found.af == function);
            assert!(there, "{} is not {} {signal} by {function:?}", name(pin), peripheral.name);
        }
        let by_software = matches!(pin.function, Function::Input | Function::Output | Function::Switch);
        assert_eq!(pin.signals.is_empty(), by_software, "{}", name(pin));
    }
}

#[test]
fn no_pin_is_used_twice_and_none_belongs_to_the_debugger_or_the_crystal() {
    for (pins, sensor) in
        TABLES.iter().flat_map(|(_, pins, sensors)| sensors.iter().map(|sensor| (*pins, *sensor)))
    {
        let names: BTreeSet<_> = pins.iter().chain(sensor).map(name).collect();
        assert_eq!(names.len(), pins.len() + sensor.len());
        for taken in ["PA13", "PA14", "PA2", "PA3", "PF0", "PF1"] {
            assert!(!names.contains(taken), "{taken}");
        }
    }
}

/// The pins that do not float from a reset until the start: by the data sheet all are analog inputs without a pull, but for these.
const NOT_FLOATING: [(&str, &str); 6] = [
    ("PA13", "SWDIO/JTMS: pull-up"),
    ("PA14", "SWCLK/JTCK: pull-down"),
    ("PA15", "JTDI: pull-up"),
    ("PB3", "JTDO: the debug port's output"),
    ("PB4", "NJTRST: pull-up; UCPD1_CC2: dead-battery pull-down of 5.1 kΩ"),
    ("PB6", "UCPD1_CC1: dead-battery pull-down of 5.1 kΩ"),
];

#[test]
fn the_pins_that_do_not_float_are_those_of_the_reset_values_and_the_chips_data() {
    let registers = Bench::new().registers;
    let ports = [Port::A, Port::B, Port::C, Port::D];
    let debug = ports.into_iter().flat_map(|port| {
        let modes = port.of(&registers).moder().read();
        (0..16).filter(move |n| modes.moder(*n) != Moder::ANALOG).map(move |n| format!("P{port:?}{n}"))
    });
    let usb = METADATA.peripherals.iter().find(|found| found.name == "UCPD1").unwrap();
    let battery = usb.pins.iter().filter(|pin| ["CC1", "CC2"].contains(&pin.signal));
    let found: BTreeSet<_> = debug.chain(battery.map(|pin| pin.pin.to_owned())).collect();
    assert_eq!(found, NOT_FLOATING.map(|(pin, _)| pin.to_owned()).into_iter().collect());
}

#[test]
fn what_switches_something_on_when_high_floats_from_reset_on() {
    for pin in every_pin().filter(|pin| matches!(pin.function, Function::Gate(_) | Function::Switch)) {
        let reason = NOT_FLOATING.iter().find(|(taken, _)| *taken == name(pin));
        assert_eq!(reason, None, "{}", pin.purpose);
    }
}

/// Two converters that sample one pin at a time disturb each other.
#[test]
fn no_pin_belongs_to_two_converters() {
    for pin in every_pin() {
        let converters = pin.signals.iter().filter(|signal| signal.starts_with("ADC")).count();
        assert!(converters <= 1, "{} {:?}", name(pin), pin.signals);
    }
}

#[test]
fn the_sequences_convert_what_the_table_says() {
    let purposes = ["current of U", "current of V", "current of W", "DC-link voltage"];
    for (converter, sequence, wanted) in [("ADC1", CONTROL, 4), ("ADC2", PWM, 3)] {
        let converted = sequence.channels.iter().take(sequence.count.into()).skip(sequence.rejected);
        assert_eq!(converted.len(), wanted);
        for (channel, purpose) in converted.zip(purposes) {
            let signal = format!("{converter}_IN{channel}");
            let pin = PINS.iter().find(|pin| pin.signals.contains(&signal.as_str())).unwrap();
            assert!(pin.purpose.starts_with(purpose), "{signal}: {}", pin.purpose);
        }
    }
}

fn row(pin: &Pin) -> String {
    let function = match pin.function {
        Function::Gate(number) => format!("AF{number}, output"),
        Function::Alternate(number) => format!("AF{number}, pull-down"),
        Function::Bus(number) => format!("AF{number}, pull-up"),
        Function::Analog => "analog".to_owned(),
        Function::Input => "input, pull-down".to_owned(),
        Function::Output => "output".to_owned(),
        Function::Switch => "output, low at first".to_owned(),
    };
    format!("| {} | {} | {function} | {} |", name(pin), pin.signals.join(", "), pin.purpose)
}

#[test]
fn the_documentation_has_the_table_that_the_code_has() {
    for (page, pins, sensors) in TABLES {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(page);
        let text = std::fs::read_to_string(path).unwrap();
        let documented: Vec<_> = text.lines().filter(|line| line.starts_with("| P")).collect();
        let wanted: Vec<_> = pins.iter().chain(sensors.concat().iter()).map(row).collect();
        assert_eq!(documented, wanted, "the table of {page} should be:\n{}", wanted.join("\n"));
    }
}

/// The level that a pin is given before it is an output.
#[test]
fn an_output_is_high_at_first_and_a_switch_low() {
    use nucleo_g474re::pins::configure_inputs;
    for pin in every_pin() {
        let registers = Bench::new().registers;
        configure_inputs(&registers, &[*pin]);
        let (high, low) = (1 << pin.number, 1 << (16 + pin.number));
        let wanted = match pin.function {
            Function::Output => high,
            Function::Switch => low,
            _ => 0,
        };
        assert_eq!(written(pin.port.of(&registers)), wanted, "{}", name(pin));
    }
}

/// A kind's configuration, and which pins are of it.
type Kind = (fn(&Registers, &[Pin]), fn(&Pin) -> bool);

/// The pins of a kind alone, each with its function, and no other pin touched.
#[test]
fn each_kind_of_pin_is_configured_by_itself() {
    use nucleo_g474re::pins::{configure_bus, configure_gates, configure_inputs};
    let kinds: [Kind; 3] = [
        (configure_inputs, |pin| !matches!(pin.function, Function::Gate(_) | Function::Bus(_))),
        (configure_bus, |pin| matches!(pin.function, Function::Bus(_))),
        (configure_gates, |pin| matches!(pin.function, Function::Gate(_))),
    ];
    for (configure, is_kind) in kinds {
        let registers = Bench::new().registers;
        let mode = |pin: &Pin| pin.port.of(&registers).moder().read().moder(usize::from(pin.number));
        let before: Vec<_> = PINS.iter().map(&mode).collect();
        configure(&registers, &PINS);
        for (pin, before) in PINS.iter().zip(before) {
            let wanted = match pin.function {
                _ if !is_kind(pin) => before,
                Function::Gate(_) | Function::Alternate(_) | Function::Bus(_) => Moder::ALTERNATE,
                Function::Analog => Moder::ANALOG,
                Function::Input => Moder::INPUT,
                Function::Output | Function::Switch => Moder::OUTPUT,
            };
            assert_eq!(mode(pin), wanted, "{}", name(pin));
            let port = pin.port.of(&registers);
            let number = usize::from(pin.number);
            if let (
                true,
                Function::Gate(function) | Function::Alternate(function) | Function::Bus(function),
            ) = (is_kind(pin), pin.function)
            {
                assert_eq!(port.afr(number / 8).read().afr(number % 8), function, "{}", name(pin));
            }
        }
    }
}
