//! A quarter-wave symmetric two-level wave, and its harmonics.

use std::f64::consts::FRAC_PI_2;

/// The highest harmonic that counts: those above it make less than a ten-thousandth of the weighted distortion.
const LAST_HARMONIC: u32 = 997;

/// One phase's voltage: it starts at the level `first` at angle 0, changes at each of the angles and is mirrored at 90°.
#[derive(Clone, Copy, Debug)]
pub struct Waveform<'a> {
    /// 1 or −1: the level between 0 and the first angle.
    pub first: f64,
    /// Angles in rad, ascending, between 0 and π/2.
    pub angles_rad: &'a [f64],
}

impl Waveform<'_> {
    /// The fundamental as a share of six-step's.
    pub fn fundamental(&self) -> f64 {
        let terms = self.angles_rad.iter().zip(signs()).map(|(angle, sign)| 2.0 * sign * libm::cos(*angle));
        self.first * (1.0 + terms.sum::<f64>())
    }

    /// The fundamental's derivative by an angle.
    pub(super) fn fundamental_slope(&self, index: usize) -> f64 {
        let sign = if index.is_multiple_of(2) { -1.0 } else { 1.0 };
        -2.0 * self.first * sign * libm::sin(self.angles_rad[index])
    }

    /// `sqrt(Σ (V_n/n)²)/V_1` over the odd n > 1 that are no multiples of three.
    pub fn weighted_distortion(&self) -> f64 {
        self.ripple(None).sqrt() / self.fundamental()
    }

    /// `Σ (V_n/n)²` in shares of six-step's fundamental, with its derivatives by the angles.
    pub(super) fn ripple(&self, mut slopes: Option<&mut [f64]>) -> f64 {
        if let Some(slopes) = &mut slopes {
            slopes.fill(0.0);
        }
        let turn = |angle: f64| (libm::cos(angle), libm::sin(angle));
        let steps: Vec<_> = self.angles_rad.iter().map(|angle| turn(2.0 * angle)).collect();
        let mut at: Vec<_> = self.angles_rad.iter().map(|angle| turn(*angle)).collect();
        let mut sum = 0.0;
        for n in (3..=LAST_HARMONIC).step_by(2) {
            for ((cos, sin), (step_cos, step_sin)) in at.iter_mut().zip(&steps) {
                (*cos, *sin) = (*cos * step_cos - *sin * step_sin, *sin * step_cos + *cos * step_sin);
            }
            if n % 3 == 0 {
                continue;
            }
            let order = f64::from(n);
            let harmonic = 1.0 + at.iter().zip(signs()).map(|((cos, _), sign)| 2.0 * sign * cos).sum::<f64>();
            let weight = 1.0 / (order * order);
            sum += harmonic * harmonic * weight * weight;
            for ((slope, (_, sin)), sign) in
                slopes.iter_mut().flat_map(|slopes| slopes.iter_mut()).zip(&at).zip(signs())
            {
                *slope -= 4.0 * harmonic * sign * sin * weight * weight * order;
            }
        }
        sum
    }

    /// The harmonics `V_n/n` in shares of six-step's fundamental, for n = 6k − 1 and 6k + 1, k from 1.
    pub(super) fn flux_harmonics(&self) -> impl Iterator<Item = (f64, f64)> {
        let harmonic = |n: f64| {
            let edges = self.angles_rad.iter().zip(signs());
            let sum: f64 = edges.map(|(angle, sign)| 2.0 * sign * libm::cos(n * angle)).sum();
            self.first * (1.0 + sum) / (n * n)
        };
        (1..).map(move |k| (harmonic(6.0 * f64::from(k) - 1.0), harmonic(6.0 * f64::from(k) + 1.0)))
    }

    /// The rms value of the ripple flux along the fundamental's, as a share of that. In this direction harmonics of the orders 6k − 1 and 6k + 1 add.
    pub(super) fn along(&self) -> f64 {
        let orders = LAST_HARMONIC as usize / 6;
        let squares =
            self.flux_harmonics().take(orders).map(|(below, above)| (below + above) * (below + above));
        (0.5 * squares.sum::<f64>()).sqrt() / self.fundamental()
    }

    /// The shortest pulse or pause, as an angle in rad: between the edges at 0, at the angles, and mirrored at 90°.
    pub fn shortest_rad(&self) -> f64 {
        let last = self.angles_rad.last().copied().unwrap_or(0.0);
        let first = self.angles_rad.first().copied().unwrap_or(FRAC_PI_2);
        let between = self.angles_rad.windows(2).map(|pair| pair[1] - pair[0]);
        between.fold(first.min(2.0 * (FRAC_PI_2 - last)), f64::min)
    }
}

/// −1, 1, −1 …: the sign with which each angle's edge counts.
fn signs() -> impl Iterator<Item = f64> {
    [-1.0, 1.0].into_iter().cycle()
}

#[cfg(test)]
mod tests;
