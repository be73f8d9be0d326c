//! Loops one step at a time: each limit, what it does to the integral, and the numbers of a step.

use tractive_control::control::{
    Limited, SpeedDesign, SpeedInput, SpeedLoop, ZSource, ZSourceDesign, ZSourceError, ZSourceInput,
    ZSourceOutput,
};

const DESIGN: ZSourceDesign = ZSourceDesign::ZS9;
/// In steady state at 667 V without load.
const STEADY: ZSourceInput = ZSourceInput {
    capacitor_v: 533.5,
    inductor_a: 0.0,
    source_v: 400.0,
    power_w: 0.0,
    link_ref_v: 667.0,
    duty_room: 0.4,
};

fn first(input: ZSourceInput) -> ZSourceOutput {
    ZSource::new().step(&input, &DESIGN, &DESIGN.gains()).unwrap()
}

fn near(got: f32, wanted: f32) {
    assert!((got - wanted).abs() <= 2e-6 * wanted.abs(), "{got}, not {wanted}");
}

/// The step as its equations have it: what each input adds to current and duty.
#[test]
fn a_step_of_the_network_is_that_of_its_equations() {
    let gains = DESIGN.gains();
    let cases = [
        STEADY,
        ZSourceInput { capacitor_v: 531.0, inductor_a: 12.0, power_w: 4_000.0, ..STEADY },
        ZSourceInput { capacitor_v: 535.0, inductor_a: -9.0, power_w: -6_000.0, ..STEADY },
        ZSourceInput { capacitor_v: 500.0, source_v: 380.0, power_w: 2_000.0, link_ref_v: 500.0, ..STEADY },
        // Links of 0.3 and 0.1 of the source: no less than a quarter is divided by.
        ZSourceInput { capacitor_v: 260.0, inductor_a: -48.6, link_ref_v: 400.0, ..STEADY },
        ZSourceInput { capacitor_v: 220.0, inductor_a: -58.2, link_ref_v: 400.0, ..STEADY },
    ];
    for input in cases {
        let ZSourceInput { capacitor_v, inductor_a, source_v, power_w, link_ref_v, .. } = input;
        let link_v = 2.0 * capacitor_v - source_v;
        let most_v = DESIGN.link_slew_v_s * DESIGN.period_s;
        let led_v = (link_v + (link_ref_v - link_v).clamp(-most_v, most_v)).max(source_v);
        let error_v = 0.5 * (led_v + source_v) - capacitor_v;
        let charging_a = DESIGN.capacitance_f * 0.5 * (led_v - link_v.max(source_v)) / DESIGN.period_s;
        let wanted_a = power_w / source_v + led_v / source_v * (charging_a + gains.outer_s * error_v);
        let current_a = wanted_a.clamp(-90.0, 90.0);
        let across_v = gains.inner_ohm * (current_a - inductor_a) + 0.01 * inductor_a;
        let duty = (capacitor_v - source_v + across_v) / link_v.max(0.25 * source_v);
        let got = first(input);
        near(got.link_v, link_v);
        near(got.link_ref_v, led_v);
        assert!((got.inductor_ref_a - current_a).abs() < 2e-3, "{got:?}: {current_a}");
        assert!((0.0..0.3).contains(&duty) && (got.duty - duty).abs() < 1e-5, "{got:?}: {duty}");
    }
}

/// The integral is seen in the next step's current, everything else as in steady state.
#[test]
fn the_networks_integral_grows_by_its_share_unless_a_limit_holds_it() {
    let gains = DESIGN.gains();
    let grown = |input: ZSourceInput| {
        let (mut state, mut fresh) = (ZSource::new(), ZSource::new());
        // Both references stand at 667 V; the integral of one has seen the input.
        for state in [&mut state, &mut fresh] {
            state.step(&STEADY, &DESIGN, &gains).unwrap();
        }
        let limited = state.step(&input, &DESIGN, &gains).unwrap().limited;
        let [with, without] =
            [state, fresh].map(|mut state| state.step(&STEADY, &DESIGN, &gains).unwrap().inductor_ref_a);
        (limited, with - without)
    };
    let ratio = 667.0 / 400.0;
    for off_v in [3.0, -3.0] {
        let (limited, grown_a) = grown(ZSourceInput { capacitor_v: 533.5 - off_v, ..STEADY });
        let wanted_a = gains.integral_share * ratio * gains.outer_s * off_v;
        assert_eq!(limited, Limited::Free);
        assert!((grown_a - wanted_a).abs() < 1e-4, "{grown_a}, not {wanted_a}");
    }
    // Current and duty at their limits, and the error that may still be learnt from.
    let [low, high] = [530.0, 537.0];
    for (capacitor_v, power_w, inductor_a, limited, grows) in [
        (low, 50e3, 90.0, Limited::Above, false),
        (high, 50e3, 90.0, Limited::Above, true),
        (low, -50e3, -90.0, Limited::Below, true),
        (high, -50e3, -90.0, Limited::Below, false),
        (low, 0.0, -60.0, Limited::Above, false),
        (high, 0.0, -60.0, Limited::Above, true),
        (low, 0.0, 80.0, Limited::Below, true),
        (high, 0.0, 80.0, Limited::Below, false),
    ] {
        let (got, grown_a) = grown(ZSourceInput { capacitor_v, power_w, inductor_a, ..STEADY });
        assert_eq!((got, grown_a != 0.0), (limited, grows), "{capacitor_v} V, {power_w} W, {inductor_a} A");
    }
}

#[test]
fn the_networks_duty_has_the_lesser_of_two_limits() {
    let starved = ZSourceInput { inductor_a: -80.0, ..STEADY };
    for (duty_room, duty) in [(0.4, 0.3), (0.3, 0.3), (0.2, 0.2), (0.0, 0.0), (-1.0, 0.0)] {
        let got = first(ZSourceInput { duty_room, ..starved });
        assert_eq!((got.duty, got.limited), (duty, Limited::Above), "{duty_room}");
    }
    let mut state = ZSource::new();
    let none = state.step(&ZSourceInput { source_v: 0.0, ..STEADY }, &DESIGN, &DESIGN.gains());
    assert_eq!((none, state), (Err(ZSourceError::NoSource(0.0)), ZSource::new()));
}

const SPEED: SpeedDesign = SpeedDesign { inertia_kg_m2: 0.5, natural_rad_s: 8.0, period_s: 0.25 };

/// 2 J ω₀ = 8 N·m and J ω₀² T = 8 N·m for a rad/s. Torque of this error at a limit, and what the integral then is, by a step without an error.
#[test]
fn the_speed_loop_is_a_pi_whose_integral_a_limit_lets_only_go_back() {
    for (integral_nm, error_rad_s, largest_nm, torque_nm, next_nm) in [
        (0.0, 1.0, 100.0, 8.0, 8.0),
        (0.0, -1.0, 100.0, -8.0, -8.0),
        (4.0, 0.5, 100.0, 8.0, 8.0),
        // Beyond the limit, and further; exactly there is not beyond.
        (4.0, 1.0, 10.0, 10.0, 4.0),
        (-4.0, -1.0, 10.0, -10.0, -4.0),
        (2.0, 1.0, 10.0, 10.0, 10.0),
        (-2.0, -1.0, 10.0, -10.0, -10.0),
        // Beyond the limit, and back.
        (30.0, -1.0, 10.0, 10.0, 10.0),
        (40.0, -4.0, 4.0, 4.0, 4.0),
        (20.0, -1.0, 8.0, 8.0, 8.0),
        (-20.0, 1.0, 8.0, -8.0, -8.0),
        // Without an error it comes back to the limit.
        (30.0, 0.0, 10.0, 10.0, 10.0),
        (-30.0, 0.0, 10.0, -10.0, -10.0),
    ] {
        let mut state = SpeedLoop::at(integral_nm);
        let input = |error: f32, largest_nm| SpeedInput {
            wanted_rad_s: 50.0 + error,
            measured_rad_s: 50.0,
            largest_nm,
        };
        let got_nm = state.step(&input(error_rad_s, largest_nm), &SPEED);
        let left_nm = state.step(&input(0.0, 1e3), &SPEED);
        assert_eq!((got_nm, left_nm), (torque_nm, next_nm), "{integral_nm} {error_rad_s} {largest_nm}");
    }
}
