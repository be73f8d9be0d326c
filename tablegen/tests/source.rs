//! The generated Rust text: reproducible, readable, every number as it was, nothing that is no number.
#![allow(missing_docs)]

mod common;

use common::reference_folder;
use tractive_tablegen::{Generated, MachineFolder};

fn reference() -> Generated {
    Generated::new(&MachineFolder::read(&reference_folder()).unwrap()).unwrap()
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
    assert_eq!(reference(), reference());
    assert!(reference().rust_source() == reference().rust_source());
}

#[test]
fn every_number_reads_back_as_itself() {
    let made = reference();
    let source = made.rust_source();
    assert_eq!(numbers(&source, "FLUX"), made.flux.as_flattened());
    assert_eq!(numbers(&source, "MTPA_PARAMETERS"), made.parameters.as_flattened());
    assert_eq!(numbers(&source, "MTPA_UNIVERSAL"), made.universal.as_flattened());
    assert_eq!(numbers(&source, "MTPA_START"), made.start.as_flattened());
    assert_eq!(numbers(&source, "WEAKENING_CURRENTS"), made.weakening.currents.as_flattened());
    assert_eq!(numbers(&source, "WEAKENING_TORQUE"), made.weakening.torque.as_flattened());
    let all = [made.flux.as_flattened(), made.start.as_flattened(), made.weakening.currents.as_flattened()];
    assert!(all.into_iter().flatten().all(|value| value.is_finite()));
}

#[test]
fn lines_are_short_and_tables_small() {
    let made = reference();
    let source = made.rust_source();
    let longest = source.lines().map(str::len).max().unwrap();
    let nodes = 2 * (made.flux.len() + made.parameters.len() + made.weakening.currents.len())
        + 5 * made.weakening.torque.len()
        + made.universal.len()
        + 4 * made.start.len();
    println!("longest line {longest}, tables {} bytes", 4 * nodes);
    assert!(longest <= 130);
    assert!(4 * nodes < 80_000);
}

#[test]
fn the_universal_curve_solves_its_equation() {
    // With x = s/(1+s), s = √t_en and i_dn = −s·node: t_en² = i_dn (i_dn − 1)³.
    let made = reference();
    assert_eq!((made.universal[0], made.universal[64]), ([0.0], [1.0]));
    for (k, [node]) in made.universal.iter().enumerate().take(64).skip(1) {
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
