//! The peripherals the board uses, as values: the chip's own, or blocks of memory in a test.

use super::legs::Legs;
use stm32_metapac as pac;

/// Handles to register blocks. They are copied freely; each place that writes says so.
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
    pub gpiod: pac::gpio::Gpio,
    /// TIM1 and TIM8.
    pub legs: Legs,
    /// The ZS9's third leg.
    pub tim20: pac::timer::TimAdv,
    /// The braking chopper's timer.
    pub tim17: pac::timer::Tim1chCmp,
    /// The ZS9's control timer.
    pub tim2: pac::timer::TimGp32,
    /// Control timer; the ZS9's second encoder.
    pub tim3: pac::timer::TimGp16,
    /// Encoder.
    pub tim4: pac::timer::TimGp16,
    /// Samples of the control interrupt; with the ZS9 those of both interrupts.
    pub adc1: pac::adc::Adc,
    /// Samples of the PWM interrupt; with the ZS9 those of both interrupts.
    pub adc2: pac::adc::Adc,
    /// The ZS9's inductor current; a resolver's sine.
    pub adc3: pac::adc::Adc,
    /// A resolver's cosine.
    pub adc5: pac::adc::Adc,
    pub adc12: pac::adccommon::AdcCommon,
    pub adc345: pac::adccommon::AdcCommon,
    /// A BiSS encoder's frames.
    pub dma1: pac::bdma::Dma,
    pub dmamux1: pac::dmamux::Dmamux,
    /// An absolute encoder.
    pub spi1: pac::spi::Spi,
    /// The ZS9's gate feedback.
    pub spi3: pac::spi::Spi,
    /// COMP1 ..= COMP7.
    pub comparators: [pac::comp::Comp; 7],
    pub dac3: pac::dac::Dac,
    pub dac4: pac::dac::Dac,
    pub iwdg: pac::iwdg::Iwdg,
}

impl Registers {
    /// The chip's own.
    pub const CHIP: Self = Self {
        rcc: pac::RCC,
        pwr: pac::PWR,
        flash: pac::FLASH,
        syscfg: pac::SYSCFG,
        dbgmcu: pac::DBGMCU,
        gpioa: pac::GPIOA,
        gpiob: pac::GPIOB,
        gpioc: pac::GPIOC,
        gpiod: pac::GPIOD,
        legs: Legs { tim1: pac::TIM1, tim8: pac::TIM8 },
        tim20: pac::TIM20,
        tim17: pac::TIM17,
        tim2: pac::TIM2,
        tim3: pac::TIM3,
        tim4: pac::TIM4,
        adc1: pac::ADC1,
        adc2: pac::ADC2,
        adc3: pac::ADC3,
        adc5: pac::ADC5,
        adc12: pac::ADC12_COMMON,
        adc345: pac::ADC345_COMMON,
        dma1: pac::DMA1,
        dmamux1: pac::DMAMUX1,
        spi1: pac::SPI1,
        spi3: pac::SPI3,
        comparators: [pac::COMP1, pac::COMP2, pac::COMP3, pac::COMP4, pac::COMP5, pac::COMP6, pac::COMP7],
        dac3: pac::DAC3,
        dac4: pac::DAC4,
        iwdg: pac::IWDG,
    };
}
