//! Slew and jerk of the torque demand.

use proptest::prelude::*;
use tractive::operator::{Ramp, Rates};

const RATES: Rates = Rates { step_s: 1e-3, slew_nm_s: 9_880.0, jerk_nm_s2: 197_600.0 };

/// Follows targets; every step keeps slew, a rate grows as the jerk allows, and no step leads away from its target or beyond it. Returns the torques.
fn follow(targets: &[(f32, u32)]) -> Vec<f32> {
    let (mut ramp, mut last, mut rate) = (Ramp::new(), 0.0_f32, 0.0_f32);
    let mut torques = Vec::new();
    for (target, steps) in targets {
        for _ in 0..*steps {
            let torque = ramp.step(*target, &RATES);
            let now = (torque - last) / RATES.step_s;
            assert!(now.abs() <= RATES.slew_nm_s * 1.001 + 1.0, "slew {now}");
            let grown = now.abs() - if now * rate < 0.0 { 0.0 } else { rate.abs() };
            assert!(grown <= RATES.jerk_nm_s2 * RATES.step_s * 1.001 + 2.0, "jerk {grown}");
            let (before, after) = (*target - last, *target - torque);
            assert!(before * after >= 0.0 && after.abs() <= before.abs(), "{before} {after}");
            (last, rate) = (torque, now);
            torques.push(torque);
        }
    }
    torques
}

#[test]
fn full_torque_takes_the_time_that_slew_and_jerk_say() {
    let torques = follow(&[(1_235.0, 400)]);
    assert_eq!(torques.last(), Some(&1_235.0), "exactly");
    assert!(torques.iter().all(|torque| *torque <= 1_235.0), "no overshoot");
    // The target stays, so the rate ends as it began; the last step may end a rest of two steps of the jerk.
    let rates: Vec<f32> = torques.windows(2).map(|pair| (pair[1] - pair[0]) / RATES.step_s).collect();
    let change = rates.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f32::max);
    assert!(change <= 2.0 * RATES.jerk_nm_s2 * RATES.step_s * 1.001 + 2.0, "jerk {change}");
    // Torque by slew, and once the time that the slew takes to come and go: 125 ms + 50 ms.
    let reached = torques.iter().position(|torque| *torque >= 1_235.0).unwrap();
    assert!((173..=180).contains(&reached), "{reached} ms");
}

proptest! {
    #[test]
    fn any_targets_keep_slew_and_jerk_and_the_last_is_reached(
        targets in proptest::collection::vec((-1_235.0_f32..1_235.0, 1_u32..200), 1..20),
    ) {
        let last = targets.last().unwrap().0;
        let mut targets = targets;
        targets.push((last, 1_000));
        let torques = follow(&targets);
        prop_assert_eq!(torques.last(), Some(&last));
    }
}
