//! The paper's MTPA compared with the project's own, judged on the smooth flux map. The paper does not say with which inductances its first pass
//! begins: those at zero current are our reading.

use crate::machine::Machine;
use crate::verdict::{Verdict, worst};
use serde::Serialize;
use tractive::control::{mtpa, mtpa_passes};
use tractive::frames::Dq;
use tractive_tablegen::{Optimum, SmoothMap};

/// The figures of a method for a torque.
#[derive(Clone, Debug, Serialize)]
pub struct MethodFigures {
    /// The method.
    pub method: &'static str,
    /// Torque wanted, in N·m.
    pub torque_nm: f64,
    /// Torque delivered minus that, in percent.
    pub torque_error_percent: f64,
    /// Current above the least that gives the delivered torque, in percent.
    pub excess_current_percent: f64,
}

/// The method that the firmware runs.
pub const OURS: &str = "the same, trimmed: ours";
/// The plain reading of the paper: `--law pi --mtpa-start zero`.
pub const ZERO: &str = "two passes from L(0, 0), as we read the paper";
/// The point at which the passes no longer change: `--law pi`.
pub const PREVIOUS: &str = "two passes from the point before, again and again";
/// More passes than the fixed point needs.
const MANY: usize = 60;
/// Its bounds: torque off, and current above the least, in percent.
const BOUNDS: (f64, f64) = (0.3, 0.05);

/// The worst value of every method; ours is judged, the others are reported.
pub fn verdicts(figures: &[MethodFigures]) -> Vec<Verdict> {
    let methods = figures.iter().map(|one| one.method).take(figures.len() / SHARES.len());
    let of = |method: &'static str| {
        let own = move || figures.iter().filter(move |one| one.method == method);
        let (torque, current) = if method == OURS { BOUNDS } else { (f64::INFINITY, f64::INFINITY) };
        [
            ("torque error", worst(own().map(|one| one.torque_error_percent.abs())), torque),
            ("current above the least", worst(own().map(|one| one.excess_current_percent)), current),
        ]
        .map(|(what, found, at_most)| {
            Verdict::at_most(&format!("MTPA {what} in %, {method}"), found, at_most)
        })
    };
    methods.flat_map(of).collect()
}

/// Torques as shares of the largest: 200, 600, 859 and 1,235 N·m of the reference machine.
const SHARES: [f64; 4] = [200.0 / 1235.0, 600.0 / 1235.0, 859.0 / 1235.0, 1.0];

/// One pass and two passes from zero current, two passes from the start in our tables, and the same with their trim.
pub fn compare(machine: &Machine) -> Vec<MethodFigures> {
    let tables = machine.tables;
    let map = SmoothMap::new(&machine.folder.map);
    let optimum = Optimum::new(&map, &machine.folder.parameters);
    let zero = Dq::default();
    let mut figures = Vec::new();
    for share in SHARES {
        let torque_nm = share * machine.folder.parameters.max_torque_nm;
        let wanted = torque_nm as f32;
        let [start_d, start_q, ..] = tables.mtpa.start.at(wanted);
        let started = Dq { d: start_d, q: start_q };
        let methods = [
            ("one pass from L(0, 0)", mtpa_passes::<1>(wanted, zero, tables)),
            (ZERO, mtpa_passes::<2>(wanted, zero, tables)),
            (PREVIOUS, mtpa_passes::<MANY>(wanted, zero, tables)),
            ("two passes as we start them", mtpa_passes::<2>(wanted, started, tables)),
            (OURS, mtpa(wanted, tables)),
        ];
        figures.extend(methods.map(|(method, current)| {
            let (id, iq) = (f64::from(current.d), f64::from(current.q));
            let delivered_nm = optimum.torque_nm(id, iq);
            let least = optimum.least_current(delivered_nm);
            MethodFigures {
                method,
                torque_nm,
                torque_error_percent: (delivered_nm / torque_nm - 1.0) * 100.0,
                excess_current_percent: (id.hypot(iq) / least.0.hypot(least.1) - 1.0) * 100.0,
            }
        }));
    }
    figures
}
