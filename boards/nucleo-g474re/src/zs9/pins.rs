//! The ZS9's wiring: the one table from which the pins are configured and with which the documentation is compared.

use crate::pins::{Function, Pin, Port, Wire, is_high, pin};
use crate::registers::Registers;
use crate::switchgear::Wires;

/// Every pin that the ZS9's drive uses.
pub const PINS: [Pin; 38] = [
    pin(Port::A, 8, Function::Gate(6), &["TIM1_CH1"], "gate UH"),
    pin(Port::A, 10, Function::Gate(6), &["TIM1_CH3"], "gate UM"),
    pin(Port::A, 9, Function::Gate(6), &["TIM1_CH2"], "gate UL"),
    pin(Port::C, 6, Function::Gate(4), &["TIM8_CH1"], "gate VH"),
    pin(Port::B, 9, Function::Gate(10), &["TIM8_CH3"], "gate VM"),
    pin(Port::C, 7, Function::Gate(4), &["TIM8_CH2"], "gate VL"),
    pin(Port::B, 2, Function::Gate(3), &["TIM20_CH1"], "gate WH"),
    pin(Port::C, 8, Function::Gate(6), &["TIM20_CH3"], "gate WM"),
    pin(Port::C, 2, Function::Gate(6), &["TIM20_CH2"], "gate WL"),
    pin(Port::B, 12, Function::Alternate(6), &["TIM1_BKIN"], "gate drivers ready, low turns leg U off"),
    pin(Port::A, 6, Function::Alternate(4), &["TIM8_BKIN"], "the same wire, low turns leg V off"),
    pin(Port::B, 13, Function::Analog, &["COMP5_INP"], "the same wire, below 1.2 V turns all legs off"),
    pin(Port::A, 1, Function::Analog, &["ADC1_IN2", "COMP1_INP"], "upper motor, current of U"),
    pin(Port::C, 1, Function::Analog, &["ADC1_IN7", "COMP3_INP"], "upper motor, current of V"),
    pin(Port::B, 11, Function::Analog, &["ADC2_IN14", "COMP6_INP"], "upper motor, current of W"),
    pin(Port::B, 0, Function::Analog, &["ADC1_IN15", "COMP4_INP"], "lower motor, current of U"),
    pin(Port::B, 14, Function::Analog, &["ADC1_IN5", "COMP7_INP"], "lower motor, current of V"),
    pin(Port::A, 7, Function::Analog, &["ADC2_IN4", "COMP2_INP"], "lower motor, current of W"),
    pin(Port::C, 0, Function::Analog, &["ADC2_IN6"], "capacitor voltage"),
    pin(Port::C, 3, Function::Analog, &["ADC2_IN9"], "source voltage"),
    pin(Port::B, 1, Function::Analog, &["ADC3_IN1"], "inductor current"),
    pin(Port::B, 6, Function::Alternate(2), &["TIM4_CH1"], "upper motor's encoder, track A"),
    pin(Port::B, 7, Function::Alternate(2), &["TIM4_CH2"], "upper motor's encoder, track B"),
    pin(Port::B, 3, Function::Alternate(2), &["TIM4_ETR"], "upper motor's encoder, index"),
    pin(Port::B, 4, Function::Alternate(2), &["TIM3_CH1"], "lower motor's encoder, track A"),
    pin(Port::B, 5, Function::Alternate(2), &["TIM3_CH2"], "lower motor's encoder, track B"),
    pin(Port::D, 2, Function::Alternate(2), &["TIM3_ETR"], "lower motor's encoder, index"),
    pin(Port::C, 10, Function::Alternate(6), &["SPI3_SCK"], "gate feedback, clock"),
    pin(Port::C, 11, Function::Alternate(6), &["SPI3_MISO"], "gate feedback, data"),
    pin(Port::A, 15, Function::Output, &[], "gate feedback, select, low while it is read"),
    pin(Port::C, 4, Function::Input, &[], "enable: high lets the gates pulse"),
    pin(Port::B, 10, Function::Switch, &[], "precharge relay, high closes"),
    pin(Port::B, 15, Function::Switch, &[], "main contactor, high closes"),
    pin(Port::C, 9, Function::Switch, &[], "discharge resistor, high switches it on"),
    pin(Port::C, 5, Function::Input, &[], "precharge relay's auxiliary contact, high: closed"),
    pin(Port::C, 12, Function::Input, &[], "main contactor's auxiliary contact, high: closed"),
    pin(Port::A, 11, Function::Bus(9), &["FDCAN1_RX"], "CAN transceiver, RXD"),
    pin(Port::A, 12, Function::Bus(9), &["FDCAN1_TX"], "CAN transceiver, TXD"),
];

/// The ZS9's switchgear.
pub const SWITCHGEAR: Wires = Wires {
    precharge: Wire::new(Port::B, 10),
    main: Wire::new(Port::B, 15),
    discharge: Wire::new(Port::C, 9),
    precharge_contact: Wire::new(Port::C, 5),
    main_contact: Wire::new(Port::C, 12),
};

/// `true` while the enable input is high.
#[inline]
pub fn is_enabled(registers: &Registers) -> bool {
    is_high(registers.gpioc, 4)
}
