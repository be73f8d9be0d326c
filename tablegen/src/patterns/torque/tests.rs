//! The ripple's torque as a turning vector's projection.

use super::*;

#[test]
fn torque_is_the_flux_vectors_projection() {
    let ripple = TorqueRipple::new();
    for (first, angles_rad) in
        [(1.0, &[0.3, 0.8, 1.2][..]), (-1.0, &[0.4, 1.1]), (1.0, &[0.15, 0.5, 0.7, 1.3])]
    {
        let wave = Waveform { first, angles_rad };
        let direction = -0.81 - FRAC_PI_2;
        let torque = |at: f64| -> f64 {
            let harmonics = (1..=20).zip(wave.flux_harmonics());
            harmonics
                .map(|(k, (below, above))| {
                    let turned = 6.0 * f64::from(k) * at;
                    above * (turned - direction).cos() + below * (turned + direction).cos()
                })
                .sum()
        };
        let instants = (0..64).map(|k| torque(FRAC_PI_3 * f64::from(k) / 64.0).powi(8));
        let mean = (instants.sum::<f64>() / 64.0).powf(0.25);
        let made = ripple.squared(&wave);
        assert!((made / (0.4 * mean) - 1.0).abs() < 1e-9, "{made}, not {}", 0.4 * mean);
    }
}
