//! The nine gates: TIM1, TIM8 and TIM20, one timer per leg.
//!
//! # How a period is played
//! Each timer counts from 0 at the carrier's valley up to the peak and down again. A leg's gates are its channels' outputs:
//!
//! | gate | channel | mode |
//! |---|---|---|
//! | H | 1 | PWM mode 1: on while `CNT < CCR1` |
//! | L | 2 | PWM mode 2: on while `CNT >= CCR2` |
//! | M | 3, which 4 lends its compare | combined PWM: on while `CNT < CCR3` or `CNT >= CCR4` |
//!
//! When the timer counts down, the same compares give the mirror image. So a period consists of compares only; all are preloaded. The PWM interrupt
//! writes them at the peak; they take effect at the valley. The update event comes at both, but nothing is written between valley and peak; an
//! interrupt that ends after the valley turns the gates off for good.
//!
//! # Dead time and shoot-through
//! The three gates of a leg have no complementary relation, so the dead-time generators are used differently: each of the channels drives its output
//! **and** its complementary one, which has no pin. With both enabled the generator delays every rising edge of the output, and leaves the falling
//! ones alone. Therefore
//!
//! * a device is on only while its compares say so, whatever happens: the three devices of a leg conduct together only within the shoot-through that
//!   is played, and never beyond it;
//! * if one device of a leg goes off and another one on, all conduct the dead time later;
//! * each shoot-through begins where a device goes on, so it is shorter by the dead time, and vanishes if it is no longer than that. The link's
//!   control, which has an integral part, compensates for it with its duty;
//! * a pulse shorter than the dead time is suppressed. A leg that has only such pulses around a valley or a peak conducts through its diodes for at
//!   most four dead times.
//!
//! Dead time, breaks and off levels are locked before any pin is connected to a timer.
//!
//! # The three timers
//! They are started by one event, count the same clock and always have the same period, so they cannot drift apart. TIM8 and TIM20 follow TIM1 by the
//! few cycles of the trigger's synchroniser. The devices that the dead time separates belong to one leg, hence to one timer.

use super::HALF_CYCLES;
use super::period::{LegCompares, PeriodCompares};
use crate::dead_time::DeadTime;
use crate::outputs::{BreakSources, Outputs};
use stm32_metapac::timer::{TimAdv, regs, vals};

/// Comparators that trigger a break: six for the currents, and one for the gate drivers' ready line, because of TIM20.
pub const BREAKING: [usize; 7] = [1, 2, 3, 4, 5, 6, 7];

/// The position within the carrier.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Beat {
    /// The counters have begun to count down.
    Peak,
    /// The counters have begun to count up.
    Valley,
}

/// The legs' timers.
#[derive(Clone, Copy)]
pub struct Bridge {
    /// TIM1, TIM8, TIM20: legs U, V, W.
    pub timers: [TimAdv; 3],
}

impl Bridge {
    /// Configures everything except the start of counting: outputs off, all gates off. Call it once after a reset: its last write locks dead time,
    /// break and polarities.
    pub fn configure(&self, dead_time: DeadTime) {
        for timer in self.timers {
            timer.cr1().write(|w| {
                w.set_arpe(true);
                w.set_urs(vals::Urs::COUNTER_ONLY);
                w.set_cms(vals::Cms::CENTER_ALIGNED1);
                w.set_ckd(vals::Ckd::from_bits(dead_time.divider));
            });
            timer.psc().write_value(0);
            timer.rcr().write(|w| w.set_rep(0));
            timer.arr().write(|w| w.set_arr(HALF_CYCLES));
            timer.ccmr_output(0).write_value(preloaded([vals::Ocm::PWM_MODE1, vals::Ocm::PWM_MODE2]));
            timer
                .ccmr_output(1)
                .write_value(preloaded([vals::Ocm::COMBINED_PWM_MODE_1, vals::Ocm::COMBINED_PWM_MODE_2]));
            timer.ccer().write(|w| {
                for channel in [0, 1, 2] {
                    w.set_cce(channel, true);
                    w.set_ccne(channel, true);
                }
            });
        }
        self.play(&PeriodCompares::OFF);
        let [first, followers @ ..] = self.timers;
        first.cr2().write(|w| {
            w.set_mms(vals::Mms::UPDATE);
            w.set_mms2(vals::Mms2::UPDATE);
        });
        for timer in followers {
            // The preloaded values take effect now: the start does not cause an update.
            timer.egr().write(|w| w.set_ug(true));
            timer.smcr().write(|w| {
                w.set_ts(vals::Ts::ITR0);
                w.set_sms(vals::Sms::TRIGGER_MODE);
            });
        }
        let [with_pin, without] = [true, false].map(|pin| BreakSources { pin, comparators: &BREAKING });
        // TIM20 has no break pin in this package.
        self.outputs().lock(dead_time, [with_pin, with_pin, without]);
    }

    /// The timers' main outputs.
    #[inline]
    pub const fn outputs(&self) -> Outputs<3> {
        Outputs(self.timers)
    }

    /// Starts counting: TIM1's update by software starts every timer that waits for its TRGO.
    pub fn start(&self) {
        let [first, ..] = self.timers;
        first.dier().write(|w| w.set_uie(true));
        first.cr1().modify(|w| w.set_cen(true));
        first.egr().write(|w| w.set_ug(true));
    }

    /// Preloads the next period.
    #[inline]
    pub fn play(&self, period: &PeriodCompares) {
        for (timer, leg) in self.timers.into_iter().zip(period.legs) {
            let LegCompares { high, low, middle_from, middle_to } = leg;
            for (channel, compare) in [high, low, middle_from, middle_to].into_iter().enumerate() {
                timer.ccr(channel).write(|w| w.set_ccr(compare));
            }
        }
    }

    /// Acknowledges the PWM interrupt.
    #[inline]
    pub fn acknowledge(&self) {
        let [first, ..] = self.timers;
        // Status flags are cleared by writing 0; writing 1 leaves them alone.
        first.sr().write_value(regs::SrAdv(!1));
    }

    /// The last beat.
    #[inline]
    pub fn beat(&self) -> Beat {
        let [first, ..] = self.timers;
        if first.cr1().read().dir() == vals::Dir::DOWN { Beat::Peak } else { Beat::Valley }
    }

    /// `true` if another beat has come since [`Self::acknowledge`].
    #[inline]
    pub fn is_late(&self) -> bool {
        let [first, ..] = self.timers;
        first.sr().read().uif()
    }
}

/// A pair of channels in these modes, both compares preloaded.
fn preloaded(modes: [vals::Ocm; 2]) -> regs::CcmrOutputGp16 {
    let mut register = regs::CcmrOutputGp16(0);
    for (channel, mode) in modes.into_iter().enumerate() {
        register.set_ocm(channel, mode);
        register.set_ocpe(channel, true);
    }
    register
}
