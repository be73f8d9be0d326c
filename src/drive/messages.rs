//! The messages between the interrupts.

use crate::cell::{Record, Words};
use crate::frames::{Abc, AlphaBeta, Angle, SQRT_3};
use crate::modulation::{CarrierHalf, MODE_CODES, Mode, Reference};
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

/// From control to the modulator.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct VoltageCommand {
    /// The fundamental; its `at` is the sample's instant.
    pub reference: Reference,
    /// From when on the command may be used: a fixed time after its sample, whenever the task really finished.
    pub valid_from: Instant,
    /// The order to make pulses at all.
    pub gates: Gates,
    /// `true` if it is for the half that is already committed, not for the one after it.
    pub revises: bool,
    /// Number of the last release: a new one makes the PWM interrupt forget its fault and leave the safe state.
    pub release: u8,
}

impl VoltageCommand {
    /// Of a command where it lies, from when on it may be used.
    #[inline]
    pub fn valid_from(record: &Record<10>) -> Instant {
        Instant(record.word::<8>())
    }
}

impl Words<10> for VoltageCommand {
    fn to_words(self) -> [u32; 10] {
        let reference = self.reference;
        [
            reference.voltage_v.to_bits(),
            reference.vector.alpha.to_bits(),
            reference.vector.beta.to_bits(),
            reference.carrier_angle.0,
            reference.rate.to_bits(),
            reference.at.0,
            reference.udc_v.to_bits(),
            reference.depth.to_bits(),
            self.valid_from.0,
            u32::from(self.gates == Gates::Pulse)
                | u32::from(self.revises) << 1
                | u32::from(self.release) << 8,
        ]
    }

    fn from_words(words: [u32; 10]) -> Self {
        let [voltage, alpha, beta, carrier_angle, rate, at, udc, depth, valid_from, flags] = words;
        Self {
            reference: Reference {
                voltage_v: f32::from_bits(voltage),
                vector: AlphaBeta { alpha: f32::from_bits(alpha), beta: f32::from_bits(beta) },
                carrier_angle: Angle(carrier_angle),
                rate: f32::from_bits(rate),
                at: Instant(at),
                udc_v: f32::from_bits(udc),
                depth: f32::from_bits(depth),
            },
            valid_from: Instant(valid_from),
            gates: if flags & 1 != 0 { Gates::Pulse } else { Gates::Off },
            revises: flags & 2 != 0,
            release: (flags >> 8) as u8,
        }
    }
}

/// From the modulator to control, one record a boundary: the samples there, and the half that was committed there, which begins
/// at the next boundary. What is running at a boundary stands in the record before.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Committal {
    /// The boundary.
    pub at: Instant,
    /// Phase currents there, in A.
    pub currents_a: Abc,
    /// The boundary where `half` begins.
    pub begins: Instant,
    /// The half.
    pub half: CarrierHalf,
    /// `true` while the modulator sees the machine in the mirror (turning backward).
    pub mirrored: bool,
    /// `true` once the PWM interrupt has found a fault; it then stands in a cell of its own.
    pub tripped: bool,
    /// Number of the release that it carried out last.
    pub released: u8,
}

/// Words of a [`Committal`] in its cell.
pub const COMMITTAL_WORDS: usize = 13;

const MIRRORED: u32 = 1 << 3;
const TRIPPED: u32 = 1 << 4;

/// Places of modes and number in the word of a half, above its flags; a mode's code has six bits.
const MODE: u32 = 5;
const NUMBER: u32 = 11;
const NEXT: u32 = 19;
const NEXT_BUT_ONE: u32 = 25;
const _: () =
    assert!(TRIPPED < 1 << MODE && MODE_CODES << MODE <= 1 << NUMBER && 1 << (NUMBER + 8) <= 1 << NEXT);
const _: () = assert!(MODE_CODES << NEXT <= 1 << NEXT_BUT_ONE && MODE_CODES << (NEXT_BUT_ONE - 1) <= 1 << 31);

/// The mode at a place of a word.
#[inline(always)]
const fn mode_at(word: u32, place: u32) -> u32 {
    word >> place & (MODE_CODES - 1)
}

impl Committal {
    /// As a record.
    #[inline]
    pub fn to_words(&self) -> [u32; COMMITTAL_WORDS] {
        let on = volt_ticks(self.half.on_ticks(0));
        let [period, u, v, w, packed] = half_to_words(self.half);
        // What never toggles does so at the end.
        let [u, v, w] = [u, v, w].map(|compare| compare.min(period));
        let [a, b, c] = self.currents_a.to_bits();
        let flags = (u32::from(self.mirrored) * MIRRORED) | (u32::from(self.tripped) * TRIPPED);
        let (alpha, beta) = (on.alpha.to_bits(), on.beta.to_bits());
        let released = self.released.into();
        [self.at.0, self.begins.0, period, u, v, w, packed | flags, alpha, beta, a, b, c, released]
    }
}

impl Committal {
    /// Gates off from an instant on, for so many ticks, and before that as well.
    pub const fn at_rest(at: Instant, off_ticks: u32) -> Self {
        Self {
            at,
            currents_a: Abc { a: 0.0, b: 0.0, c: 0.0 },
            begins: at,
            half: CarrierHalf::off(off_ticks),
            mirrored: false,
            tripped: false,
            released: 0,
        }
    }
}

/// A [`Committal`] where it lies.
pub struct CommittalRecord<'a>(pub Record<'a, COMMITTAL_WORDS>);

impl CommittalRecord<'_> {
    /// The boundary.
    #[inline]
    pub fn at(&self) -> Instant {
        Instant(self.0.word::<0>())
    }

    /// The boundary where the half begins.
    #[inline]
    pub fn begins(&self) -> Instant {
        Instant(self.0.word::<1>())
    }

    /// The half's length, in ticks.
    #[inline]
    pub fn period_ticks(&self) -> u32 {
        self.0.word::<2>()
    }

    /// Mode, number and levels of the half.
    #[inline]
    pub fn kind(&self) -> HalfKind {
        HalfKind(self.0.word::<6>())
    }

    /// The volt-ticks of the whole half, in ticks; see [`volt_ticks`].
    #[inline]
    pub fn volt_ticks(&self) -> AlphaBeta {
        AlphaBeta { alpha: f32::from_bits(self.0.word::<7>()), beta: f32::from_bits(self.0.word::<8>()) }
    }

    /// The same from `elapsed` ticks after its beginning on.
    #[inline]
    pub fn volt_ticks_from(&self, elapsed: u32) -> AlphaBeta {
        let (period, packed) = (self.period_ticks(), self.0.word::<6>());
        let left = period.saturating_sub(elapsed);
        let on = |compare: u32, level: u32| {
            let before = compare.saturating_sub(elapsed);
            if packed & level != 0 { before } else { left - before }
        };
        volt_ticks([on(self.0.word::<3>(), 1), on(self.0.word::<4>(), 2), on(self.0.word::<5>(), 4)])
    }

    /// Phase currents at the boundary, in A.
    #[inline]
    pub fn currents_a(&self) -> Abc {
        Abc::from_bits([self.0.word::<9>(), self.0.word::<10>(), self.0.word::<11>()])
    }

    /// See [`Committal::released`].
    #[inline]
    pub fn released(&self) -> u8 {
        self.0.word::<12>() as u8
    }
}

/// The kind of a half, in one word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct HalfKind(u32);

impl HalfKind {
    /// The mode that made it.
    #[inline]
    pub fn mode(self) -> Mode {
        Mode::from_code(mode_at(self.0, MODE))
    }

    /// `true` if the gates are off in it.
    #[inline]
    pub fn is_off(self) -> bool {
        mode_at(self.0, MODE) == Mode::Off as u32
    }

    /// See [`CarrierHalf::is_free`].
    #[inline]
    pub fn is_free(self) -> bool {
        const MODES: u32 = 1 << MODE | 1 << NEXT | 1 << NEXT_BUT_ONE;
        self.0 & (MODES * (MODE_CODES - 1)) == MODES * Mode::Async as u32
    }

    /// Its number within the turn.
    #[inline]
    pub fn half(self) -> u32 {
        self.0 >> NUMBER & 0xFF
    }

    /// Mode of the half that follows.
    #[inline]
    pub fn next_mode(self) -> Mode {
        Mode::from_code(mode_at(self.0, NEXT))
    }

    /// Mode of the half after that.
    #[inline]
    pub fn next_but_one_mode(self) -> Mode {
        Mode::from_code(mode_at(self.0, NEXT_BUT_ONE))
    }

    /// See [`Committal::mirrored`].
    #[inline]
    pub fn is_mirrored(self) -> bool {
        self.0 & MIRRORED != 0
    }

    /// See [`Committal::tripped`].
    #[inline]
    pub fn is_tripped(self) -> bool {
        self.0 & TRIPPED != 0
    }
}

/// The space vector of on-times in ticks: times the link voltage it is volt-ticks.
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
pub fn half_to_words(half: CarrierHalf) -> [u32; 5] {
    let [u, v, w] = half.compare_ticks;
    let [lu, lv, lw] = half.start_levels.map(u32::from);
    let [first, second] = half.ahead.map(|mode| mode as u32);
    let packed = lu | lv << 1 | lw << 2 | (half.mode as u32) << MODE | u32::from(half.half) << NUMBER;
    let packed = packed | first << NEXT | second << NEXT_BUT_ONE;
    [half.period_ticks, u, v, w, packed]
}

/// The inverse of [`half_to_words`].
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
