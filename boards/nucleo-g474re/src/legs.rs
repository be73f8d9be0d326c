//! The three legs: TIM1 and TIM8 as one PWM timer.
//!
//! # How a half is played
//! Both timers count up, one period per carrier half. Leg U is TIM1's channel pair 1 and 2, V its pair 3 and 4, W TIM8's pair 1 and 2. The odd
//! channel of a pair is in combined PWM mode 1 and drives the outputs OCx and OCxN; the even one is in combined PWM mode 2 and only lends its
//! compare: `CNT < CCRodd || CNT >= CCReven`. So a half's start levels and toggles are compare values, and no mode bit ever changes from half to
//! half.
//!
//! # What is shadowed
//! | taken over at the update event | at once |
//! |---|---|
//! | ARR (ARPE), CCR1 ..= CCR4 (OCxPE), PSC (always) | OCxM, CCxE, CCxNE (CCPC = 0: no COM event is needed), MOE, the dead time |
//!
//! [`Legs::play`] writes ARR and compares only, so everything about a half changes in the same clock. Registers that act at once are written only at
//! the start and to leave normal operation.
//!
//! # TIM8
//! Each update of TIM1 is its TRGO, which resets TIM8 and makes it take over its own compares (combined reset and trigger mode). TIM8's own reload is
//! never reached, so the two cannot drift apart. W follows U and V by the few cycles of the trigger's synchroniser, always the same number.
//!
//! # On and off
//! See [`super::outputs`].

use super::dead_time::DeadTime;
use super::half::{HalfRegisters, LegCompares, NEVER};
pub use super::outputs::SoftwareBreak;
use super::outputs::{BreakSources, Outputs};
use stm32_metapac::timer::{TimAdv, regs, vals};

/// Numbers of the comparators that break the timers.
pub const BREAKING: [usize; 6] = [1, 2, 3, 4, 6, 7];

/// A leg's channel pair.
const FIRST_PAIR: usize = 0;
const SECOND_PAIR: usize = 1;

/// The two timers.
#[derive(Clone, Copy)]
pub struct Legs {
    /// Legs U and V, the carrier, the PWM interrupt.
    pub tim1: TimAdv,
    /// Leg W.
    pub tim8: TimAdv,
}

impl Legs {
    /// Configures everything except the start of counting: outputs off, all legs low, halves of `reload` + 1 ticks. Call it once after a reset: its
    /// last write locks dead time, break and polarities.
    pub fn configure(&self, prescaler: u16, dead_time: DeadTime, reload: u16) {
        // TIM8 has no interrupt that an update by its trigger could raise; with URS set, the reset mode makes none, says one page of RM0440.
        for (timer, interrupts) in [(self.tim1, vals::Urs::COUNTER_ONLY), (self.tim8, vals::Urs::ANY_EVENT)] {
            timer.cr1().write(|w| {
                w.set_arpe(true);
                w.set_urs(interrupts);
                w.set_ckd(vals::Ckd::from_bits(dead_time.divider));
            });
            timer.psc().write_value(prescaler - 1);
            timer.ccmr_output(FIRST_PAIR).write_value(combined());
        }
        self.tim1.ccmr_output(SECOND_PAIR).write_value(combined());
        self.tim1.rcr().write(|w| w.set_rep(0));
        self.tim1.arr().write(|w| w.set_arr(reload));
        self.tim8.arr().write(|w| w.set_arr(NEVER));
        self.write_compares(&[LegCompares::steady(false); 3]);
        self.tim1.ccer().write_value(driven(&[0, 2]));
        self.tim8.ccer().write_value(driven(&[0]));
        self.tim1.cr2().write(|w| {
            w.set_mms(vals::Mms::UPDATE);
            w.set_mms2(vals::Mms2::UPDATE);
        });
        self.tim8.smcr().write(|w| {
            w.set_ts(vals::Ts::ITR0);
            w.set_sms(vals::Sms::COMBINED_RESET_TRIGGER);
        });
        let sources = BreakSources { pin: true, comparators: &BREAKING };
        self.outputs().lock(dead_time, [sources; 2]);
    }

    /// The timers' main outputs.
    pub const fn outputs(&self) -> Outputs<2> {
        Outputs([self.tim1, self.tim8])
    }

    /// Starts counting: TIM1's update by software takes over what is preloaded, and its TRGO starts every timer that waits for it.
    pub fn start(&self) {
        self.tim1.dier().write(|w| w.set_uie(true));
        self.tim1.cr1().modify(|w| w.set_cen(true));
        self.tim1.egr().write(|w| w.set_ug(true));
    }

    /// Preloads the next half.
    #[inline]
    pub fn play(&self, half: &HalfRegisters) {
        self.tim1.arr().write(|w| w.set_arr(half.reload));
        self.write_compares(&half.legs);
    }

    #[inline]
    fn write_compares(&self, [u, v, w]: &[LegCompares; 3]) {
        let write =
            |timer: TimAdv, channel: usize, value: u16| timer.ccr(channel).write(|w| w.set_ccr(value));
        write(self.tim1, 0, u.fall);
        write(self.tim1, 1, u.rise);
        write(self.tim1, 2, v.fall);
        write(self.tim1, 3, v.rise);
        write(self.tim8, 0, w.fall);
        write(self.tim8, 1, w.rise);
    }

    /// Acknowledges the PWM interrupt.
    #[inline]
    pub fn acknowledge(&self) {
        self.tim1.sr().write_value(all_but_update());
    }

    /// `true` if an update has come since the last [`Self::acknowledge`].
    #[inline]
    pub fn has_updated(&self) -> bool {
        self.tim1.sr().read().uif()
    }

    /// Switches the outputs on, unless a break is latched or the lower devices short-circuit the machine.
    #[inline]
    pub fn switch_on(&self) {
        if !self.is_short_circuited() {
            self.outputs().switch_on();
        }
    }

    /// Switches the outputs off for a while, unless the lower devices short-circuit the machine.
    #[inline]
    pub fn switch_off(&self) {
        if !self.is_short_circuited() {
            self.outputs().switch_off();
        }
    }

    /// `true` while the outputs are on.
    pub fn is_on(&self) -> bool {
        self.outputs().is_on()
    }

    /// Switches the outputs off for good, as a break input would.
    #[inline]
    pub fn trip(&self) {
        self.outputs().trip();
    }

    /// The same, with the software cause recorded.
    #[inline]
    pub fn trip_by(&self, software: SoftwareBreak) {
        self.outputs().trip_by(software);
    }

    /// The software cause of a break; `None` if the hardware was first.
    #[inline]
    pub fn software_break(&self) -> Option<SoftwareBreak> {
        self.outputs().software_break()
    }

    /// `true` if a break, from hardware or software, has switched the outputs off.
    #[inline]
    pub fn is_tripped(&self) -> bool {
        self.outputs().is_tripped()
    }

    /// Clears a break or a short circuit: outputs off, legs played again. `false` while the cause of a break lasts, because it sets the flag again.
    #[inline]
    pub fn leave(&self) -> bool {
        self.outputs().switch_off();
        self.tim1.ccmr_output(FIRST_PAIR).write_value(combined());
        self.tim1.ccmr_output(SECOND_PAIR).write_value(combined());
        self.tim8.ccmr_output(FIRST_PAIR).write_value(combined());
        self.outputs().leave()
    }

    /// Turns the three lower devices on for good, unless a break is latched that the drive has not made. The dead time passes first, in hardware.
    #[inline]
    pub fn short_circuit(&self) {
        if self.software_break() == Some(SoftwareBreak::Drive) {
            self.leave();
        }
        if self.is_tripped() {
            return;
        }
        self.tim1.ccmr_output(FIRST_PAIR).write_value(forced_low());
        self.tim1.ccmr_output(SECOND_PAIR).write_value(forced_low());
        self.tim8.ccmr_output(FIRST_PAIR).write_value(forced_low());
        self.outputs().switch_on();
    }

    /// `true` if the lower devices are commanded to short-circuit the machine.
    #[inline]
    pub fn is_short_circuited(&self) -> bool {
        self.tim1.ccmr_output(FIRST_PAIR).read().ocm(0) == vals::Ocm::FORCE_INACTIVE
    }
}

/// A pair that acts as one leg, both compares preloaded.
fn combined() -> regs::CcmrOutputGp16 {
    pair(vals::Ocm::COMBINED_PWM_MODE_1)
}

/// Forces the leg low at once, whatever the compares say.
fn forced_low() -> regs::CcmrOutputGp16 {
    pair(vals::Ocm::FORCE_INACTIVE)
}

fn pair(odd: vals::Ocm) -> regs::CcmrOutputGp16 {
    let mut modes = regs::CcmrOutputGp16(0);
    modes.set_ocm(0, odd);
    modes.set_ocm(1, vals::Ocm::COMBINED_PWM_MODE_2);
    modes.set_ocpe(0, true);
    modes.set_ocpe(1, true);
    modes
}

/// Enables output and complementary output of these channels, active high.
fn driven(channels: &[usize]) -> regs::CcerAdv {
    let mut enabled = regs::CcerAdv(0);
    for channel in channels {
        enabled.set_cce(*channel, true);
        enabled.set_ccne(*channel, true);
    }
    enabled
}

/// Status flags are cleared by writing 0; writing 1 leaves them alone.
const fn all_but_update() -> regs::SrAdv {
    regs::SrAdv(!1)
}
