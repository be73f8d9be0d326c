//! The optimised patterns: each one's pulses, spectrum and distortion, from the modulator's own edges.

use super::chai::modes::{level, pulses};
use super::ink::draw;
use super::sheet::{Axis, BLACK, BLUE, Colour, GREEN, GREY, ORANGE, Panel, RED, Side, VIOLET, number};
use crate::machine::Machine;
use crate::pattern::LegEdge;
use anyhow::{Context, Result};
use core::f64::consts::TAU;
use tractive::modulation::{Ladder, Mode};
use tractive_tablegen::patterns::{BRANCHES, Branch};

const COLOURS: [Colour; 5] = [BLUE, RED, GREEN, ORANGE, VIOLET];
/// Highest harmonic of a spectrum, and of a distortion.
const SHOWN: u32 = 61;
const COUNTED: u32 = 499;

/// Top of the axis of distortion, in %.
const HIGHEST: f64 = 12.0;
/// Place of a pattern's name: share of its curve, distance above it in %, and side. The curves fall: a curve leaves the areas above to its
/// right and below to its left free.
fn name_place(name: &str) -> (f64, f64, Side) {
    match name {
        "opp5c" => (0.0, 0.0, Side::Left),
        "opp7e" => (1.0, -0.35, Side::Right),
        "opp13b" | "opp15" | "opp11" | "opp7a" | "opp7c" => (0.33, -0.25, Side::Left),
        _ => (0.5, 0.2, Side::Right),
    }
}

/// A pattern at a modulation index in its window.
struct Played {
    branch: Branch,
    index: f64,
    f1_hz: f64,
    edges: Vec<LegEdge>,
}

impl Played {
    /// The pattern as the modulator plays it, at nine tenths of the highest frequency that it is for.
    fn of(machine: &Machine, branch: Branch, index: f64) -> Result<Self> {
        let mode = Mode::named(branch.name).with_context(|| format!("no mode {}", branch.name))?;
        let f1_hz = 0.9 * branch.highest_hz;
        Ok(Self { branch, index, f1_hz, edges: pulses(machine, mode, f1_hz, index)? })
    }

    /// The pattern in the middle of its window, or at the index for which the best of many starts was sought.
    fn usual(machine: &Machine, branch: Branch) -> Result<Self> {
        Self::of(machine, branch, f64::from(branch.anchor) / 100.0)
    }

    fn title(&self) -> String {
        format!("{}: {} pulses, index {}", self.branch.name, self.branch.pulses, number(self.index))
    }

    /// Harmonic of a leg's voltage, as a share of its fundamental.
    fn harmonic(&self, order: u32) -> f64 {
        harmonic(&self.edges, self.f1_hz, order) / harmonic(&self.edges, self.f1_hz, 1)
    }
}

/// Harmonic of the first leg's level over one turn, in units of its own.
fn harmonic(edges: &[LegEdge], f1_hz: f64, order: u32) -> f64 {
    let turn = TAU * f64::from(order) * f1_hz;
    // The first entry of a leg is its level, not a change.
    let changes = edges.iter().filter(|(t_s, leg, _)| *leg == 0 && *t_s > 0.0);
    let (re, im) = changes.fold((0.0, 0.0), |(re, im), (t_s, _, on)| {
        let (sin, cos) = (turn * t_s).sin_cos();
        if *on { (re + cos, im + sin) } else { (re - cos, im - sin) }
    });
    re.hypot(im) / f64::from(order)
}

/// Weighted distortion `√Σ(V_n/n)²/V₁` of the harmonics that a machine sees, in percent.
fn distortion(edges: &[LegEdge], f1_hz: f64) -> f64 {
    let orders = (2..=COUNTED).filter(|order| order % 3 != 0);
    let sum: f64 = orders.map(|order| (harmonic(edges, f1_hz, order) / f64::from(order)).powi(2)).sum();
    100.0 * sum.sqrt() / harmonic(edges, f1_hz, 1)
}

/// Places of panels in two columns.
fn place(k: usize, height: f64) -> (f64, f64, f64, f64) {
    (480.0 * (k % 2) as f64, height * (k / 2) as f64, 480.0, height - 4.0)
}

/// A leg's level over a turn, of each pattern.
pub fn every_pulse(machine: &Machine) -> Result<String> {
    const ROW: f64 = 1.5;
    let rows = BRANCHES.len() as f64;
    let axes = (Axis::turn("pulse angle in degrees"), Axis::of("", -0.3, ROW * rows - 0.1).bare());
    let mut panel =
        Panel::new((110.0, 0.0, 850.0, 640.0), "A leg of each pattern over a turn", axes.0, axes.1);
    for (k, branch) in BRANCHES.into_iter().enumerate() {
        let played = Played::usual(machine, branch)?;
        let base = ROW * (rows - 1.0 - k as f64);
        let points = level(&played.edges, played.f1_hz, 0);
        panel.line(points.iter().map(|(x, on)| (x.min(360.0), base + on)), COLOURS[k % COLOURS.len()], 1.6);
        let words = format!("{}, index {}", branch.name, number(played.index));
        panel.words((-5.0, base + 0.5), &words, Side::Left, BLACK);
    }
    draw((960, 640), &[panel])
}

/// Harmonics of each pattern's voltage.
pub fn every_spectrum(machine: &Machine) -> Result<String> {
    const HEIGHT: f64 = 170.0;
    let mut panels = Vec::new();
    for (k, branch) in BRANCHES.into_iter().enumerate() {
        let played = Played::usual(machine, branch)?;
        let axes = (Axis::of("harmonic", 0.0, f64::from(SHOWN + 1)), Axis::of("% of V_{1}", 0.0, 110.0));
        let mut panel = Panel::new(place(k, HEIGHT), &played.title(), axes.0, axes.1);
        // For a machine without a neutral: odd, and no multiple of three.
        for order in (1..=SHOWN).step_by(2).filter(|order| order % 3 != 0) {
            let (x, height) = (f64::from(order), 100.0 * played.harmonic(order));
            panel.shade((x - 0.4, 0.0), (x + 0.4, height), if order == 1 { GREY } else { BLUE }, 1.0);
        }
        panels.push(panel);
    }
    draw((960, (HEIGHT * panels.len().div_ceil(2) as f64) as u32), &panels)
}

/// Weighted distortion over the modulation index, of each pattern in its window and of the paper's locked modes.
pub fn every_distortion(machine: &Machine) -> Result<String> {
    let axes = (Axis::of("modulation index", 0.3, 1.0), Axis::of("weighted distortion in %", 0.0, HIGHEST));
    let title = "Weighted distortion; dashed: the paper's modes";
    let mut panel = Panel::new((0.0, 0.0, 960.0, 560.0), title, axes.0, axes.1);
    for (k, branch) in BRANCHES.into_iter().enumerate() {
        let colour = COLOURS[k % COLOURS.len()];
        let mut points = Vec::new();
        for hundredths in branch.window.0.max(30)..=branch.window.1 {
            let played = Played::of(machine, branch, f64::from(hundredths) / 100.0)?;
            points.push((played.index, distortion(&played.edges, played.f1_hz)));
        }
        let (share, above, side) = name_place(branch.name);
        if let Some((x, y)) = points.get((share * points.len() as f64) as usize) {
            panel.words((*x, y + above), branch.name, side, colour);
        }
        panel.line(points, colour, 2.0);
    }
    for mode in Ladder::PAPER.modes().filter(|mode| mode.turn_ons() > 1) {
        let f1_hz = 0.9 * f64::from(machine.tables.ratings.max_switching_hz) / f64::from(mode.turn_ons());
        let mut points = Vec::new();
        for hundredths in (30..=98).step_by(2) {
            let share = f64::from(hundredths) / 100.0;
            // A carrier's amplitude ends below six-step: beyond it the mode is not asked for.
            let Ok(edges) = pulses(machine, mode, f1_hz, share) else { break };
            points.push((share, distortion(&edges, f1_hz)));
        }
        if let Some((x, y)) = points.iter().find(|(_, percent)| *percent < HIGHEST - 0.5) {
            panel.words((*x, y + 0.25), mode.name(), Side::Right, GREY);
        }
        panel.dashes(points, GREY);
    }
    draw((960, 560), &[panel])
}
