//! The paper's figures of vectors and switching sequences, drawn from the modulator's own gates.

use crate::report::Page;
use core::f64::consts::TAU;
use tractive::frames::Angle;
use tractive::nine_switch::{MotorVoltage, Request, Scheme, step};

type Points = Vec<(f64, f64)>;

/// Figures 3 to 9 beside ours.
pub fn draw(page: &mut Page) {
    page.draw_xy("figure 3", "vectors of either motor", ("α in U_in", "β in U_in"), &hexagon());
    let sequences = [
        ("figure 4", Scheme::S),
        ("figure 5", Scheme::Rs),
        ("figure 6", Scheme::Rthd),
        ("figures 7 and 8", Scheme::Zvo),
    ];
    for (figure, scheme) in sequences {
        let title = format!("{}: states of the legs over a carrier period, no shoot-through", scheme.name());
        page.draw_xy(figure, &title, ("time in periods", LEVELS), &legs(scheme, 0.0));
    }
    for (_, scheme) in sequences {
        let title = format!("{}: the same with a shoot-through duty of 0.2", scheme.name());
        page.draw_xy("figure 9", &title, ("time in periods", LEVELS), &legs(scheme, 0.2));
    }
}

const LEVELS: &str = "−1, 0, 1, 2 = shorted";

fn hexagon() -> Vec<(String, Points)> {
    let corners = (0..=6).map(|k| {
        let (sin, cos) = (TAU * f64::from(k) / 6.0).sin_cos();
        (2.0 / 3.0 * cos, 2.0 / 3.0 * sin)
    });
    let share = (0..=90).map(|k| {
        let (sin, cos) = (TAU * f64::from(k) / 90.0).sin_cos();
        let half = 0.5 / 3.0_f64.sqrt();
        (half * cos, half * sin)
    });
    vec![
        ("active vectors".to_owned(), corners.collect()),
        ("what each of two motors may have at every angle".to_owned(), share.collect()),
    ]
}

/// The three legs' states, W lowest, for both motors in sector I.
fn legs(scheme: Scheme, shoot_through: f32) -> Vec<(String, Points)> {
    let motor = |degrees: f64, depth: f32| MotorVoltage {
        angle: Angle::from_radians((degrees / 360.0 * TAU) as f32),
        depth,
    };
    let request = Request { scheme, upper: motor(20.0, 0.4), lower: motor(40.0, 0.3), shoot_through };
    let Ok(period) = step(&request) else {
        return Vec::new();
    };
    const SAMPLES: usize = 4000;
    let on = |gate: usize, t: f64| {
        let pattern = &period.gates[gate];
        let toggles = pattern.toggles().filter(|at| f64::from(*at) <= t).count();
        pattern.starts_on() ^ (toggles % 2 == 1)
    };
    (0..3)
        .map(|leg| {
            let base = 4.0 * (2 - leg) as f64;
            let points = (0..=SAMPLES).map(|k| {
                let t = k as f64 / SAMPLES as f64;
                let state = match (on(leg, t), on(leg + 3, t), on(leg + 6, t)) {
                    (true, true, true) => 2.0,
                    (true, false, true) => 1.0,
                    (true, true, false) => -1.0,
                    _ => 0.0,
                };
                (t, base + state)
            });
            (["U", "V", "W"][leg].to_owned(), points.collect())
        })
        .collect()
}
