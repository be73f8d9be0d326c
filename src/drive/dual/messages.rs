//! The messages between the ZS9's interrupts.

use crate::cell::{Record, Words};
use crate::drive::Gates;
use crate::frames::Angle;
use crate::nine_switch::Scheme;
use crate::protection::Trip;
use crate::protection::trip_from_words;
use crate::protection::trip_to_words;
use crate::time::Instant;

/// One motor's voltage, from control to the modulator.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MotorCommand {
    /// Peak phase voltage, in V.
    pub voltage_v: f32,
    /// Angle of the vector at the sample.
    pub angle: Angle,
    /// The rate at which it turns, in angle units (2⁻³² turn) per tick.
    pub rate: f32,
}

/// From control to the modulator. Motors in the order upper, lower.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DualCommand {
    /// Voltages.
    pub motors: [MotorCommand; 2],
    /// Instant of the sample.
    pub at: Instant,
    /// The instant from which the command may be used: a fixed time after its sample, whenever the task really finished.
    pub valid_from: Instant,
    /// Shoot-through duty.
    pub duty: f32,
    /// The place of the zero vectors.
    pub scheme: Scheme,
    /// The order to make pulses at all.
    pub gates: Gates,
    /// Number of the last release: a new one makes the PWM interrupt forget its fault and let the gates go.
    pub release: u8,
}

impl DualCommand {
    /// The instant from which a stored command may be used.
    #[inline]
    pub fn valid_from(record: &Record<10>) -> Instant {
        Instant(record.word::<7>())
    }
}

impl Words<10> for DualCommand {
    fn to_words(self) -> [u32; 10] {
        let [upper, lower] = self.motors;
        [
            upper.voltage_v.to_bits(),
            upper.angle.0,
            upper.rate.to_bits(),
            lower.voltage_v.to_bits(),
            lower.angle.0,
            lower.rate.to_bits(),
            self.at.0,
            self.valid_from.0,
            self.duty.to_bits(),
            u32::from(self.gates == Gates::Pulse) | (self.scheme as u32) << 8 | u32::from(self.release) << 16,
        ]
    }

    fn from_words(words: [u32; 10]) -> Self {
        let [v1, a1, r1, v2, a2, r2, at, valid_from, duty, flags] = words;
        let motor = |voltage, angle, rate| MotorCommand {
            voltage_v: f32::from_bits(voltage),
            angle: Angle(angle),
            rate: f32::from_bits(rate),
        };
        Self {
            motors: [motor(v1, a1, r1), motor(v2, a2, r2)],
            at: Instant(at),
            valid_from: Instant(valid_from),
            duty: f32::from_bits(duty),
            scheme: Scheme::from_code(flags >> 8 & 0xFF),
            release: (flags >> 16) as u8,
            gates: if flags & 1 == 1 { Gates::Pulse } else { Gates::Off },
        }
    }
}

/// The mean voltage that one motor has in a period, as a share of the link.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MotorShare {
    /// Modulation index, 2 |V|/U_in.
    pub modulation_index: f32,
    /// Angle of the vector.
    pub angle: Angle,
}

/// From the modulator to control: the output of the period that begins at the next valley.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DualApplied {
    /// Instant of the interrupt, a peak of the carrier.
    pub at: Instant,
    /// The motors' voltages; `None` while the gates are off.
    pub next: Option<[MotorShare; 2]>,
    /// A fault that the PWM interrupt found.
    pub trip: Option<Trip>,
    /// Number of the release carried out last.
    pub released: u8,
}

impl Words<10> for DualApplied {
    fn to_words(self) -> [u32; 10] {
        let [upper, lower] = self.next.unwrap_or_default();
        let [code, value, limit, at] = trip_to_words(self.trip);
        [
            self.at.0,
            u32::from(self.next.is_some()) | u32::from(self.released) << 8,
            upper.modulation_index.to_bits(),
            upper.angle.0,
            lower.modulation_index.to_bits(),
            lower.angle.0,
            code,
            value,
            limit,
            at,
        ]
    }

    fn from_words(words: [u32; 10]) -> Self {
        let [at, pulsing, d1, a1, d2, a2, trip @ ..] = words;
        let share = |modulation_index, angle| MotorShare {
            modulation_index: f32::from_bits(modulation_index),
            angle: Angle(angle),
        };
        Self {
            at: Instant(at),
            released: (pulsing >> 8) as u8,
            next: (pulsing & 1 == 1).then_some([share(d1, a1), share(d2, a2)]),
            trip: trip_from_words(trip),
        }
    }
}
