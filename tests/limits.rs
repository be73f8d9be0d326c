//! Limits of the protection to the last bit: the last value that is allowed, the first that is not, and the fault that is named if
//! several limits are broken at once.

use core::f32::consts::TAU;
use tractive::built_in::traction::BUILT_IN;
use tractive::cell::Words;
use tractive::control::{
    AimInput, Committed, ControlLaw, Controller, Demand, Gains, Law, Measurements, ModeLimits, RotorSample,
    VoltageLimit, operating_point,
};
use tractive::frames::{Abc, AlphaBeta, Angle};
use tractive::machine::Ratings;
use tractive::protection::{
    DiodeWatch, FailedCheck, Fault, FrozenWatch, INNOVATION_RAD, LegFaults, LinkLimits, OpenGates, SafeState,
    Trip, check_angle, check_currents, check_demand, check_known, check_measurements, check_speed,
    check_undervoltage, safe_state, trip_from_words, trip_to_words,
};
use tractive::time::{Clock, Instant};

const RATINGS: &Ratings = &BUILT_IN.ratings;
const PERIOD_S: f32 = 1e-4;

/// The limit itself is allowed, and the next number above it is not.
fn most(limit: f32, fault: Fault, check: impl Fn(f32) -> Option<FailedCheck>) {
    assert_eq!(check(limit), None, "{limit}");
    let beyond = limit.next_up();
    assert_eq!(check(beyond), Some((fault, beyond, limit)));
}

/// The same for the next number below.
fn least(limit: f32, fault: Fault, check: impl Fn(f32) -> Option<FailedCheck>) {
    assert_eq!(check(limit), None, "{limit}");
    let beyond = limit.next_down();
    assert_eq!(check(beyond), Some((fault, beyond, limit)));
}

/// Phase currents whose sum is zero.
fn phases(a: f32) -> Abc {
    Abc { a, b: -a, c: 0.0 }
}

fn measured(udc_v: f32, currents_a: Abc) -> Measurements {
    Measurements { currents_a, udc_v, angle: Angle::ZERO }
}

#[test]
fn currents_to_the_last_bit() {
    let trip_a = RATINGS.trip_current_a;
    for sign in [1.0, -1.0] {
        most(trip_a, Fault::Overcurrent, |a| check_currents(&phases(sign * a), RATINGS));
        let swapped = |a: f32| Abc { a: 0.0, b: -sign * a, c: sign * a };
        most(trip_a, Fault::Overcurrent, |a| check_currents(&swapped(a), RATINGS));
    }
    let sum_a = 0.1 * RATINGS.max_current_a;
    let in_phase: [fn(f32) -> Abc; 4] = [
        |a| Abc { a, b: 0.0, c: 0.0 },
        |b| Abc { a: 0.0, b, c: 0.0 },
        |c| Abc { a: 0.0, b: 0.0, c },
        |sum| Abc { a: 128.0 + sum, b: -64.0, c: -64.0 },
    ];
    for currents in &in_phase[..3] {
        most(sum_a, Fault::PhaseSum, |sum| check_currents(&currents(sum), RATINGS));
        // The value keeps its sign.
        let below = check_currents(&currents(-sum_a.next_up()), RATINGS);
        assert_eq!(below, Some((Fault::PhaseSum, -sum_a.next_up(), sum_a)));
        assert_eq!(check_currents(&currents(-sum_a), RATINGS), None);
    }
    assert!(check_currents(&in_phase[3](sum_a + 0.01), RATINGS).is_some());
    assert!(check_currents(&in_phase[3](sum_a - 0.01), RATINGS).is_none());
    // A current at its limit is no fault; beyond it, it is named before the sum.
    let at = Abc { a: trip_a, b: 0.0, c: 0.0 };
    assert_eq!(check_currents(&at, RATINGS), Some((Fault::PhaseSum, trip_a, sum_a)));
    let both = Abc { a: trip_a.next_up(), b: 0.0, c: 0.0 };
    assert_eq!(check_currents(&both, RATINGS), Some((Fault::Overcurrent, trip_a.next_up(), trip_a)));
}

#[test]
fn link_and_speed_to_the_last_bit() {
    let check = |udc_v| check_measurements(&measured(udc_v, Abc::default()), 0.0, RATINGS);
    most(RATINGS.trip_dc_over_v, Fault::DcOvervoltage, check);
    least(RATINGS.trip_dc_under_v, Fault::DcUndervoltage, |udc_v| check_undervoltage(udc_v, RATINGS));
    assert_eq!(check_undervoltage(f32::INFINITY, RATINGS), None);
    // Electrical in, mechanical out: the pole pairs are a power of two.
    let pole_pairs = RATINGS.pole_pairs;
    for sign in [1.0, -1.0] {
        let check = |speed: f32| check_speed(sign * speed * pole_pairs, RATINGS);
        most(RATINGS.trip_speed_rad_s, Fault::Overspeed, check);
    }
    most(INNOVATION_RAD, Fault::AngleLost, check_angle);
    assert_eq!(check_angle(-INNOVATION_RAD), None);
    let beyond = INNOVATION_RAD.next_up();
    assert_eq!(check_angle(-beyond), Some((Fault::AngleLost, beyond, INNOVATION_RAD)));
    assert_eq!(check_known(false), None);
    assert_eq!(check_known(true), Some((Fault::PositionSensor, 0.0, 1.0)));
}

/// Each limit is broken at once with all that follow it: the first of the row is named.
#[test]
fn the_first_fault_is_named() {
    let (udc_v, omega) = (2.0 * RATINGS.trip_dc_over_v, 2.0 * RATINGS.trip_speed_rad_s * RATINGS.pole_pairs);
    let current = phases(2.0 * RATINGS.trip_current_a);
    let named = |udc_v: f32, omega: f32, currents: Abc| {
        check_measurements(&measured(udc_v, currents), omega, RATINGS).map(|(fault, ..)| fault)
    };
    let unknown = Abc { a: f32::NAN, ..current };
    for no_number in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        assert_eq!(named(no_number, omega, current), Some(Fault::NotFinite));
    }
    assert_eq!(named(udc_v, omega, unknown), Some(Fault::DcOvervoltage));
    assert_eq!(named(1_500.0, omega, unknown), Some(Fault::Overspeed));
    assert_eq!(named(1_500.0, 0.0, unknown), Some(Fault::NotFinite));
    assert_eq!(named(1_500.0, 0.0, current), Some(Fault::Overcurrent));
    assert_eq!(named(0.0, 0.0, Abc::default()), None, "without pulses the link may be empty");
    let (fault, _, limit) = check_measurements(&measured(f32::NAN, current), 0.0, RATINGS).unwrap();
    assert_eq!((fault, limit), (Fault::NotFinite, f32::MAX));
}

#[test]
fn any_finite_torque_is_a_demand() {
    let check = |torque_nm| check_demand(&Demand { torque_nm, slew_limited: true });
    assert!([0.0, f32::MIN, f32::MAX].into_iter().all(|torque_nm| check(torque_nm).is_none()));
    for torque_nm in [f32::INFINITY, f32::NEG_INFINITY] {
        assert_eq!(check(torque_nm), Some((Fault::NotFinite, torque_nm, f32::MAX)));
    }
    assert!(check(f32::NAN).is_some_and(|(fault, ..)| fault == Fault::NotFinite));
}

#[test]
fn the_zs9s_link_to_the_last_bit() {
    let limits = LinkLimits { source_min_v: 300.0, capacitor_max_v: 700.0, duty_max: 0.25 };
    least(300.0, Fault::SourceUndervoltage, |source_v| limits.check_link(source_v, 533.0));
    most(700.0, Fault::CapacitorOvervoltage, |capacitor_v| limits.check_link(400.0, capacitor_v));
    most(0.25, Fault::DutyRange, |duty| limits.check_duty(duty));
    least(0.0, Fault::DutyRange, |duty| limits.check_duty(duty).map(|(fault, duty, _)| (fault, duty, 0.0)));
    assert!(
        limits
            .check_duty(f32::NAN)
            .is_some_and(|(fault, _, limit)| (fault, limit) == (Fault::DutyRange, 0.25))
    );
    assert_eq!(limits.check_link(200.0, 800.0), Some((Fault::SourceUndervoltage, 200.0, 300.0)));
    for (source_v, capacitor_v) in
        [(f32::NAN, 533.0), (400.0, f32::NAN), (f32::INFINITY, 533.0), (400.0, f32::INFINITY)]
    {
        let found = limits.check_link(source_v, capacitor_v);
        assert!(found.is_some_and(|(fault, _, limit)| (fault, limit) == (Fault::NotFinite, f32::MAX)));
    }
    assert_eq!(limits.check_link(0.0, f32::INFINITY), Some((Fault::NotFinite, f32::INFINITY, f32::MAX)));
    // U_in = U_dc/(1 − 2D): at a quarter twice the source's voltage.
    for (link_v, duty) in
        [(200.0, None), (400.0, None), (800.0, None), (1_000.0, Some(0.3)), (4_000.0, Some(0.45))]
    {
        let found = limits.check_link_reference(link_v, 400.0);
        assert_eq!(found, duty.map(|duty| (Fault::DutyRange, duty, 0.25)), "{link_v}");
    }
    assert!(limits.check_link_reference(800.01, 400.0).is_some());
    let found = limits.check_link_reference(f32::INFINITY, 400.0);
    assert_eq!(found, Some((Fault::NotFinite, f32::INFINITY, f32::MAX)));
}

/// Every report of the legs in every state and at every speed, by the rules in words.
#[test]
fn every_report_of_the_legs_has_its_safe_state() {
    use SafeState::{GatesOff, ShortCircuit, UpperShortCircuit};
    let stands = (RATINGS.trip_dc_over_v - 1.0) / (3.0_f32.sqrt() * RATINGS.magnet_flux_wb);
    let not = (RATINGS.trip_dc_over_v + 1.0) / (3.0_f32.sqrt() * RATINGS.magnet_flux_wb);
    for number in 0..1_u32 << 12 {
        let (blocked, low, high) = ((number & 63) as u8, (number >> 6 & 7) as u8, (number >> 9) as u8);
        let legs = LegFaults { blocked, low, high };
        let astray = f32::from(low | high);
        let fault = match blocked {
            0 => (astray > 0.0).then_some((Fault::LegStuck, astray, 0.0)),
            _ => Some((Fault::DriverBlocked, f32::from(blocked), 0.0)),
        };
        assert_eq!(legs.check(), fault, "{legs:?}");
        // Upper device, lower device.
        let devices = [0, 2, 4].map(|bit| (blocked >> bit & 1 == 1, blocked >> (bit + 1) & 1 == 1));
        for (usual, omega) in [GatesOff, ShortCircuit, UpperShortCircuit]
            .into_iter()
            .flat_map(|usual| [0.0, stands, -stands, not, -not].map(|omega| (usual, omega)))
        {
            let safe = if devices.contains(&(false, true)) {
                UpperShortCircuit
            } else if devices.contains(&(true, false)) {
                ShortCircuit
            } else if usual != ShortCircuit {
                usual
            } else if devices.contains(&(true, true)) && omega.abs() < not {
                GatesOff
            } else if high != 0 {
                UpperShortCircuit
            } else {
                ShortCircuit
            };
            assert_eq!(legs.in_place_of(usual, omega, RATINGS), safe, "{legs:?} {usual:?} {omega}");
        }
        let usual = safe_state(1_900.0, 1_500.0, RATINGS);
        assert_eq!(legs.safe_state(1_900.0, 1_500.0, RATINGS), legs.in_place_of(usual, 1_900.0, RATINGS));
    }
}

/// The EMF, as it is computed.
fn emf_v(omega: f32) -> f32 {
    omega.abs() * 3.0_f32.sqrt() * RATINGS.magnet_flux_wb
}

/// The first of some neighbouring numbers at which the EMF is exactly a voltage.
fn omega_of(emf: f32) -> Option<f32> {
    let about = emf / (3.0_f32.sqrt() * RATINGS.magnet_flux_wb);
    let first = about.to_bits() - 16;
    (first..first + 32).map(f32::from_bits).find(|omega| emf_v(*omega) == emf)
}

/// Link voltages below the nominal one, a volt apart, of which some speed makes exactly this share as its EMF.
fn just(share: f32) -> Vec<(f32, f32)> {
    let volts = (500..1_500).map(|udc_v| udc_v as f32);
    let found: Vec<_> = volts.filter_map(|udc_v| Some((udc_v, omega_of(share * udc_v)?))).collect();
    assert!(found.len() > 100, "{}", found.len());
    found
}

#[test]
fn the_rectifying_speed_to_the_last_bit() {
    for (udc_v, omega) in just(0.9) {
        for sign in [1.0, -1.0] {
            assert_eq!(safe_state(sign * omega, udc_v, RATINGS), SafeState::GatesOff);
            let faster = (1..8).fold(omega, |omega, _| omega.next_up());
            assert_eq!(safe_state(sign * faster, udc_v, RATINGS), SafeState::ShortCircuit, "{udc_v}");
        }
    }
    // Above its nominal voltage a link counts as nominal.
    let nominal_v = RATINGS.dc_link_nominal_v;
    let fast = 0.905 * nominal_v / (3.0_f32.sqrt() * RATINGS.magnet_flux_wb);
    for (udc_v, safe) in [
        (1.2 * nominal_v, SafeState::ShortCircuit),
        (nominal_v, SafeState::ShortCircuit),
        (f32::NAN, SafeState::ShortCircuit),
    ] {
        assert_eq!(safe_state(fast, udc_v, RATINGS), safe, "{udc_v}");
        assert_eq!(safe_state(0.99 * fast, udc_v, RATINGS), SafeState::GatesOff, "{udc_v}");
    }
    assert_eq!(safe_state(f32::NAN, nominal_v, RATINGS), SafeState::GatesOff);
}

/// Periods until a machine with its gates off is shorted; `None` if it never is.
fn shorted_after(currents_a: Abc, omega: f32, udc_v: f32) -> Option<u32> {
    let open = OpenGates { currents_a, udc_v, omega, period_s: PERIOD_S };
    let mut watch = DiodeWatch::new();
    (1..2_000).find(|_| watch.step(SafeState::GatesOff, &open, &LegFaults::default(), RATINGS).is_some())
}

#[test]
fn what_flows_through_the_diodes_to_the_last_bit() {
    let flowing_a = 0.05 * RATINGS.max_current_a;
    let (omega, udc_v) = (1_500.0, 1_500.0);
    // 0.15 rad a period: more than a turn after 42 of them.
    // At least two phases must show it; a current in one alone is its sensor's.
    for (current, shorted) in [
        ([1.0, -1.0, 0.0], Some(42)),
        ([0.0, 1.0, -1.0], Some(42)),
        ([-1.0, 0.0, 1.0], Some(42)),
        ([1.0, -2.0, 1.0], Some(42)),
        ([30.0, 0.0, 0.0], None),
        ([0.0, -30.0, 0.0], None),
        ([0.0, 0.0, 30.0], None),
    ] {
        let of = |size: f32| {
            let [a, b, c] =
                current.map(|part: f32| if part.abs() > 1.0 { part * flowing_a } else { part * size });
            shorted_after(Abc { a, b, c }, omega, udc_v)
        };
        assert_eq!((of(flowing_a), of(flowing_a.next_up())), (None, shorted), "{current:?}");
    }
    let least_v = RATINGS.trip_dc_under_v;
    for (udc_v, omega) in just(0.5).into_iter().filter(|(udc_v, _)| *udc_v >= least_v) {
        let faster = (1..8).fold(omega, |omega, _| omega.next_up());
        assert_eq!(shorted_after(phases(50.0), omega, udc_v), None, "{udc_v} V");
        assert!(shorted_after(phases(50.0), faster, udc_v).is_some(), "{udc_v} V");
        assert!(shorted_after(phases(50.0), -faster, udc_v).is_some(), "{udc_v} V");
    }
}

/// A sensor that shows a current that does not flow shorts no slowly turning machine, not even on an empty link.
#[test]
fn an_empty_link_is_no_reason_to_short_a_slow_machine() {
    let (_, omega) = just(0.5).into_iter().find(|(udc_v, _)| *udc_v >= RATINGS.trip_dc_under_v).unwrap();
    for udc_v in [0.0, 60.0, 0.9 * RATINGS.trip_dc_under_v] {
        for share in [0.01, 0.1, 0.5, 0.99] {
            assert_eq!(shorted_after(phases(50.0), share * omega, udc_v), None, "{udc_v} V, {share}");
        }
        assert!(shorted_after(phases(50.0), 1.01 * omega, udc_v).is_some(), "{udc_v} V");
    }
}

/// Periods without current take back as much of the counted turn as they last; a machine that is shorted already is left alone.
#[test]
fn a_pause_of_the_current_takes_back_what_it_lasts() {
    let open =
        |a: f32| OpenGates { currents_a: phases(a), udc_v: 1_500.0, omega: 1_500.0, period_s: PERIOD_S };
    let sound = LegFaults::default();
    let mut watch = DiodeWatch::new();
    let mut step = |a: f32, safe: SafeState| watch.step(safe, &open(a), &sound, RATINGS);
    assert!((0..41).all(|_| step(50.0, SafeState::GatesOff).is_none()));
    assert!((0..10).all(|_| step(0.0, SafeState::GatesOff).is_none()));
    assert!((0..10).all(|_| step(50.0, SafeState::GatesOff).is_none()));
    assert_eq!(step(50.0, SafeState::GatesOff), Some(SafeState::ShortCircuit));
    assert!((0..100).all(|_| step(50.0, SafeState::ShortCircuit).is_none()));
    assert!((0..41).all(|_| step(50.0, SafeState::GatesOff).is_none()));
}

/// A failed sensor, whichever it is and whatever it shows, hides no more of a held current than the zero crossings of the other two.
#[test]
fn a_sensor_that_fails_does_not_hide_a_current_that_stays() {
    const PERIODS_A_TURN: f32 = 42.0;
    for failed in 0..3 {
        for shown_a in [0.0, f32::NAN, 400.0] {
            let mut watch = DiodeWatch::new();
            let turns = (1..500).map(|period| period as f32 / PERIODS_A_TURN).find(|turns| {
                let mut currents =
                    [0.0, 1.0, 2.0].map(|third: f32| 100.0 * ((turns - third / 3.0) * TAU).cos());
                currents[failed] = shown_a;
                let [a, b, c] = currents;
                let omega = TAU / (PERIODS_A_TURN * PERIOD_S);
                let open =
                    OpenGates { currents_a: Abc { a, b, c }, udc_v: 1_500.0, omega, period_s: PERIOD_S };
                watch.step(SafeState::GatesOff, &open, &LegFaults::default(), RATINGS).is_some()
            });
            assert!(turns.is_some_and(|turns| turns < 1.75), "{failed} shows {shown_a} A: {turns:?} turns");
        }
    }
}

/// Periods that a watch takes for these currents and this voltage, with a rotor whose angle `turns` or stands, after the voltage has been
/// `before_v`.
fn frozen_after(
    a: f32,
    (before_v, voltage_v): (f32, f32),
    omega: f32,
    turns: bool,
) -> Option<(u32, FailedCheck)> {
    let mut watch = FrozenWatch::new();
    let mut angle = Angle::ZERO;
    let currents_a = Abc { a, b: -0.5 * a, c: -0.5 * a };
    let mut look = |volts: f32, currents_a: Abc, moves: bool| {
        watch.command(AlphaBeta { alpha: volts, beta: 0.0 });
        angle = if moves { angle + Angle::from_radians(omega * PERIOD_S) + Angle(1) } else { angle };
        watch.check(&Measurements { currents_a, udc_v: 1_500.0, angle }, omega, PERIOD_S, RATINGS)
    };
    // Two different currents, then the first one that repeats.
    assert_eq!(look(before_v, phases(1.0), true), None);
    assert_eq!(look(before_v, currents_a, true), None);
    (1..3_000).find_map(|period| {
        // The voltage that goes with the currents is that of the first period in which they repeat.
        let volts = if period == 1 { before_v } else { voltage_v };
        Some((period, look(volts, currents_a, turns)?))
    })
}

/// An angle that stands is a fault once the rotor should have turned by 0.2 rad, at a speed that fades by a part in 200 a period: at 20 rad/s
/// after 139 periods, by 20 · 0.02 · (1 − 0.995ⁿ). At 10 rad/s the limit of the sum is just that angle.
#[test]
fn an_angle_that_stands_is_found_in_its_time() {
    for (omega, periods) in
        [(20.0, Some(139)), (-20.0, Some(139)), (10.5, Some(608)), (9.9, None), (400.0, Some(6))]
    {
        let found = frozen_after(0.0, (0.0, 0.0), omega, false);
        assert_eq!(found.map(|(periods, _)| periods), periods, "{omega}");
        if let (Some((_, (fault, value, limit))), Some(periods)) = (found, periods) {
            assert_eq!((fault, value, limit), (Fault::Frozen, periods as f32, 20.0));
        }
        assert!(frozen_after(0.0, (0.0, 0.0), omega, true).is_none(), "{omega}");
    }
}

/// Currents that repeat are a fault once they should have changed, and after 20 periods at the earliest.
#[test]
fn currents_that_repeat_are_found_in_their_time() {
    let periods = |a, volts, omega| frozen_after(a, volts, omega, true).map(|(periods, _)| periods);
    let value = |a, volts, omega| frozen_after(a, volts, omega, true).map(|(_, failed)| failed);
    // Too small to be suspicious: 5 % of the largest.
    let least_a = 0.05 * RATINGS.max_current_a;
    assert_eq!(periods(least_a, (0.0, 0.0), 400.0), None);
    assert_eq!(periods(least_a.next_up(), (0.0, 0.0), 400.0), Some(20));
    assert_eq!(value(200.0, (0.0, 0.0), 400.0), Some((Fault::Frozen, 20.0, 20.0)));
    // 20 A turned by more than 2 % of 233.3 A.
    let turn_rad = 0.02 * RATINGS.max_current_a / 20.0;
    for omega in [84.0, -84.0, 30.0] {
        let wanted = (turn_rad / (f32::abs(omega) * PERIOD_S)) as u32 + 1;
        assert_eq!(periods(20.0, (0.0, 0.0), omega), Some(wanted), "{omega}");
        assert_eq!(value(20.0, (0.0, 0.0), omega), Some((Fault::Frozen, wanted as f32, 20.0)));
    }
    assert_eq!(periods(20.0, (0.0, 0.0), 0.0), None);
    // A quarter of the flux linkage of the largest torque, by a change of the voltage that fades in 20 ms.
    let flux_wb =
        f64::from(0.25 * RATINGS.max_torque_nm / (1.5 * RATINGS.pole_pairs * RATINGS.max_current_a));
    for (before_v, voltage_v) in [(0.0, 25.0), (0.0, -25.0), (10.0, 30.0), (-15.0, -40.0), (0.0, 300.0)] {
        let volts = f64::from(voltage_v) - f64::from(before_v);
        let fades = |n: i32| volts.abs() * 0.02 * (1.0 - 0.995_f64.powi(n));
        // From the period after the first one on.
        let wanted = (1..).find(|n| fades(*n) > flux_wb).unwrap() as u32 + 1;
        assert_eq!(periods(20.0, (before_v, voltage_v), 0.0), Some(wanted.max(20)), "{before_v} {voltage_v}");
    }
    // 11 V never add up to it.
    assert!((10.9..11.2).contains(&(flux_wb / 0.02)), "{flux_wb}");
    assert_eq!(periods(20.0, (0.0, 10.9), 0.0), None);
}

#[test]
fn a_change_of_a_current_or_of_the_angle_begins_anew() {
    let mut watch = FrozenWatch::new();
    assert_eq!((watch.angle_stands(), watch.turned_rad()), (false, (0.0, 0.2)));
    let mut look = |a: f32, angle: u32| {
        let measured = Measurements { currents_a: phases(a), udc_v: 1_500.0, angle: Angle(angle) };
        let found = watch.check(&measured, 100.0, PERIOD_S, RATINGS);
        (found.is_some(), watch.angle_stands(), watch.turned_rad().0)
    };
    assert_eq!(look(50.0, 0), (false, false, 0.0));
    assert_eq!(look(50.0, 7), (false, false, 0.0));
    let (_, stands, turned_rad) = look(51.0, 7);
    assert!(stands && (turned_rad - 0.01).abs() < 1e-6, "{turned_rad}");
    let (_, stands, turned_rad) = look(52.0, 7);
    assert!(stands && (turned_rad - 0.019_95).abs() < 1e-6, "{turned_rad}");
    assert_eq!(look(50.0, 8), (false, false, 0.0));
    // Nineteen times the same, another one, and from the beginning.
    for round in 0..3 {
        assert!((9..28).all(|angle| !look(50.0, 100 * round + angle).0), "{round}");
        assert!(!look(60.0, 100 * round + 30).0);
    }
}

#[test]
fn a_trip_comes_back_from_its_words() {
    for (fault, safe) in Fault::ALL.into_iter().flat_map(|fault| {
        [SafeState::GatesOff, SafeState::ShortCircuit, SafeState::UpperShortCircuit].map(|safe| (fault, safe))
    }) {
        let trip = Trip { fault, value: -1.5, limit: 320.25, at: Instant(0xFEDC_BA98), safe };
        let words = trip_to_words(Some(trip));
        assert_eq!(
            words,
            [fault as u32 | (safe as u32) << 8, (-1.5_f32).to_bits(), 320.25_f32.to_bits(), 0xFEDC_BA98]
        );
        assert_eq!(trip_from_words(words), Some(trip));
        assert_eq!((trip.to_words(), Trip::from_words(words)), (words, trip));
        // Anything beyond the two bytes is not part of it.
        let [code, rest @ ..] = words;
        let [value, limit, at] = rest;
        assert_eq!(trip_from_words([code | 0xABCD_0000, value, limit, at]), Some(trip));
    }
    assert_eq!((trip_to_words(None), trip_from_words([0; 4])), ([0; 4], None));
    let unknown = Trip::from_words([0xFF, 1, 2, 3]);
    assert_eq!((unknown.fault, unknown.value, unknown.limit), (Fault::NotFinite, 0.0, 0.0));
    assert_eq!((unknown.at, unknown.safe), (Instant(0), SafeState::GatesOff));
    let known = [SafeState::GatesOff, SafeState::ShortCircuit, SafeState::UpperShortCircuit];
    for code in 0..1_000 {
        assert_eq!(
            SafeState::from_code(code),
            known.get(code as usize).copied().unwrap_or(SafeState::GatesOff)
        );
    }
}

/// The torque that is aimed at after a second, over the largest at 4,000 r/min and 1,000 V, for a demand of this share of the largest
/// and a machine that gives a tenth more than its map.
fn aimed_share(share: f32) -> f32 {
    let (tables, clock) = (&BUILT_IN, Clock::new(25_000_000, 2_500));
    let law = Law { gains: &Gains::DEFAULT, clock: &clock, tables };
    let limits = ModeLimits::carrier(1.0);
    let turns = 4_000.0 / 60.0 * tables.ratings.pole_pairs * 1e-4;
    let limit = VoltageLimit { udc_v: 1_000.0, modulation_index: 1.0, filled: false };
    let omega = turns * 1e4 * std::f32::consts::TAU;
    let most_nm = operating_point(1e4, omega, &limit, tables).torque_nm;
    let demand = Demand { torque_nm: share * most_nm, slew_limited: false };
    let volt_seconds = Some(AlphaBeta::default());
    let committed = Committed { horizon_s: 0.0, volt_seconds, ripple_wb: None, interval_s: 0.5e-3 };
    let mut controller = Controller::new();
    for period in 0..10_000_u16 {
        let angle = Angle::from_turns(turns * f32::from(period));
        controller.track(angle, &clock);
        let current = controller.target().current * 1.1;
        let sample = RotorSample::new(current.unpark(angle.sin_cos()).abc(), angle, tables);
        controller.observe(&sample, tables);
        if period % 5 == 0 && period > 1_000 {
            controller.aim(&AimInput::plain(&demand, 1_000.0, &limits), &law);
            controller.regulate(&sample, &committed, &limits, &law);
        }
    }
    controller.target().torque_nm / most_nm
}

/// A machine that gives more torque than its map is not asked for less if the demand exceeds the available torque: otherwise the crests of the
/// ripple alone would take the torque down until the limit seemed kept.
#[test]
fn a_demand_beyond_the_limit_is_not_trimmed_down() {
    for share in [1.01, 1.5] {
        let aimed = aimed_share(share);
        assert!((aimed - 1.0).abs() < 1e-3, "{share}: {aimed}");
    }
}
