//! The main outputs of the PWM timers, switched together.
//!
//! MOE alone switches a timer's outputs on and off; off, all its gates are driven low (OSSI = 1, OIS = 0), whatever the compares
//! say. A break clears MOE without clock or software and sets BIF, and BIF, which nothing clears, is the latch: while
//! it is set the outputs are not switched on again. Switching off for good is a break made by software.

use super::dead_time::DeadTime;
use stm32_metapac::timer::{TimAdv, regs, vals};

/// What breaks a timer.
#[derive(Clone, Copy, Debug)]
pub struct BreakSources {
    /// Its BKIN pin is wired: low breaks.
    pub pin: bool,
    /// Numbers of the comparators that break.
    pub comparators: &'static [usize],
}

/// The PWM timers of a system.
#[derive(Clone, Copy)]
pub struct Outputs<const N: usize>(pub [TimAdv; N]);

impl<const N: usize> Outputs<N> {
    /// Break sources, dead time and off levels, which are locked with this write until the next reset. Each timer has its own sources.
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

    /// Forgets what the break inputs saw before they were wired up. Only for the start, with the outputs off.
    pub fn forget_breaks(&self) {
        for timer in self.0 {
            timer.sr().write_value(regs::SrAdv(0));
        }
    }

    /// Whether a break, from hardware or software, has switched the outputs off.
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

    /// Whether any output is on.
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
        // A break between the look and the write would be undone by the write; its latch tells.
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
