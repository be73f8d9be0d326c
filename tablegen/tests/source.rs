//! The generated Rust text: reproducible, readable, every number as it was, nothing that is no number.
#![allow(missing_docs)]

mod common;

use common::reference_folder;
use tractive_control::machine::Tables;
use tractive_tablegen::{MachineFolder, rust_source};

fn reference() -> Tables {
    MachineFolder::read(&reference_folder()).unwrap().tables()
}

/// The numbers of one static array, in order.
fn numbers(source: &str, name: &str) -> Vec<f32> {
    let begin = source.find(&format!("static {name}: ")).unwrap();
    let array = &source[begin..];
    let array = &array[array.find("= [").unwrap() + 3..array.find("];\n").unwrap()];
    let words = array.split(|c: char| "[], \n".contains(c)).filter(|word| !word.is_empty());
    words.map(|word| word.parse().unwrap()).collect()
}

#[test]
fn twice_the_same() {
    let [first, second] = [(); 2].map(|()| rust_source(&reference(), "tractive_control::machine"));
    assert!(first == second);
}

#[test]
fn every_number_reads_back_as_itself() {
    let made = reference();
    let source = rust_source(&made, "tractive_control::machine");
    assert_eq!(numbers(&source, "FLUX"), made.flux.nodes.as_flattened());
    assert_eq!(numbers(&source, "MTPA_PARAMETERS"), made.mtpa.parameters.nodes.as_flattened());
    assert_eq!(numbers(&source, "MTPA_UNIVERSAL"), made.mtpa.universal.nodes.as_flattened());
    assert_eq!(numbers(&source, "MTPA_START"), made.mtpa.start.nodes.as_flattened());
    assert_eq!(numbers(&source, "MTPA_CURVATURE"), made.mtpa.curvature.nodes.as_flattened());
    assert_eq!(numbers(&source, "WEAKENING_CURRENTS"), made.weakening.currents.nodes.as_flattened());
    assert_eq!(numbers(&source, "WEAKENING_TORQUE"), made.weakening.torque.nodes.as_flattened());
    let all = [
        made.flux.nodes.as_flattened(),
        made.mtpa.start.nodes.as_flattened(),
        made.mtpa.curvature.nodes.as_flattened(),
        made.weakening.currents.nodes.as_flattened(),
    ];
    assert!(all.into_iter().flatten().all(|value| value.is_finite()));
}

#[test]
fn lines_are_short_and_tables_small() {
    let made = reference();
    let source = rust_source(&made, "tractive_control::machine");
    let longest = source.lines().map(str::len).max().unwrap();
    let nodes = 2
        * (made.flux.nodes.len() + made.mtpa.parameters.nodes.len() + made.weakening.currents.nodes.len())
        + 5 * made.weakening.torque.nodes.len()
        + made.mtpa.universal.nodes.len()
        + 4 * made.mtpa.start.nodes.len()
        + 2 * made.mtpa.curvature.nodes.len();
    println!("longest line {longest}, tables {} bytes", 4 * nodes);
    assert!(longest <= 130);
    assert!(4 * nodes < 80_000);
}

#[test]
fn the_universal_curve_solves_its_equation() {
    // With x = s/(1+s), s = √t_en and i_dn = −s·node: t_en² = i_dn (i_dn − 1)³.
    let universal = reference().mtpa.universal.nodes;
    assert_eq!((universal[0], universal[64]), ([0.0], [1.0]));
    for (k, [node]) in universal.iter().enumerate().take(64).skip(1) {
        let x = k as f64 / 64.0;
        let s = x / (1.0 - x);
        let i_dn = -s * f64::from(*node);
        let left = i_dn * (i_dn - 1.0).powi(3);
        assert!((left / s.powi(4) - 1.0).abs() < 1e-6, "node {k}: {left} {}", s.powi(4));
    }
}

#[test]
fn ratings_are_converted() {
    let ratings = reference().ratings;
    assert!((ratings.max_speed_rad_s - 628.318_5).abs() < 1e-3);
    assert!((ratings.trip_speed_rad_s - 1.1 * 628.318_5).abs() < 1e-3);
    assert!((ratings.magnet_flux_wb - 0.448_455_2).abs() < 1e-6);
    assert_eq!(ratings.pole_pairs, 4.0);
    assert_eq!(ratings.max_power_w, 246.4e3);
}
