//! The second paper's sequences over a carrier period: figures 2, 4 to 6, 8 and 9.

use super::super::ink::draw;
use super::super::sheet::{
    Axis, BLACK, BLUE, Colour, GREEN, GREY, LETTERS, Mark, Panel, Point, RED, Side, VIOLET,
};
use super::gates::{FIRST_ZERO, is_on, leg, period, steps, vectors};
use anyhow::{Context, Result};
use tractive::nine_switch::{GATES, Period, Scheme};

/// Angles in degrees and indices of the upper and the lower motor in the sequences: sector I for both, as in the paper.
const UPPER: (f64, f32) = (20.0, 0.4);
const LOWER: (f64, f32) = (40.0, 0.3);
/// The shoot-through duty that is drawn.
const DUTY: f32 = 0.2;
/// Width of a sheet, in px.
const WIDTH: f64 = 900.0;

fn made(scheme: Scheme, upper: (f64, f32), lower: (f64, f32), duty: f32) -> Result<Period> {
    period(scheme, upper, lower, duty).context("the modulator refuses the pulses of a picture")
}

/// The carrier: 0 at its valley, 1 at its peak.
fn carrier(t: f64) -> f64 {
    1.0 - (2.0 * t.rem_euclid(1.0) - 1.0).abs()
}

/// Dashed lines where the two motors' shares meet, and where the carrier turns.
fn quarters(panel: &mut Panel, (low, high): Point) {
    for t in [0.25, 0.75] {
        panel.dashes([(t, low), (t, high)], RED);
    }
    panel.dashes([(0.5, low), (0.5, high)], GREY);
}

/// The vectors in a row of boxes, zero vectors shaded, shoot-through hatched.
fn row_of_vectors(panel: &mut Panel, period: &Period, (low, high): Point) {
    for (from, to, number) in vectors(period) {
        if number >= FIRST_ZERO {
            panel.shade((from, low), (to, high), GREY, 0.35);
        }
        if number == 0 {
            panel.shade((from, low), (to, high), RED, 0.18);
            for k in 0..((to - from) * 200.0) as i32 {
                let x = from + f64::from(k) / 200.0;
                panel.line([(x, low), ((x + 0.01).min(to), high)], RED, 0.6);
            }
        }
        panel.line([(from, low), (to, low), (to, high), (from, high), (from, low)], BLACK, 0.8);
        if number > 0 && to - from > 0.025 {
            let at = (0.5 * (from + to), 0.5 * (low + high));
            panel.words(at, &format!("V_{{{number}}}"), Side::Middle, BLACK);
        }
    }
}

/// The legs' states, U highest, from a base on; a step of 1 each.
fn legs(panel: &mut Panel, period: &Period, base: f64) {
    for (k, (name, colour)) in [("U", BLUE), ("V", GREEN), ("W", VIOLET)].into_iter().enumerate() {
        let zero = base + 3.2 * (2 - k) as f64 + 1.0;
        let state = |t: f64| zero + leg(period, k, t).map_or(0.0, f64::from);
        panel.dashes([(0.0, zero), (1.0, zero)], LIGHT);
        panel.line(steps(period, state), colour, 1.8);
        panel.words((-0.035, zero), name, Side::Middle, BLACK);
        for (level, text) in [(-1.0, "−1"), (0.0, "0"), (1.0, "1")] {
            panel.marks.push(Mark::Words(
                (-0.006, zero + level),
                text.to_owned(),
                Side::Left,
                GREY,
                LETTERS - 1.0,
            ));
        }
    }
}

const LIGHT: Colour = plotters::style::RGBColor(215, 215, 215);

/// A panel over a carrier period, without numbers upwards.
fn over_a_period(top: f64, height: f64, title: &str, (low, high): Point) -> Panel {
    let axes = (Axis::of("time in carrier periods", 0.0, 1.0), Axis::of("", low, high).bare());
    Panel::new((0.0, top, WIDTH, height), title, axes.0, axes.1)
}

/// Vectors and legs of a scheme.
fn sequence(top: f64, title: &str, period: &Period) -> Panel {
    let mut panel = over_a_period(top, 330.0, title, (-0.3, 12.0));
    halves(&mut panel, (-0.3, 12.0));
    row_of_vectors(&mut panel, period, (10.2, 11.7));
    legs(&mut panel, period, 0.3);
    quarters(&mut panel, (-0.3, 10.2));
    panel
}

/// The two motors' halves of the period as grounds.
fn halves(panel: &mut Panel, (low, high): Point) {
    panel.shade((0.25, low), (0.75, high), BLUE, 0.05);
    panel.shade((0.0, low), (0.25, high), RED, 0.05);
    panel.shade((0.75, low), (1.0, high), RED, 0.05);
}

/// The six compare levels of figure 4: where the carrier crosses them H or L of a leg toggles.
fn compare_levels(panel: &mut Panel, period: &Period) {
    panel.line([(0.0, 0.0), (0.5, 1.0), (1.0, 0.0)], BLACK, 1.6);
    for (k, gate) in [0, 1, 2, 6, 7, 8].into_iter().enumerate() {
        let Some(t) = period.gates[gate].toggles().next() else { continue };
        let level = carrier(f64::from(t));
        let colour = if k < 3 { BLUE } else { RED };
        panel.dashes([(0.0, level), (1.0, level)], colour);
        let name = format!("T_{{COM{}}} ({})", k + 1, GATES[gate]);
        panel.words((if k < 3 { 0.995 } else { 0.745 }, level + 0.035), &name, Side::Left, colour);
    }
}

/// Figure 4: S-SVPWM with the carrier and the six compare levels.
pub fn figure4() -> Result<String> {
    let period = made(Scheme::S, UPPER, LOWER, 0.0)?;
    let title = "S-SVPWM: carrier, compare levels, vectors, states of the legs";
    let mut top = over_a_period(0.0, 320.0, title, (-0.02, 1.06));
    halves(&mut top, (-0.02, 1.06));
    compare_levels(&mut top, &period);
    quarters(&mut top, (-0.02, 1.06));
    top.words((0.42, 0.08), "upper motor", Side::Middle, BLUE);
    top.words((0.12, 0.95), "lower motor", Side::Middle, RED);
    draw((WIDTH as u32, 650), &[top, sequence(320.0, "", &period)])
}

/// Figures 5 and 6: the sequence of a scheme.
pub fn figure5_or_6(scheme: Scheme) -> Result<String> {
    let title = format!("{}-SVPWM: vectors and states of the legs", scheme.name().to_uppercase());
    draw((WIDTH as u32, 330), &[sequence(0.0, &title, &made(scheme, UPPER, LOWER, 0.0)?)])
}

/// Figure 8: ZVO-SVPWM's two sequences.
pub fn figure8() -> Result<String> {
    let with_own = made(Scheme::Zvo, UPPER, (15.0, LOWER.1), 0.0)?;
    let with_13 = made(Scheme::Zvo, (40.0, UPPER.1), LOWER, 0.0)?;
    let first = sequence(0.0, "a) ZVO-SVPWM where the zero vectors are V_{14} and V_{15}", &with_own);
    let second = sequence(330.0, "b) ZVO-SVPWM where they are V_{13}", &with_13);
    draw((WIDTH as u32, 660), &[first, second])
}

/// Figure 9, there of RTHD-SVPWM: shoot-through beside the zero vectors, the nine gates, and the link that it pulses.
pub fn shoot_through(scheme: Scheme) -> Result<String> {
    let period = made(scheme, UPPER, LOWER, DUTY)?;
    let blocks = vectors(&period).iter().filter(|(_, _, number)| *number == 0).count();
    let scheme = scheme.name().to_uppercase();
    let title =
        format!("{scheme}-SVPWM with a shoot-through duty of {DUTY}: {blocks} blocks, red and hatched");
    let mut panel = over_a_period(0.0, 480.0, &title, (-1.2, 15.6));
    halves(&mut panel, (-1.2, 15.6));
    row_of_vectors(&mut panel, &period, (13.8, 15.3));
    for (k, name) in GATES.into_iter().enumerate() {
        // Leg by leg, H above M above L.
        let base = 1.5 * (8 - (k % 3 * 3 + k / 3)) as f64;
        let colour = [BLUE, GREEN, VIOLET][k % 3];
        panel.line(steps(&period, |t| base + f64::from(u8::from(is_on(&period, k, t)))), colour, 1.6);
        panel.words((-0.008, base + 0.5), name, Side::Left, BLACK);
    }
    for (from, to, _) in vectors(&period).into_iter().filter(|(_, _, number)| *number == 0) {
        panel.shade((from, -1.2), (to, 13.8), RED, 0.15);
    }
    quarters(&mut panel, (-1.2, 13.8));
    let mut link = over_a_period(
        480.0,
        170.0,
        "The link that it pulses: no voltage while a leg is shorted",
        (-0.1, 1.25),
    );
    let shorted = |t: f64| (0..3).any(|k| leg(&period, k, t).is_none());
    link.line(steps(&period, |t| f64::from(u8::from(!shorted(t)))), BLACK, 1.8);
    link.words((-0.01, 1.0), "U_{in}", Side::Left, BLACK);
    link.words((-0.01, 0.0), "0", Side::Left, BLACK);
    draw((WIDTH as u32, 650), &[panel, link])
}

/// Figure 2: time-sharing. Two references that never cross on one carrier, and the half of the period that each motor has.
pub fn figure2() -> Result<String> {
    const CARRIERS: f64 = 18.0;
    let modulation_index = 0.5;
    let at = |turns: f64| {
        made(Scheme::S, (360.0 * turns, modulation_index), (252.0 * turns, modulation_index), 0.0)
    };
    let axes =
        (Axis::of("turns of the upper motor's voltage", 0.0, 1.0), Axis::of("carrier's level", 0.0, 1.0));
    let mut first =
        Panel::new((0.0, 0.0, WIDTH, 290.0), "a) One carrier, and leg U's two references", axes.0, axes.1);
    let triangle = (0..=2 * CARRIERS as i32).map(|k| (f64::from(k) / (2.0 * CARRIERS), f64::from(k % 2)));
    first.line(triangle, LIGHT, 1.0);
    let (mut upper, mut lower) = (Vec::new(), Vec::new());
    for k in 0..=180 {
        let turns = f64::from(k) / 180.0;
        let period = at(turns)?;
        let level = |gate: usize| period.gates[gate].toggles().next().map(|t| (turns, carrier(f64::from(t))));
        upper.extend(level(0));
        lower.extend(level(6));
    }
    first.named("of UH, the upper motor's", upper, BLUE);
    first.named("of UL, the lower motor's, at 0.7 of the frequency", lower, RED);
    first.dashes([(0.0, 0.5), (1.0, 0.5)], GREY);
    let period = at(0.27)?;
    let mut second = over_a_period(
        290.0,
        360.0,
        "b) One carrier period: the motors' turns, which meet at T/4 and 3T/4",
        (-4.6, 3.2),
    );
    halves(&mut second, (-4.6, 3.2));
    second.line([(0.0, 0.0), (0.5, 3.0), (1.0, 0.0)], BLACK, 1.6);
    for (gate, colour) in [(0, BLUE), (6, RED)] {
        let level = period.gates[gate].toggles().next().map_or(0.0, |t| 3.0 * carrier(f64::from(t)));
        second.line([(0.0, level), (1.0, level)], colour, 1.4);
    }
    for (gate, name, base) in [(0, "UH", -1.5), (3, "UM", -3.0), (6, "UL", -4.5)] {
        second.line(steps(&period, |t| base + f64::from(u8::from(is_on(&period, gate, t)))), BLACK, 1.6);
        second.words((-0.008, base + 0.5), name, Side::Left, BLACK);
    }
    quarters(&mut second, (-4.6, 3.2));
    for (t, text, colour) in
        [(0.125, "lower motor", RED), (0.56, "upper motor", BLUE), (0.875, "lower motor", RED)]
    {
        second.words((t, 1.75), text, Side::Middle, colour);
    }
    draw((WIDTH as u32, 650), &[first, second])
}
