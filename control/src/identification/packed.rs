//! Observations in three words, as a drive keeps them until a bus has carried them away.

use super::observation::{Observation, Stage};
use crate::frames::{AlphaBeta, Angle, Dq};
use crate::machine::Ratings;

/// Words of a packed observation.
pub const PACKED_WORDS: usize = 3;

/// An observation in few words: volt-seconds; currents; angle, link, length and stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Packed(pub [u32; PACKED_WORDS]);

/// The units of packed observations, which follow from a machine's ratings: a drive and its listener have the same.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Units {
    /// In V·s.
    volt_seconds: f32,
    /// In A.
    current_a: f32,
    /// In V.
    udc_v: f32,
    /// Length of a carrier half, in s.
    half_s: f32,
}

/// Steps of a number with a sign, either side.
const STEPS: f32 = 32_767.0;
/// Steps of the link's voltage, and of a length in halves.
const UDC_STEPS: f32 = 1_023.0;
const MOST_HALVES: f32 = 7.0;

const UDC_PLACE: u32 = 16;
const HALVES_PLACE: u32 = 26;
const STAGE_PLACE: u32 = 29;

/// The nearest step of a number, held within the range.
fn steps(value: f32, unit: f32, most: f32) -> i32 {
    let steps = value / unit;
    let nearest = (if steps < 0.0 { steps - 0.5 } else { steps + 0.5 }) as i32;
    nearest.clamp(-(most as i32), most as i32)
}

/// Two numbers with a sign in a word.
fn pair(first: i32, second: i32) -> u32 {
    u32::from(first as u16) | u32::from(second as u16) << 16
}

/// The numbers in such a word.
fn numbers(word: u32) -> [f32; 2] {
    [word as u16, (word >> 16) as u16].map(|half| f32::from(half as i16))
}

impl Units {
    /// The units for a machine: currents to twice the trip level, volt-seconds to a whole carrier at the link's, which is more than any vector has.
    pub const fn of(ratings: &Ratings) -> Self {
        let half_s = 0.5 / ratings.max_switching_hz;
        Self {
            volt_seconds: ratings.trip_dc_over_v * 2.0 * half_s / STEPS,
            current_a: 2.0 * ratings.trip_current_a / STEPS,
            udc_v: ratings.trip_dc_over_v / UDC_STEPS,
            half_s,
        }
    }

    /// The observation in three words.
    pub fn pack(&self, observation: &Observation) -> Packed {
        let Observation { stage, volt_seconds, length_s, current, frame, udc_v } = *observation;
        let signed = |value: f32, unit: f32| steps(value, unit, STEPS);
        let angle = AlphaBeta { alpha: frame.cos, beta: frame.sin }.angle();
        let positive = |value: f32, unit: f32, most: f32| steps(value, unit, most).max(0) as u32;
        let last = angle.0 >> 16
            | positive(udc_v, self.udc_v, UDC_STEPS) << UDC_PLACE
            | positive(length_s, self.half_s, MOST_HALVES) << HALVES_PLACE
            | (stage as u32) << STAGE_PLACE;
        Packed([
            pair(signed(volt_seconds.alpha, self.volt_seconds), signed(volt_seconds.beta, self.volt_seconds)),
            pair(signed(current.d, self.current_a), signed(current.q, self.current_a)),
            last,
        ])
    }

    /// The observation of three words.
    pub fn unpack(&self, Packed([volts, amperes, last]): Packed) -> Observation {
        let [alpha, beta] = numbers(volts).map(|steps| steps * self.volt_seconds);
        let [d, q] = numbers(amperes).map(|steps| steps * self.current_a);
        let at = |place: u32, most: f32| (last >> place & most as u32) as f32;
        // In the middle of its step.
        let angle = Angle(last << 16 | 1 << 15);
        Observation {
            stage: Stage::ALL.get((last >> STAGE_PLACE) as usize).copied().unwrap_or_default(),
            volt_seconds: AlphaBeta { alpha, beta },
            length_s: at(HALVES_PLACE, MOST_HALVES) * self.half_s,
            current: Dq { d, q },
            frame: angle.sin_cos(),
            udc_v: at(UDC_PLACE, UDC_STEPS) * self.udc_v,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::SinCos;

    const UNITS: Units = Units { volt_seconds: 1e-4, current_a: 0.02, udc_v: 2.0, half_s: 1.0 / 1_800.0 };

    #[test]
    fn a_packed_observation_is_the_same_within_its_steps() {
        for stage in Stage::ALL {
            for (k, sign) in [1.0, -1.0].into_iter().enumerate() {
                let observation = Observation {
                    stage,
                    volt_seconds: AlphaBeta { alpha: 0.4 * sign, beta: -0.123_45 },
                    length_s: (k + 1) as f32 / 1_800.0,
                    current: Dq { d: -210.0 * sign, q: 33.333 },
                    frame: SinCos { sin: -0.6 * sign, cos: 0.8 },
                    udc_v: 1_501.0,
                };
                let found = UNITS.unpack(UNITS.pack(&observation));
                assert_eq!(found.stage, stage);
                let near = |a: f32, b: f32, step: f32| (a - b).abs() <= 0.51 * step;
                assert!(near(found.volt_seconds.alpha, observation.volt_seconds.alpha, 1e-4));
                assert!(near(found.volt_seconds.beta, observation.volt_seconds.beta, 1e-4));
                assert!(near(found.current.d, observation.current.d, 0.02));
                assert!(near(found.current.q, observation.current.q, 0.02));
                assert!(near(found.frame.sin, observation.frame.sin, 1e-4));
                assert!(near(found.frame.cos, observation.frame.cos, 1e-4));
                assert!(near(found.length_s, observation.length_s, 1e-6), "{}", found.length_s);
                assert!(near(found.udc_v, observation.udc_v, 2.0));
            }
        }
    }

    #[test]
    fn what_is_beyond_the_range_is_held_at_its_end() {
        let observation = Observation {
            stage: Stage::Turn,
            volt_seconds: AlphaBeta { alpha: 1e9, beta: f32::NAN },
            length_s: 1e9,
            current: Dq { d: f32::NEG_INFINITY, q: 0.0 },
            frame: SinCos { sin: 0.0, cos: 1.0 },
            udc_v: -5.0,
        };
        let found = UNITS.unpack(UNITS.pack(&observation));
        assert!((found.volt_seconds.alpha - 3.2767).abs() < 1e-4 && found.volt_seconds.beta == 0.0);
        assert!((found.current.d + 655.34).abs() < 1e-2);
        assert!((found.udc_v, found.stage) == (0.0, Stage::Turn) && found.length_s < 0.004);
    }
}
