//! The rotor's position.

use super::power_stage::PowerStage;
use crate::frames::Angle;
use stm32_metapac::timer::{TimGp16, vals};

/// A source of the electrical angle. The board has the encoder; a resolver or an absolute encoder (SSI) implements this
/// and takes its place in [`super::Control`].
pub trait Position {
    /// The angle now; `None` while it is not known, which keeps the gates off. Called in the control interrupt: it may not wait.
    fn angle(&mut self) -> Option<Angle>;
}

/// An incremental encoder with an index, counted by TIM4.
#[derive(Clone, Copy)]
pub struct Encoder {
    timer: TimGp16,
    units_per_count: u32,
    zero: Angle,
}

impl Encoder {
    /// The encoder of a machine with this many pole pairs.
    pub fn new(timer: TimGp16, stage: &PowerStage, pole_pairs: u32) -> Self {
        Self {
            timer,
            units_per_count: units_per_count(stage.encoder_counts, pole_pairs),
            zero: stage.encoder_zero,
        }
    }

    /// Counts every edge of both tracks, 0 ..= counts − 1 a turn; the index sets it to 0 in either direction.
    pub fn configure(timer: TimGp16, stage: &PowerStage) {
        timer.ccmr_input(0).write(|w| {
            for channel in [0, 1] {
                w.set_ccs(channel, vals::CcmrInputCcs::TI4);
                w.set_icf(channel, vals::FilterValue::FCK_INT_N8);
            }
        });
        timer.arr().write(|w| w.set_arr((stage.encoder_counts - 1) as u16));
        timer.smcr().write(|w| {
            w.set_sms(vals::Sms::ENCODER_MODE_3);
            w.set_etf(vals::FilterValue::FCK_INT_N8);
        });
        timer.ecr().write(|w| w.set_ie(true));
        timer.cr1().write(|w| w.set_cen(true));
    }
}

impl Position for Encoder {
    /// Known once the index has passed.
    #[inline]
    fn angle(&mut self) -> Option<Angle> {
        let known = self.timer.sr().read().idxif();
        let count = u32::from(self.timer.cnt().read().cnt());
        known.then(|| Angle(count.wrapping_mul(self.units_per_count)) + self.zero)
    }
}

/// Electrical angle units of one count, rounded; over a turn the rounding is 2⁻¹⁷ of a turn at most.
fn units_per_count(counts: u32, pole_pairs: u32) -> u32 {
    let turns = u64::from(pole_pairs) << 32;
    let counts = u64::from(counts.max(1));
    ((turns + counts / 2) / counts) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_of_the_shaft_is_as_many_electrical_turns_as_pole_pairs() {
        assert_eq!(units_per_count(4_096, 4), 1 << 22);
        let units = units_per_count(10_000, 3);
        let error = (u64::from(units) * 10_000).abs_diff(3 << 32);
        assert!(error <= 5_000, "{error}");
    }
}
