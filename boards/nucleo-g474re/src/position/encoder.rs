//! An incremental encoder with an index.
//!
//! Hardware captures the encoder's count at the control timer's update, the instant at which the currents are sampled: channel 3 of the encoder's
//! timer captures the internal trigger TRC, which TS selects; the encoder mode leaves TS free (RM0440, general-purpose timers: encoder interface,
//! "latching the counter value into a third input capture register", and TIMx_CCMR2.CC3S = 11).

use super::Position;
use crate::pins::{Function, Pin, Port, pin};
use crate::power_stage::PowerStage;
use crate::registers::Registers;
use crate::start::{StartError, Wait};
use stm32_metapac::timer::{TimGp16, regs, vals};
use tractive::frames::Angle;
use tractive::machine::Ratings;
use tractive::start_up::axis_error;

/// An incremental encoder with an index, counted by TIM4.
#[derive(Clone, Copy)]
pub struct Encoder {
    ratings: &'static Ratings,
    timer: TimGp16,
    units_per_count: u32,
    counts: u32,
    zero: Angle,
    /// Count at the last call and counts since the one before, once the index has passed.
    last: Option<(u32, u32)>,
    /// `true` if the last call has seen the index. Its count may be older than the index: the next one is not.
    passed: bool,
    lost: bool,
    /// Before the index: the counted angle, and its change in the last call.
    counted: Angle,
    moved: Angle,
    /// The angle at count 0, if it was found before the index.
    found: Option<Angle>,
    /// The rest of the error of that angle, after the index.
    left: Angle,
}

/// Share of that error that is left after each call, as a number of bits: the angle is corrected over some hundreds of calls, without a step.
const MENDING_BITS: u32 = 7;

/// The channel that captures the count, from 0.
const CAPTURE: usize = 2;

/// TS of an encoder on TIM4 captured by TIM3; of encoders on TIM3 and TIM4 captured by TIM2 (RM0440, internal trigger connection).
pub const TIM4_BY_TIM3: vals::Ts = vals::Ts::ITR2;
/// See [`TIM4_BY_TIM3`].
pub const BY_TIM2: vals::Ts = vals::Ts::ITR1;

/// By how many counts an index pulse may be off: acceleration within a control period, and the filters' delays.
const INDEX_TOLERANCE: u32 = 8;

impl Encoder {
    /// The encoder of a machine.
    pub fn new(timer: TimGp16, stage: &PowerStage, ratings: &'static Ratings) -> Self {
        let units_per_count = units_per_count(stage.encoder_counts, ratings.pole_pairs as u32);
        Self {
            ratings,
            timer,
            units_per_count,
            counts: stage.encoder_counts.max(1),
            // The middle of a count, not its beginning.
            zero: stage.encoder_zero + Angle(units_per_count / 2),
            last: None,
            passed: false,
            lost: false,
            counted: Angle::ZERO,
            moved: Angle::ZERO,
            found: None,
            left: Angle::ZERO,
        }
    }

    /// Counts every edge of both tracks, 0 ..= counts − 1 per turn; the index sets it to 0 in either direction. Each `trigger`, the control timer's
    /// TRGO, captures the count. The index counts at one state of the tracks only.
    pub fn configure(timer: TimGp16, stage: &PowerStage, trigger: vals::Ts) {
        timer.ccmr_input(0).write(|w| {
            for channel in [0, 1] {
                w.set_ccs(channel, vals::CcmrInputCcs::TI4);
                w.set_icf(channel, vals::FilterValue::FCK_INT_N8);
            }
        });
        timer.ccmr_input(1).write(|w| w.set_ccs(0, vals::CcmrInputCcs::TRC));
        timer.arr().write(|w| w.set_arr((stage.encoder_counts - 1) as u16));
        // TS may change only while no mode uses it.
        timer.smcr().write(|w| w.set_ts(trigger));
        timer.smcr().modify(|w| {
            w.set_sms(vals::Sms::ENCODER_MODE_3);
            w.set_etf(vals::FilterValue::FCK_INT_N8);
        });
        timer.ecr().write(|w| {
            w.set_ie(true);
            w.set_ipos(stage.encoder_index_ab);
        });
        timer.ccer().write(|w| w.set_cce(CAPTURE, true));
        timer.cr1().write(|w| w.set_cen(true));
    }
}

impl Position for Encoder {
    const PINS: &'static [Pin] = &[
        pin(Port::B, 6, Function::Alternate(2), &["TIM4_CH1"], "encoder, track A"),
        pin(Port::B, 7, Function::Alternate(2), &["TIM4_CH2"], "encoder, track B"),
        pin(Port::B, 3, Function::Alternate(2), &["TIM4_ETR"], "encoder, index"),
    ];

    fn prepare(registers: &Registers, stage: &PowerStage, _wait: &mut dyn Wait) -> Result<(), StartError> {
        Self::configure(registers.tim4, stage, TIM4_BY_TIM3);
        Ok(())
    }

    fn of(registers: &Registers, stage: &PowerStage, ratings: &'static Ratings) -> Self {
        Self::new(registers.tim4, stage, ratings)
    }

    /// Known from the second call after the index on: the flag is read, not captured, so an index between the capture and the reading shows in the
    /// next count. Called every control period: each further index must come at a count that the speed makes possible; otherwise counts were lost
    /// or added, and the angle is lost for good.
    #[inline]
    fn angle(&mut self) -> Option<Angle> {
        let index = self.timer.sr().read().idxif();
        let count = u32::from(self.timer.ccr(CAPTURE).read().ccr());
        if index {
            // Status flags are cleared by writing 0; writing 1 leaves them alone.
            let mut all_but_index = regs::SrGp16(u32::MAX);
            all_but_index.set_idxif(false);
            self.timer.sr().write_value(all_but_index);
        }
        let passed = core::mem::replace(&mut self.passed, index);
        let turned = Angle(count.wrapping_mul(self.units_per_count));
        let left = self.left.signed();
        self.left = Angle(left.wrapping_sub(left >> MENDING_BITS) as u32);
        self.last = match self.last {
            None if !passed => return self.before_index(turned, index),
            None => {
                if let Some(found) = self.found {
                    let error = self.counted + self.moved + found - (turned + self.zero);
                    self.left = axis_error(self.ratings, error);
                    self.zero = self.zero + error - self.left;
                }
                Some((count, 0))
            }
            Some((before, moved)) => {
                let moves = self.wrapped(count + self.counts - before);
                let off = self.wrapped(moves + self.counts - moved);
                self.lost |= (index || passed)
                    && off > INDEX_TOLERANCE
                    && off < self.counts.saturating_sub(INDEX_TOLERANCE);
                Some((count, moves))
            }
        };
        Some(turned + self.zero + self.left)
    }

    fn counted(&self) -> Option<Angle> {
        (self.last.is_none() && self.found.is_none()).then_some(self.counted)
    }

    fn align(&mut self, zero: Angle) {
        self.found = self.found.or(Some(zero));
    }

    #[inline]
    fn is_lost(&self) -> bool {
        self.lost
    }
}

impl Encoder {
    /// The angle before the index, if it has been found. A count that comes with the index flag may be from before or after the index: then the rotor
    /// is assumed to have turned on.
    #[cold]
    fn before_index(&mut self, turned: Angle, index: bool) -> Option<Angle> {
        if !index {
            self.moved = turned - self.counted;
        }
        self.counted = self.counted + self.moved;
        self.found.map(|found| self.counted + found)
    }

    /// Reduces a count of less than two turns to less than one.
    #[inline]
    fn wrapped(&self, counts: u32) -> u32 {
        if counts >= self.counts { counts - self.counts } else { counts }
    }
}

/// Electrical angle units per count, rounded; over a turn the rounding error is 2⁻¹⁷ of a turn at most.
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
        // 429,496.7296: rounded to the nearest.
        assert_eq!(units_per_count(10_000, 1), 429_497);
    }
}
