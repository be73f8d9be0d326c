//! The ripple flux that each pulse pattern leaves at its carrier boundaries: pure functions of (mode, u, θ).
//!
//! In steady state the flux of a symmetric pattern runs along a hexagon; at a boundary it stands off its fundamental
//! by an amount that is known beforehand. Control subtracts it, so that samples at boundaries tell the fundamental.

use super::{Mode, middle60};
use crate::frames::{AlphaBeta, SinCos};

/// The ripple flux of a pattern in steady state. In each sector of 60° the flux moves along one edge of a hexagon, over as many
/// halves as the sector has.
#[derive(Clone, Copy, Debug)]
pub struct RippleFlux {
    sector_halves: u32,
    /// A half's length, in 5°.
    half_places: u32,
    /// Length of the hexagon's edge, `(2/3) udc (π/3 − N β/2)/ω`, in Wb.
    edge_wb: f32,
    /// Fundamental, `u/ω`, in Wb.
    fundamental_wb: f32,
}

impl RippleFlux {
    /// Of a pattern with a fundamental of `voltage_v` (peak phase) at a stator frequency of `omega` (rad/s, greater than zero).
    /// `None` for the triangular carriers: at their peaks and valleys the flux is that of the sampled fundamental.
    #[inline]
    pub fn new(mode: Mode, voltage_v: f32, udc_v: f32, omega: f32) -> Option<Self> {
        if !mode.is_pattern() {
            return None;
        }
        let sector_halves = mode.sector_halves();
        let zero = 2.0 * middle60::zero_rad(mode, voltage_v, udc_v);
        let per_omega = 1.0 / omega;
        let edge_wb = (2.0 / 3.0) * udc_v * (core::f32::consts::FRAC_PI_3 - zero) * per_omega;
        let half_places = PLACES.len() as u32 / sector_halves.max(1);
        Some(Self { sector_halves, half_places, edge_wb, fundamental_wb: voltage_v * per_omega })
    }

    /// At the boundary where half number `half` begins, in Wb, in the stationary frame of the (mirrored) turn.
    ///
    /// At half i of N the flux stands at `D (1 + (i/N)(e^{j60°} − 1))`, turned by the sector, with the edge D; from that the
    /// fundamental at `i/N · 60°` is taken away. The flux lags the voltage by 90°, and that the pulse angle by 90°.
    pub fn at(&self, half: u32) -> AlphaBeta {
        let Some((start, place)) = self.place(half) else {
            return AlphaBeta::default();
        };
        let Some(round) = PLACES.get(place as usize) else {
            return AlphaBeta::default();
        };
        let round = AlphaBeta { alpha: round.cos, beta: round.sin };
        (round * self.fundamental_wb - self.along_edge(place)).turned(*start)
    }

    /// The flux itself where half number `half` begins, which is that of the hexagon, in Wb, in the stationary frame of the (mirrored)
    /// turn.
    pub fn hexagon(&self, half: u32) -> AlphaBeta {
        match self.place(half) {
            Some((start, place)) => self.along_edge(place).turned(*start) * -1.0,
            None => AlphaBeta::default(),
        }
    }

    /// The beginning of a half's sector, and its place there in 5°.
    #[inline(always)]
    fn place(&self, half: u32) -> Option<(&'static SinCos, u32)> {
        let turn = 6 * self.sector_halves;
        let half = if half >= turn { half - turn } else { half };
        let sector = half.checked_div(self.sector_halves).unwrap_or(0);
        let place = (half - sector * self.sector_halves) * self.half_places;
        Some((SECTORS.get(sector as usize)?, place))
    }

    /// The distance of a place along the edge of the first sector, seen from the centre.
    #[inline(always)]
    fn along_edge(&self, place: u32) -> AlphaBeta {
        let part = place as f32 * (1.0 / PLACES.len() as f32);
        AlphaBeta { alpha: 1.0 - 0.5 * part, beta: part * (0.5 * crate::frames::SQRT_3) } * self.edge_wb
    }
}

/// The sectors' beginnings.
static SECTORS: [SinCos; 6] = directions(6);
/// The places of 5° in a sector, where a boundary may lie.
static PLACES: [SinCos; 12] = directions(72);

/// The first directions of so many that are evenly spread over the turn.
const fn directions<const N: usize>(count: u32) -> [SinCos; N] {
    let mut directions = [SinCos { sin: 0.0, cos: 1.0 }; N];
    let mut k = 0;
    while k < directions.len() {
        directions[k] = SinCos::of_turns(k as f64 / count as f64);
        k += 1;
    }
    directions
}

/// The ripple flux of any mode where half number `half` begins, in Wb, in the stationary frame of the (mirrored) turn, for a fundamental of
/// `voltage_v` (peak phase) at a stator frequency of `omega` (rad/s, greater than zero): nothing under a carrier.
#[inline(never)]
pub fn ripple_at(mode: Mode, half: u32, voltage_v: f32, udc_v: f32, omega: f32) -> AlphaBeta {
    #[cfg(feature = "optimal")]
    if let Some(ripple) = super::optimal::ripple(mode, half, voltage_v, udc_v, omega) {
        return ripple;
    }
    RippleFlux::new(mode, voltage_v, udc_v, omega).map_or(AlphaBeta::default(), |flux| flux.at(half))
}

/// The flux ripple of a mode as a share of the fundamental flux (its weighted distortion), for a fundamental of `modulation_index` of
/// six-step: within a tenth of what the pulses have, but for three pulses, which count by their torque. The carriers count as one, that of 12
/// carriers a turn.
pub fn ripple_share(mode: Mode, modulation_index: f32) -> f32 {
    #[cfg(feature = "optimal")]
    let modulation_index = mode.branch().map_or(modulation_index, |branch| branch.within(modulation_index));
    let missing = if modulation_index < 1.0 { 1.0 - modulation_index } else { 0.0 };
    let share = mode.row().ripple;
    share.least + share.linear * missing + share.square * missing * missing
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;

    /// The flux of the pulses themselves, summed up over a turn, less its fundamental.
    #[test]
    fn the_ripple_is_that_of_a_hexagon() {
        for (mode, halves) in [(Mode::Mid7, 36), (Mode::Mid5, 24), (Mode::Mid3, 12), (Mode::Square, 12)] {
            let (omega, udc_v) = (600.0_f32, 1500.0_f32);
            let voltage_v = if mode == Mode::Square { 954.93 } else { 900.0 };
            let ripple = RippleFlux::new(mode, voltage_v, udc_v, omega).unwrap();
            let notch =
                if mode == Mode::Square { 0.0 } else { middle60::half_notch_rad(mode, voltage_v, udc_v) };
            let per_sector = halves / 6;
            let edge = f64::from(2.0 / 3.0 * udc_v / omega)
                * (core::f64::consts::FRAC_PI_3 - f64::from(per_sector) * f64::from(notch));
            for half in 0..halves {
                let corner = |k: u32| {
                    let angle = f64::from(k) * core::f64::consts::FRAC_PI_3 + core::f64::consts::PI;
                    (edge * angle.cos(), edge * angle.sin())
                };
                let (sector, part) =
                    (half / per_sector, f64::from(half % per_sector) / f64::from(per_sector));
                let ((x0, y0), (x1, y1)) = (corner(sector), corner(sector + 1));
                let turned =
                    f64::from(half) / f64::from(halves) * core::f64::consts::TAU + core::f64::consts::PI;
                let round = f64::from(voltage_v / omega);
                let expected = (
                    x0 + part * (x1 - x0) - round * turned.cos(),
                    y0 + part * (y1 - y0) - round * turned.sin(),
                );
                let got = ripple.at(half);
                let error = (f64::from(got.alpha) - expected.0).hypot(f64::from(got.beta) - expected.1);
                assert!(error < 2e-6, "{mode:?} {half} {got:?} {expected:?}");
            }
        }
        assert!(RippleFlux::new(Mode::Sync12, 500.0, 1500.0, 300.0).is_none());
    }
}
