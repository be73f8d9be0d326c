//! The clock tree: 170 MHz for the core, both buses and all timers, from the 24 MHz crystal.

use super::registers::Registers;
use super::start::{StartError, Wait};
use stm32_metapac::{flash, rcc};

/// PWR_CR2.PLS: the supply threshold below which the gates go off, some 2.9 V, the highest one. Comparators and converters use the supply as their
/// reference.
const SUPPLY_THRESHOLD: u8 = 6;

/// PWR_CR5.R1MODE (RM0440): bit 8, set after a reset. The register crate places it in bit 0, which is unused.
const NORMAL_MODE: u32 = 1 << 8;

/// Removes USB's dead-battery pull-downs of 5.1 kΩ from PB4 and PB6. They are active from reset on, controlled by PA9 and PA10; all these pins have
/// other uses here (RM0440, PWR_CR3.UCPD1_DBDIS). The power controller is clocked from here on.
pub fn release_dead_battery(registers: &Registers, wait: &mut dyn Wait) {
    registers.rcc.apb1enr1().modify(|w| w.set_pwren(true));
    // A peripheral accepts writes only some cycles after its clock has been enabled.
    wait.microseconds(1);
    registers.pwr.cr3().modify(|w| w.set_ucpd1_dbdis(true));
}

/// 24 MHz / 6 · 85 / 2 = 170 MHz, with the wait states and the core voltage that this needs. If the crystal stops later, the clock security system
/// triggers a break of the PWM timers in hardware.
pub fn configure(registers: &Registers, wait: &mut dyn Wait) -> Result<(), StartError> {
    let Registers { rcc, pwr, flash, .. } = *registers;
    pwr.cr2().modify(|w| {
        w.set_pls(SUPPLY_THRESHOLD);
        w.set_pvde(true);
    });
    // Boost mode: range 1 without it ends at 150 MHz. The bit's name says normal mode.
    pwr.cr5().modify(|w| w.0 &= !NORMAL_MODE);
    flash.acr().modify(|w| {
        w.set_latency(flash::vals::Latency::WS4);
        w.set_prften(true);
        w.set_icen(true);
        w.set_dcen(true);
    });
    wait.until(&mut || flash.acr().read().latency() == flash::vals::Latency::WS4)
        .or(Err(StartError::FlashLatency))?;
    rcc.cr().modify(|w| w.set_hseon(true));
    wait.until(&mut || rcc.cr().read().hserdy()).or(Err(StartError::Crystal))?;
    rcc.pllcfgr().write(|w| {
        w.set_pllsrc(rcc::vals::Pllsrc::HSE);
        w.set_pllm(rcc::vals::Pllm::DIV6);
        w.set_plln(rcc::vals::Plln::MUL85);
        w.set_pllr(rcc::vals::Pllr::DIV2);
        w.set_pllren(true);
    });
    rcc.cr().modify(|w| w.set_pllon(true));
    wait.until(&mut || rcc.cr().read().pllrdy()).or(Err(StartError::Pll))?;
    // Above 150 MHz the buses have to run at half the frequency for a microsecond first.
    rcc.cfgr().write(|w| {
        w.set_hpre(rcc::vals::Hpre::DIV2);
        w.set_sw(rcc::vals::Sw::PLL1_R);
    });
    wait.until(&mut || rcc.cfgr().read().sws() == rcc::vals::Sw::PLL1_R).or(Err(StartError::ClockSwitch))?;
    wait.microseconds(1);
    rcc.cfgr().modify(|w| w.set_hpre(rcc::vals::Hpre::DIV1));
    rcc.cr().modify(|w| w.set_csson(true));
    Ok(())
}

/// Enables the clocks of the peripherals. Timers and processor stop together under a debugger, and stopped PWM and chopper timers have their outputs
/// off. The watchdog runs on: it resets a halted chip, which opens the contactors too. A locked-up processor, a bad memory word or a low supply
/// triggers a break of the timers.
pub fn enable_peripherals(registers: &Registers, wait: &mut dyn Wait) {
    let Registers { rcc, syscfg, dbgmcu, .. } = *registers;
    rcc.ahb2enr().modify(|w| {
        w.set_gpioaen(true);
        w.set_gpioben(true);
        w.set_gpiocen(true);
        w.set_gpioden(true);
        w.set_adc12en(true);
        w.set_adc345en(true);
        w.set_dac3en(true);
        w.set_dac4en(true);
    });
    rcc.apb1enr1().modify(|w| {
        w.set_tim2en(true);
        w.set_tim3en(true);
        w.set_tim4en(true);
        w.set_spi3en(true);
    });
    rcc.apb2enr().modify(|w| {
        w.set_syscfgen(true);
        w.set_tim1en(true);
        w.set_tim8en(true);
        w.set_tim17en(true);
        w.set_tim20en(true);
    });
    wait.microseconds(1);
    dbgmcu.apb2fzr().modify(|w| {
        w.set_tim1(true);
        w.set_tim8(true);
        w.set_tim17(true);
        w.set_tim20(true);
    });
    dbgmcu.apb1lfzr().modify(|w| {
        w.set_tim2(true);
        w.set_tim3(true);
    });
    syscfg.cfgr2().modify(|w| {
        w.set_cll(true);
        w.set_eccl(true);
        w.set_pvdl(true);
    });
}
