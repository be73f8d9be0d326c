//! The main outputs of the PWM timers, switched together.
//!
//! MOE alone switches a timer's outputs on and off. When off, all its gates are driven low (OSSI = 1, OIS = 0), whatever the compares say. A break
//! clears MOE without clock or software and sets BIF. BIF, which nothing clears, is the latch: while it is set the outputs are not switched on again.
//! Switching off for good is a break made by software.

use super::dead_time::DeadTime;
use stm32_metapac::timer::{TimAdv, regs, vals};

/// The sources of a timer's break.
#[derive(Clone, Copy, Debug)]
pub struct BreakSources {
    /// `true` if its BKIN pin is wired: low breaks.
    pub pin: bool,
    /// Numbers of the comparators that break.
    pub comparators: &'static [usize],
}

/// The software cause of a break.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u16)]
pub enum SoftwareBreak {
    /// The drive has named a fault.
    Drive = 1,
    /// The PWM interrupt ended too late, or was missed.
    Late = 2,
}

/// The PWM timers of a system.
#[derive(Clone, Copy)]
pub struct Outputs<const N: usize>(pub [TimAdv; N]);

impl<const N: usize> Outputs<N> {
    /// Sets break sources, dead time and off levels; this write locks them until the next reset. Each timer has its own sources.
    pub fn lock(&self, dead_time: DeadTime, sources: [BreakSources; N]) {
        for (timer, sources) in self.0.into_iter().zip(sources) {
            timer.af1().write(|w| {
                w.set_bkine(sources.pin);
                w.set_bkinp(vals::Bkinp::INVERTED);
                for comparator in sources.comparators {
                    w.set_bkcmpe(comparator - 1, true);
                }
            });
            timer.bdtr().write(|w| {
                w.set_dtg(dead_time.code);
                w.set_ossi(vals::Ossi::IDLE_LEVEL);
                w.set_ossr(vals::Ossr::IDLE_LEVEL);
                w.set_bke(0, true);
                w.set_bkp(0, vals::Bkp::ACTIVE_HIGH);
                w.set_lock(vals::Lock::LEVEL2);
            });
        }
    }

    /// Clears what the break inputs saw before they were wired up. Only for the start, with the outputs off.
    pub fn forget_breaks(&self) {
        for timer in self.0 {
            timer.sr().write_value(regs::SrAdv(0));
        }
    }

    /// `true` if a break, from hardware or software, has switched the outputs off.
    #[inline]
    pub fn is_tripped(&self) -> bool {
        self.0.into_iter().any(|timer| {
            let status = timer.sr().read();
            status.bif(0) || status.bif(1) || status.sbif()
        })
    }

    /// Switches the outputs off for good, as a break input would.
    #[inline]
    pub fn trip(&self) {
        for timer in self.0 {
            timer.egr().write(|w| w.set_bg(0, true));
        }
    }

    /// The same, with the software cause kept in the last timer's sixth compare, which has no output.
    #[inline]
    pub fn trip_by(&self, software: SoftwareBreak) {
        if !self.is_tripped() {
            self.note(software as u16);
        }
        self.trip();
    }

    /// The software cause of a break; `None` if the hardware was first.
    #[inline]
    pub fn software_break(&self) -> Option<SoftwareBreak> {
        match self.0.last()?.ccr6().read().ccr() {
            1 => Some(SoftwareBreak::Drive),
            2 => Some(SoftwareBreak::Late),
            _ => None,
        }
    }

    #[inline]
    fn note(&self, value: u16) {
        if let Some(timer) = self.0.last() {
            timer.ccr6().write(|w| w.set_ccr(value));
        }
    }

    /// `true` if the chip's own break occurred: crystal, lock-up, memory.
    #[inline]
    pub fn is_system_break(&self) -> bool {
        self.0.into_iter().any(|timer| timer.sr().read().sbif())
    }

    /// The timers that have latched a break, one bit each from the first on.
    #[inline]
    pub fn broken(&self) -> u16 {
        self.0.into_iter().rev().fold(0, |bits, timer| {
            let status = timer.sr().read();
            bits << 1 | u16::from(status.bif(0) || status.bif(1) || status.sbif())
        })
    }

    /// Clears a break, outputs off. `false` while the cause lasts, because it sets the flag again.
    #[inline]
    pub fn leave(&self) -> bool {
        self.switch_off();
        self.note(0);
        for timer in self.0 {
            timer.sr().write_value(all_but_breaks());
        }
        !self.is_tripped()
    }

    /// `true` if any output is on.
    pub fn is_on(&self) -> bool {
        self.0.into_iter().any(|timer| timer.bdtr().read().moe())
    }

    /// Switches the outputs on, unless a break is latched.
    #[inline]
    pub fn switch_on(&self) {
        if self.is_tripped() {
            return;
        }
        self.set_main_output(true);
        // The write would undo a break that came after the check above; its latch tells.
        if self.is_tripped() {
            self.trip();
        }
    }

    /// Switches the outputs off for a while.
    #[inline]
    pub fn switch_off(&self) {
        self.set_main_output(false);
    }

    #[inline]
    fn set_main_output(&self, on: bool) {
        for timer in self.0 {
            timer.bdtr().modify(|w| w.set_moe(on));
        }
    }
}

/// Status flags are cleared by writing 0; writing 1 leaves them alone. Here: the flags of the breaks.
fn all_but_breaks() -> regs::SrAdv {
    let mut flags = regs::SrAdv(u32::MAX);
    flags.set_bif(0, false);
    flags.set_bif(1, false);
    flags.set_sbif(false);
    flags
}
