//! The flux path of an optimised pattern.

use super::{Branch, Pattern};
use crate::frames::{AlphaBeta, SQRT_3, six_step_v};
use crate::modulation::Mode;
use crate::modulation::half::boundary;
use core::f32::consts::FRAC_PI_2;

/// The ripple flux where half number `half` begins, in Wb, in the stationary frame of the (mirrored) turn, for a fundamental of
/// `voltage_v` (peak phase) at a stator frequency of `omega` (rad/s, greater than zero); `None` for modes of another kind.
///
/// As in control, it is counted from where a carrier's sampled fundamental stands at its boundaries: outside the circle by x/sin x, with x half the
/// angle of a half.
#[inline(never)]
pub fn ripple(mode: Mode, half: u32, voltage_v: f32, udc_v: f32, omega: f32) -> Option<AlphaBeta> {
    let branch = mode.branch()?;
    let turn = 4 * branch.quarter();
    let half = if half >= turn { half - turn } else { half };
    let six_step_v = six_step_v(udc_v);
    let index = branch.within(voltage_v / six_step_v);
    let x = 0.5 * branch.half_rad();
    let round = boundary(half, mode.carriers()).sin_cos();
    let fundamental = index * six_step_v * (1.0 + x * x * (1.0 / 6.0));
    let path = branch.pattern(index).path(half) * (0.5 * udc_v);
    let fundamental = AlphaBeta { alpha: round.cos, beta: round.sin } * fundamental;
    Some((path + fundamental) * (1.0 / omega))
}

impl Pattern<'_> {
    /// The flux at the beginning of half number `half`, in units of half the link's voltage over the stator frequency.
    fn path(&self, half: u32) -> AlphaBeta {
        let third = self.branch.quarter() * 4 / 3;
        let [a, b, c] = [half, half + 2 * third, half + third].map(|half| self.phase_path(half));
        AlphaBeta { alpha: (2.0 * a - b - c) * (1.0 / 3.0), beta: (b - c) * (1.0 / SQRT_3) }
    }

    /// The integral of phase a's level (1 or −1) over the angle from 90°, where its flux is zero.
    fn phase_path(&self, half: u32) -> f32 {
        let quarter = self.branch.quarter();
        let (quadrant, rest) = (half / quarter % 4, half % quarter);
        let mirrored = quadrant & 1 != 0;
        let place = if mirrored { quarter - rest } else { rest };
        let left = self.left_from(place as f32 * self.branch.half_rad());
        // Odd about 90°, and inverted in the second half wave.
        if quadrant == 1 || quadrant == 2 { left } else { -left }
    }

    /// The integral of the level from an angle in rad, in the first quarter, to 90°.
    fn left_from(&self, from: f32) -> f32 {
        let mut level = self.branch.first_level();
        let (mut sum, mut from) = (0.0, from);
        for angle in self.angles() {
            if angle > from {
                sum += level * (angle - from);
                from = angle;
            }
            level = -level;
        }
        sum + level * (FRAC_PI_2 - from)
    }
}

impl Branch {
    /// The level just after angle 0: 1 or −1.
    fn first_level(&self) -> f32 {
        if self.starts_high { 1.0 } else { -1.0 }
    }
}
