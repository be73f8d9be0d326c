//! The ripple flux that each pulse pattern leaves at its carrier boundaries: pure functions of (mode, u, θ).
//!
//! In steady state the flux of a symmetric pattern runs along a hexagon; at a boundary it differs from its fundamental
//! by a known amount. Control subtracts it, so that samples at boundaries show the fundamental.

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
    /// The ripple of a pattern with a fundamental of `voltage_v` (peak phase) at a stator frequency of `omega` (rad/s, greater than zero).
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

    /// The ripple at the boundary where half number `half` begins, in Wb, in the stationary frame of the (mirrored) turn.
    ///
    /// At half i of N the flux is at `D (1 + (i/N)(e^{j60°} − 1))`, turned by the sector, with the edge D; the
    /// fundamental at `i/N · 60°` is subtracted from it. The flux lags the voltage by 90°, and the voltage lags the pulse angle by 90°.
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

    /// The flux itself, which is that of the hexagon, at the beginning of half number `half`, in Wb, in the stationary frame of the (mirrored)
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

/// The first of so many directions that are evenly spread over the turn.
const fn directions<const N: usize>(count: u32) -> [SinCos; N] {
    let mut directions = [SinCos { sin: 0.0, cos: 1.0 }; N];
    let mut k = 0;
    while k < directions.len() {
        directions[k] = SinCos::of_turns(k as f64 / count as f64);
        k += 1;
    }
    directions
}

/// The ripple flux of any mode at the beginning of half number `half`, in Wb, in the stationary frame of the (mirrored) turn, for a fundamental of
/// `voltage_v` (peak phase) at a stator frequency of `omega` (rad/s, greater than zero): zero under a carrier.
#[inline(never)]
pub fn ripple_at(mode: Mode, half: u32, voltage_v: f32, udc_v: f32, omega: f32) -> AlphaBeta {
    #[cfg(feature = "optimal")]
    if let Some(ripple) = super::optimal::ripple(mode, half, voltage_v, udc_v, omega) {
        return ripple;
    }
    RippleFlux::new(mode, voltage_v, udc_v, omega).map_or(AlphaBeta::default(), |flux| flux.at(half))
}

/// The flux ripple of a mode as a share of the fundamental flux (its weighted distortion), for a fundamental of `modulation_index` of
/// six-step: within 6 % of that of a pattern's pulses, 12 % of an optimised one's. All carriers count as one, that of 12
/// carriers a turn.
#[inline(always)]
pub fn ripple_share(mode: Mode, modulation_index: f32) -> f32 {
    #[cfg(feature = "optimal")]
    let modulation_index = mode.branch().map_or(modulation_index, |branch| branch.within(modulation_index));
    let missing = if modulation_index < 1.0 { 1.0 - modulation_index } else { 0.0 };
    let share = mode.row().ripple;
    share.least + share.linear * missing + share.square * missing * missing
}

/// Least stator frequency of a locked pattern, in rad/s: only for a rotor that has just stopped is one made so slowly.
const SLOWEST: f32 = 1.0;

/// Mean squares of a mode's flux ripple along the flux linkage and across it, over the square of the link's voltage, in s², for a fundamental of
/// `modulation_index` of six-step at a stator frequency of `omega` (rad/s; a free carrier's halves last `free_half_s` at any).
///
/// For a carrier with min-max zero sequence they are polynomials of `m`, the amplitude over half of the link, times (udc T)² with the half's length T:
/// the volt-seconds of the half's three edges, squared and averaged over the half and the turn. A pattern's zero vectors make ripple across the flux
/// linkage, its hexagon ripple along it.
#[inline(always)]
pub fn ripple_squares(mode: Mode, modulation_index: f32, omega: f32, free_half_s: f32) -> [f32; 2] {
    let omega = if omega > SLOWEST { omega } else { SLOWEST };
    if mode.is_carrier() {
        let m = modulation_index * (4.0 / core::f32::consts::PI);
        let half_s = match mode.carriers() {
            0 => free_half_s,
            carriers => core::f32::consts::PI / (carriers as f32 * omega),
        };
        let square = half_s * half_s * m * m;
        return [square * (0.003_062_9 * m), square * (1.0 / 48.0 - (0.033_692_3 - 0.013_746_2 * m) * m)];
    }
    if !mode.has_path() {
        return [0.0; 2];
    }
    let per_v = modulation_index * core::f32::consts::FRAC_2_PI / omega;
    let share = ripple_share(mode, modulation_index);
    let along = along_share(mode, modulation_index);
    let along = if along < share { along } else { share };
    let (along, share) = (along * along, share * share);
    [along, share - along].map(|square| square * (per_v * per_v))
}

/// The rms value of a pattern's ripple along the flux linkage as a share of the fundamental flux: a hexagon's own, or by the optimised pattern's angles.
#[inline(always)]
fn along_share(mode: Mode, _modulation_index: f32) -> f32 {
    #[cfg(feature = "optimal")]
    if let Some(branch) = mode.branch() {
        return branch.along(_modulation_index);
    }
    mode.row().ripple.least
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use std::vec::Vec;

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

    /// Mean squares of what a turn of a pattern's pulses leaves around its fundamental, along and across it, over the square of the fundamental.
    fn of_pattern(mode: Mode, index: f64) -> [f64; 2] {
        const STEPS: u32 = 36_000;
        let (halves, udc_v) = (2 * mode.carriers(), 1_500.0_f32);
        let voltage_v = index as f32 * udc_v * core::f32::consts::FRAC_2_PI;
        let notch = f64::from(middle60::half_notch_rad(mode, voltage_v, udc_v));
        let half_rad = core::f64::consts::TAU / f64::from(halves);
        let per_sector = halves / 6;
        let speed = f64::from(2.0 / 3.0 * udc_v);
        let edge = speed * (core::f64::consts::FRAC_PI_3 - f64::from(per_sector) * notch);
        let mut sums = [0.0; 2];
        for step in 0..STEPS {
            let turned = (f64::from(step) + 0.5) / f64::from(STEPS) * core::f64::consts::TAU;
            let half = (turned / half_rad) as u32;
            let (into, in_sector) = (turned - f64::from(half) * half_rad, half % per_sector);
            let moving =
                if half.is_multiple_of(2) { into.min(half_rad - notch) } else { (into - notch).max(0.0) };
            let moved = speed * (moving + f64::from(in_sector) * (half_rad - notch));
            let corner = f64::from(half / per_sector) * core::f64::consts::FRAC_PI_3;
            // The flux from the centre, turned back by the fundamental's angle.
            let (at, along) = (corner - turned, corner - turned + 2.0 * core::f64::consts::FRAC_PI_3);
            let flux = (edge * at.cos() + moved * along.cos(), edge * at.sin() + moved * along.sin());
            let off = [flux.0 - f64::from(voltage_v), flux.1];
            sums = [0, 1].map(|axis: usize| sums[axis] + off[axis] * off[axis]);
        }
        sums.map(|sum| sum / f64::from(STEPS) / f64::from(voltage_v).powi(2))
    }

    /// The ripple of patterns is that of their pulses: as a whole within 6 % of its rms value, and a quarter of its square may be on the wrong axis.
    #[test]
    fn the_squares_are_those_of_patterns() {
        for (mode, least) in [(Mode::Mid7, 0.45), (Mode::Mid5, 0.5), (Mode::Mid3, 0.5), (Mode::Square, 1.0)] {
            for index in (0..=10).map(|k| least + (0.99 - least) * f64::from(k) / 10.0) {
                let omega = 700.0;
                let per_v = index as f32 * core::f32::consts::FRAC_2_PI / omega;
                let got =
                    ripple_squares(mode, index as f32, omega, 0.0).map(|s2| f64::from(s2 / (per_v * per_v)));
                let wanted = of_pattern(mode, index);
                let shares = [got, wanted].map(|[along, across]| (along + across).sqrt());
                assert!((shares[0] / shares[1] - 1.0).abs() < 0.06, "{mode:?} {index}: {shares:?}");
                let off = (got[0] - wanted[0]).abs() / (shares[1] * shares[1]);
                assert!(off < 0.25, "{mode:?} {index}: {got:?}, not {wanted:?}");
                assert!(got[0] > 0.0 && got[1] >= 0.0, "{mode:?} {index}: {got:?}");
            }
        }
    }

    /// Mean squares of what the halves of a carrier leave, along the voltage and across it, over the square of the link's volt-seconds in a half.
    fn of_carrier(m: f64) -> [f64; 2] {
        const TURN: u32 = 720;
        let mut sums = [0.0; 2];
        for step in 0..TURN {
            let turned = (f64::from(step) + 0.5) / f64::from(TURN) * core::f64::consts::TAU;
            let phases =
                [0, 1, 2].map(|k| 0.5 * m * (turned - f64::from(k) * core::f64::consts::TAU / 3.0).cos());
            let zero = -0.5
                * (phases.iter().fold(-1.0, |a: f64, b| a.max(*b))
                    + phases.iter().fold(1.0, |a: f64, b| a.min(*b)));
            let on_from = phases.map(|volts| 0.5 - volts - zero);
            let mut edges: Vec<f64> = on_from.into_iter().chain([1.0]).collect();
            edges.sort_by(f64::total_cmp);
            let (mut from, mut flux) = (0.0, [0.0; 2]);
            for to in edges {
                let levels = on_from.map(|on| f64::from(u8::from(from >= on)));
                let alpha = (2.0 * levels[0] - levels[1] - levels[2]) / 3.0;
                let beta = (levels[1] - levels[2]) / 3.0_f64.sqrt();
                let (sin, cos) = turned.sin_cos();
                let slope = [alpha * cos + beta * sin - 0.5 * m, beta * cos - alpha * sin];
                let length = to - from;
                for axis in 0..2 {
                    let (at, slope) = (flux[axis], slope[axis] * length);
                    sums[axis] += length * (at * at + at * slope + slope * slope / 3.0);
                    flux[axis] += slope;
                }
                from = to;
            }
        }
        sums.map(|sum| sum / f64::from(TURN))
    }

    /// A carrier's voltage is across its flux linkage.
    #[test]
    fn the_squares_are_those_of_carriers() {
        for index in [0.02, 0.2, 0.45, 0.7, 0.9] {
            let [along_voltage, across_voltage] = of_carrier(index * 4.0 / core::f64::consts::PI);
            let wanted = [across_voltage, along_voltage];
            for (mode, omega, half_s) in
                [(Mode::Async, 0.0, 2e-4_f32), (Mode::Sync15, 300.0, core::f32::consts::PI / 4_500.0)]
            {
                let got = ripple_squares(mode, index as f32, omega, 2e-4)
                    .map(|s2| f64::from(s2 / (half_s * half_s)));
                for (got, wanted) in got.into_iter().zip(wanted) {
                    assert!((got - wanted).abs() < 1e-3 * wanted, "{mode:?} {index}: {got} {wanted}");
                }
            }
        }
        assert_eq!(ripple_squares(Mode::Off, 0.5, 0.0, 2e-4), [0.0; 2], "no pulses, no ripple");
    }
}
