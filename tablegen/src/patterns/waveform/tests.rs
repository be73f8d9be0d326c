//! Harmonics compared with sums over all edges, integrals over the wave and finite differences.

use super::*;
use std::f64::consts::PI;

const WAVES: [(f64, &[f64]); 5] = [
    (1.0, &[0.5]),
    (-1.0, &[0.4, 1.1]),
    (1.0, &[0.2, 0.35, 0.9]),
    (-1.0, &[0.2, 0.35, 0.9, 1.4]),
    (1.0, &[0.1, 0.3, 0.6, 1.0, 1.3]),
];

/// The share of six-step's fundamental, by Simpson's rule from edge to edge.
fn integrated(wave: &Waveform, n: f64) -> f64 {
    let mut level = wave.first;
    let mut edges = vec![0.0];
    edges.extend(wave.angles_rad);
    edges.push(FRAC_PI_2);
    let mut sum = 0.0;
    for pair in edges.windows(2) {
        let step = (pair[1] - pair[0]) / 2_000.0;
        for k in 0..1_000 {
            let at = pair[0] + 2.0 * f64::from(k) * step;
            let [a, b, c] = [at, at + step, at + 2.0 * step].map(|angle| (n * angle).sin());
            sum += level * step / 3.0 * (a + 4.0 * b + c);
        }
        level = -level;
    }
    // 4/π of a quarter's integral, over 4/π.
    sum
}

#[test]
fn harmonics_are_the_waves_integrals() {
    for (first, angles_rad) in WAVES {
        let wave = Waveform { first, angles_rad };
        assert!((wave.fundamental() - integrated(&wave, 1.0)).abs() < 1e-9);
        for (k, (below, above)) in (1..=6).zip(wave.flux_harmonics()) {
            let n = 6.0 * f64::from(k);
            assert!((below - integrated(&wave, n - 1.0) / (n - 1.0)).abs() < 1e-10, "{n}");
            assert!((above - integrated(&wave, n + 1.0) / (n + 1.0)).abs() < 1e-10, "{n}");
        }
    }
}

#[test]
fn ripple_is_the_sum_of_the_harmonics_squares() {
    for (first, angles_rad) in WAVES {
        let wave = Waveform { first, angles_rad };
        let harmonic = |n: f64| {
            let edges = angles_rad.iter().enumerate();
            1.0 + edges.map(|(k, a)| 2.0 * (-1.0_f64).powi(k as i32 + 1) * (n * a).cos()).sum::<f64>()
        };
        let orders = (5..=997).filter(|n| n % 2 == 1 && n % 3 != 0).map(f64::from);
        let squares: f64 = orders.map(|n| (harmonic(n) / (n * n)).powi(2)).sum();
        assert!((wave.ripple(None) / squares - 1.0).abs() < 1e-9);
        assert!((wave.weighted_distortion() * wave.fundamental() / squares.sqrt() - 1.0).abs() < 1e-9);
    }
}

#[test]
fn slopes_are_finite_differences() {
    const STEP: f64 = 1e-5;
    for (first, angles_rad) in WAVES {
        // The previous content does not matter.
        let mut slopes = vec![7.0; angles_rad.len()];
        let whole = Waveform { first, angles_rad }.ripple(Some(&mut slopes));
        assert_eq!(whole, Waveform { first, angles_rad }.ripple(None));
        for (k, slope) in slopes.into_iter().enumerate() {
            let at = |by: f64, of: fn(&Waveform) -> f64| {
                let mut moved = angles_rad.to_vec();
                moved[k] += by;
                of(&Waveform { first, angles_rad: &moved })
            };
            let by = |of: fn(&Waveform) -> f64| (at(STEP, of) - at(-STEP, of)) / (2.0 * STEP);
            assert!((slope - by(|wave| wave.ripple(None))).abs() < 1e-7, "{k}: {slope}");
            let own = Waveform { first, angles_rad }.fundamental_slope(k);
            assert!((own - by(|wave| wave.fundamental())).abs() < 1e-8, "{k}: {own}");
        }
    }
}

#[test]
fn the_shortest_pulse_is_the_least_of_all() {
    let shortest = |angles_rad: &[f64]| Waveform { first: 1.0, angles_rad }.shortest_rad();
    for (angles, expected) in [
        (&[0.2, 0.9, 1.2][..], 0.2),
        (&[0.4, 0.9, 1.2], 0.3),
        (&[0.4, 0.9, 1.5], PI - 3.0),
        (&[1.0], 1.0),
        (&[], FRAC_PI_2),
    ] {
        assert!((shortest(angles) - expected).abs() < 1e-12, "{angles:?}");
    }
}
