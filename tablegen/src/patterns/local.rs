//! The local optimum from a start: sequential quadratic programming, by the crate `slsqp`.

use super::waveform::Waveform;
use slsqp::{Func, StopTols, minimize};

/// Scale of the cost, which is small: the optimiser's tolerances suit values near one.
const SCALE: f64 = 1e3;
/// Most evaluations, and the relative change of cost at which the search ends.
const MOST_EVALUATIONS: usize = 100;
const TOLERANCE: f64 = 1e-10;
/// Deviation of the fundamental up to which Newton's steps can make an optimum exact, and the number of these steps.
const NEAR: f64 = 1e-4;
const NEWTON_STEPS: usize = 4;

/// The problem at one modulation index.
pub(super) struct Problem<'a> {
    /// Level at the beginning, 1 or −1.
    pub first: f64,
    /// Fundamental, as a share of six-step.
    pub index: f64,
    /// Shortest pulse, in rad.
    pub shortest_rad: f64,
    /// Least and largest value of each angle, in rad.
    pub bounds: &'a [(f64, f64)],
    /// Cost in addition to the square of the distortion, if there is any.
    pub beside: Option<&'a dyn Fn(&Waveform) -> f64>,
}

/// Step of an angle by which the slope of the additional cost is found, in rad.
const SLOPE_STEP: f64 = 1e-6;

/// Offset in each angle of a start near another problem's optimum, in rad.
const BESIDE: f64 = 0.01;

impl Problem<'_> {
    /// The optimum that is reached from that of the distortion alone. A search from exactly there often ends at once, so a second one begins beside
    /// it: the better result counts.
    pub fn calmest(&self, start: &[f64]) -> Option<Vec<f64>> {
        let cost = |angles: &Vec<f64>| {
            let wave = Waveform { first: self.first, angles_rad: angles };
            wave.ripple(None) + self.beside.map_or(0.0, |beside| beside(&wave))
        };
        let starts = [0.0, BESIDE].map(|off| start.iter().map(|angle| angle + off).collect::<Vec<_>>());
        let found = starts.iter().filter_map(|start| self.optimum(start));
        found.min_by(|a, b| cost(a).total_cmp(&cost(b)))
    }

    /// The local optimum that is reached from a start; `None` if there is none, or if the constraints are not met.
    pub fn optimum(&self, start: &[f64]) -> Option<Vec<f64>> {
        let first = self.first;
        let cost = |angles: &[f64], mut slopes: Option<&mut [f64]>, (): &mut ()| {
            let wave = Waveform { first, angles_rad: angles };
            let mut value = wave.ripple(slopes.as_deref_mut());
            if let Some(beside) = self.beside {
                let own = beside(&wave);
                value += own;
                for (k, slope) in slopes.iter_mut().flat_map(|slopes| slopes.iter_mut()).enumerate() {
                    let mut moved = angles.to_vec();
                    moved[k] += SLOPE_STEP;
                    *slope += (beside(&Waveform { first, angles_rad: &moved }) - own) / SLOPE_STEP;
                }
            }
            slopes.into_iter().flatten().for_each(|slope| *slope *= SCALE);
            SCALE * value
        };
        let constraints = self.constraints(start.len());
        let constraints: Vec<&dyn Func<()>> = constraints.iter().map(AsRef::as_ref).collect();
        let start: Vec<_> =
            start.iter().zip(self.bounds).map(|(angle, (low, high))| angle.clamp(*low, *high)).collect();
        let ends = StopTols { ftol_rel: TOLERANCE, ..StopTols::default() };
        let found = minimize(cost, &start, self.bounds, &constraints, (), MOST_EVALUATIONS, Some(ends));
        // Near the optimum it may stop because of rounding: the constraints decide.
        let (Ok((_, angles, _)) | Err((_, angles, _))) = found;
        self.made_exact(angles)
    }

    /// Negative if they are met: the fundamental neither larger nor smaller, pulses no shorter.
    fn constraints(&self, angles: usize) -> Vec<Box<dyn Func<()>>> {
        let (first, index, shortest) = (self.first, self.index, self.shortest_rad);
        let fundamental = |side: f64| -> Box<dyn Func<()>> {
            Box::new(move |angles: &[f64], slopes: Option<&mut [f64]>, (): &mut ()| {
                let wave = Waveform { first, angles_rad: angles };
                for (k, slope) in slopes.into_iter().flatten().enumerate() {
                    *slope = side * wave.fundamental_slope(k);
                }
                side * (wave.fundamental() - index)
            })
        };
        let pulse = |k: usize| -> Box<dyn Func<()>> {
            Box::new(move |angles: &[f64], slopes: Option<&mut [f64]>, (): &mut ()| {
                if let Some(slopes) = slopes {
                    slopes.fill(0.0);
                    (slopes[k], slopes[k + 1]) = (1.0, -1.0);
                }
                angles[k] - angles[k + 1] + shortest
            })
        };
        [1.0, -1.0].map(fundamental).into_iter().chain((0..angles - 1).map(pulse)).collect()
    }

    /// The angles moved along the fundamental's slope until it is exact, if all bounds are then met.
    fn made_exact(&self, mut angles: Vec<f64>) -> Option<Vec<f64>> {
        let missing =
            |angles: &[f64]| self.index - Waveform { first: self.first, angles_rad: angles }.fundamental();
        if missing(&angles).abs() > NEAR {
            return None;
        }
        for _ in 0..NEWTON_STEPS {
            let error = missing(&angles);
            let wave = Waveform { first: self.first, angles_rad: &angles };
            let slopes: Vec<_> = (0..angles.len()).map(|k| wave.fundamental_slope(k)).collect();
            let squared: f64 = slopes.iter().map(|slope| slope * slope).sum();
            angles.iter_mut().zip(slopes).for_each(|(angle, slope)| *angle += error * slope / squared);
        }
        let slack = 1e-4;
        let inside = angles
            .iter()
            .zip(self.bounds)
            .all(|(angle, (low, high))| (low - slack..=high + slack).contains(angle));
        let apart = angles.windows(2).all(|pair| pair[1] - pair[0] >= self.shortest_rad - slack);
        (inside && apart).then_some(angles)
    }
}

#[cfg(test)]
mod tests;
