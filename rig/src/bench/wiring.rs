//! The wires between the current sensors and the converters.

use serde::{Serialize, Serializer};
use std::fmt::{Display, Formatter};
use std::str::FromStr;

/// The phase that each current sensor reads, and its sign: `u,v,w` if all is right, `-u,v,w` if the first has its leads swapped, `v,u,w` if the first
/// two are swapped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wiring([(u8, bool); 3]);

impl Wiring {
    /// Correct wiring.
    pub const RIGHT: Self = Self([(0, false), (1, false), (2, false)]);

    /// The wirings in which all sensors have the same sign, the right one first. Others are detected by the phases' sum.
    pub fn of_one_sign() -> [Self; 12] {
        const ORDERS: [[u8; 3]; 6] = [[0, 1, 2], [0, 2, 1], [2, 1, 0], [1, 0, 2], [1, 2, 0], [2, 0, 1]];
        std::array::from_fn(|k| Self(ORDERS[k / 2].map(|phase| (phase, k % 2 == 1))))
    }

    /// The stationary-frame currents read for 1 A along α and along β, by rows.
    pub fn matrix(self) -> [[f64; 2]; 2] {
        let half_root = 0.75_f64.sqrt();
        let [of_alpha, of_beta] = [[1.0, -0.5, -0.5], [0.0, half_root, -half_root]].map(|phases| {
            let [a, b, c] = self.read(phases);
            [(2.0 * a - b - c) / 3.0, (b - c) / (2.0 * half_root)]
        });
        [[of_alpha[0], of_beta[0]], [of_alpha[1], of_beta[1]]]
    }

    /// The sensors' readings of these phase currents, in A.
    pub fn read(self, currents_a: [f64; 3]) -> [f64; 3] {
        self.0.map(
            |(phase, reversed)| {
                if reversed { -currents_a[usize::from(phase)] } else { currents_a[usize::from(phase)] }
            },
        )
    }
}

impl Default for Wiring {
    fn default() -> Self {
        Self::RIGHT
    }
}

const PHASES: [&str; 3] = ["u", "v", "w"];

impl FromStr for Wiring {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let sensor = |word: &str| {
            let (reversed, name) = word.strip_prefix('-').map_or((false, word), |name| (true, name));
            Some((PHASES.iter().zip(0..).find(|(phase, _)| **phase == name)?.1, reversed))
        };
        let found: Option<Vec<_>> = text.split(',').map(|word| sensor(word.trim())).collect();
        let sensors = found.and_then(|found| <[_; 3]>::try_from(found).ok());
        let seen = |phase: u8, sensors: &[(u8, bool); 3]| sensors.iter().any(|(own, _)| *own == phase);
        let sensors = sensors.filter(|sensors| (0..3).all(|phase| seen(phase, sensors)));
        sensors.map(Self).ok_or_else(|| "must be u, v and w in some order, each with or without -".to_owned())
    }
}

impl Display for Wiring {
    fn fmt(&self, to: &mut Formatter) -> std::fmt::Result {
        let words = self.0.map(|(phase, reversed)| {
            format!("{}{}", if reversed { "-" } else { "" }, PHASES[usize::from(phase)])
        });
        write!(to, "{}", words.join(","))
    }
}

impl Serialize for Wiring {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.collect_str(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sensors_read_the_phase_that_they_are_wired_to() {
        let read = |text: &str| text.parse::<Wiring>().unwrap().read([1.0, 20.0, 300.0]);
        assert_eq!(read("u,v,w"), [1.0, 20.0, 300.0]);
        assert_eq!(read("-u,-v,-w"), [-1.0, -20.0, -300.0]);
        assert_eq!(read("v, u, -w"), [20.0, 1.0, -300.0]);
        assert_eq!("-w,u,v".parse::<Wiring>().unwrap().to_string(), "-w,u,v");
        for wrong in ["", "u,v", "u,v,v", "u,v,w,u", "x,v,w", "--u,v,w"] {
            assert!(wrong.parse::<Wiring>().is_err(), "{wrong}");
        }
    }
}
