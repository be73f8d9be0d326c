//! The highest i_d compared with a search on the closed form, for a machine without saturation.

use super::*;
use crate::testing::{IPM, MOST_A, RESISTANCE_OHM, near};

/// Goes down in small steps from zero current.
fn by_search(torque_nm: f64, omega: f64, voltage_v: f64) -> Option<f64> {
    (0..=200_000).map(|k| -MOST_A * f64::from(k) / 200_000.0).find(|id| {
        let iq = torque_nm / IPM.torque_nm(*id, 1.0);
        let (psi_d, psi_q) = IPM.flux_wb(*id, iq);
        let volts = (RESISTANCE_OHM * id - omega * psi_q, RESISTANCE_OHM * iq + omega * psi_d);
        id.hypot(iq) <= MOST_A && volts.0.hypot(volts.1) <= voltage_v
    })
}

#[test]
fn the_highest_id_is_what_a_search_finds() {
    let machine = IPM.folder(&[]);
    let map = SmoothMap::new(&machine.map);
    let (mut some, mut none) = (0, 0);
    for torque_nm in [0.0, 4.0, 12.0, 20.0, 22.0] {
        for (omega, voltage_v) in [
            (0.0, f64::INFINITY),
            (60.0, 15.0),
            (300.0, 70.0),
            (600.0, 110.0),
            (942.0, 150.0),
            (1200.0, 90.0),
        ] {
            let point = Point { what: "", torque_nm, omega, voltage_v };
            let found = highest_id_a(&point, &map, &machine.parameters);
            match by_search(torque_nm, omega, voltage_v) {
                Some(id) => {
                    some += 1;
                    let found = found.unwrap_or(f64::NAN);
                    assert!((found - id).abs() < 3e-4, "{torque_nm} {omega} {voltage_v}: {found}, not {id}");
                }
                None => {
                    none += 1;
                    assert_eq!(found, None, "{torque_nm} {omega} {voltage_v}");
                }
            }
        }
    }
    assert!(some > 10 && none > 5, "{some}, {none}");
}

/// The largest torque of the largest current needs exactly the i_d of its optimum.
#[test]
fn the_most_torque_takes_its_own_id() {
    let machine = IPM.folder(&[]);
    let map = SmoothMap::new(&machine.map);
    let (id, iq) = IPM.best(MOST_A);
    let torque_nm = Optimum::new(&map, &machine.parameters).most_torque_nm();
    near(torque_nm, IPM.torque_nm(id, iq), 1e-9);
    let point = |torque_nm| Point { what: "", torque_nm, omega: 0.0, voltage_v: f64::INFINITY };
    let found = highest_id_a(&point(torque_nm), &map, &machine.parameters).unwrap();
    assert!((found - id).abs() < 0.01, "{found}, not {id}");
    assert_eq!(highest_id_a(&point(1.000_1 * torque_nm), &map, &machine.parameters), None);
}

#[test]
fn points_of_a_machine() {
    let [full, rated, fast] = points(&IPM.folder(&[]).parameters);
    assert_eq!((full.torque_nm, full.omega, full.voltage_v), (22.0, 0.0, f64::INFINITY));
    assert_eq!((rated.torque_nm, fast.torque_nm), (15.0, 0.0));
    near(rated.omega, 471.238_898_038, 1e-9);
    near(fast.omega, 942.477_796_077, 1e-9);
    near(rated.voltage_v, 190.985_931_710, 1e-9);
    near(fast.voltage_v, 159.154_943_092, 1e-9);
}

/// Refused above the highest value that every point allows, accepted below it; the message names that value.
#[test]
fn a_limit_is_held_against_each_point() {
    let mut machine = IPM.folder(&[]);
    let map = SmoothMap::new(&machine.map);
    let needed =
        points(&machine.parameters).map(|point| highest_id_a(&point, &map, &machine.parameters).unwrap());
    let lowest = needed.into_iter().fold(0.0, f64::min);
    let file = Path::new("machine.toml");
    machine.parameters.min_id_a = lowest - 1e-6;
    assert!(check(&machine, file).is_ok(), "{needed:?}");
    machine.parameters.min_id_a = lowest + 1e-3;
    let said = check(&machine, file).err().map(|error| error.to_string()).unwrap();
    let allowed = format!("must be at or below {:.1}, ", (10.0 * lowest).floor() / 10.0);
    assert!(said.contains(&allowed), "{said}");
}
