//! Settings of the ZS9's drive: the numbers that follow from clock, carrier and ratings.

use tractive::built_in::zs9::BUILT_IN;
use tractive::control::{Gains, SpeedDesign, ZSourceDesign};
use tractive::drive::dual::Settings;
use tractive::machine::{Ratings, Tables, ZSourceNetwork};
use tractive::time::Clock;

const CLOCK: Clock = Clock::new(25_000_000, 2_500);

#[test]
fn loops_are_designed_for_the_control_period_and_for_two_motors_in_turn() {
    let settings = Settings::new(CLOCK, 2_500, &BUILT_IN);
    let wanted = Gains {
        carrier: 0.6,
        observer: 0.04,
        sixth_turn_rad: 2.0 * Gains::DEFAULT.sixth_turn_rad,
        ..Gains::DEFAULT
    };
    assert_eq!(format!("{:?}", settings.gains), format!("{wanted:?}"));
    let ZSourceDesign { period_s, inner_hz, outer_hz, inductor_max_a, .. } = settings.link;
    assert_eq!((period_s, inner_hz, outer_hz), (1e-4, 700.0, 150.0));
    // Half as much again as both motors' 25.14 kW take from 400 V.
    assert!((inductor_max_a - 94.275).abs() < 1e-3, "{inductor_max_a}");
    let of_the_paper = ZSourceDesign { period_s, inner_hz, outer_hz, inductor_max_a, ..ZSourceDesign::ZS9 };
    assert_eq!(settings.link, of_the_paper);
    assert_eq!(settings.link_gains, settings.link.gains());
    let speed = SpeedDesign { inertia_kg_m2: 0.1, natural_rad_s: 280.0, period_s: 2e-4 };
    assert_eq!(settings.speed, speed);
    let limits = settings.limits;
    assert!((limits.source_min_v - 280.0).abs() < 1e-3 && (limits.capacitor_max_v - 720.0).abs() < 1e-3);
    assert_eq!(limits.duty_max, 0.3);
}

/// A line filter is damped by twice the conductance that both motors' 25.14 kW are at 400 V.
#[test]
fn a_source_behind_a_line_filter_is_damped() {
    let settings = Settings::new(CLOCK, 2_500, &BUILT_IN);
    assert_eq!(settings.link.damping_s, 0.0);
    let damped = settings.behind_line_filter(true, &BUILT_IN);
    assert!((damped.link.damping_s - 2.0 * 25.14e3 / 160e3).abs() < 1e-6, "{}", damped.link.damping_s);
    assert_eq!(ZSourceDesign { damping_s: 0.0, ..damped.link }, settings.link);
    assert_eq!(damped.behind_line_filter(false, &BUILT_IN).link, settings.link);
    assert_eq!(damped.check(&BUILT_IN), Ok(()));
}

#[test]
fn another_control_period_is_that_of_every_loop() {
    let settings = Settings::new(Clock::new(25_000_000, 5_000), 2_500, &BUILT_IN);
    assert_eq!([settings.link.period_s, settings.speed.period_s], [2e-4, 4e-4]);
}

/// Of another machine's and another inverter's ratings.
#[test]
fn loops_are_designed_for_the_folders_rotor_and_network() {
    let near = |got: f32, wanted: f32| assert!((got / wanted - 1.0).abs() < 1e-5, "{got} {wanted}");
    let of = |ratings, z_source| Settings::new(CLOCK, 2_500, &Tables { ratings, z_source, ..BUILT_IN });
    let own = BUILT_IN.ratings;
    // A hundredth of the inertia; then so heavy a rotor that 10 times the largest torque for 1 rad/s bounds the loop.
    let light = of(Ratings { max_acceleration_rad_s2: 480_000.0, ..own }, BUILT_IN.z_source);
    near(light.speed.inertia_kg_m2, 0.001);
    near(light.speed.natural_rad_s, 280.0);
    let heavy = of(Ratings { max_acceleration_rad_s2: 48.0, ..own }, BUILT_IN.z_source);
    near(heavy.speed.inertia_kg_m2 * heavy.speed.natural_rad_s, 5.0 * own.max_torque_nm);
    assert_eq!(
        heavy.check(&Tables { ratings: Ratings { max_acceleration_rad_s2: 48.0, ..own }, ..BUILT_IN }),
        Ok(())
    );
    // Four times the inductance: the zero in the right half-plane lies at 253 Hz.
    let network =
        ZSourceNetwork { inductance_h: 2e-3, resistance_ohm: 0.02, capacitance_f: 1e-3, ..BUILT_IN.z_source };
    let link = of(own, network).link;
    assert_eq!([link.inductance_h, link.resistance_ohm, link.capacitance_f], [2e-3, 0.02, 1e-3]);
    near(link.outer_hz, 0.15 * 400.0 * 400.0 / (4.0 * own.max_power_w * 2e-3) / std::f32::consts::TAU);
    // A source of a tenth, and a tenth of the power.
    let ratings = Ratings { max_power_w: 0.1 * own.max_power_w, ..own };
    let link = of(ratings, ZSourceNetwork { source_v: 40.0, ..BUILT_IN.z_source }).link;
    near(link.inductor_max_a, 94.275);
    near(link.link_slew_v_s, 267.0);
}

#[test]
fn gains_of_the_network_are_those_of_its_bandwidths() {
    use std::f32::consts::TAU;
    let gains = ZSourceDesign::ZS9.gains();
    let near = |got: f32, wanted: f32| assert!((got / wanted - 1.0).abs() < 1e-6, "{got} {wanted}");
    near(gains.inner_ohm, TAU * 600.0 * 0.5e-3);
    near(gains.outer_s, TAU * 80.0 * 500e-6);
    near(gains.integral_share, 0.25 * TAU * 80.0 * 100e-6);
}

#[test]
fn instants_are_those_of_the_carrier() {
    for (carrier_ticks, dead_time_ticks, peak, deadline, half, pause) in
        [(2_500, 0, 1_250, 1_250, 40_000, 36_000), (1_250, 10, 625, 1_875, 20_000, 15_680)]
    {
        let settings = Settings { dead_time_ticks, ..Settings::new(CLOCK, carrier_ticks, &BUILT_IN) };
        let got = [
            settings.first_peak_ticks(),
            settings.deadline_ticks(),
            settings.half_steps(),
            settings.longest_pause_steps(),
        ];
        assert_eq!(got, [peak, deadline, half, pause]);
    }
}

/// Links of machines as capacitors: by what two levels make of them, and the lowest by what is charged.
#[test]
fn the_operator_looks_at_capacitors() {
    let two_level = std::f32::consts::FRAC_PI_4 / 3_f32.sqrt();
    let ratings = Settings::operator_ratings(&BUILT_IN.ratings);
    let own = &BUILT_IN.ratings;
    let near = |got: f32, wanted: f32| assert!((got / wanted - 1.0).abs() < 1e-6, "{got} {wanted}");
    near(ratings.dc_link_min_v, 0.9 * own.dc_link_min_v / two_level);
    near(ratings.dc_link_nominal_v, own.dc_link_nominal_v / two_level);
    near(ratings.dc_link_max_v, own.dc_link_max_v / two_level);
    near(ratings.trip_dc_over_v, 720.0);
    near(ratings.trip_dc_under_v, 140.0);
    let links = Ratings { dc_link_min_v: 360.0, dc_link_max_v: 600.0, dc_link_nominal_v: 500.0, ..*own };
    assert_eq!(Settings::link_range_v(&links), [400.0, 800.0, 600.0]);
}

/// Of a duty, 5 µs that nobody tells are missing in each carrier period of 100 µs, and two dead times that are told, of 2 µs.
#[test]
fn the_least_duty_lacks_what_dead_times_take() {
    let told = Settings { dead_time_ticks: 50, ..Settings::new(CLOCK, 2_500, &BUILT_IN) };
    for (duty, least) in [(0.2, 0.11), (0.09, 0.0), (0.05, 0.0)] {
        assert!((told.least_duty(duty) - least).abs() < 1e-6, "{duty}: {}", told.least_duty(duty));
    }
}
