//! A second axis of the table, the torque, and its possible benefit: patterns recomputed for operating points other than the one they were made for.
//!
//! For the flux harmonics `a` of order 6k − 1 and `b` of 6k + 1, the sum is ripple along the fundamental's flux and the difference is ripple along
//! its voltage. So with a gain from ripple flux to ripple current of `g` along the one and `h` along the other, the distortion of the current is,
//! except for a factor, `Σ (a² + b² + 2 ρ a b)` with `ρ = (g² − h²)/(g² + h²)`: a machine and its operating point enter only through this one number.

use super::*;
use crate::{MachineFolder, Optimum, SmoothMap};

/// ρ at the reference machine's operating points from a quarter of its torque up, including field weakening.
const SKEWS: [f64; 4] = [-0.44, -0.2, 0.25, 0.34];
/// Directions in which ripple flux makes torque there, ahead of the fundamental's voltage or behind it, in degrees; the last one applies only at the
/// largest torque in weakening.
const DIRECTIONS: [f64; 5] = [6.0, 23.0, 48.0, 60.0, 90.0];
/// The reference machine's currents (id, iq) in weakening at 2,700 r/min and 1,500 V, in A, at the largest torque, 900 and 600 N·m.
const WEAKENED: [(f64, f64); 3] = [(-202.6, 75.3), (-172.5, 78.7), (-97.4, 77.3)];
/// Harmonics that count, six a turn each.
const HARMONICS: usize = 40;

/// For a cost other than the distortion's square, the largest and the mean share by which patterns made for it are better, over every fifth node of a
/// branch.
fn bought(
    followed: &Followed,
    bounds: &[(f64, f64)],
    beside: &dyn Fn(&Waveform) -> f64,
    judged: &dyn Fn(&Waveform) -> f64,
) -> (f64, f64) {
    let Followed { branch, nodes } = followed;
    let shares: Vec<_> = nodes
        .iter()
        .rev()
        .step_by(5)
        .map(|(index, angles)| {
            let problem = branch.problem((index / STEP).round() as u32, bounds);
            let own = Problem { beside: Some(beside), ..problem }.calmest(angles).unwrap();
            let of = |angles_rad: &[f64]| judged(&Waveform { first: branch.first(), angles_rad });
            1.0 - of(&own) / of(angles)
        })
        .collect();
    (shares.iter().copied().fold(0.0, f64::max), shares.iter().sum::<f64>() / shares.len() as f64)
}

/// ρ at a current, and the angle of the torque's direction to the voltage, in degrees, from the flux linkage and the currents that a ripple of it causes.
fn seen_by_the_machine(map: &SmoothMap, (id_a, iq_a): (f64, f64)) -> (f64, f64) {
    let at = map.at(id_a, iq_a);
    let det = at.ldd_h * at.lqq_h - at.ldq_h * at.lqd_h;
    let current = |d: f64, q: f64| ((at.lqq_h * d - at.ldq_h * q) / det, (at.ldd_h * q - at.lqd_h * d) / det);
    let flux_wb = at.psi_d_wb.hypot(at.psi_q_wb);
    let (d, q) = (at.psi_d_wb / flux_wb, at.psi_q_wb / flux_wb);
    let torque = |(id, iq): (f64, f64), (along_d, along_q): (f64, f64)| {
        at.psi_d_wb * iq - at.psi_q_wb * id + along_d * iq_a - along_q * id_a
    };
    let (along_flux, along_voltage) = (current(d, q), current(-q, d));
    let (g, h) = (along_flux.0.hypot(along_flux.1), along_voltage.0.hypot(along_voltage.1));
    let (by_flux, by_voltage) = (torque(along_flux, (d, q)), torque(along_voltage, (-q, d)));
    ((g * g - h * h) / (g * g + h * h), (by_flux / by_voltage).atan().abs().to_degrees())
}

#[test]
fn the_reference_machine_is_within_what_is_tried() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../tables/pmasynrm-180kw");
    let MachineFolder { parameters, map, .. } = MachineFolder::read(std::path::Path::new(folder)).unwrap();
    let map = SmoothMap::new(&map);
    let optimum = Optimum::new(&map, &parameters);
    let shares = [0.25, 0.5, 0.75, 1.0].map(|share| optimum.least_current(share * parameters.max_torque_nm));
    let (mut skews, mut directions) = (Vec::new(), Vec::new());
    for at in shares.into_iter().chain(WEAKENED) {
        let (skew, degrees) = seen_by_the_machine(&map, at);
        println!("{at:.1?} A: ρ {skew:.3}, {degrees:.1}°");
        skews.push(skew);
        directions.push(degrees);
    }
    let ends = |values: &[f64]| {
        let fold = |by: fn(f64, f64) -> f64, from| values.iter().copied().fold(from, by);
        (fold(f64::min, f64::INFINITY), fold(f64::max, f64::NEG_INFINITY))
    };
    let ((low, high), (least, most)) = (ends(&skews), ends(&directions));
    assert!(SKEWS[0] <= low && high <= SKEWS[3] && low < -0.4 && high > 0.3, "{skews:?}");
    assert!(DIRECTIONS[0] - 1.0 < least && most > 89.0, "{directions:?}");
    assert!(directions.iter().all(|degrees| *degrees < 61.0 || *degrees > 89.0), "{directions:?}");
}

#[test]
fn a_second_axis_would_buy_little() {
    let (mut least_distortion, mut calmer) = (0.0_f64, 0.0_f64);
    for branch in BRANCHES {
        let followed = branch.followed().unwrap();
        let bounds = branch.bounds(&branch.best_at_anchor().unwrap()).unwrap();
        let mut line = format!("{:7}", branch.name);
        for skew in SKEWS {
            let cross = |wave: &Waveform| {
                2.0 * skew
                    * wave.flux_harmonics().take(HARMONICS).map(|(below, above)| below * above).sum::<f64>()
            };
            let (most, mean) =
                bought(&followed, &bounds, &cross, &|wave| (wave.ripple(None) + cross(wave)).sqrt());
            line +=
                &format!(" | ρ {skew:5}: {:4.1} % at most, {:4.1} % on average", 100.0 * most, 100.0 * mean);
            least_distortion = least_distortion.max(most);
        }
        // In weakening at the largest torque the patterns next to six-step are used.
        let is_last = branch.pulses <= 5 && branch.window.1 >= 97;
        for degrees in DIRECTIONS.into_iter().filter(|degrees| *degrees < 90.0 || is_last) {
            let ripple = TorqueRipple::ahead(degrees.to_radians());
            let torque = |wave: &Waveform| ripple.squared(wave);
            let (most, mean) = bought(&followed, &bounds, &torque, &|wave| torque(wave).sqrt());
            line +=
                &format!(" | {degrees}°: {:4.1} % at most, {:4.1} % on average", 100.0 * most, 100.0 * mean);
            calmer = calmer.max(most);
        }
        println!("{line}");
    }
    // Not zero: this shows that the optimiser is at work.
    assert!((0.01..0.04).contains(&least_distortion), "current distortion {least_distortion}");
    assert!((0.05..0.16).contains(&calmer), "torque ripple {calmer}");
}
