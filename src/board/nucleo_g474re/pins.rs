//! Which pin does what: the one table, from which the pins are configured and with which the documentation is compared.

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

/// What a pin is connected to inside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Function {
    /// A gate: alternate function of this number, output.
    Gate(u8),
    /// Alternate function of this number, input with pull-down.
    Alternate(u8),
    /// Converters and comparators.
    Analog,
    /// Read by software, with pull-down.
    Input,
    /// Written by software, high at first.
    Output,
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
    /// What is to be wired to it.
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

/// Every pin the PMaSynRM's drive uses.
pub const PINS: [Pin; 19] = [
    pin(Port::A, 8, Function::Gate(6), &["TIM1_CH1"], "gate U, upper device"),
    pin(Port::B, 13, Function::Gate(6), &["TIM1_CH1N"], "gate U, lower device"),
    pin(Port::A, 10, Function::Gate(6), &["TIM1_CH3"], "gate V, upper device"),
    pin(Port::B, 15, Function::Gate(4), &["TIM1_CH3N"], "gate V, lower device"),
    pin(Port::C, 6, Function::Gate(4), &["TIM8_CH1"], "gate W, upper device"),
    pin(Port::C, 10, Function::Gate(4), &["TIM8_CH1N"], "gate W, lower device"),
    pin(Port::B, 12, Function::Alternate(6), &["TIM1_BKIN"], "gate drivers ready, low turns U and V off"),
    pin(Port::A, 6, Function::Alternate(4), &["TIM8_BKIN"], "the same wire, low turns W off"),
    pin(Port::A, 1, Function::Analog, &["ADC1_IN2", "ADC2_IN2", "COMP1_INP"], "current of U"),
    pin(Port::A, 7, Function::Analog, &["COMP2_INP"], "current of U, the same wire"),
    pin(Port::C, 1, Function::Analog, &["ADC1_IN7", "ADC2_IN7", "COMP3_INP"], "current of V"),
    pin(Port::B, 0, Function::Analog, &["COMP4_INP"], "current of V, the same wire"),
    pin(Port::B, 11, Function::Analog, &["ADC1_IN14", "ADC2_IN14", "COMP6_INP"], "current of W"),
    pin(Port::B, 14, Function::Analog, &["COMP7_INP"], "current of W, the same wire"),
    pin(Port::C, 0, Function::Analog, &["ADC1_IN6", "ADC2_IN6"], "DC-link voltage"),
    pin(Port::B, 6, Function::Alternate(2), &["TIM4_CH1"], "encoder, track A"),
    pin(Port::B, 7, Function::Alternate(2), &["TIM4_CH2"], "encoder, track B"),
    pin(Port::B, 3, Function::Alternate(2), &["TIM4_ETR"], "encoder, index"),
    pin(Port::C, 2, Function::Input, &[], "enable: high lets the gates pulse"),
];

/// The enable input.
const ENABLE: usize = 2;

impl Port {
    /// Its registers.
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
    /// Whether it drives a gate.
    pub const fn is_gate(&self) -> bool {
        matches!(self.function, Function::Gate(_))
    }
}

/// Configures every pin of the table that drives no gate.
pub fn configure_inputs(registers: &Registers, pins: &[Pin]) {
    pins.iter().filter(|pin| !pin.is_gate()).for_each(|pin| configure(registers, pin));
}

/// Gives the gates' pins to the timers, which drive them low as long as their outputs are off. Until then the pins float, as
/// after a reset: each gate driver needs a pull-down of its own.
pub fn configure_gates(registers: &Registers, pins: &[Pin]) {
    pins.iter().filter(|pin| pin.is_gate()).for_each(|pin| configure(registers, pin));
}

/// Whether the enable input is high.
#[inline]
pub fn is_enabled(registers: &Registers) -> bool {
    is_high(registers.gpioc, ENABLE)
}

/// Whether an input is high.
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
        Function::Output => (Moder::OUTPUT, Pupdr::FLOATING),
    };
    if pin.function == Function::Output {
        port.bsrr().write(|w| w.set_bs(number, true));
    }
    port.pupdr().modify(|w| w.set_pupdr(number, pull));
    if let Function::Gate(function) | Function::Alternate(function) = pin.function {
        port.ospeedr().modify(|w| w.set_ospeedr(number, Ospeedr::MEDIUM_SPEED));
        port.afr(number / 8).modify(|w| w.set_afr(number % 8, function));
    }
    port.moder().modify(|w| w.set_moder(number, mode));
}
