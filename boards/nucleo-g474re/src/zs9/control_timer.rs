//! TIM2, the control timer: its update is the control interrupt and, as TRGO, captures both encoders.

use stm32_metapac::timer::{TimGp32, regs, vals};

/// The control timer.
#[derive(Clone, Copy)]
pub struct ControlTimer(pub TimGp32);

impl ControlTimer {
    /// Makes it ready to count as soon as TIM1 is started: it waits for TIM1's TRGO, so both count from the same valley.
    pub fn configure(&self, prescaler: u16, period_ticks: u32) {
        let timer = self.0;
        timer.cr1().write(|w| {
            w.set_arpe(true);
            w.set_urs(vals::Urs::COUNTER_ONLY);
        });
        timer.psc().write_value(prescaler - 1);
        timer.arr().write_value(period_ticks - 1);
        // The prescaler is taken over at an update, and the start does not cause one.
        timer.egr().write(|w| w.set_ug(true));
        timer.cr2().write(|w| w.set_mms(vals::Mms::UPDATE));
        timer.smcr().write(|w| {
            w.set_ts(vals::Ts::ITR0);
            w.set_sms(vals::Sms::TRIGGER_MODE);
        });
        timer.dier().write(|w| w.set_uie(true));
    }

    /// Acknowledges the control interrupt: status flags are cleared by writing 0; writing 1 leaves them alone.
    #[inline]
    pub fn acknowledge(&self) {
        self.0.sr().write_value(regs::SrGp16(!1));
    }

    /// Number of ticks by which the control interrupt has outlived `deadline_ticks`; 0 when in time. It was acknowledged on entry: if another update
    /// has come since, one more period has passed.
    #[inline]
    pub fn overrun_ticks(&self, deadline_ticks: u32, period_ticks: u32) -> u32 {
        let count = self.0.cnt().read();
        let age = if self.0.sr().read().uif() { count + period_ticks } else { count };
        age.saturating_sub(deadline_ticks)
    }
}
