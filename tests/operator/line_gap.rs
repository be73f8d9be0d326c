//! The line that is lost while the drive works: what the operator then asks of it.

use super::world::World;
use tractive::operator::State;

/// Enabled at 1,500 V and at an electrical speed in rad/s, 400 N·m asked for and reached.
fn turning(omega: f32) -> World {
    let mut world = World::enabled();
    world.observed.omega = omega;
    world.observed.torque_nm = 400.0 * omega.signum();
    world.request.torque_nm = 400.0 * omega.signum();
    world.slots(300);
    world
}

fn demand_nm(world: &World) -> f32 {
    world.output().command.demand.torque_nm
}

/// 900 rad/s give the largest power.
#[test]
fn a_machine_that_turns_brakes_a_little_and_holds_the_link() {
    for direction in [1.0, -1.0] {
        let mut world = turning(900.0 * direction);
        assert_eq!(demand_nm(&world), 400.0 * direction);
        world.source_v = 1_200.0;
        world.slots(150);
        let holding_nm = demand_nm(&world) * direction;
        assert!((-124.0..-100.0).contains(&holding_nm), "{holding_nm} N·m");
    }
}

#[test]
fn without_speed_there_is_nothing_to_hold_it_by() {
    for (omega, most_nm) in [(0.0, 0.0), (0.1, 5.0), (1.0, 50.0)] {
        let mut world = turning(omega);
        world.source_v = 1_200.0;
        world.slots(150);
        assert!((-most_nm..=0.0).contains(&demand_nm(&world)), "{omega}: {} N·m", demand_nm(&world));
    }
}

/// A line that sags keeps its drive: what it gave is forgotten in seconds, at the rated lowest voltage at the latest.
#[test]
fn torque_returns_on_a_line_that_has_sagged() {
    let mut world = turning(900.0);
    world.source_v = 1_350.0;
    world.slots(100);
    assert!(demand_nm(&world) < 400.0 + 1e-3);
    world.slots(10_000);
    assert_eq!(demand_nm(&world), 400.0);
    world.source_v = 1_100.0;
    world.slots(20_000);
    assert_eq!(demand_nm(&world), 400.0);
}

/// Braking lifts a link behind a rectifier: that rise is not the line's.
#[test]
fn a_link_that_braking_has_lifted_is_not_taken_for_the_line() {
    let mut world = turning(900.0);
    let before = world.output().command.window;
    world.observed.torque_nm = -400.0;
    world.source_v = 1_850.0;
    world.slots(3_000);
    assert_eq!(world.output().command.window, before);
    world.observed.torque_nm = 400.0;
    world.slots(10_000);
    assert!(world.output().command.window.motoring_none_v > before.motoring_none_v + 200.0);
}

/// A window that was asked for ends motoring, and makes nothing brake: its line is there.
#[test]
fn a_link_below_the_window_that_was_asked_for_is_not_held() {
    let mut world = turning(900.0);
    (world.request.limits.link_low_v, world.request.limits.link_high_v) = (1_600.0, 1_700.0);
    world.slots(300);
    assert_eq!(demand_nm(&world), 0.0);
    world.request.enable = false;
    world.until(State::Charged);
}

/// Holding keeps the braking limit; the line's own limits of braking power are for a line that is there.
#[test]
fn holding_keeps_the_limit_of_braking() {
    for (braking_nm, braking_w, held_nm) in [(50.0, 1e6, 50.0), (0.0, 1e6, 0.0), (1_000.0, 0.0, 123.5)] {
        let mut world = turning(900.0);
        world.request.limits.braking_nm = braking_nm;
        world.settings.train.braking_w = braking_w;
        world.source_v = 1_200.0;
        world.slots(150);
        assert!((demand_nm(&world) + held_nm).abs() < 1.0, "{braking_nm} N·m: {}", demand_nm(&world));
    }
}
