//! The nine gates with their dead time made up for: whatever currents are expected, the legs stay legal and nothing is shorted for longer.

use proptest::prelude::*;
use tractive::frames::{Abc, Angle};
use tractive::nine_switch::{DeadTime, GateTicks, LegState, MotorVoltage, Request, Scheme, step};

/// Ticks of a carrier half.
const HALF_TICKS: u32 = 4_000;

fn any_request() -> impl Strategy<Value = Request> {
    let motor = || {
        let angle = prop_oneof![any::<u32>(), (0..24_u64).prop_map(|k| ((k << 32) / 24) as u32)];
        (angle, 0.0..1.2_f32)
            .prop_map(|(angle, modulation_index)| MotorVoltage { angle: Angle(angle), modulation_index })
    };
    let duty = prop_oneof![Just(0.0), 0.0..0.4_f32];
    (0..Scheme::ALL.len(), motor(), motor(), duty).prop_map(|(scheme, upper, lower, shoot_through)| Request {
        scheme: Scheme::ALL[scheme],
        upper,
        lower,
        shoot_through,
    })
}

fn any_current() -> impl Strategy<Value = f32> {
    prop_oneof![4 => -100.0..100.0_f32, 1 => -3.0..3.0_f32, 1 => any::<f32>()]
}

fn any_currents() -> impl Strategy<Value = [Abc; 2]> {
    let phases = || (any_current(), any_current(), any_current()).prop_map(|(a, b, c)| Abc { a, b, c });
    (phases(), phases()).prop_map(|(upper, lower)| [upper, lower])
}

/// The ticks in which each leg shorts the link, in a half; an error where a leg's state is illegal.
fn shorted(gates: &[GateTicks; 9]) -> Result<[usize; 3], String> {
    let mut shorted = [0; 3];
    for (leg, count) in shorted.iter_mut().enumerate() {
        for tick in 0..HALF_TICKS {
            let [high, middle, low] = [leg, leg + 3, leg + 6].map(|gate| gates[gate].is_on(tick));
            match LegState::of_gates(high, middle, low) {
                Some(LegState::ShootThrough) => *count += 1,
                Some(_) => {}
                None => return Err(format!("leg {leg} at tick {tick}: {gates:?}")),
            }
        }
    }
    Ok(shorted)
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(1_000) })]

    #[test]
    fn legs_stay_legal(request in any_request(), currents_a in any_currents(), ticks in 0..600_u32) {
        let ideal = step(&request).unwrap().ticks(HALF_TICKS);
        let mut gates = ideal;
        DeadTime { ticks, small_a: 2.0 }.compensate(&mut gates, &currents_a);
        let [before, after] = [&ideal, &gates].map(shorted);
        let (before, after) = (before.unwrap(), after.map_err(TestCaseError::fail)?);
        prop_assert!(before.iter().zip(after).all(|(before, after)| after <= *before), "{before:?} {after:?}");
        for (before, after) in ideal.iter().zip(&gates) {
            prop_assert!(after.off_from <= after.off_to && after.off_to <= HALF_TICKS, "{after:?}");
            let moved = before.off_from.abs_diff(after.off_from).max(before.off_to.abs_diff(after.off_to));
            prop_assert!(moved <= ticks, "{before:?} {after:?}");
        }
        prop_assert!(ticks > 0 || gates == ideal);
    }
}
