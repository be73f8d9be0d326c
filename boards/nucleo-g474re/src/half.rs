//! A carrier half in the form that the timers' shadow registers take.
//!
//! Each leg has two compares. It is at the upper level while the counter is below the first **or** at or above the second:
//! `CNT < fall || CNT >= rise`. That is a pair of channels in the combined PWM modes. A half that starts high falls at `fall` and never rises; one
//! that starts low has `fall` = 0 and rises at `rise`. So start level and toggle are nothing but compare values, which all take effect together at
//! the update event.

use tractive::modulation::{CarrierHalf, Mode};

pub use super::rates::LONGEST_HALF_TICKS;

/// A compare that the counter never reaches.
pub const NEVER: u16 = u16::MAX;

/// The two compares of a leg.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LegCompares {
    /// The leg is high below this count.
    pub fall: u16,
    /// The leg is high from this count on.
    pub rise: u16,
}

impl LegCompares {
    /// One level for the whole half.
    pub const fn steady(high: bool) -> Self {
        Self { fall: if high { NEVER } else { 0 }, rise: NEVER }
    }

    /// A level that toggles `compare_ticks` after the start of a half with so many ticks; at its end and beyond it stays. Leg W's counter may pass the end:
    /// its reset is a trigger's.
    pub const fn toggling(start_high: bool, compare_ticks: u32, period_ticks: u32) -> Self {
        let toggle = if compare_ticks < period_ticks { compare_ticks as u16 } else { NEVER };
        if start_high { Self { fall: toggle, rise: NEVER } } else { Self { fall: 0, rise: toggle } }
    }

    /// `true` if the leg is high while the counter stands at `count`.
    pub const fn is_high(self, count: u16) -> bool {
        count < self.fall || count >= self.rise
    }
}

/// The register values of a half.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HalfRegisters {
    /// ARR: the counter's last value.
    pub reload: u16,
    /// The legs U, V, W.
    pub legs: [LegCompares; 3],
}

impl HalfRegisters {
    /// Made of the modulator's half. While the gates are off the legs keep the levels `held`, so that no device turns on between the half's beginning
    /// and the moment when software switches the outputs off.
    ///
    /// A half is 1 ..= [`LONGEST_HALF_TICKS`] long; longer ones would be cut, which the board's start rules out.
    pub fn new(half: &CarrierHalf, held: [bool; 3]) -> Self {
        let mut legs = held.map(LegCompares::steady);
        if half.mode != Mode::Off {
            let phases = half.start_levels.into_iter().zip(half.compare_ticks);
            for (leg, (start_high, compare_ticks)) in legs.iter_mut().zip(phases) {
                *leg = LegCompares::toggling(start_high, compare_ticks, half.period_ticks);
            }
        }
        Self { reload: reload(half.period_ticks), legs }
    }

    /// The levels at which the half ends.
    pub fn end_levels(&self) -> [bool; 3] {
        self.legs.map(|leg| leg.is_high(self.reload))
    }
}

/// ARR for a half of this length.
pub const fn reload(period_ticks: u32) -> u16 {
    let ticks = if period_ticks < LONGEST_HALF_TICKS { period_ticks } else { LONGEST_HALF_TICKS };
    ticks.saturating_sub(1) as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Levels tick by tick, as the half itself defines them.
    fn wanted(half: &CarrierHalf, phase: usize, tick: u32) -> bool {
        half.start_levels[phase] != (tick >= half.compare_ticks[phase])
    }

    #[test]
    fn every_tick_of_a_half_has_its_level() {
        let period_ticks = 9;
        for start in [false, true] {
            for compare in [0, 1, 4, 8, 9, 10, 65_534, 65_535, 65_536, u32::MAX] {
                let half = CarrierHalf {
                    period_ticks,
                    compare_ticks: [compare; 3],
                    start_levels: [start; 3],
                    mode: Mode::Async,
                    ..CarrierHalf::default()
                };
                let registers = HalfRegisters::new(&half, [false; 3]);
                assert_eq!(registers.reload, 8);
                for tick in 0..period_ticks {
                    let level = registers.legs[0].is_high(tick as u16);
                    assert_eq!(level, wanted(&half, 0, tick), "{start} {compare} {tick}");
                }
                assert_eq!(registers.end_levels(), [wanted(&half, 0, period_ticks - 1); 3]);
            }
        }
    }

    #[test]
    fn the_longest_half_still_has_a_level_without_an_edge() {
        let half =
            CarrierHalf { period_ticks: LONGEST_HALF_TICKS, mode: Mode::Square, ..CarrierHalf::off(1) };
        let registers = HalfRegisters::new(&half, [true; 3]);
        assert_eq!(registers.end_levels(), [false; 3]);
        assert!((0..=registers.reload).all(|count| LegCompares::steady(true).is_high(count)));
        assert!(!(0..=registers.reload).any(|count| LegCompares::steady(false).is_high(count)));
    }

    #[test]
    fn an_off_half_holds_what_was() {
        let held = [true, false, true];
        let registers = HalfRegisters::new(&CarrierHalf::off(100), held);
        assert_eq!((registers.reload, registers.end_levels()), (99, held));
    }
}
