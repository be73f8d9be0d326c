//! The second paper's planes of vectors: figures 3 and 7.

use super::super::ink::draw;
use super::super::sheet::{Axis, BLACK, BLUE, Colour, GREEN, GREY, Panel, Point, RED, Side, VIOLET};
use super::gates::{FIRST_ZERO, VECTORS, period, vectors, voltages};
use anyhow::Result;
use tractive::nine_switch::Scheme;

/// Length of an active vector, as a share of the link.
const LENGTH: f64 = 2.0 / 3.0;
/// The sectors' names.
const SECTORS: [&str; 6] = ["I", "II", "III", "IV", "V", "VI"];

fn polar(length: f64, degrees: f64) -> Point {
    let (sin, cos) = degrees.to_radians().sin_cos();
    (length * cos, length * sin)
}

fn circle(radius: f64) -> impl Iterator<Item = Point> {
    (0..=120).map(move |k| polar(radius, 3.0 * f64::from(k)))
}

fn plane(left: f64, title: &str, reach: f64) -> Panel {
    let axes = (Axis::of("α in U_{in}", -reach, reach), Axis::of("β in U_{in}", -reach, reach));
    Panel::plane((left, 0.0, 500.0, 520.0), title, axes.0, axes.1)
}

fn words(panel: &mut Panel, at: Point, text: &str, colour: Colour) {
    panel.words(at, text, Side::Middle, colour);
}

/// Figure 3: the vectors of the upper and of the lower motor by their names, with the legs' states.
pub fn figure3() -> Result<String> {
    let upper = motor(0, "a) Upper motor: V_{1} to V_{6}", BLUE);
    let lower = motor(1, "b) Lower motor: V_{7} to V_{12}", RED);
    draw((1000, 520), &[upper, lower])
}

fn motor(which: usize, title: &str, colour: Colour) -> Panel {
    let mut panel = plane(500.0 * which as f64, title, 1.05);
    panel.line((0..=6).map(|k| polar(LENGTH, 60.0 * f64::from(k))), GREY, 1.0);
    panel.dashes(circle(0.5 / 3.0_f64.sqrt()), GREEN);
    for (k, name) in SECTORS.into_iter().enumerate() {
        words(&mut panel, polar(0.44, 30.0 + 60.0 * k as f64), name, GREY);
    }
    let mut zeros = Vec::new();
    for (k, legs) in VECTORS.into_iter().enumerate() {
        let at = voltages(legs)[which];
        if k + 1 >= FIRST_ZERO {
            zeros.push(format!("V_{{{}}}", k + 1));
        } else if k / 6 == which {
            panel.arrow([(0.0, 0.0), at], colour);
            let [u, v, w] = legs.map(|leg| leg.to_string().replace('-', "−"));
            let far = 1.26;
            words(&mut panel, (far * at.0, far * at.1 + 0.05), &format!("V_{{{}}}", k + 1), BLACK);
            words(&mut panel, (far * at.0, far * at.1 - 0.05), &format!("({u} {v} {w})"), BLACK);
        }
    }
    panel.spot((0.0, 0.0), BLACK);
    panel.names = vec![
        ("U_{in}/(2√3): half the time".to_owned(), GREEN),
        (format!("{}: no voltage", zeros.join(", ")), BLACK),
    ];
    reference(&mut panel, which);
    panel
}

/// A reference between two vectors, with its angle.
fn reference(panel: &mut Panel, which: usize) {
    let degrees = 22.0;
    panel.arrow([(0.0, 0.0), polar(0.27, degrees)], VIOLET);
    panel.line((0..=22).map(|k| polar(0.14, f64::from(k))), VIOLET, 1.0);
    words(panel, polar(0.185, 10.0), &format!("θ_{{{}}}", which + 1), VIOLET);
    panel.words(polar(0.285, 26.0), &format!("V_{{ref{}}}", which + 1), Side::Right, VIOLET);
}

/// Figure 7: the zero vector that ZVO-SVPWM takes at each angle, obtained from the modulator degree by degree.
pub fn figure7() -> Result<String> {
    let outer = |degrees: i32| takes(f64::from(degrees) + 0.5, true);
    let inner = |degrees: i32| takes(f64::from(degrees) + 0.5, false);
    let upper = intervals("a) Upper motor: V_{14} or V_{13}", 0.0, "V_{14}", outer);
    let lower = intervals("b) Lower motor: V_{15} or V_{13}", 500.0, "V_{15}", inner);
    draw((1000, 520), &[upper, lower])
}

/// `true` if a motor's zero vector at an angle in degrees is its own, V14 of the upper and V15 of the lower one, and not V13.
fn takes(degrees: f64, upper: bool) -> bool {
    let (idle, own) = ((30.0, 0.0), (degrees, 0.4));
    let (motors, number) = if upper { ((own, idle), 14) } else { ((idle, own), 15) };
    let found = period(Scheme::Zvo, motors.0, motors.1, 0.0).map(|period| vectors(&period));
    let (low, high) = if upper { (0.25, 0.75) } else { (0.0, 0.25) };
    found.is_some_and(|found| {
        found.iter().any(|(from, to, one)| *one == number && *to > low + 1e-4 && *from < high - 1e-4)
    })
}

fn intervals(title: &str, left: f64, own: &str, takes: impl Fn(i32) -> bool) -> Panel {
    let mut panel = plane(left, title, 0.8);
    let rim = |degrees: f64| {
        let within = (degrees.rem_euclid(60.0) - 30.0).to_radians();
        LENGTH * 3.0_f64.sqrt() / 2.0 / within.cos()
    };
    let mut begin = 0;
    while begin < 360 {
        let same = (begin..360).take_while(|degrees| takes(*degrees) == takes(begin)).count() as i32;
        let corners = (begin..=begin + same).map(|k| polar(rim(f64::from(k)), f64::from(k)));
        let (colour, cover) = if takes(begin) { (BLUE, 0.25) } else { (GREY, 0.15) };
        panel.area(std::iter::once((0.0, 0.0)).chain(corners), colour, cover);
        begin += same;
    }
    for k in 0..12 {
        let degrees = 30.0 * f64::from(k);
        panel.line([(0.0, 0.0), polar(rim(degrees), degrees)], GREY, 1.0);
        let name = if takes(30 * k + 15) { own } else { "V_{13}" };
        words(&mut panel, polar(0.4, degrees + 15.0), name, BLACK);
        words(&mut panel, polar(0.7, degrees + 15.0), &(k + 1).to_string(), GREY);
    }
    panel.line((0..=6).map(|k| polar(LENGTH, 60.0 * f64::from(k))), GREY, 1.0);
    for k in 0..6 {
        words(&mut panel, polar(0.74, 60.0 * f64::from(k)), &format!("{}°", 60 * k), GREY);
    }
    panel
}
