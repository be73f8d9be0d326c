//! A latched fault as words.

use super::{Fault, SafeState, Trip};
use crate::cell::Words;
use crate::time::Instant;

impl Words<4> for Trip {
    fn to_words(self) -> [u32; 4] {
        trip_to_words(Some(self))
    }

    fn from_words(words: [u32; 4]) -> Self {
        let unknown = Self {
            fault: Fault::NotFinite,
            value: 0.0,
            limit: 0.0,
            at: Instant(0),
            safe: SafeState::GatesOff,
        };
        trip_from_words(words).unwrap_or(unknown)
    }
}

/// A latched fault as four words: fault and safe state, value, limit, instant; zeros for none.
pub fn trip_to_words(trip: Option<Trip>) -> [u32; 4] {
    match trip {
        None => [0; 4],
        Some(trip) => [
            trip.fault as u32 | (trip.safe as u32) << 8,
            trip.value.to_bits(),
            trip.limit.to_bits(),
            trip.at.0,
        ],
    }
}

/// The inverse of [`trip_to_words`].
pub fn trip_from_words(words: [u32; 4]) -> Option<Trip> {
    let [code, value, limit, at] = words;
    Some(Trip {
        fault: Fault::from_code(code & 0xFF)?,
        value: f32::from_bits(value),
        limit: f32::from_bits(limit),
        at: Instant(at),
        safe: SafeState::from_code(code >> 8 & 0xFF),
    })
}
