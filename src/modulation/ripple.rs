//! The ripple flux that each pulse pattern leaves at its carrier boundaries: pure functions of (mode, u, θ).
//!
//! In steady state the flux of a symmetric pattern runs along a hexagon; at a boundary it stands off its fundamental
//! by an amount that is known beforehand. Control subtracts it, so that samples at boundaries tell the fundamental.

use super::{Mode, middle60};
use crate::frames::{AlphaBeta, Angle, Dq};

/// Ripple flux linkage at the boundary where half number `half` begins, in Wb, in the stationary frame of the
/// (mirrored) turn. `voltage_v`: fundamental, peak phase; `omega`: stator frequency in rad/s, greater than zero.
///
/// Zero for the triangular carriers: at their peaks and valleys the flux is that of the sampled fundamental. For
/// middle 60° and square wave: in each sector the flux moves along one edge of a hexagon, by
/// `D = (2/3) udc (π/3 − N β/2)/ω` over N halves, so at half i it stands at `D (1 + (i/N)(e^{j60°} − 1))`, turned by
/// the sector; from that the fundamental `u/ω` at `i/N · 60°` is taken away. The flux lags the voltage by 90°.
pub fn ripple_flux(mode: Mode, half: u32, voltage_v: f32, udc_v: f32, omega: f32) -> AlphaBeta {
    let per_sector = match mode {
        Mode::Mid7 | Mode::Mid3 | Mode::Square => mode.carriers() / 3,
        _ => return AlphaBeta::default(),
    };
    let notch = if mode == Mode::Square { 0.0 } else { middle60::half_notch_rad(mode, voltage_v, udc_v) };
    let edge = (2.0 / 3.0) * udc_v * (core::f32::consts::FRAC_PI_3 - per_sector as f32 * notch) / omega;
    let half = half % (per_sector * 6);
    let (sector, within) = (half / per_sector, half % per_sector);
    let part = within as f32 / per_sector as f32;
    // The flux lags the voltage by 90°, and the voltage lags the pulse angle by 90°.
    let start = Angle(sector.wrapping_mul(SECTOR)) - Angle::DEG_90 - Angle::DEG_90;
    let chord = Dq { d: edge * (1.0 - 0.5 * part), q: edge * part * (0.5 * crate::frames::SQRT_3) };
    let fundamental = Angle((SECTOR as f32 * part) as u32).sin_cos();
    let round = Dq { d: fundamental.cos, q: fundamental.sin } * (voltage_v / omega);
    (chord - round).unpark(start.sin_cos())
}

/// 60° in angle units, rounded to the nearest.
const SECTOR: u32 = 715_827_883;

/// The flux ripple of a mode as a share of the fundamental flux (its weighted distortion), for a fundamental of `depth` of
/// six-step: within a tenth of what the pulses have. The carriers count as one, that of 12 carriers a turn.
pub fn ripple_share(mode: Mode, depth: f32) -> f32 {
    const SQUARE: f32 = 0.046_4;
    let missing = if depth < 1.0 { 1.0 - depth } else { 0.0 };
    match mode {
        Mode::Square => SQUARE,
        Mode::Mid3 => SQUARE + 0.49 * missing * missing,
        Mode::Mid7 => SQUARE + 0.02 * missing,
        _ => 0.045_3,
    }
}
