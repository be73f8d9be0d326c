//! The pin table against the chip's own data and against the documentation.

use std::collections::BTreeSet;
use std::path::Path;
use stm32_metapac::metadata::METADATA;
use tractive::board::nucleo_g474re::pins::{Function, PINS, Pin};
use tractive::board::nucleo_g474re::zs9;

/// The wiring of each drive, with its page.
const TABLES: [(&str, &[Pin]); 2] =
    [("docs/nucleo-g474re.md", &PINS), ("docs/nucleo-g474re-zs9.md", &zs9::pins::PINS)];

fn name(pin: &Pin) -> String {
    format!("P{:?}{}", pin.port, pin.number)
}

#[test]
fn the_chip_has_every_signal_on_its_pin() {
    for pin in TABLES.iter().flat_map(|(_, pins)| *pins) {
        let function = match pin.function {
            Function::Gate(number) | Function::Alternate(number) | Function::Bus(number) => Some(number),
            Function::Analog | Function::Input | Function::Output => None,
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
        let by_software = matches!(pin.function, Function::Input | Function::Output);
        assert_eq!(pin.signals.is_empty(), by_software, "{}", name(pin));
    }
}

#[test]
fn no_pin_is_used_twice_and_none_belongs_to_the_debugger_or_the_crystal() {
    for (_, pins) in TABLES {
        let names: BTreeSet<_> = pins.iter().map(name).collect();
        assert_eq!(names.len(), pins.len());
        for taken in ["PA13", "PA14", "PA2", "PA3", "PF0", "PF1"] {
            assert!(!names.contains(taken), "{taken}");
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
    };
    format!("| {} | {} | {function} | {} |", name(pin), pin.signals.join(", "), pin.purpose)
}

#[test]
fn the_documentation_has_the_table_that_the_code_has() {
    for (page, pins) in TABLES {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(page);
        let text = std::fs::read_to_string(path).unwrap();
        let documented: Vec<_> = text.lines().filter(|line| line.starts_with("| P")).collect();
        let wanted: Vec<_> = pins.iter().map(row).collect();
        assert_eq!(documented, wanted, "the table of {page} should be:\n{}", wanted.join("\n"));
    }
}
