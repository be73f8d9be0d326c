//! Maps written, imported, and held against the machine that they are of.
#![allow(dead_code)] // each test file uses its part

use crate::folders::SMALL;
use std::fmt::Write as _;
use std::path::Path;
use std::process::{Command, Output};
use tractive_rig::machine::Machine;
use tractive_tablegen::SmoothMap;

/// The limits of the machine that the maps are of.
pub const LIMITS: &str =
    "--pole-pairs 3 --rs 0.1 --max-current 20 --udc 560 --max-speed-rpm 6000 --max-switching-hz 5000";

/// The command with a map, more options, and a folder.
pub fn import(map: &Path, options: &str, out: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_tractive-rig"))
        .args(["machine", "import"])
        .arg(map)
        .args(LIMITS.split_whitespace())
        .args(options.split_whitespace())
        .arg("--out")
        .arg(out)
        .output()
        .unwrap()
}

/// Flux linkage of the machine at a current.
pub type Flux = fn(f64, f64) -> (f64, f64);

/// The machine that the maps are of.
pub fn truth(id: f64, iq: f64) -> (f64, f64) {
    SMALL.truth.flux(id, iq)
}

/// A map: its head, its values of both currents, and a row from currents (the map's own) and flux linkages.
pub fn map(head: &str, first: &[f64], second: &[f64], row: impl Fn(f64, f64) -> String) -> String {
    let mut text = format!("{head}\n");
    for a in first {
        for b in second {
            let _ = writeln!(text, "{}", row(*a, *b));
        }
    }
    text
}

/// The largest error of the imported map within the current limit, as a share of the largest flux linkage.
pub fn error(folder: &Path, wanted: Flux) -> f64 {
    let machine = Machine::load(&folder.display().to_string()).unwrap();
    let smooth = SmoothMap::new(&machine.folder.map);
    let (top_d, top_q) = wanted(0.0, 20.0);
    let mut worst: f64 = 0.0;
    for k in 0..=40 {
        for angle in 0..=36 {
            let (sin, cos) = (f64::from(angle) * 5.0_f64.to_radians()).sin_cos();
            let (id, iq) = (-0.5 * f64::from(k) * sin, 0.5 * f64::from(k) * cos);
            let (at, (psi_d, psi_q)) = (smooth.at(id, iq), wanted(id, iq));
            worst = worst.max((at.psi_d_wb - psi_d).hypot(at.psi_q_wb - psi_q) / top_d.hypot(top_q));
        }
    }
    worst
}
