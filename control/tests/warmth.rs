//! The warmth of a machine in the control law: its resistance in the voltage and in the operating point, nothing where nothing is known.

use std::path::Path;
use std::sync::LazyLock;
use tractive_control::control::{
    AimInput, Committed, ControlLaw, Controller, Demand, Gains, Law, ModeLimits, RotorSample, Warmth,
};
use tractive_control::frames::{AlphaBeta, Angle, Dq, six_step_v};
use tractive_control::machine::Tables;
use tractive_control::time::Clock;
use tractive_tablegen::MachineFolder;

static TABLES: LazyLock<Tables> = LazyLock::new(|| {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tables/pmasynrm-180kw");
    MachineFolder::read(&folder).unwrap().tables()
});

/// After a second at a speed with a torque asked for, the reference, its flux linkage and the steady voltage in V.
fn driven(warmth: Warmth, rpm: f32, torque_nm: f32, udc_v: f32) -> (Dq, Dq, f32) {
    let (tables, clock) = (&*TABLES, Clock::new(25_000_000, 2_500));
    let constants = Law { gains: &Gains::DEFAULT, clock: &clock, tables };
    let limits = ModeLimits::carrier(1.0);
    let volt_seconds = Some(AlphaBeta::default());
    let committed = Committed { horizon_s: 0.0, volt_seconds, ripple_wb: None, interval_s: 0.5e-3 };
    let turns = rpm / 60.0 * tables.ratings.pole_pairs * 1e-4;
    let (mut law, mut steady_v) = (Controller::new(), 0.0);
    for period in 0..10_000_u16 {
        let angle = Angle::from_turns(turns * f32::from(period));
        law.track(angle, &clock);
        let sample = RotorSample::new(law.target().current.unpark(angle.sin_cos()).abc(), angle, tables);
        law.observe(&sample, tables);
        if warmth != Warmth::NONE {
            law.warm(warmth);
        }
        if period % 5 == 0 && period > 1_000 {
            let demand = Demand { torque_nm, slew_limited: true };
            law.aim(&AimInput::plain(&demand, udc_v, &limits), &constants);
            steady_v = law.regulate(&sample, &committed, &limits, &constants).steady_v;
        }
    }
    (law.target().current, law.target().flux, steady_v)
}

#[test]
fn the_resistance_is_the_windings_in_the_voltage() {
    let [(current, _, cold_v), (_, _, hot_v)] =
        [Warmth::NONE, Warmth::new(1.5)].map(|warmth| driven(warmth, 0.0, 600.0, 1_500.0));
    let rated_ohm = TABLES.ratings.stator_resistance_ohm;
    assert!((cold_v - rated_ohm * current.length()).abs() < 1e-3 * cold_v, "{cold_v} V");
    assert!((hot_v / cold_v - 1.5).abs() < 1e-3, "{hot_v} V, {cold_v} V");
}

/// In weakening a warm winding drops more of what the link gives, and what is left is still the operating point's.
#[test]
fn the_operating_point_keeps_the_voltage_with_a_warm_winding() {
    let (omega, ratings) = (4_000.0 / 60.0 * std::f32::consts::TAU * 4.0, TABLES.ratings);
    for (ratio, kept) in [(1.0, false), (1.5, true)] {
        let (current, flux, _) = driven(Warmth::new(ratio), 4_000.0, 1_235.0, 1_000.0);
        let hot = flux.j() * omega + current * (1.5 * ratings.stator_resistance_ohm);
        let over = hot.length() / six_step_v(1_000.0) - 1.0;
        assert_eq!(over < 1e-4, kept, "taken for {ratio} of the rating: {over}");
    }
}
