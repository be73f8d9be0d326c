//! The pulses of an optimised pattern, one carrier half after the other.

use super::{Branch, Pattern};
use crate::frames::{AlphaBeta, limit};
use crate::modulation::{CarrierHalf, SwitchLimits};

/// Share of a half's ticks from which volt-seconds count as far off.
const FAR_SHARE: f32 = 0.1;
/// Part of the volt-seconds across the direction that is then made along it. Chosen by trial, for errors of any size: 0.3 leaves 231 A of 306, 0.6 190 A,
/// 1 172 A; with 1.5 a start goes astray.
const LEAN: f32 = 0.5;

/// One phase's part of a carrier half.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Part {
    /// Level at the beginning of the half.
    pub level: bool,
    /// The place of its edge, as a share of the half.
    pub edge: Option<f32>,
    /// `true` if it also has an edge at its very beginning, and at its very end: these cannot move.
    pub jumps: (bool, bool),
}

/// A half of a branch's pattern at a modulation index, `period_ticks` long, with its edges moved so that it has `more_ticks` of additional
/// volt-seconds, over the link's voltage, in the stationary frame of the (mirrored) turn.
pub fn half(
    branch: &Branch,
    half: u32,
    period_ticks: u32,
    (index, more_ticks): (f32, AlphaBeta),
    devices: &SwitchLimits,
) -> CarrierHalf {
    let parts = branch.parts(half, index);
    let far_ticks = FAR_SHARE * period_ticks as f32;
    let has_one_edge = parts.iter().filter(|part| part.edge.is_some()).count() == 1;
    let leans = has_one_edge && more_ticks.squared() > far_ticks * far_ticks;
    played(&parts, period_ticks, if leans { leaning(more_ticks) } else { more_ticks }, devices)
}

/// Volt-seconds that lead the flux linkage to its magnitude by the one available direction, the voltage's, which lies across the
/// magnitude: flux linkage turned ahead grows, turned back it shrinks. Without this, a magnitude that is far off never gets there: with a tenth less
/// than by the map 306 A flowed when torque fell to none at 1,196 r/min, now 212 A. For small errors the direction itself is better, at switches
/// above all.
fn leaning(more_ticks: AlphaBeta) -> AlphaBeta {
    let AlphaBeta { alpha, beta } = more_ticks;
    AlphaBeta { alpha: alpha - LEAN * beta, beta: beta + LEAN * alpha }
}

/// The half of these parts, with their edges moved.
pub(super) fn played(
    parts: &[Part; 3],
    period_ticks: u32,
    more_ticks: AlphaBeta,
    devices: &SwitchLimits,
) -> CarrierHalf {
    let longer = longer(parts.map(|part| part.edge.is_some()), more_ticks);
    let mut out = CarrierHalf {
        period_ticks,
        compare_ticks: [u32::MAX; 3],
        start_levels: parts.map(|part| part.level),
        ..CarrierHalf::default()
    };
    let period = period_ticks as f32;
    let least = |jumps: bool| devices.min_pulse_ticks as f32 * if jumps { 1.0 } else { 0.5 };
    for ((compare, part), longer) in out.compare_ticks.iter_mut().zip(parts).zip(longer) {
        let Some(edge) = part.edge else { continue };
        // A falling edge comes later, a rising one earlier.
        let moved = edge * period + if part.level { longer } else { -longer };
        let (low, high) = (least(part.jumps.0), period - least(part.jumps.1));
        *compare = (limit(moved, low, high) + 0.5) as u32;
    }
    out
}

/// Ticks by which each phase is to be on for longer, if it has an `edge`: with two or three such phases the volt-seconds themselves,
/// with one the part of them that lies in its direction.
fn longer(edge: [bool; 3], more_ticks: AlphaBeta) -> [f32; 3] {
    let more = more_ticks.abc();
    let [a, b, c] = [more.a, more.b, more.c];
    match edge {
        [true, true, true] => [a, b, c],
        [true, true, false] => [a - c, b - c, 0.0],
        [true, false, true] => [a - b, 0.0, c - b],
        [false, true, true] => [0.0, b - a, c - a],
        _ => [1.5 * a, 1.5 * b, 1.5 * c],
    }
}

impl Part {
    /// Level at the end of the half.
    pub fn ends_at(&self) -> bool {
        self.level ^ self.edge.is_some()
    }

    /// The share of the half for which the level is the upper one.
    pub fn on(&self) -> f32 {
        let edge = self.edge.unwrap_or(1.0);
        if self.level { edge } else { 1.0 - edge }
    }
}

impl Branch {
    /// The parts of the three phases in half number `half`, at a modulation index.
    pub(super) fn parts(&self, half: u32, index: f32) -> [Part; 3] {
        let third = self.quarter() * 4 / 3;
        let pattern = self.pattern(index);
        [half, half + 2 * third, half + third].map(|half| pattern.part(half))
    }
}

impl Pattern<'_> {
    /// Phase a's part of half number `half`.
    fn part(&self, half: u32) -> Part {
        let quarter = self.branch.quarter();
        let (quadrant, rest) = (half / quarter % 4, half % quarter);
        let mirrored = quadrant & 1 != 0;
        let place = if mirrored { quarter - 1 - rest } else { rest } as f32;
        let per_half = 1.0 / self.branch.half_rad();
        let mut level = self.branch.starts_high;
        let mut edge = None;
        for angle in self.angles() {
            let beyond = angle * per_half - place;
            if beyond <= 0.0 {
                level = !level;
            } else if beyond < 1.0 {
                edge = Some(beyond);
            }
        }
        if mirrored {
            level ^= edge.is_some();
            edge = edge.map(|edge| 1.0 - edge);
        }
        let jumps = (!mirrored && rest == 0, mirrored && rest + 1 == quarter);
        Part { level: level ^ (quadrant >= 2), edge, jumps }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::super::flux::ripple;
    use super::*;
    use crate::frames::six_step_v;
    use crate::modulation::Mode;
    use std::{format, string::String, vec::Vec};

    const LINK_V: f32 = 1_500.0;
    const PERIOD: u32 = 10_000;
    const DEVICES: SwitchLimits =
        SwitchLimits { min_pulse_ticks: 0, dead_time_ticks: 0, shortest_half_ticks: 10_000 };

    /// Every branch at modulation indices through its window, also between nodes.
    fn everywhere() -> Vec<(Mode, &'static Branch, f32)> {
        let mut all = Vec::new();
        for mode in Mode::ALL {
            let Some(branch) = mode.branch() else { continue };
            let steps = ((branch.last - branch.first) / 0.003) as u32;
            all.extend((0..=steps).map(|step| (mode, branch, branch.first + 0.003 * step as f32)));
        }
        assert!(all.len() > 1_000);
        all
    }

    fn turn(branch: &Branch, index: f32) -> Vec<CarrierHalf> {
        let halves = 0..4 * branch.quarter();
        halves.map(|at| half(branch, at, PERIOD, (index, AlphaBeta::default()), &DEVICES)).collect()
    }

    /// The edges of a turn: place in halves, phase, level after it.
    fn edges(halves: &[CarrierHalf]) -> Vec<(f64, usize, bool)> {
        let mut edges = Vec::new();
        let ends = |half: &CarrierHalf, phase: usize| {
            half.start_levels[phase] ^ (half.compare_ticks[phase] < PERIOD)
        };
        let mut before = halves.last().unwrap();
        for (place, half) in halves.iter().enumerate() {
            for phase in 0..3 {
                if half.start_levels[phase] != ends(before, phase) {
                    edges.push((place as f64, phase, half.start_levels[phase]));
                }
                if half.compare_ticks[phase] < PERIOD {
                    let at = f64::from(half.compare_ticks[phase]) / f64::from(PERIOD);
                    edges.push((place as f64 + at, phase, !half.start_levels[phase]));
                }
            }
            before = half;
        }
        edges
    }

    /// The fundamental of phase a as a share of six-step, by its edges.
    fn fundamental(edges: &[(f64, usize, bool)], halves: f64) -> (f64, f64) {
        let own = edges.iter().filter(|(_, phase, _)| *phase == 0);
        let terms = own.map(|(at, _, rises)| {
            let angle = at / halves * core::f64::consts::TAU;
            let sign = if *rises { 0.5 } else { -0.5 };
            (sign * angle.cos(), sign * angle.sin())
        });
        terms.fold((0.0, 0.0), |sum, term| (sum.0 + term.0, sum.1 + term.1))
    }

    #[test]
    fn every_pattern_has_its_pulses_its_fundamental_and_three_equal_phases() {
        for (mode, branch, index) in everywhere() {
            let told = || -> String { format!("{} at {index}", mode.name()) };
            let (halves, played) = (f64::from(4 * branch.quarter()), turn(branch, index));
            let edges = edges(&played);
            let (sine, cosine) = fundamental(&edges, halves);
            assert!((sine / f64::from(index) - 1.0).abs() < 0.000_5, "{}: {sine}", told());
            assert!(cosine.abs() < 2e-4, "{}: {cosine}", told());
            for phase in 0..3 {
                let own: Vec<_> = edges.iter().filter(|edge| edge.1 == phase).collect();
                assert_eq!(own.len() as u32, 2 * mode.turn_ons(), "{}", told());
                for (at, _, rises) in own {
                    let moved = (at + halves * (1.0 - phase as f64 / 3.0)) % halves;
                    let like = |edge: &&(f64, usize, bool)| {
                        let apart = (edge.0 - moved).abs();
                        edge.1 == 0 && edge.2 == *rises && apart.min(halves - apart) < 2.0 / f64::from(PERIOD)
                    };
                    assert!(edges.iter().any(|edge| like(&edge)), "{} phase {phase} {at}", told());
                }
            }
        }
    }

    /// The flux of the pulses themselves, summed up over a turn, less its mean and its fundamental.
    #[test]
    fn the_ripple_is_that_of_the_pulses() {
        let omega = 600.0;
        for (mode, branch, index) in everywhere() {
            let played = turn(branch, index);
            let half_s = branch.half_rad() / omega;
            let mut flux = AlphaBeta::default();
            let mut path = Vec::new();
            for half in &played {
                path.push(flux);
                let [a, b, c] = half.on_ticks(0).map(|on| on as f32 / PERIOD as f32);
                let share =
                    AlphaBeta { alpha: (2.0 * a - b - c) / 3.0, beta: (b - c) / crate::frames::SQRT_3 };
                flux = flux + share * (LINK_V * half_s);
            }
            let mean =
                path.iter().fold(AlphaBeta::default(), |sum, one| sum + *one) * (1.0 / path.len() as f32);
            let voltage_v = index * six_step_v(LINK_V);
            let x = 0.5 * branch.half_rad();
            let round = voltage_v / omega * (1.0 + x * x / 6.0);
            for (place, flux) in path.iter().enumerate() {
                let angle = 2.0 * x * place as f32;
                let fundamental = AlphaBeta { alpha: -angle.cos(), beta: -angle.sin() } * round;
                let wanted = *flux - mean - fundamental;
                let got = ripple(mode, place as u32, voltage_v, LINK_V, omega).unwrap();
                let off = (got - wanted).squared().sqrt();
                assert!(
                    off < 4e-4 * LINK_V / omega,
                    "{} {index} {place}: {off} {got:?} {wanted:?}",
                    mode.name()
                );
            }
        }
    }

    /// By the flux of the pulses themselves over a turn, in steps of a fortieth of a half: the share of all ripple is within 12 %, that along the flux within
    /// 0.012 of the fundamental; 0.55 of all ripple for every branch would miss the latter by up to 0.11.
    #[test]
    fn the_ripples_shares_are_those_of_the_pulses() {
        const STEPS: u32 = 40;
        for (mode, branch, index) in everywhere() {
            let step_rad = f64::from(branch.half_rad()) / f64::from(STEPS);
            let mut flux = (0.0, 0.0);
            let mut path = Vec::new();
            for half in turn(branch, index) {
                for step in 0..STEPS {
                    let [from, to] = [step, step + 1].map(|step| half.on_ticks(PERIOD / STEPS * step));
                    let share = |phase: usize| f64::from(from[phase] - to[phase]) / f64::from(PERIOD / STEPS);
                    let [a, b, c] = [0, 1, 2].map(share);
                    flux.0 += (2.0 * a - b - c) / 3.0 * step_rad;
                    flux.1 += (b - c) / f64::from(crate::frames::SQRT_3) * step_rad;
                    path.push(flux);
                }
            }
            let samples = path.len() as f64;
            let mean = path.iter().fold((0.0, 0.0), |sum, (x, y)| (sum.0 + x / samples, sum.1 + y / samples));
            let fundamental = f64::from(index) * core::f64::consts::FRAC_2_PI;
            let (mut along, mut across) = (0.0, 0.0);
            for (place, (x, y)) in path.iter().enumerate() {
                let (sin, cos) = ((place as f64 + 1.0) * step_rad).sin_cos();
                let (x, y) = (mean.0 - x, mean.1 - y);
                along += (x * cos + y * sin - fundamental).powi(2) / samples;
                across += (y * cos - x * sin).powi(2) / samples;
            }
            let [along, all] = [along, along + across].map(|square| square.sqrt() / fundamental);
            let told = [branch.along(index), crate::modulation::ripple_share(mode, index)].map(f64::from);
            assert!((told[0] - along).abs() < 0.012, "{} {index}: {} for {along}", mode.name(), told[0]);
            assert!((told[1] / all - 1.0).abs() < 0.12, "{} {index}: {} for {all}", mode.name(), told[1]);
        }
    }

    #[test]
    fn edges_move_by_the_volt_seconds_that_are_asked_for() {
        let branch = Mode::named("opp11").and_then(Mode::branch).unwrap();
        let more = AlphaBeta { alpha: 60.0, beta: -25.0 };
        for at in 0..4 * branch.quarter() {
            let [plain, moved] =
                [AlphaBeta::default(), more].map(|more| half(branch, at, PERIOD, (0.6, more), &DEVICES));
            let movable = plain.compare_ticks.iter().filter(|compare| **compare < PERIOD).count();
            let longer = |phase: usize| moved.on_ticks(0)[phase] as f32 - plain.on_ticks(0)[phase] as f32;
            let [a, b, c] = [longer(0), longer(1), longer(2)];
            let got = AlphaBeta { alpha: (2.0 * a - b - c) / 3.0, beta: (b - c) / crate::frames::SQRT_3 };
            if movable > 1 {
                assert!((got - more).squared() < 4.0, "{at}: {got:?}");
            } else {
                // No farther from what is wanted in the one direction that there is.
                assert!(got.dot(more - got).abs() < 0.03 * more.squared(), "{at}: {got:?}");
            }
        }
    }

    /// A lone edge moves for a part of what lies across its phase, where that is far off; toward a phase from its neighbours is across it.
    #[test]
    fn a_lone_edge_moves_for_what_lies_across_it_where_that_is_far() {
        let branch = Mode::named("opp9a").and_then(Mode::branch).unwrap();
        let period = PERIOD as f32;
        let mut lone = 0;
        for at in 0..4 * branch.quarter() {
            let parts = branch.parts(at, 0.3);
            let edges = parts.map(|part| part.edge);
            let (Some(phase), 1) = (edges.iter().position(Option::is_some), edges.iter().flatten().count())
            else {
                continue;
            };
            if !edges[phase].is_some_and(|edge| (0.2..0.8).contains(&edge)) {
                continue;
            }
            lone += 1;
            let axis = core::f32::consts::TAU / 3.0 * phase as f32;
            let across = AlphaBeta { alpha: axis.sin(), beta: -axis.cos() };
            let longer = |share: f32| {
                let [plain, moved] = [0.0, share]
                    .map(|share| half(branch, at, PERIOD, (0.3, across * (share * period)), &DEVICES));
                (moved.on_ticks(0)[phase] as f32 - plain.on_ticks(0)[phase] as f32) / period
            };
            assert_eq!(longer(0.9 * FAR_SHARE), 0.0, "half {at}");
            for far in [1.1 * FAR_SHARE, -1.1 * FAR_SHARE] {
                assert!((longer(far) - 1.5 * LEAN * far).abs() < 2e-4, "half {at}: {}", longer(far));
            }
        }
        assert!(lone > 10, "{lone} halves");
    }

    #[test]
    fn moved_edges_keep_the_shortest_pulse() {
        let devices = SwitchLimits { min_pulse_ticks: 250, ..DEVICES };
        let branch = Mode::named("opp7b").and_then(Mode::branch).unwrap();
        for more in [1e5, -1e5].map(|alpha| AlphaBeta { alpha, beta: 0.7 * alpha }) {
            let halves = 0..4 * branch.quarter();
            let played: Vec<_> = halves.map(|at| half(branch, at, PERIOD, (0.8, more), &devices)).collect();
            for phase in 0..3 {
                let own: Vec<_> = edges(&played).into_iter().filter(|edge| edge.1 == phase).collect();
                for pair in own.windows(2) {
                    let ticks = (pair[1].0 - pair[0].0) * f64::from(PERIOD);
                    assert!(ticks.round() >= 250.0, "{ticks} ticks in phase {phase} at half {}", pair[0].0);
                }
            }
        }
    }

    #[test]
    fn a_calm_half_begins_where_the_flux_lies_next_to_its_fundamental() {
        for mode in Mode::ALL {
            let Some(branch) = mode.branch() else { continue };
            let voltage_v = 0.5 * (branch.first + branch.last) * six_step_v(LINK_V);
            let off =
                |half: u32| ripple(mode, half, voltage_v, LINK_V, 1.0).unwrap().squared().sqrt() / voltage_v;
            let least = (0..2 * branch.halves).min_by(|a, b| off(*a).total_cmp(&off(*b))).unwrap();
            let told = (0..2 * branch.halves).find(|half| branch.is_calm(*half)).unwrap();
            assert!(
                off(told) < off(least) + 0.001,
                "{}: {least} has {}, {told} {}",
                mode.name(),
                off(least),
                off(told)
            );
        }
    }
}
