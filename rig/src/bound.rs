//! The bound set by pulses and the machine's inductances: distortion and torque ripple of the modulator's own pattern on the machine, with no control
//! at all.
//!
//! The volt-seconds of the pattern are exactly the stationary flux; without mean and fundamental they are its ripple. Added to the mean flux linkage
//! of the operating point and converted into current by the map, they give the least that any control could reach with these pulses. The folder is the
//! true machine's, whatever its map and its resistance are in the drive's tables.

use crate::analysis;
use crate::distortion::{self, Distortion, Samples};
use crate::machine::Machine;
use crate::options::RunOptions;
use crate::pattern::{self, Wanted};
use crate::trace::Recording;
use crate::verdict::{Verdict, bound, worst};
use core::f64::consts::{FRAC_2_PI, TAU};
use serde::Serialize;
use tractive::modulation::Mode;
use tractive_tablegen::SmoothMap;

/// A measured distortion compared with its bound.
#[derive(Clone, Debug, Serialize)]
pub struct Beside {
    /// Mechanical speed, in r/min.
    pub speed_rpm: f64,
    /// Mode.
    pub mode: &'static str,
    /// Current distortion, in percent.
    pub thd_percent: f64,
    /// The bound on it.
    pub thd_bound_percent: f64,
    /// Excess over the bound, in percent of it.
    pub thd_excess_percent: f64,
    /// Torque ripple, rms, in N·m.
    pub ripple_rms_nm: f64,
    /// The bound on it.
    pub ripple_rms_bound_nm: f64,
    /// Excess over the bound, in percent of it.
    pub ripple_rms_excess_percent: f64,
    /// Torque ripple, peak to peak, in N·m.
    pub ripple_peak_to_peak_nm: f64,
    /// The bound on it.
    pub ripple_peak_to_peak_bound_nm: f64,
    /// Excess over the bound, in percent of it.
    pub ripple_peak_to_peak_excess_percent: f64,
}

/// The limits that a run sets to its pulses.
#[derive(Clone, Copy, Debug)]
pub struct PulseLimits {
    /// Shortest pulse, in µs.
    pub min_pulse_us: f64,
    /// Rate of control, in Hz; `None`: the usual one.
    pub control_hz: Option<u32>,
}

/// The bound for the operating point in a window of a recording.
pub fn beside(
    recording: &Recording,
    window: (f64, f64),
    limits: PulseLimits,
    machine: &Machine,
) -> Option<Beside> {
    let rows = analysis::window(recording, window.0, window.1);
    let last = rows.last()?;
    let measured = distortion::of_recording(recording, window, &machine.folder);
    let bound = Distortion::of(&ideal(rows, limits, machine)?);
    // For pulses without ripple, no ripple is no excess.
    let excess = |value: f64, bound: f64| if value == bound { 0.0 } else { (value / bound - 1.0) * 100.0 };
    Some(Beside {
        speed_rpm: last.speed_rpm,
        mode: last.mode.name(),
        thd_percent: measured.thd_percent,
        thd_bound_percent: bound.thd_percent,
        thd_excess_percent: excess(measured.thd_percent, bound.thd_percent),
        ripple_rms_nm: measured.torque_rms_nm,
        ripple_rms_bound_nm: bound.torque_rms_nm,
        ripple_rms_excess_percent: excess(measured.torque_rms_nm, bound.torque_rms_nm),
        ripple_peak_to_peak_nm: measured.torque_peak_to_peak_nm,
        ripple_peak_to_peak_bound_nm: bound.torque_peak_to_peak_nm,
        ripple_peak_to_peak_excess_percent: excess(
            measured.torque_peak_to_peak_nm,
            bound.torque_peak_to_peak_nm,
        ),
    })
}

/// Fundamental periods of a pattern: the asynchronous carrier repeats only after several.
const fn cycles(mode: Mode) -> u32 {
    if mode.carriers() == 0 { 20 } else { 1 }
}

/// The distortion of pulses beyond which the current has no usable fundamental as a reference, in percent.
const NO_FUNDAMENTAL_PERCENT: f64 = 1000.0;

/// The verdicts on distortion and torque ripple: for an ideal inverter, no more than slightly above the bound. Distortion is judged at the points
/// whose current has a fundamental; if none has, it is only reported.
pub fn verdicts(points: &[Beside], options: &RunOptions) -> [Verdict; 3] {
    let with_fundamental: Vec<_> =
        points.iter().filter(|point| point.thd_bound_percent < NO_FUNDAMENTAL_PERCENT).collect();
    let all: Vec<_> = points.iter().collect();
    let (of, thd_percent) =
        if with_fundamental.is_empty() { (&all, f64::INFINITY) } else { (&with_fundamental, 2.0) };
    let judged = |what: &str, points: &[&Beside], value: fn(&Beside) -> f64, at_most: f64| {
        let found = worst(points.iter().map(|point| value(point)));
        Verdict::at_most(what, found, bound(options, at_most, f64::INFINITY))
    };
    [
        judged("current THD over its bound in %", of, |point| point.thd_excess_percent, thd_percent),
        judged("rms torque ripple over its bound in %", &all, |point| point.ripple_rms_excess_percent, 2.0),
        judged(
            "peak-to-peak torque over its bound in %",
            &all,
            |point| point.ripple_peak_to_peak_excess_percent,
            8.0,
        ),
    ]
}

/// The ideal samples at the operating point of these rows.
pub fn ideal(rows: &[crate::trace::Row], limits: PulseLimits, machine: &Machine) -> Option<Samples> {
    let last = rows.last()?;
    let map = SmoothMap::new(&machine.folder.map);
    // Backward rotation is forward rotation seen in a mirror.
    let mirror = last.speed_rpm.signum();
    let count = rows.len() as f64;
    let mean = |value: &dyn Fn(&crate::trace::Row) -> f64| rows.iter().map(value).sum::<f64>() / count;
    let flux = |row: &crate::trace::Row| map.at(row.id_a, mirror * row.iq_a);
    let at = Operation {
        mode: last.mode,
        speed_rpm: last.speed_rpm.abs(),
        udc_v: last.udc_v,
        current_a: (mean(&|row| row.id_a), mirror * mean(&|row| row.iq_a)),
        flux_wb: (mean(&|row| flux(row).psi_d_wb), mean(&|row| flux(row).psi_q_wb)),
    };
    let mut samples = at.samples(limits.min_pulse_us, limits.control_hz, machine)?;
    samples.torque_nm.iter_mut().for_each(|torque_nm| *torque_nm *= mirror);
    Some(samples)
}

/// An operating point in steady state, of a machine that turns forward.
pub struct Operation {
    /// Mode.
    pub mode: Mode,
    /// Mechanical speed, in r/min, greater than zero.
    pub speed_rpm: f64,
    /// DC link, in V.
    pub udc_v: f64,
    /// Mean current along d and q, in A.
    pub current_a: (f64, f64),
    /// Mean flux linkage along d and q, in Wb.
    pub flux_wb: (f64, f64),
}

impl Operation {
    /// The samples from the mode's own pulses, none of them shorter than this many µs, with control at a rate in Hz or, without one, at that which goes
    /// with the machine; `None` if the mode has none for this voltage.
    pub fn samples(&self, min_pulse_us: f64, control_hz: Option<u32>, machine: &Machine) -> Option<Samples> {
        let parameters = &machine.folder.parameters;
        let map = SmoothMap::new(&machine.folder.map);
        let pole_pairs = f64::from(parameters.pole_pairs);
        let f1_hz = self.speed_rpm * pole_pairs / 60.0;
        let omega = TAU * f1_hz;
        let ((id, iq), (psi_d, psi_q)) = (self.current_a, self.flux_wb);
        let resistance = parameters.stator_resistance_ohm;
        let (ud, uq) = (resistance * id - omega * psi_q, resistance * iq + omega * psi_d);
        let wanted = Wanted {
            mode: self.mode,
            voltage_v: if self.mode.is_whole() { self.udc_v * FRAC_2_PI } else { ud.hypot(uq) },
            udc_v: self.udc_v,
            f1_hz,
            cycles: cycles(self.mode),
            dead_time_us: 0.0,
            min_pulse_us,
            max_switching_hz: machine.tables.ratings.max_switching_hz,
            control_hz,
        };
        let ripple = Ripple::of(&wanted)?;
        let voltage_angle = uq.atan2(ud);
        let mut samples = Samples { angle: Vec::new(), current_a: Vec::new(), torque_nm: Vec::new() };
        let mut current = (id, iq);
        for (alpha, beta, angle) in ripple.points {
            // The rotor lags the voltage by the voltage's angle in its frame.
            let rotor = angle - voltage_angle;
            let (sin, cos) = rotor.sin_cos();
            let (d, q) = (psi_d + alpha * cos + beta * sin, psi_q + beta * cos - alpha * sin);
            current = map.inverse(d, q, current)?;
            samples.angle.push(angle);
            samples.current_a.push(current.0 * cos - current.1 * sin);
            samples.torque_nm.push(1.5 * pole_pairs * (d * current.1 - q * current.0));
        }
        Some(samples)
    }
}

/// A pattern's ripple flux, evenly sampled: (α, β) in Wb, and the angle of the fundamental voltage in rad.
struct Ripple {
    points: Vec<(f64, f64, f64)>,
}

/// Samples a fundamental period.
const PER_CYCLE: usize = 1440;

impl Ripple {
    fn of(wanted: &Wanted) -> Option<Self> {
        let edges = pattern::edges(wanted).ok()?;
        let period_s = f64::from(wanted.cycles) / wanted.f1_hz;
        let samples = PER_CYCLE * wanted.cycles as usize;
        let dt_s = period_s / samples as f64;
        let (mut levels, mut next) = ([false; 3], 0);
        let (mut now_s, mut alpha, mut beta) = (0.0, 0.0, 0.0);
        let mut flux = Vec::with_capacity(samples);
        for k in 0..samples {
            let until_s = k as f64 * dt_s;
            while now_s < until_s || edges.get(next).is_some_and(|(at_s, ..)| *at_s <= until_s) {
                let edge = edges.get(next).filter(|(at_s, ..)| *at_s <= until_s);
                let to_s = edge.map_or(until_s, |(at_s, ..)| *at_s);
                let [a, b, c] = levels.map(|on| if on { wanted.udc_v } else { 0.0 });
                alpha += (to_s - now_s) * (2.0 * a - b - c) / 3.0;
                beta += (to_s - now_s) * (b - c) / 3.0_f64.sqrt();
                now_s = to_s;
                if let Some((_, leg, on)) = edge {
                    levels[*leg] = *on;
                    next += 1;
                }
            }
            flux.push((alpha, beta));
        }
        let count = samples as f64;
        let omega = TAU * wanted.f1_hz;
        let mean =
            flux.iter().fold((0.0, 0.0), |sum, value| (sum.0 + value.0 / count, sum.1 + value.1 / count));
        // The fundamental: the component that turns forward once a period.
        let (mut cos, mut sin) = (0.0, 0.0);
        for (k, (alpha, beta)) in flux.iter().enumerate() {
            let (s, c) = (omega * k as f64 * dt_s).sin_cos();
            cos += (alpha * c + beta * s) / count;
            sin += (beta * c - alpha * s) / count;
        }
        let (size, phase) = (cos.hypot(sin), sin.atan2(cos));
        let points = flux.iter().enumerate().map(|(k, (alpha, beta))| {
            let angle = omega * k as f64 * dt_s + phase;
            let (s, c) = angle.sin_cos();
            // The integral of a turning vector lags it by a quarter of a turn.
            (alpha - mean.0 - size * c, beta - mean.1 - size * s, angle + 0.25 * TAU)
        });
        Some(Self { points: points.collect() })
    }
}
