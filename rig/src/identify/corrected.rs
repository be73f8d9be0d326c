//! Observations without the drive's reading errors: currents read at zero current, and the angle's zero.

use tractive::frames::{AlphaBeta, Dq, SinCos};
use tractive::identification::{Observation, Stage};

/// Volt-seconds that count as zero, as a share of the link's: less than the first pulse has.
const NONE_SHARE: f32 = 5e-4;

/// The current read before the first pulse, when none flows, in A: α and β. The zero sequence drops out.
pub fn offset_a(observations: &[Observation]) -> [f64; 2] {
    let quiet = |observation: &&Observation| {
        let most = NONE_SHARE * observation.udc_v * observation.length_s;
        let AlphaBeta { alpha, beta } = observation.volt_seconds;
        observation.stage == Stage::Probe && alpha.hypot(beta) <= most
    };
    let (mut sums, mut count) = ([0.0; 2], 0.0);
    for observation in observations.iter().take_while(quiet) {
        let AlphaBeta { alpha, beta } = observation.current.unpark(observation.frame);
        sums = [sums[0] + f64::from(alpha), sums[1] + f64::from(beta)];
        count += 1.0;
    }
    sums.map(|sum| if count > 0.0 { sum / count } else { 0.0 })
}

/// The same without this current offset.
pub fn without_offset(observations: &[Observation], [alpha, beta]: [f64; 2]) -> Vec<Observation> {
    let offset = AlphaBeta { alpha: alpha as f32, beta: beta as f32 };
    let without = |of: &Observation| Observation { current: of.current - offset.park(of.frame), ..*of };
    observations.iter().map(without).collect()
}

/// The same with the d axis ahead of its stated position by this angle, in rad.
pub fn turned_by(observations: &[Observation], zero_rad: f64) -> Vec<Observation> {
    let (sin, cos) = (zero_rad.sin() as f32, zero_rad.cos() as f32);
    let ahead = |of: &Observation| {
        let (frame, Dq { d, q }) = (of.frame, of.current);
        Observation {
            frame: SinCos { sin: frame.sin * cos + frame.cos * sin, cos: frame.cos * cos - frame.sin * sin },
            current: Dq { d: d * cos + q * sin, q: q * cos - d * sin },
            ..*of
        }
    };
    observations.iter().map(ahead).collect()
}
