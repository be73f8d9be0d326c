//! Dead time as the timers count it.

/// The dead time of a leg: the code of BDTR.DTG and the divider of its clock (CR1.CKD).
///
/// The generator counts the timers' undivided clock, halved or quartered by CKD, whatever the prescaler:
///
/// | DTG | dead time, in its clock's periods |
/// |---|---|
/// | `0xxx_xxxx` | x, 0 ..= 127 |
/// | `10xx_xxxx` | 2 (64 + x), 128 ..= 254 |
/// | `110x_xxxx` | 8 (32 + x), 256 ..= 504 |
/// | `111x_xxxx` | 16 (32 + x), 512 ..= 1,008 |
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DeadTime {
    /// CR1.CKD: the clock is divided by 2 to this power, 0 ..= 2.
    pub divider: u8,
    /// BDTR.DTG.
    pub code: u8,
}

/// The generator's longest time, in periods of its own clock.
const LONGEST: u32 = 1_008;

impl DeadTime {
    /// The longest dead time, in cycles of the timers' clock.
    pub const LONGEST_CYCLES: u32 = LONGEST << 2;

    /// The shortest dead time that lasts `cycles` of the timers' clock or more; `None` for 0, which protects nothing, and
    /// beyond [`Self::LONGEST_CYCLES`].
    pub const fn at_least(cycles: u32) -> Option<Self> {
        if cycles == 0 || cycles > Self::LONGEST_CYCLES {
            return None;
        }
        // A divided clock can be the finer one: each of its ranges reaches twice as far with the same steps.
        let mut best: Option<Self> = None;
        let mut divider = 0;
        while divider <= 2 {
            let periods = cycles.div_ceil(1 << divider);
            if periods <= LONGEST {
                let found = Self { divider, code: code(periods) };
                best = match best {
                    Some(best) if best.cycles() <= found.cycles() => Some(best),
                    _ => Some(found),
                };
            }
            divider += 1;
        }
        best
    }

    /// The dead time of the code, in cycles of the timers' clock.
    pub const fn cycles(self) -> u32 {
        let code = self.code as u32;
        let periods = match code >> 5 {
            0..=3 => code,
            4 | 5 => 2 * (64 + (code & 0x3F)),
            6 => 8 * (32 + (code & 0x1F)),
            _ => 16 * (32 + (code & 0x1F)),
        };
        periods << self.divider
    }
}

/// The code for a number of periods, 0 ..= 1,008, rounded up.
const fn code(periods: u32) -> u8 {
    let code = match periods {
        0..=127 => periods,
        128..=254 => 0x80 | (periods.div_ceil(2) - 64),
        255..=504 => 0xC0 | (periods.div_ceil(8) - 32),
        _ => 0xE0 | (periods.div_ceil(16) - 32),
    };
    code as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_means_its_own_time() {
        for divider in 0..=2 {
            let mut last = None;
            for code in 0..=u8::MAX {
                let cycles = DeadTime { divider, code }.cycles();
                assert!(last < Some(cycles), "code {code:#x} is no longer than the one before");
                last = Some(cycles);
            }
            assert_eq!(last, Some(LONGEST << divider));
        }
    }

    #[test]
    fn every_number_of_periods_gets_the_shortest_code_that_is_long_enough() {
        let cycles = |code| DeadTime { divider: 0, code }.cycles();
        for periods in 0..=LONGEST {
            let best = (0..=u8::MAX).map(cycles).filter(|time| *time >= periods).min();
            assert_eq!(Some(cycles(code(periods))), best, "{periods}");
        }
    }

    #[test]
    fn every_time_gets_the_shortest_code_that_is_long_enough() {
        for cycles in 1..=DeadTime::LONGEST_CYCLES {
            let found = DeadTime::at_least(cycles).unwrap();
            let codes = (0..=2).flat_map(|divider| (0..=u8::MAX).map(move |code| DeadTime { divider, code }));
            let best = codes.map(DeadTime::cycles).filter(|time| *time >= cycles).min();
            assert_eq!(Some(found.cycles()), best, "{cycles}");
        }
    }

    #[test]
    fn no_time_and_too_long_a_time_are_refused() {
        assert_eq!(DeadTime::at_least(0), None);
        assert_eq!(DeadTime::at_least(DeadTime::LONGEST_CYCLES + 1), None);
    }
}
