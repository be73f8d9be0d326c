//! The flight recorder: the last control periods, frozen by a fault.
//!
//! Every control period writes one [`Record`] into a ring in RAM, whatever the drive does. A fault lets an eighth of the ring pass
//! and stops it: what led to the fault is there to be read, until the ring is released.

#![forbid(unsafe_code)]

use crate::cell::{Ring, Words};
use crate::frames::{Abc, Angle};
use crate::modulation::Mode;
use crate::protection::Fault;
use crate::time::Instant;

/// Control periods in the ring: 25.6 ms at 10 kHz, 3.2 ms of them from the fault on.
pub const RECORDS: usize = 256;

/// Words of a record.
pub const RECORD_WORDS: usize = 10;

/// The ring, for a static of its own: whoever reads it needs nothing else.
pub type Recorder = Ring<Record, RECORD_WORDS, RECORDS>;

/// One control period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Record {
    /// Instant of the sample.
    pub at: Instant,
    /// Phase currents as sampled, in A.
    pub currents_a: Abc,
    /// DC-link voltage as sampled, in V.
    pub udc_v: f32,
    /// Rotor angle as sampled, electrical.
    pub angle: Angle,
    /// Current reference, d axis, in A.
    pub id_a: f32,
    /// Current reference, q axis, in A.
    pub iq_a: f32,
    /// Commanded fundamental, peak phase, in V.
    pub voltage_v: f32,
    /// Mode, gates and fault.
    pub state: State,
}

/// What the drive was doing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct State {
    /// Mode of the carrier half in which the sample lies.
    pub mode: Mode,
    /// The operator lets the gates pulse.
    pub enabled: bool,
    /// Control asked for pulses.
    pub pulsing: bool,
    /// The latched fault.
    pub fault: Option<Fault>,
}

const ENABLED: u32 = 1 << 8;
const PULSING: u32 = 1 << 9;

impl State {
    #[inline(always)]
    fn to_word(self) -> u32 {
        self.mode as u32
            | if self.enabled { ENABLED } else { 0 }
            | if self.pulsing { PULSING } else { 0 }
            | self.fault.map_or(0, |fault| (fault as u32) << 16)
    }

    fn from_word(word: u32) -> Self {
        Self {
            mode: Mode::from_code(word & 0xFF),
            enabled: word & ENABLED != 0,
            pulsing: word & PULSING != 0,
            fault: Fault::from_code(word >> 16),
        }
    }
}

impl Words<RECORD_WORDS> for Record {
    #[inline(always)]
    fn to_words(self) -> [u32; RECORD_WORDS] {
        let Abc { a, b, c } = self.currents_a;
        [
            self.at.0,
            a.to_bits(),
            b.to_bits(),
            c.to_bits(),
            self.udc_v.to_bits(),
            self.angle.0,
            self.id_a.to_bits(),
            self.iq_a.to_bits(),
            self.voltage_v.to_bits(),
            self.state.to_word(),
        ]
    }

    fn from_words(words: [u32; RECORD_WORDS]) -> Self {
        let [at, a, b, c, udc, angle, id, iq, voltage, state] = words;
        Self {
            at: Instant(at),
            currents_a: Abc { a: f32::from_bits(a), b: f32::from_bits(b), c: f32::from_bits(c) },
            udc_v: f32::from_bits(udc),
            angle: Angle(angle),
            id_a: f32::from_bits(id),
            iq_a: f32::from_bits(iq),
            voltage_v: f32::from_bits(voltage),
            state: State::from_word(state),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_survives_as_words() {
        let state = State { mode: Mode::Mid3, enabled: true, pulsing: false, fault: Some(Fault::LegStuck) };
        let record = Record {
            at: Instant(7),
            currents_a: Abc { a: 1.0, b: -2.0, c: 1.0 },
            udc_v: 1_500.0,
            angle: Angle::DEG_90,
            id_a: -120.0,
            iq_a: 300.0,
            voltage_v: 600.0,
            state,
        };
        assert_eq!(Record::from_words(record.to_words()), record);
        for state in [State::default(), State { pulsing: true, ..State::default() }] {
            assert_eq!(State::from_word(state.to_word()), state);
        }
    }
}
