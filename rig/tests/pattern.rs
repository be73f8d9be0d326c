//! The modulator's pulses in steady state, by their spectrum.

use std::f64::consts::{FRAC_2_PI, TAU};
use tractive::modulation::Mode;
use tractive_rig::pattern::{Wanted, edges};

const UDC_V: f64 = 1500.0;

/// Levels of the three legs over whole cycles.
struct Pattern {
    edges: Vec<(f64, usize, bool)>,
    f1_hz: f64,
    cycles: u32,
}

impl Pattern {
    fn new(mode: Mode, voltage_v: f64, f1_hz: f64, cycles: u32) -> Self {
        let wanted = Wanted {
            mode,
            voltage_v,
            udc_v: UDC_V,
            f1_hz,
            cycles,
            dead_time_us: 0.0,
            min_pulse_us: 0.0,
            max_switching_hz: 900.0,
            control_hz: None,
        };
        Self { edges: edges(&wanted).unwrap(), f1_hz, cycles }
    }

    /// Harmonic `order` (of the fundamental, may be fractional) of phase u's voltage against the star point, in V.
    fn harmonic(&self, order: f64) -> (f64, f64) {
        let end_s = f64::from(self.cycles) / self.f1_hz;
        let omega = TAU * self.f1_hz * order;
        let (mut cosine, mut sine) = (0.0, 0.0);
        for (leg, weight) in [(0, 2.0 / 3.0), (1, -1.0 / 3.0), (2, -1.0 / 3.0)] {
            let changes: Vec<_> = self.edges.iter().filter(|(_, of, _)| *of == leg).collect();
            for (index, (from_s, _, on)) in changes.iter().enumerate() {
                let to_s = changes.get(index + 1).map_or(end_s, |(t_s, _, _)| t_s.min(end_s));
                if *on {
                    cosine += weight * ((omega * to_s).sin() - (omega * from_s).sin());
                    sine -= weight * ((omega * to_s).cos() - (omega * from_s).cos());
                }
            }
        }
        let scale = 2.0 * UDC_V / (omega * end_s);
        (scale * cosine, scale * sine)
    }

    fn fundamental_v(&self) -> f64 {
        let (cosine, sine) = self.harmonic(1.0);
        cosine.hypot(sine)
    }

    /// Harmonics weighted by 1/order, over the fundamental, in percent.
    fn weighted_distortion_percent(&self) -> f64 {
        let cycles = self.cycles as i32;
        let orders = (1..300 * cycles).filter(|k| *k != cycles).map(|k| f64::from(k) / f64::from(cycles));
        let sum: f64 = orders
            .map(|order| {
                let (cosine, sine) = self.harmonic(order);
                (cosine * cosine + sine * sine) / (order * order)
            })
            .sum();
        100.0 * sum.sqrt() / self.fundamental_v()
    }

    /// Switch-ons of leg u per cycle.
    fn pulses(&self) -> f64 {
        let ons = self.edges.iter().filter(|(t_s, leg, on)| *t_s > 0.0 && *leg == 0 && *on).count();
        ons as f64 / f64::from(self.cycles)
    }
}

#[test]
fn every_mode_makes_the_fundamental_that_it_is_asked_for() {
    let six_step = UDC_V * FRAC_2_PI;
    let cases = [
        (Mode::Async, 22.5, 40, [0.05, 0.3, 0.6, 0.88]),
        (Mode::Sync15, 50.0, 4, [0.05, 0.3, 0.6, 0.88]),
        (Mode::Sync12, 70.0, 4, [0.05, 0.3, 0.6, 0.88]),
        (Mode::Mid7, 100.0, 4, [0.5, 0.7, 0.9, 0.97]),
        (Mode::Mid5, 150.0, 4, [0.4, 0.7, 0.9, 0.97]),
        (Mode::Mid3, 120.0, 4, [0.3, 0.7, 0.9, 0.98]),
        (Mode::Square, 130.0, 4, [1.0, 1.0, 1.0, 1.0]),
    ];
    for (mode, f1_hz, cycles, indices) in cases {
        for modulation_index in indices {
            let wanted = modulation_index * six_step;
            let error = Pattern::new(mode, wanted, f1_hz, cycles).fundamental_v() / wanted - 1.0;
            println!("{} at {modulation_index}: {:.4} %", mode.name(), 100.0 * error);
            let bound = if mode == Mode::Square { 1e-3 } else { 3e-3 };
            assert!(error.abs() < bound, "{} at {modulation_index}: {error}", mode.name());
        }
    }
}

#[test]
fn weighted_distortion_is_that_of_the_literature() {
    let six_step = UDC_V * FRAC_2_PI;
    let cases = [
        (Mode::Async, 450.0, 40.0, 2, 2.41),
        (Mode::Sync15, 450.0, 55.0, 1, 3.62),
        (Mode::Sync12, 450.0, 70.0, 1, 4.53),
        (Mode::Mid7, 0.7 * six_step, 100.0, 1, 5.28),
        (Mode::Mid5, 0.7 * six_step, 150.0, 1, 5.99),
        (Mode::Mid3, 0.7 * six_step, 120.0, 1, 9.07),
        (Mode::Mid7, 0.9 * six_step, 100.0, 1, 4.65),
        (Mode::Mid5, 0.9 * six_step, 150.0, 1, 4.67),
        (Mode::Mid3, 0.9 * six_step, 120.0, 1, 4.96),
        (Mode::Square, six_step, 130.0, 1, 4.64),
    ];
    for (mode, voltage_v, f1_hz, cycles, wanted) in cases {
        let got = Pattern::new(mode, voltage_v, f1_hz, cycles).weighted_distortion_percent();
        println!("{}: {got:.3} % (literature {wanted})", mode.name());
        assert!((got - wanted).abs() < 0.02, "{}: {got}", mode.name());
    }
}

#[test]
fn locked_modes_switch_as_often_as_they_say() {
    for mode in Mode::ALL.into_iter().filter(|mode| mode.carriers() > 0) {
        let pulses = f64::from(mode.turn_ons());
        // Some branches of optimised patterns end below 600 V.
        let voltage_v = if mode.is_optimal() { 500.0 } else { 600.0 };
        assert_eq!(Pattern::new(mode, voltage_v, 100.0, 6).pulses(), pulses, "{}", mode.name());
    }
}

#[test]
fn patterns_keep_half_wave_symmetry_where_they_should() {
    for (mode, symmetric) in [
        (Mode::Sync15, true),
        (Mode::Sync12, false),
        (Mode::Mid7, true),
        (Mode::Mid5, true),
        (Mode::Mid3, true),
    ] {
        let pattern = Pattern::new(mode, 500.0, 100.0, 2);
        let even: f64 = [8.0, 10.0, 14.0, 16.0]
            .iter()
            .map(|order| pattern.harmonic(*order).0.hypot(pattern.harmonic(*order).1))
            .sum();
        assert_eq!(even < 2.0, symmetric, "{}: {even} V", mode.name());
    }
}
