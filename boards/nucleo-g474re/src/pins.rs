//! The pins and their purposes: the one table from which the pins are configured and with which the documentation is compared.

use super::registers::Registers;
use stm32_metapac::gpio::Gpio;
use stm32_metapac::gpio::vals::{Idr, Moder, Ospeedr, Pupdr};

/// A port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the letters are the ports' names")]
pub enum Port {
    A,
    B,
    C,
    D,
}

/// The connection of a pin inside the chip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Function {
    /// A gate: alternate function of this number, output.
    Gate(u8),
    /// Alternate function of this number, with pull-down.
    Alternate(u8),
    /// Converters and comparators.
    Analog,
    /// Read by software, with pull-down.
    Input,
    /// Written by software, high at first.
    Output,
    /// Written by software, low at first: switches something on when high.
    Switch,
    /// A bus: alternate function of this number, with pull-up, so that it rests.
    Bus(u8),
}

/// A pin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pin {
    /// Port.
    pub port: Port,
    /// Number within the port, 0 ..= 15.
    pub number: u8,
    /// Connection.
    pub function: Function,
    /// The chip's names of what it is connected to.
    pub signals: &'static [&'static str],
    /// The wire connected to it.
    pub purpose: &'static str,
}

pub(super) const fn pin(
    port: Port,
    number: u8,
    function: Function,
    signals: &'static [&'static str],
    purpose: &'static str,
) -> Pin {
    Pin { port, number, function, signals, purpose }
}

/// Every pin that the PMaSynRM's drive uses, except those of its [position sensor](super::Position::PINS).
pub const PINS: [Pin; 26] = [
    pin(Port::A, 8, Function::Gate(6), &["TIM1_CH1"], "gate U, upper device"),
    pin(Port::B, 13, Function::Gate(6), &["TIM1_CH1N"], "gate U, lower device"),
    pin(Port::A, 10, Function::Gate(6), &["TIM1_CH3"], "gate V, upper device"),
    pin(Port::B, 15, Function::Gate(4), &["TIM1_CH3N"], "gate V, lower device"),
    pin(Port::C, 6, Function::Gate(4), &["TIM8_CH1"], "gate W, upper device"),
    pin(Port::C, 10, Function::Gate(4), &["TIM8_CH1N"], "gate W, lower device"),
    pin(Port::B, 12, Function::Alternate(6), &["TIM1_BKIN"], "gate drivers ready, low turns U and V off"),
    pin(Port::A, 6, Function::Alternate(4), &["TIM8_BKIN"], "the same wire, low turns W off"),
    pin(Port::A, 1, Function::Analog, &["ADC1_IN2", "COMP1_INP"], "current of U"),
    pin(Port::A, 7, Function::Analog, &["ADC2_IN4", "COMP2_INP"], "current of U, the same wire"),
    pin(Port::C, 1, Function::Analog, &["ADC2_IN7", "COMP3_INP"], "current of V"),
    pin(Port::B, 0, Function::Analog, &["ADC1_IN15", "COMP4_INP"], "current of V, the same wire"),
    pin(Port::B, 11, Function::Analog, &["ADC2_IN14", "COMP6_INP"], "current of W"),
    pin(Port::B, 14, Function::Analog, &["ADC1_IN5", "COMP7_INP"], "current of W, the same wire"),
    pin(Port::C, 0, Function::Analog, &["ADC1_IN6"], "DC-link voltage"),
    pin(Port::A, 0, Function::Analog, &["ADC1_IN1"], "winding's temperature sensor"),
    pin(Port::C, 3, Function::Analog, &["ADC1_IN9"], "heat sink's temperature sensor"),
    pin(Port::C, 2, Function::Input, &[], "enable: high lets the gates pulse"),
    pin(Port::C, 8, Function::Switch, &[], "precharge relay, high closes"),
    pin(Port::C, 9, Function::Switch, &[], "main contactor, high closes"),
    pin(Port::C, 11, Function::Switch, &[], "discharge resistor, high switches it on"),
    pin(Port::B, 9, Function::Gate(1), &["TIM17_CH1"], "braking chopper, high conducts"),
    pin(Port::C, 4, Function::Input, &[], "precharge relay's auxiliary contact, high: closed"),
    pin(Port::C, 5, Function::Input, &[], "main contactor's auxiliary contact, high: closed"),
    pin(Port::A, 11, Function::Bus(9), &["FDCAN1_RX"], "CAN transceiver, RXD"),
    pin(Port::A, 12, Function::Bus(9), &["FDCAN1_TX"], "CAN transceiver, TXD"),
];

/// A wire to the switchgear.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Wire {
    port: Port,
    /// Number within the port.
    pub(super) number: usize,
}

/// The wires of a system's switchgear.
#[derive(Clone, Copy, Debug)]
pub struct Wires {
    pub(super) precharge: Wire,
    pub(super) main: Wire,
    pub(super) discharge: Wire,
    pub(super) precharge_contact: Wire,
    pub(super) main_contact: Wire,
}

/// The PMaSynRM drive's switchgear.
pub const SWITCHGEAR: Wires = Wires {
    precharge: Wire::new(Port::C, 8),
    main: Wire::new(Port::C, 9),
    discharge: Wire::new(Port::C, 11),
    precharge_contact: Wire::new(Port::C, 4),
    main_contact: Wire::new(Port::C, 5),
};

impl Wire {
    /// A pin.
    pub(super) const fn new(port: Port, number: usize) -> Self {
        Self { port, number }
    }

    pub(super) const fn port(self, registers: &Registers) -> Gpio {
        self.port.of(registers)
    }

    /// Sets an output with a write that touches no other pin.
    pub(super) fn set(self, registers: &Registers, high: bool) {
        let (port, number) = (self.port.of(registers), self.number);
        port.bsrr().write(|w| if high { w.set_bs(number, true) } else { w.set_br(number, true) });
    }
}

/// The chopper's compare at which it never conducts.
pub(super) const CHOPPER_OFF: u16 = 0;

/// Inputs of the gate drivers' ready wire: PB12, and PA6 for leg W.
const DRIVERS_READY: usize = 12;
const DRIVERS_READY_W: usize = 6;

/// `true` if the gate drivers signal at both break inputs that they are ready.
#[inline]
pub fn drivers_ready(registers: &Registers) -> bool {
    is_high(registers.gpiob, DRIVERS_READY) && is_high(registers.gpioa, DRIVERS_READY_W)
}

/// The enable input.
const ENABLE: usize = 2;

impl Port {
    /// The port's registers.
    pub const fn of(self, registers: &Registers) -> Gpio {
        match self {
            Self::A => registers.gpioa,
            Self::B => registers.gpiob,
            Self::C => registers.gpioc,
            Self::D => registers.gpiod,
        }
    }
}

impl Pin {
    /// `true` if it drives a gate.
    pub const fn is_gate(&self) -> bool {
        matches!(self.function, Function::Gate(_))
    }

    /// `true` if it belongs to a bus.
    pub const fn is_bus(&self) -> bool {
        matches!(self.function, Function::Bus(_))
    }
}

/// Configures every pin of the table that drives no gate and belongs to no bus.
pub fn configure_inputs(registers: &Registers, pins: &[Pin]) {
    pins.iter().filter(|pin| !pin.is_gate() && !pin.is_bus()).for_each(|pin| configure(registers, pin));
}

/// Gives a bus its pins, while its controller is at rest.
pub fn configure_bus(registers: &Registers, pins: &[Pin]) {
    pins.iter().filter(|pin| pin.is_bus()).for_each(|pin| configure(registers, pin));
}

/// Gives the gates' pins to the timers, which drive them low as long as their outputs are off. Until then the pins float, as after a reset: each gate
/// driver needs its own pull-down.
pub fn configure_gates(registers: &Registers, pins: &[Pin]) {
    pins.iter().filter(|pin| pin.is_gate()).for_each(|pin| configure(registers, pin));
}

/// Takes the switches' pins from software for good: they become inputs with pull-down, as the external pull-downs hold them after a reset, so that no
/// later command reaches what they switch.
pub fn release_switches(registers: &Registers, pins: &[Pin]) {
    for pin in pins.iter().filter(|pin| pin.function == Function::Switch) {
        // A port has sixteen pins: nothing here may panic, because the program is about to stop.
        let (port, number) = (pin.port.of(registers), usize::from(pin.number & 15));
        port.pupdr().modify(|w| w.set_pupdr(number, Pupdr::PULL_DOWN));
        port.moder().modify(|w| w.set_moder(number, Moder::INPUT));
    }
}

/// `true` while the enable input is high.
#[inline]
pub fn is_enabled(registers: &Registers) -> bool {
    is_high(registers.gpioc, ENABLE)
}

/// `true` while an input is high.
#[inline]
pub(super) fn is_high(port: Gpio, number: usize) -> bool {
    port.idr().read().idr(number) == Idr::HIGH
}

fn configure(registers: &Registers, pin: &Pin) {
    let port = pin.port.of(registers);
    let number = usize::from(pin.number);
    let (mode, pull) = match pin.function {
        Function::Gate(_) | Function::Alternate(_) => (Moder::ALTERNATE, Pupdr::PULL_DOWN),
        Function::Analog => (Moder::ANALOG, Pupdr::FLOATING),
        Function::Input => (Moder::INPUT, Pupdr::PULL_DOWN),
        Function::Output | Function::Switch => (Moder::OUTPUT, Pupdr::FLOATING),
        Function::Bus(_) => (Moder::ALTERNATE, Pupdr::PULL_UP),
    };
    if pin.function == Function::Output {
        port.bsrr().write(|w| w.set_bs(number, true));
    }
    if pin.function == Function::Switch {
        port.bsrr().write(|w| w.set_br(number, true));
    }
    port.pupdr().modify(|w| w.set_pupdr(number, pull));
    if pin.function == Function::Output {
        port.ospeedr().modify(|w| w.set_ospeedr(number, Ospeedr::MEDIUM_SPEED));
    }
    if let Function::Gate(function) | Function::Alternate(function) | Function::Bus(function) = pin.function {
        port.ospeedr().modify(|w| w.set_ospeedr(number, Ospeedr::MEDIUM_SPEED));
        port.afr(number / 8).modify(|w| w.set_afr(number % 8, function));
    }
    port.moder().modify(|w| w.set_moder(number, mode));
}
