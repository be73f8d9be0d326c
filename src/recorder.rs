//! The flight recorder: the last control periods, frozen by a fault.
//!
//! Every control period writes one [`Record`] into a ring in RAM, whatever the drive does. After a fault the ring takes an eighth of its length more
//! and stops: the periods that led to the fault can then be read until the gates pulse again.

#![forbid(unsafe_code)]

use crate::cell::{Ring, Words};
use crate::frames::{Abc, Angle};
use crate::modulation::Mode;
use crate::nine_switch::Scheme;
use crate::protection::Fault;
use crate::time::Instant;

/// Control periods in the ring: 25.6 ms at 10 kHz, 3.2 ms of them from the fault on.
pub const RECORDS: usize = 256;

/// Words of a record.
pub const RECORD_WORDS: usize = 10;

/// The ring, for a static of its own: a reader needs nothing else.
pub type Recorder = Ring<Record, RECORD_WORDS, RECORDS>;

/// One control period.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
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

/// The drive's mode, gates and fault.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
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
        let [a, b, c] = self.currents_a.to_bits();
        [
            self.at.0,
            a,
            b,
            c,
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
            currents_a: Abc::from_bits([a, b, c]),
            udc_v: f32::from_bits(udc),
            angle: Angle(angle),
            id_a: f32::from_bits(id),
            iq_a: f32::from_bits(iq),
            voltage_v: f32::from_bits(voltage),
            state: State::from_word(state),
        }
    }
}

/// Words of a [`DualRecord`].
pub const DUAL_WORDS: usize = 15;

/// The ZS9's ring.
pub type DualRecorder = Ring<DualRecord, DUAL_WORDS, RECORDS>;

/// One control period of the ZS9. Motors in the order upper, lower.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DualRecord {
    /// Instant of the sample.
    pub at: Instant,
    /// Phase currents as sampled, in A.
    pub currents_a: [Abc; 2],
    /// Rotor angles as sampled, electrical; zero where a sensor has lost its rotor.
    pub angles: [Angle; 2],
    /// Capacitor voltage as sampled, in V.
    pub capacitor_v: f32,
    /// Source voltage as sampled, in V.
    pub source_v: f32,
    /// Inductor current as sampled, in A.
    pub inductor_a: f32,
    /// Torque references, in N·m.
    pub torque_nm: [f32; 2],
    /// Shoot-through duty, below 1; in the ring in steps of 2⁻¹⁵.
    pub duty: f32,
    /// Scheme, gates and fault.
    pub state: DualState,
}

impl DualRecord {
    /// Link voltage outside shoot-through, in V.
    pub const fn link_v(&self) -> f32 {
        2.0 * self.capacitor_v - self.source_v
    }
}

/// The ZS9's scheme, gates and fault.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DualState {
    /// The place of the zero vectors.
    pub scheme: Scheme,
    /// The operator lets the gates pulse.
    pub enabled: bool,
    /// Control asked for pulses.
    pub pulsing: bool,
    /// The latched fault.
    pub fault: Option<Fault>,
}
/// Steps of the duty in its half of the last word.
const DUTY_STEPS: f32 = 32_768.0;
const DUAL_ENABLED: u32 = 1 << 3;
const DUAL_PULSING: u32 = 1 << 4;
const DUAL_FAULT: u32 = 8;
const DUAL_DUTY: u32 = 16;

impl Words<DUAL_WORDS> for DualRecord {
    #[inline(always)]
    fn to_words(self) -> [u32; DUAL_WORDS] {
        let [[a1, b1, c1], [a2, b2, c2]] = self.currents_a.map(Abc::to_bits);
        let [first, second] = self.angles;
        let [t1, t2] = self.torque_nm;
        let DualState { scheme, enabled, pulsing, fault } = self.state;
        let state = scheme as u32
            | if enabled { DUAL_ENABLED } else { 0 }
            | if pulsing { DUAL_PULSING } else { 0 }
            | fault.map_or(0, |fault| (fault as u32) << DUAL_FAULT)
            | ((self.duty * DUTY_STEPS) as u32) << DUAL_DUTY;
        [
            self.at.0,
            a1,
            b1,
            c1,
            a2,
            b2,
            c2,
            first.0,
            second.0,
            self.capacitor_v.to_bits(),
            self.source_v.to_bits(),
            self.inductor_a.to_bits(),
            t1.to_bits(),
            t2.to_bits(),
            state,
        ]
    }

    fn from_words(words: [u32; DUAL_WORDS]) -> Self {
        let [at, a1, b1, c1, a2, b2, c2, first, second, capacitor, source, inductor, t1, t2, state] = words;
        Self {
            at: Instant(at),
            currents_a: [Abc::from_bits([a1, b1, c1]), Abc::from_bits([a2, b2, c2])],
            angles: [Angle(first), Angle(second)],
            capacitor_v: f32::from_bits(capacitor),
            source_v: f32::from_bits(source),
            inductor_a: f32::from_bits(inductor),
            torque_nm: [t1, t2].map(f32::from_bits),
            duty: (state >> DUAL_DUTY) as f32 / DUTY_STEPS,
            state: DualState {
                scheme: Scheme::from_code(state & 7),
                enabled: state & DUAL_ENABLED != 0,
                pulsing: state & DUAL_PULSING != 0,
                fault: Fault::from_code(state >> DUAL_FAULT & 0xFF),
            },
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
    #[test]
    fn a_record_of_the_zs9_survives_as_words() {
        let state =
            DualState { scheme: Scheme::Zvo, enabled: true, pulsing: false, fault: Some(Fault::SensorLost2) };
        let record = DualRecord {
            at: Instant(7),
            currents_a: [Abc { a: 1.0, b: -2.0, c: 1.5 }, Abc { a: 3.0, b: -5.0, c: 2.0 }],
            angles: [Angle::DEG_90, Angle(1)],
            capacitor_v: 533.0,
            source_v: 400.0,
            inductor_a: -30.0,
            torque_nm: [120.0, -60.0],
            duty: 0.25,
            state,
        };
        assert_eq!(DualRecord::from_words(record.to_words()), record);
        let record = DualRecord { state: DualState { pulsing: true, ..DualState::default() }, ..record };
        assert_eq!(DualRecord::from_words(record.to_words()), record);
    }
}
