//! Arbitrary machine folders: each is refused in one line that names its file, or it is a machine whose numbers make sense.

use tractive_tablegen::MachineFolder;

/// A small machine, and its map.
const MACHINE: &str = include_str!("../machine/machine.toml");
const MAP: &str = include_str!("../machine/flux_map.csv");

/// The first byte chooses the file that the others become: `m`, the map; any other, the machine.
pub fn check(bytes: &[u8]) {
    let Some((which, bytes)) = bytes.split_first() else { return };
    let text = String::from_utf8_lossy(bytes);
    let (machine, map) = if *which == b'm' { (MACHINE, &*text) } else { (&*text, MAP) };
    match MachineFolder::parse(machine, map) {
        Ok(MachineFolder { parameters, map }) => {
            assert!(parameters.max_current_a.is_finite() && parameters.max_current_a > 0.0);
            assert!(parameters.max_torque_nm.is_finite() && parameters.max_torque_nm > 0.0);
            let numbers = [&map.id_a, &map.iq_a, &map.psi_d_wb, &map.psi_q_wb];
            assert!(numbers.into_iter().flatten().all(|number| number.is_finite()));
            let nodes = map.id_a.len() * map.iq_a.len();
            assert_eq!([map.psi_d_wb.len(), map.psi_q_wb.len()], [nodes; 2]);
        }
        Err(error) => check_refusal(&error.to_string()),
    }
}

/// A refusal is one line, and begins with its file.
pub fn check_refusal(refusal: &str) {
    assert_eq!(refusal.lines().count(), 1, "{refusal}");
    assert!(refusal.contains("machine.toml") || refusal.contains("flux_map.csv"), "{refusal}");
}
