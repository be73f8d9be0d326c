//! The independent watchdog: a reset, which turns the gates off, unless both interrupts keep running.

use super::registers::Registers;
use super::start::{StartError, Wait};
use core::sync::atomic::{AtomicBool, Ordering};
use stm32_metapac::iwdg;

/// Time without feeding before the reset, in counts of 32 kHz / 4: 20 ms, several of the slowest carrier halves.
pub const RELOAD: u16 = 160;

/// Starts the watchdog; only a reset stops it.
pub fn start(registers: &Registers, wait: &mut dyn Wait) -> Result<(), StartError> {
    let iwdg = registers.iwdg;
    iwdg.kr().write(|w| w.set_key(iwdg::vals::Key::START));
    iwdg.kr().write(|w| w.set_key(iwdg::vals::Key::ENABLE));
    iwdg.pr().write(|w| w.set_pr(iwdg::vals::Pr::DIVIDE_BY4));
    iwdg.rlr().write(|w| w.set_rl(RELOAD));
    wait.until(&mut || iwdg.sr().read().0 == 0).or(Err(StartError::Watchdog))?;
    feed(registers);
    Ok(())
}

/// An error if the watchdog caused the last reset of the chip; reported once.
pub fn refuse_after_bite(registers: &Registers) -> Result<(), StartError> {
    let bitten = registers.rcc.csr().read().iwdgrstf();
    registers.rcc.csr().modify(|w| w.set_rmvf(true));
    if bitten { Err(StartError::WatchdogReset) } else { Ok(()) }
}

fn feed(registers: &Registers) {
    registers.iwdg.kr().write(|w| w.set_key(iwdg::vals::Key::RESET));
}

/// The interrupts that have run since the watchdog was last fed.
#[derive(Debug)]
pub struct Pulse {
    control: AtomicBool,
    pwm: AtomicBool,
}

impl Pulse {
    /// Neither has run.
    pub const fn new() -> Self {
        Self { control: AtomicBool::new(false), pwm: AtomicBool::new(false) }
    }

    /// At the end of the control interrupt.
    #[inline]
    pub fn control_ran(&self) {
        self.control.store(true, Ordering::Relaxed);
    }

    /// At the end of the PWM interrupt.
    #[inline]
    pub fn pwm_ran(&self) {
        self.pwm.store(true, Ordering::Relaxed);
    }

    /// Called in the idle loop: feeds the watchdog if both have run since the last time, and says so.
    pub fn feed_if_both_ran(&self, registers: &Registers) -> bool {
        let both = self.control.load(Ordering::Relaxed) && self.pwm.load(Ordering::Relaxed);
        if both {
            self.control.store(false, Ordering::Relaxed);
            self.pwm.store(false, Ordering::Relaxed);
            feed(registers);
        }
        both
    }
}
