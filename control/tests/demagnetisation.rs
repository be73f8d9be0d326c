//! The demagnetisation limit in the operating points of both laws: i_d is never below it, and within it there is no more torque to be had.

use std::path::Path;
use tractive_control::control::{
    AimInput, ControlLaw, Controller, Demand, Gains, Law, ModeLimits, PiLaw, Region, Regulated, RotorSample,
    VoltageLimit, flux_linkage, mtpa, operating_point, torque_nm,
};
use tractive_control::frames::{Angle, Dq, six_step_v};
use tractive_control::machine::Tables;
use tractive_control::time::Clock;
use tractive_tablegen::MachineFolder;

const LEAST_A: f32 = -160.0;

/// The reference machine, with the limit or without.
fn tables(limited: bool) -> Tables {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tables/pmasynrm-180kw");
    let [toml, map] =
        ["machine.toml", "flux_map.csv"].map(|name| std::fs::read_to_string(folder.join(name)).unwrap());
    let key = if limited { format!("\nmin_id_a = {LEAST_A}\n") } else { String::new() };
    MachineFolder::parse(&(toml + &key), &map).unwrap().tables()
}

fn omega(tables: &Tables, rpm: f32) -> f32 {
    rpm / 60.0 * std::f32::consts::TAU * tables.ratings.pole_pairs
}

/// The most torque of a sign within current, voltage and limit of i_d, by looking everywhere.
fn most_nm(tables: &Tables, sign: f32, omega: f32, voltage_v: f32) -> f32 {
    let most_a = tables.ratings.max_current_a;
    let mut most = 0.0_f32;
    for d in 0..=160 {
        for q in 0..=240 {
            let current = Dq { d: -d as f32, q: sign * q as f32 };
            let flux = flux_linkage(tables, current);
            let voltage = flux.j() * omega + current * tables.ratings.stator_resistance_ohm;
            if current.length() <= most_a && voltage.length() <= voltage_v {
                most = most.max(sign * torque_nm(tables, flux, current));
            }
        }
    }
    most
}

#[test]
fn no_operating_point_is_below_the_limit_and_the_most_torque_is_what_there_is_above_it() {
    let (limited, free) = (tables(true), tables(false));
    let (mut below, mut weakened, mut worst, mut off_nm) = (0, 0, 0.0_f32, 0.0_f32);
    for rpm in (0..=24).map(|k| 250.0 * k as f32) {
        for udc_v in [1_000.0, 1_250.0, 1_500.0, 1_800.0] {
            let at = omega(&limited, rpm);
            for (modulation_index, filled) in [(0.85, false), (1.0, false), (1.0, true)] {
                let limit = VoltageLimit { udc_v, modulation_index, filled };
                for torque_nm in (-13..=13).map(|k| 100.0 * k as f32) {
                    let point = operating_point(torque_nm, at, &limit, &limited);
                    let name =
                        format!("{torque_nm} N·m, {rpm} r/min, {udc_v} V, {modulation_index} {filled}");
                    assert!(point.current.d >= LEAST_A, "{name}: {point:?}");
                    assert_eq!(point.flux, flux_linkage(&limited, point.current), "{name}");
                    let given_nm = self::torque_nm(&limited, point.flux, point.current);
                    off_nm = off_nm.max((given_nm - point.torque_nm).abs());
                    weakened += u32::from(point.region == Region::Weakening);
                    below += u32::from(operating_point(torque_nm, at, &limit, &free).current.d < LEAST_A);
                }
            }
            // As much as there is at six-step, of either sign.
            for sign in [1.0, -1.0] {
                let limit = VoltageLimit { udc_v, modulation_index: 1.0, filled: false };
                let given = operating_point(sign * 1_235.0, at, &limit, &limited);
                let most = most_nm(&limited, sign, at, six_step_v(udc_v)).min(1_235.0);
                worst = worst.max((most - sign * given.torque_nm) / 1_235.0);
            }
        }
    }
    println!(
        "{below} points below without the limit, {weakened} weakened with it; {worst} of the largest torque short, {off_nm} N·m off at most"
    );
    assert!(
        below > 300 && weakened > 1_000 && worst < 0.01 && off_nm < 6.0,
        "{below}, {weakened}, {worst}, {off_nm}"
    );
    // A link that is too low for the narrowest circle of the tables.
    let limit = VoltageLimit { udc_v: 500.0, modulation_index: 1.0, filled: true };
    for torque_nm in [-1_235.0, 0.0, 300.0, 1_235.0] {
        let point = operating_point(torque_nm, omega(&limited, 6_000.0), &limit, &limited);
        assert!(point.current.d >= LEAST_A, "{point:?}");
    }
}

#[test]
fn mtpa_ends_at_a_limit_above_its_own_currents() {
    let mut limited = tables(true);
    let [little, much] = [100.0, 1_235.0].map(|torque_nm| mtpa(torque_nm, &limited));
    limited.ratings.min_id_a = 0.5 * much.d;
    assert_eq!(mtpa(1_235.0, &limited).d, 0.5 * much.d);
    assert_eq!(mtpa(100.0, &limited), little);
}

/// The argument in a range at which a rising function has a value, by halving.
fn halved(wanted: f32, (mut low, mut high): (f32, f32), at: impl Fn(f32) -> f32) -> f32 {
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if at(middle) < wanted { low = middle } else { high = middle }
    }
    high
}

/// i_d of a flux linkage, in A: at the same ψ_q, ψ_d rises with it.
fn id_a(tables: &Tables, flux: Dq) -> f32 {
    let q_of = |d: f32| halved(flux.q, (-400.0, 400.0), |q| flux_linkage(tables, Dq { d, q }).q);
    halved(flux.d, (-400.0, 100.0), |d| flux_linkage(tables, Dq { d, q: q_of(d) }).d)
}

/// The least i_d of current and flux references at a speed, with torque reversed from one sign to the other again and again.
fn least_of_references<L: ControlLaw>(
    law: &mut L,
    tables: &Tables,
    rpm: f32,
    limits: &ModeLimits,
) -> (f32, f32) {
    let clock = Clock::new(25_000_000, 2_500);
    let constants = Law { gains: &Gains::DEFAULT, clock: &clock, tables };
    let omega = omega(tables, rpm);
    let (mut current_a, mut flux_a) = (0.0_f32, 0.0_f32);
    for period in 0..12_000_u16 {
        let angle = Angle::from_turns(omega / std::f32::consts::TAU * 1e-4 * f32::from(period));
        law.track(angle, &clock);
        // The link falls as the torque is reversed: the circle gets narrower while the reference is still on its way.
        let (wanted_nm, udc_v) =
            [(1_235.0, 1_500.0), (0.0, 1_020.0), (-1_235.0, 1_500.0)][usize::from(period / 2_000 % 3)];
        let flowing = law.target().current;
        let sample = RotorSample::new(flowing.unpark(angle.sin_cos()).abc(), angle, tables);
        law.observe(&sample, tables);
        if period % 5 != 0 || period < 1_000 {
            continue;
        }
        let demand = Demand { torque_nm: wanted_nm, slew_limited: period < 6_000 };
        law.aim(&AimInput::plain(&demand, udc_v, limits), &constants);
        let target = law.target();
        current_a = current_a.min(target.current.d);
        flux_a = flux_a.min(id_a(tables, target.flux));
    }
    (current_a, flux_a)
}

#[test]
fn references_keep_the_limit_on_their_way_as_well() {
    let way = |follows, filled, settled| ModeLimits { follows, filled, settled, ..ModeLimits::carrier(1.0) };
    let ways = [
        way(Regulated::Mean, false, true),
        way(Regulated::Fundamental, false, true),
        way(Regulated::Angle, true, true),
        way(Regulated::Angle, true, false),
    ];
    let (limited, free) = (tables(true), tables(false));
    for limits in ways {
        for rpm in [2_500.0, 4_000.0, 5_900.0] {
            let name = format!("{:?} at {rpm} r/min", limits.follows);
            let (current_a, flux_a) = least_of_references(&mut Controller::new(), &limited, rpm, &limits);
            let (without_a, free_a) = least_of_references(&mut Controller::new(), &free, rpm, &limits);
            println!("{name}: {current_a} A, flux {flux_a} A; without the limit {without_a} A, {free_a} A");
            // What the halving and single precision leave.
            assert!(
                current_a >= LEAST_A && flux_a >= LEAST_A - 0.05,
                "{name}: {current_a} A, flux {flux_a} A"
            );
            assert!(without_a < LEAST_A - 10.0 && free_a < LEAST_A - 10.0, "{name} tries nothing");
        }
    }
}

/// The other law moves i_d for as long as its loops want more voltage than there is: as if the link were gone.
#[test]
fn the_papers_law_keeps_it_however_much_voltage_is_missing() {
    let limited = tables(true);
    let limits = ModeLimits::carrier(0.9);
    let clock = Clock::new(25_000_000, 2_500);
    let constants = Law { gains: &Gains::DEFAULT, clock: &clock, tables: &limited };
    let mut law = PiLaw::new();
    let omega = omega(&limited, 6_000.0);
    let volt_seconds = Some(tractive_control::frames::AlphaBeta::default());
    let committed = tractive_control::control::Committed {
        horizon_s: 0.5e-3,
        volt_seconds,
        ripple_wb: None,
        interval_s: 0.5e-3,
    };
    let (mut least_a, mut torque_nm) = (0.0_f32, 0.0);
    for period in 0..20_000_u16 {
        let angle = Angle::from_turns(omega / std::f32::consts::TAU * 1e-4 * f32::from(period));
        law.track(angle, &clock);
        let sample = RotorSample::new(law.target().current.unpark(angle.sin_cos()).abc(), angle, &limited);
        law.observe(&sample, &limited);
        if period % 5 != 0 || period < 1_000 {
            continue;
        }
        let demand = Demand { torque_nm: 1_235.0, slew_limited: true };
        law.aim(&AimInput::plain(&demand, 900.0, &limits), &constants);
        law.regulate(&sample, &committed, &limits, &constants);
        least_a = least_a.min(law.target().current.d);
        torque_nm = law.target().torque_nm;
    }
    assert_eq!((least_a, torque_nm > 0.0), (LEAST_A, true));
}
