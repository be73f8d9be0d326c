//! The messages between the interrupts.

use crate::cell::{Record, Words};
use crate::frames::{Abc, AlphaBeta, SQRT_3};
use crate::modulation::{CarrierHalf, MODE_CODES, Mode};
use crate::time::Instant;

/// The order of control to the gates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Gates {
    /// Pulses.
    Pulse,
    /// All off.
    Off,
}

/// From control to the PWM interrupt: the half to be loaded at a boundary, and what else the interrupt must know.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PlannedHalf {
    /// The boundary at which it is loaded; the half begins at the boundary after it.
    pub at: Instant,
    /// The half.
    pub half: CarrierHalf,
    /// Number of the last release: a new one makes the PWM interrupt forget its fault and leave the safe state.
    pub release: u8,
    /// Angle units (2⁻³² turn) per tick by which the voltage turns, and the DC-link voltage, in V; both serve to choose the safe state.
    pub rate: f32,
    /// See `rate`.
    pub udc_v: f32,
}

/// Words of a [`PlannedHalf`] in its cell.
pub const PLANNED_WORDS: usize = 9;

impl Words<PLANNED_WORDS> for PlannedHalf {
    #[inline]
    fn to_words(self) -> [u32; PLANNED_WORDS] {
        let [period, u, v, w, packed] = half_to_words(self.half);
        let (rate, udc) = (self.rate.to_bits(), self.udc_v.to_bits());
        [self.at.0, period, u, v, w, packed, self.release.into(), rate, udc]
    }

    #[inline]
    fn from_words(words: [u32; PLANNED_WORDS]) -> Self {
        let [at, period, u, v, w, packed, release, rate, udc] = words;
        Self {
            at: Instant(at),
            half: half_from_words([period, u, v, w, packed]),
            release: release as u8,
            rate: f32::from_bits(rate),
            udc_v: f32::from_bits(udc),
        }
    }
}

/// A [`PlannedHalf`] where it is stored.
pub struct PlannedRecord<'a>(pub Record<'a, PLANNED_WORDS>);

impl PlannedRecord<'_> {
    /// See [`PlannedHalf::at`].
    #[inline]
    pub fn at(&self) -> Instant {
        Instant(self.0.word::<0>())
    }

    /// See [`PlannedHalf::half`]; without the modes of the following halves, which no board asks for.
    #[inline]
    pub fn half(&self) -> CarrierHalf {
        let packed = self.0.word::<5>() & ((1 << NEXT) - 1);
        let [period, u, v, w] =
            [self.0.word::<1>(), self.0.word::<2>(), self.0.word::<3>(), self.0.word::<4>()];
        half_from_words([period, u, v, w, packed])
    }

    /// `true` if the gates are off in this half.
    #[inline]
    pub fn is_off(&self) -> bool {
        mode_at(self.0.word::<5>(), MODE) == Mode::Off as u32
    }

    /// See [`PlannedHalf::release`].
    #[inline]
    pub fn release(&self) -> u8 {
        self.0.word::<6>() as u8
    }

    /// See [`PlannedHalf::rate`].
    #[inline]
    pub fn rate(&self) -> f32 {
        f32::from_bits(self.0.word::<7>())
    }

    /// DC-link voltage, in V.
    #[inline]
    pub fn udc_v(&self) -> f32 {
        f32::from_bits(self.0.word::<8>())
    }
}

/// From the PWM interrupt to control, one record per boundary: the samples there, and the fact that a half was loaded, which begins at the next
/// boundary.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Loaded {
    /// The boundary.
    pub at: Instant,
    /// The boundary at which the loaded half begins.
    pub begins: Instant,
    /// Phase currents at the boundary, in A.
    pub currents_a: Abc,
    /// `true` once the PWM interrupt has found a fault, which then stands in a cell of its own; from then on it loads halves without pulses, whatever
    /// is planned.
    pub tripped: bool,
    /// Number of the release carried out last.
    pub released: u8,
}

/// Words of a [`Loaded`] in its cell.
pub const LOADED_WORDS: usize = 6;

const TRIPPED: u32 = 1 << 8;

impl Loaded {
    /// As a record.
    #[inline]
    pub fn to_words(&self) -> [u32; LOADED_WORDS] {
        let [a, b, c] = self.currents_a.to_bits();
        let flags = u32::from(self.released) | (u32::from(self.tripped) * TRIPPED);
        [self.at.0, self.begins.0, flags, a, b, c]
    }
}

/// A [`Loaded`] where it is stored.
pub struct LoadedRecord<'a>(pub Record<'a, LOADED_WORDS>);

impl LoadedRecord<'_> {
    /// See [`Loaded::at`].
    #[inline]
    pub fn at(&self) -> Instant {
        Instant(self.0.word::<0>())
    }

    /// See [`Loaded::begins`].
    #[inline]
    pub fn begins(&self) -> Instant {
        Instant(self.0.word::<1>())
    }

    /// See [`Loaded::tripped`] and [`Loaded::released`].
    #[inline]
    pub fn tripped_and_released(&self) -> (bool, u8) {
        let flags = self.0.word::<2>();
        (flags & TRIPPED != 0, flags as u8)
    }

    /// See [`Loaded::currents_a`].
    #[inline]
    pub fn currents_a(&self) -> Abc {
        Abc::from_bits([self.0.word::<3>(), self.0.word::<4>(), self.0.word::<5>()])
    }
}

/// Positions of modes and number in the word of a half, above its levels; a mode's code has six bits.
const MODE: u32 = 5;
const NUMBER: u32 = 11;
const NEXT: u32 = 19;
const NEXT_BUT_ONE: u32 = 25;
const _: () = assert!(MODE_CODES << MODE <= 1 << NUMBER && 1 << (NUMBER + 8) <= 1 << NEXT);
const _: () = assert!(MODE_CODES << NEXT <= 1 << NEXT_BUT_ONE && MODE_CODES << (NEXT_BUT_ONE - 1) <= 1 << 31);

/// The mode at a position in a word.
#[inline(always)]
const fn mode_at(word: u32, place: u32) -> u32 {
    word >> place & (MODE_CODES - 1)
}

/// The space vector of on-times in ticks; multiplied by the link voltage it gives volt-ticks.
#[inline]
pub fn volt_ticks([a, b, c]: [u32; 3]) -> AlphaBeta {
    let (a, b, c) = (a as i32, b as i32, c as i32);
    let whole = |ticks: i32| ticks as f32;
    AlphaBeta {
        alpha: whole(a.wrapping_sub(b).wrapping_add(a.wrapping_sub(c))) * (1.0 / 3.0),
        beta: whole(b.wrapping_sub(c)) * (1.0 / SQRT_3),
    }
}

/// A carrier half as five words: period, three compares, and levels, modes and number packed.
#[inline]
pub fn half_to_words(half: CarrierHalf) -> [u32; 5] {
    let [u, v, w] = half.compare_ticks;
    let [lu, lv, lw] = half.start_levels.map(u32::from);
    let [first, second] = half.ahead.map(|mode| mode as u32);
    let packed = lu | lv << 1 | lw << 2 | (half.mode as u32) << MODE | u32::from(half.half) << NUMBER;
    let packed = packed | first << NEXT | second << NEXT_BUT_ONE;
    [half.period_ticks, u, v, w, packed]
}

/// The inverse of [`half_to_words`].
#[inline]
pub fn half_from_words(words: [u32; 5]) -> CarrierHalf {
    let [period_ticks, u, v, w, packed] = words;
    CarrierHalf {
        period_ticks,
        compare_ticks: [u, v, w],
        start_levels: [packed & 1 != 0, packed & 2 != 0, packed & 4 != 0],
        mode: Mode::from_code(mode_at(packed, MODE)),
        half: (packed >> NUMBER) as u8,
        ahead: [NEXT, NEXT_BUT_ONE].map(|place| Mode::from_code(mode_at(packed, place))),
    }
}
