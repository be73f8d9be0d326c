//! The peripherals the board uses, as values: the chip's own, or blocks of memory in a test.

use super::legs::Legs;
use stm32_metapac as pac;

/// Handles to register blocks. They are copied freely; who writes what is said where it is written.
#[derive(Clone, Copy)]
#[allow(missing_docs, reason = "the names are the reference manual's")]
pub struct Registers {
    pub rcc: pac::rcc::Rcc,
    pub pwr: pac::pwr::Pwr,
    pub flash: pac::flash::Flash,
    pub syscfg: pac::syscfg::Syscfg,
    pub dbgmcu: pac::dbgmcu::Dbgmcu,
    pub gpioa: pac::gpio::Gpio,
    pub gpiob: pac::gpio::Gpio,
    pub gpioc: pac::gpio::Gpio,
    /// TIM1 and TIM8.
    pub legs: Legs,
    /// Control timer.
    pub tim3: pac::timer::TimGp16,
    /// Encoder.
    pub tim4: pac::timer::TimGp16,
    /// Samples of the control interrupt.
    pub adc1: pac::adc::Adc,
    /// Samples of the PWM interrupt.
    pub adc2: pac::adc::Adc,
    pub adc12: pac::adccommon::AdcCommon,
    /// COMP1 ..= COMP7.
    pub comparators: [pac::comp::Comp; 7],
    pub dac3: pac::dac::Dac,
    pub dac4: pac::dac::Dac,
    pub iwdg: pac::iwdg::Iwdg,
}

impl Registers {
    /// The chip's.
    pub const CHIP: Self = Self {
        rcc: pac::RCC,
        pwr: pac::PWR,
        flash: pac::FLASH,
        syscfg: pac::SYSCFG,
        dbgmcu: pac::DBGMCU,
        gpioa: pac::GPIOA,
        gpiob: pac::GPIOB,
        gpioc: pac::GPIOC,
        legs: Legs { tim1: pac::TIM1, tim8: pac::TIM8 },
        tim3: pac::TIM3,
        tim4: pac::TIM4,
        adc1: pac::ADC1,
        adc2: pac::ADC2,
        adc12: pac::ADC12_COMMON,
        comparators: [pac::COMP1, pac::COMP2, pac::COMP3, pac::COMP4, pac::COMP5, pac::COMP6, pac::COMP7],
        dac3: pac::DAC3,
        dac4: pac::DAC4,
        iwdg: pac::IWDG,
    };
}
