//! The words reported by an identification, one observation per carrier boundary.

use crate::frames::{AlphaBeta, Dq, SinCos};
use crate::named;

named! {
    /// The part of the experiment in which a carrier half lies.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum Stage {
        /// Longer pulses until a current moves.
        #[default]
        Probe => "probe",
        /// Direct currents along d.
        Staircase => "staircase",
        /// Pulses along d.
        AlongD => "along_d",
        /// Pulses along q.
        AlongQ => "along_q",
        /// Pulses along both.
        AlongBoth => "along_both",
        /// No current.
        Rest => "rest",
        /// A turning rotor: sped up, coasting, braked.
        Turn => "turn",
        /// The experiment is over; no current.
        Done => "done",
    }
}

/// A carrier boundary, and what acted since the one before it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// The part of the experiment.
    pub stage: Stage,
    /// Volt-seconds that the modulator made since then, in V·s, stationary frame; none before the first pulses.
    pub volt_seconds: AlphaBeta,
    /// Time since then, in s.
    pub length_s: f32,
    /// Current at the boundary, rotor frame, in A.
    pub current: Dq,
    /// Direction of the rotor's d axis there.
    pub frame: SinCos,
    /// DC-link voltage, in V.
    pub udc_v: f32,
}

/// Words of an observation.
pub const OBSERVATION_WORDS: usize = 9;

impl Observation {
    /// The observation as words.
    pub fn to_words(self) -> [u32; OBSERVATION_WORDS] {
        let numbers = [
            self.volt_seconds.alpha,
            self.volt_seconds.beta,
            self.length_s,
            self.current.d,
            self.current.q,
            self.frame.sin,
            self.frame.cos,
            self.udc_v,
        ];
        let [alpha, beta, length, d, q, sin, cos, udc] = numbers.map(f32::to_bits);
        [self.stage as u32, alpha, beta, length, d, q, sin, cos, udc]
    }

    /// The observation of words; `None` if the stage is none.
    pub fn from_words(words: [u32; OBSERVATION_WORDS]) -> Option<Self> {
        let [stage, alpha, beta, length, d, q, sin, cos, udc] = words;
        let number = f32::from_bits;
        Some(Self {
            stage: *Stage::ALL.get(stage as usize)?,
            volt_seconds: AlphaBeta { alpha: number(alpha), beta: number(beta) },
            length_s: number(length),
            current: Dq { d: number(d), q: number(q) },
            frame: SinCos { sin: number(sin), cos: number(cos) },
            udc_v: number(udc),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_observation_survives_as_words() {
        for stage in Stage::ALL {
            let observation = Observation {
                stage,
                volt_seconds: AlphaBeta { alpha: 0.1, beta: -0.2 },
                length_s: 5e-4,
                current: Dq { d: -100.0, q: 30.0 },
                frame: SinCos { sin: 0.6, cos: 0.8 },
                udc_v: 1_500.0,
            };
            assert_eq!(Observation::from_words(observation.to_words()), Some(observation));
        }
        assert_eq!(Observation::from_words([8; OBSERVATION_WORDS]), None);
    }
}
