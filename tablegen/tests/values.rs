//! Tables of the machines by their sums: what changes one number of a table by a millionth of what stands in it changes a line of
//! `tests/values/`, written anew with `TRACTIVE_PINNED=write`. And the shortest branches of patterns, which are followed in a moment.
#![allow(missing_docs)]

use std::fmt::Write;
use std::path::Path;
use tractive_control::machine::Tables;
use tractive_tablegen::MachineFolder;

/// Sums of a column with weights that differ from number to number: of the values, and of their magnitudes, which is the scale.
fn sums(values: impl Iterator<Item = f32>) -> [f64; 3] {
    values.enumerate().fold([0.0; 3], |[plain, weighted, scale], (place, value)| {
        let (value, weight) = (f64::from(value), (place * 7_919 % 101) as f64 / 50.0 - 1.0);
        [plain + value, weighted + value * weight, scale + value.abs()]
    })
}

fn table<const N: usize>(out: &mut Vec<(String, [f64; 3])>, name: &str, nodes: &[[f32; N]]) {
    for column in 0..N {
        out.push((format!("{name}.{column}"), sums(nodes.iter().map(|node| node[column]))));
    }
}

/// All of a machine's tables.
fn told(machine: &str) -> Vec<(String, [f64; 3])> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tables").join(machine);
    let Tables { ratings, flux, mtpa, weakening, .. } = MachineFolder::read(&folder).unwrap().tables();
    let mut out = Vec::new();
    let mut table_of = |name: &str, ends: [f32; 4]| {
        out.push((format!("{machine}.{name}"), sums(ends.into_iter())));
    };
    table_of(
        "flux.grid",
        [flux.first_row, flux.inverse_row_step, flux.first_column, flux.inverse_column_step],
    );
    let parameters = &mtpa.parameters;
    table_of(
        "mtpa.grid",
        [
            parameters.first_row,
            parameters.inverse_row_step,
            parameters.first_column,
            parameters.inverse_column_step,
        ],
    );
    let currents = &weakening.currents;
    table_of(
        "weakening.grid",
        [currents.first_row, currents.inverse_row_step, currents.first_column, currents.inverse_column_step],
    );
    let knees = [weakening.flux_knee_wb, weakening.share_knee];
    table_of("curves", [mtpa.start.first, mtpa.start.inverse_step, knees[0], knees[1]]);
    table_of(
        "torque",
        [
            weakening.torque.first,
            weakening.torque.inverse_step,
            ratings.magnet_flux_wb,
            ratings.max_torque_nm,
        ],
    );
    let name = |table: &str| format!("{machine}.{table}");
    table(&mut out, &name("flux"), flux.nodes);
    table(&mut out, &name("mtpa.parameters"), parameters.nodes);
    table(&mut out, &name("mtpa.universal"), mtpa.universal.nodes);
    table(&mut out, &name("mtpa.start"), mtpa.start.nodes);
    table(&mut out, &name("mtpa.curvature"), mtpa.curvature.nodes);
    table(&mut out, &name("weakening.currents"), currents.nodes);
    table(&mut out, &name("weakening.torque"), weakening.torque.nodes);
    out
}

fn check(machine: &str) {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/values").join(machine).with_extension("txt");
    let told = told(machine);
    if std::env::var_os("TRACTIVE_PINNED").is_some_and(|word| word == "write") {
        let mut text = String::new();
        for (name, [plain, weighted, scale]) in &told {
            writeln!(text, "{name} {plain:.9e} {weighted:.9e} {scale:.9e}").unwrap();
        }
        std::fs::write(&file, text).unwrap();
    }
    let pinned = std::fs::read_to_string(&file).unwrap();
    assert_eq!(pinned.lines().count(), told.len());
    for (line, (name, sums)) in pinned.lines().zip(told) {
        let mut words = line.split(' ');
        assert_eq!(words.next(), Some(name.as_str()));
        let pinned: Vec<f64> = words.map(|word| word.parse().unwrap()).collect();
        for (now, pinned_sum) in sums.into_iter().zip(&pinned) {
            assert!((now - pinned_sum).abs() <= 1e-7 * pinned[2], "{name}: {sums:?}, not {pinned:?}");
        }
    }
}

#[test]
fn tables_of_the_large_machine() {
    check("pmasynrm-180kw");
}

#[test]
fn tables_of_the_small_machine() {
    check("pmsm-48v-1kw");
}

#[test]
fn tables_of_the_zs9s_machine() {
    check("ipm-zs9");
}

#[cfg(feature = "patterns")]
mod patterns {
    use tractive_tablegen::patterns::{BRANCHES, Waveform, angle_table};

    #[test]
    fn short_branches_are_followed_to_the_committed_angles() {
        let committed = include_str!("../../control/src/modulation/optimal/table.rs");
        for name in ["opp3b", "opp5c"] {
            let branch = BRANCHES.into_iter().find(|branch| branch.name == name).unwrap();
            let table = angle_table(&[branch.followed().unwrap()]);
            let own = &table[table.find("#[rustfmt::skip]").unwrap()..];
            assert!(committed.contains(own), "{own}");
        }
    }

    /// Of two pulses and none within: by hand.
    #[test]
    fn a_wave_is_what_its_edges_make() {
        let (a, b) = (0.4_f64, 1.1_f64);
        for first in [1.0, -1.0] {
            let wave = Waveform { first, angles_rad: &[a, b] };
            let harmonic = |n: f64| first * (1.0 - 2.0 * (n * a).cos() + 2.0 * (n * b).cos());
            assert!((wave.fundamental() - harmonic(1.0)).abs() < 1e-12);
            let orders = (5..=997).filter(|n| n % 2 == 1 && n % 3 != 0).map(f64::from);
            let squares: f64 = orders.map(|n| (harmonic(n) / (n * n)).powi(2)).sum();
            assert!((wave.weighted_distortion() - squares.sqrt() / harmonic(1.0)).abs() < 1e-9);
            assert_eq!(wave.shortest_rad(), a);
        }
        let shortest = |angles_rad: &[f64]| Waveform { first: 1.0, angles_rad }.shortest_rad();
        assert!((shortest(&[0.6, 0.9]) - 0.3).abs() < 1e-12, "between two edges");
        assert!((shortest(&[0.6, 1.5]) - (std::f64::consts::PI - 3.0)).abs() < 1e-12, "around 90°");
        assert!((shortest(&[]) - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
    }
}
