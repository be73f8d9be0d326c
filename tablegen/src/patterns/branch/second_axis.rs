//! A second axis of the table, the torque, and what it would buy: patterns made anew for other points than the one they are made for.
//!
//! Of the flux harmonics `a` of order 6k − 1 and `b` of 6k + 1 the sum is ripple along the fundamental's flux, the difference ripple along
//! its voltage. So with a gain of ripple current by ripple flux of `g` along the one and `h` along the other the distortion of the
//! current is, but for a factor, `Σ (a² + b² + 2 ρ a b)` with `ρ = (g² − h²)/(g² + h²)`: all of a machine and its operating point is one number.

use super::*;

/// ρ at the reference machine's operating points from a quarter of its torque up, in weakening too.
const SKEWS: [f64; 4] = [-0.43, -0.2, 0.25, 0.33];
/// Directions in which ripple flux makes torque there, ahead of the fundamental's voltage or behind it, in degrees.
const DIRECTIONS: [f64; 4] = [9.0, 23.0, 48.0, 60.0];
/// Harmonics that count, six a turn each.
const HARMONICS: usize = 40;

/// For a cost beside the distortion's square, the largest and the mean share by which patterns made for it are better, over every fifth
/// node of a branch.
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
        for degrees in DIRECTIONS {
            let ripple = TorqueRipple::ahead(degrees.to_radians());
            let torque = |wave: &Waveform| ripple.squared(wave);
            let (most, mean) = bought(&followed, &bounds, &torque, &|wave| torque(wave).sqrt());
            line +=
                &format!(" | {degrees}°: {:4.1} % at most, {:4.1} % on average", 100.0 * most, 100.0 * mean);
            calmer = calmer.max(most);
        }
        println!("{line}");
    }
    // Not nothing: the optimiser is at work.
    assert!((0.01..0.04).contains(&least_distortion), "current distortion {least_distortion}");
    assert!((0.05..0.16).contains(&calmer), "torque ripple {calmer}");
}
