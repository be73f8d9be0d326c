//! A machine's known iron loss in the control law: the air gap gives as much more torque as the iron takes, so that the torque is the rotor's.

use std::path::Path;
use tractive_control::control::{
    AimInput, ControlLaw, Controller, Demand, Gains, Law, ModeLimits, Region, RotorSample, Target,
    flux_linkage, torque_nm,
};
use tractive_control::frames::Angle;
use tractive_control::machine::Tables;
use tractive_control::time::Clock;
use tractive_tablegen::MachineFolder;

/// A machine at the end of a second at a speed with a torque asked for, of which this share of the iron loss is made up for.
struct Driven {
    target: Target,
    /// Torque of the air gap by the map, what the iron takes of it, and the torque that is told, in N·m.
    gap_nm: f32,
    iron_nm: f32,
    told_nm: f32,
}

fn driven(tables: &Tables, share: f32, (rpm, udc_v): (f32, f32), demand_nm: f32) -> Driven {
    let clock = Clock::new(25_000_000, 2_500);
    let constants = Law { gains: &Gains::DEFAULT, clock: &clock, tables };
    let limits = ModeLimits::carrier(1.0);
    let turns = rpm / 60.0 * tables.ratings.pole_pairs * 1e-4;
    let mut law = Controller::new();
    for period in 0..10_000_u16 {
        let angle = Angle::from_turns(turns * f32::from(period));
        law.track(angle, &clock);
        let sample = RotorSample::new(law.target().current.unpark(angle.sin_cos()).abc(), angle, tables);
        law.observe(&sample, tables);
        if period % 5 == 0 && period > 1_000 {
            let demand = Demand { torque_nm: demand_nm, slew_limited: true };
            let aim = AimInput { iron_share: share, ..AimInput::plain(&demand, udc_v, &limits) };
            law.aim(&aim, &constants);
        }
    }
    let target = *law.target();
    let square_wb2 = target.flux.squared();
    Driven {
        target,
        gap_nm: torque_nm(tables, flux_linkage(tables, target.current), target.current),
        iron_nm: share * tables.ratings.iron.torque_nm(square_wb2, law.omega()),
        told_nm: law.flowing_nm(),
    }
}

#[test]
fn the_rotor_gets_what_is_asked_for_and_that_is_told() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tables/pmasynrm-180kw");
    let tables = MachineFolder::read(&folder).unwrap().tables();
    for (rpm, demand_nm) in [(1_000.0, 600.0), (-1_800.0, 600.0), (1_800.0, -600.0), (3_000.0, 300.0)] {
        for share in [0.0, 0.5, 1.0] {
            let Driven { target, gap_nm, iron_nm, told_nm } =
                driven(&tables, share, (rpm, 1_500.0), demand_nm);
            assert_eq!(iron_nm.abs() > 2.0 * share, share > 0.0, "{iron_nm} N·m");
            let close = |one: f32, other: f32| (one - other).abs() < 1.0;
            assert!(close(gap_nm - iron_nm, demand_nm), "{gap_nm} N·m, of which the iron takes {iron_nm}");
            assert!(close(told_nm, demand_nm) && target.torque_nm == demand_nm, "{told_nm} N·m told");
        }
    }
}

/// The air gap gives what current and voltage allow at the limit, and the iron takes its part of that.
#[test]
fn at_the_limit_the_rotor_gets_less() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tables/pmasynrm-180kw");
    let tables = MachineFolder::read(&folder).unwrap().tables();
    let [none, all] = [0.0, 1.0].map(|share| driven(&tables, share, (4_000.0, 1_000.0), 588.0));
    assert_eq!([none.target.region, all.target.region], [Region::Limit; 2]);
    assert!(all.iron_nm > 5.0 && (none.gap_nm - all.gap_nm).abs() < 1.0, "{} N·m", all.iron_nm);
    let less_nm = none.target.torque_nm - all.target.torque_nm;
    assert!((less_nm - all.iron_nm).abs() < 1.0, "{less_nm} N·m less, {} N·m", all.iron_nm);
}
