//! TIM3, the control timer: its update is the control interrupt and, as TRGO, starts ADC1 and captures the encoder.

use stm32_metapac::timer::{TimGp16, regs, vals};

/// The control timer.
#[derive(Clone, Copy)]
pub struct ControlTimer(pub TimGp16);

impl ControlTimer {
    /// Makes it ready to count as soon as TIM1 is started: it waits for TIM1's TRGO, so both count from the same instant.
    pub fn configure(&self, prescaler: u16, period_ticks: u32) {
        let timer = self.0;
        timer.cr1().write(|w| {
            w.set_arpe(true);
            w.set_urs(vals::Urs::COUNTER_ONLY);
        });
        timer.psc().write_value(prescaler - 1);
        timer.arr().write(|w| w.set_arr((period_ticks - 1) as u16));
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

    /// Number of ticks by which the control interrupt has outlived its period; 0 when in time. It was acknowledged on entry: if another update has
    /// come since, the period is over.
    #[inline]
    pub fn overrun_ticks(&self) -> u32 {
        if self.0.sr().read().uif() { u32::from(self.0.cnt().read().cnt()).max(1) } else { 0 }
    }
}
