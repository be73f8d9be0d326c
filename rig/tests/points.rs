//! Operating points by the firmware's own code, judged by brute force on the machines' own equations.

mod brute_force;
mod linear;
#[path = "../../tablegen/tests/common/mod.rs"]
mod folders;

use brute_force::{Supply, TorqueCurve, Truth};
use folders::{Analytic, CoEnergy, REFERENCE};
use linear::Linear;
use rayon::prelude::*;
use std::fmt;
use tractive::control::{OperatingPoint, Region, VoltageLimit, operating_point};
use tractive_rig::machine::Machine;
use tractive_tablegen::SmoothMap;

/// A machine as the drive knows it, and as it is.
struct Case {
    name: &'static str,
    machine: Machine,
    truth: Truth,
}

impl Case {
    fn reference() -> Self {
        Self::new("the reference machine", Machine::load("pmasynrm-180kw").unwrap(), REFERENCE)
    }

    fn new(name: &'static str, machine: Machine, co_energy: CoEnergy) -> Self {
        let parameters = &machine.folder.parameters;
        let truth = Truth {
            co_energy,
            pole_pairs: parameters.pole_pairs,
            resistance_ohm: parameters.stator_resistance_ohm,
            max_current_a: parameters.max_current_a,
        };
        Self { name, machine, truth }
    }

    fn linear(linear: &Linear) -> Self {
        let folder = tempfile::tempdir().unwrap();
        linear.write(folder.path());
        let machine = Machine::load(&folder.path().display().to_string()).unwrap();
        Self::new(linear.name, machine, folders::linear(linear.ld_h, linear.lq_h, linear.magnet_wb))
    }

    fn analytic(name: &'static str, analytic: &Analytic) -> Self {
        let folder = analytic.folder();
        let machine = Machine::load(&folder.path().display().to_string()).unwrap();
        Self::new(name, machine, analytic.truth)
    }

    fn point(&self, torque_nm: f64, supply: &Supply, udc_v: f64) -> OperatingPoint {
        let limit = VoltageLimit { udc_v: udc_v as f32, depth: 1.0, filled: false };
        operating_point(torque_nm as f32, supply.omega as f32, &limit, self.machine.tables)
    }

    fn largest_nm(&self) -> f64 {
        self.machine.folder.parameters.max_torque_nm
    }
}

/// The largest value met, and where.
#[derive(Clone, Default)]
struct Worst(f64, String);

impl Worst {
    fn meet(&mut self, value: f64, place: impl FnOnce() -> String) {
        if value > self.0 || self.1.is_empty() {
            *self = Self(value, place());
        }
    }

    fn max(self, other: Self) -> Self {
        if other.1.is_empty() || (!self.1.is_empty() && self.0 >= other.0) { self } else { other }
    }
}

impl fmt::Display for Worst {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        write!(out, "{:+.3e} at {}", self.0, self.1)
    }
}

macro_rules! worst {
    ($($(#[$doc:meta])* $name:ident: $text:literal),* $(,)?) => {
        /// The worst of a map of points.
        #[derive(Clone, Default)]
        struct Found { points: usize, feasible: usize, $($(#[$doc])* $name: Worst),* }

        impl Found {
            fn and(self, other: Self) -> Self {
                Self {
                    points: self.points + other.points,
                    feasible: self.feasible + other.feasible,
                    $($name: self.$name.max(other.$name)),*
                }
            }
        }

        impl fmt::Display for Found {
            fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
                writeln!(out, "{} points, {} of them feasible", self.points, self.feasible)?;
                $(writeln!(out, "  {:<44} {}", $text, self.$name)?;)*
                Ok(())
            }
        }
    };
}

worst! {
    voltage: "voltage over its limit, share",
    current: "current over its limit, share",
    told: "torque told less torque given, N·m",
    torque: "feasible: torque off, share of its bound",
    excess: "feasible: current over the least, share",
    little: "feasible, little torque: the same, A",
    early: "feasible, but told limited: torque left, share",
    short: "not feasible: short of the most torque, share",
    unsaid: "not feasible, but not told: torque over, share",
}

/// From this share of the largest torque on (25 N·m of the reference machine) the least current is judged as a share; below it,
/// where the current itself is next to nothing, in A.
const LITTLE: f64 = 0.02;

#[derive(Clone, Copy)]
struct Raster {
    speeds: u32,
    links: u32,
    torques: &'static [f64],
}

/// Shares of the largest torque: 0, 5, 10, 25, 35, 50 … 1,235 N·m of the reference machine.
const TORQUES: [f64; 29] = [
    0.0, 0.00405, 0.0081, 0.020243, 0.0283, 0.0405, 0.0607, 0.081, 0.101, 0.1215, 0.162, 0.2024, 0.243, 0.283, 0.324, 0.364,
    0.405, 0.445, 0.486, 0.526, 0.567, 0.607, 0.648, 0.6885, 0.7287, 0.81, 0.891, 0.9717, 1.0,
];

/// The whole plane of speed, torque and link, all ends included.
fn survey(case: &Case, raster: &Raster) -> Found {
    let parameters = &case.machine.folder.parameters;
    let torques: Vec<(f64, TorqueCurve)> = raster
        .torques
        .par_iter()
        .map(|share| share * case.largest_nm())
        .map(|torque_nm| (torque_nm, case.truth.torque_curve(torque_nm)))
        .collect();
    let places: Vec<(f64, f64)> = (0..=raster.links)
        .flat_map(|link| (0..=raster.speeds).map(move |speed| (link, speed)))
        .map(|(link, speed)| {
            let (low, high) = (parameters.dc_link_min_v, parameters.dc_link_max_v);
            let udc_v = low + (high - low) * f64::from(link) / f64::from(raster.links);
            (udc_v, parameters.max_speed_rpm * f64::from(speed) / f64::from(raster.speeds))
        })
        .collect();
    let at = |(udc_v, speed_rpm): &(f64, f64)| at_place(case, &torques, *speed_rpm, *udc_v);
    places.par_iter().map(at).reduce(Found::default, Found::and)
}

fn at_place(case: &Case, torques: &[(f64, TorqueCurve)], speed_rpm: f64, udc_v: f64) -> Found {
    let truth = &case.truth;
    let supply = Supply::new(speed_rpm, truth.pole_pairs, udc_v);
    let mut found = Found::default();
    for sign in [1.0, -1.0] {
        let most_nm = truth.most_torque_nm(sign, &supply);
        for (torque_nm, curve) in torques {
            let wanted_nm = sign * torque_nm;
            let point = case.point(wanted_nm, &supply, udc_v);
            let place =
                || format!("{wanted_nm:.1} N·m, {speed_rpm:.0} r/min, {udc_v:.0} V: {:?} {:?}", point.region, point.current);
            let given = truth.point(point.current.d.into(), point.current.q.into());
            let given_nm = truth.torque_nm(&given);
            found.points += 1;
            found.voltage.meet(truth.voltage_v(&given, supply.omega) / supply.voltage_v - 1.0, place);
            found.current.meet(given.current_a() / truth.max_current_a - 1.0, place);
            found.told.meet((f64::from(point.torque_nm) - given_nm).abs(), place);
            let limited = point.region == Region::Limit;
            let Some(least_a) = truth.least_current_a(curve, sign, &supply) else {
                found.short.meet(1.0 - given_nm.abs() / most_nm, place);
                if !limited {
                    found.unsaid.meet(torque_nm / most_nm - 1.0, place);
                }
                continue;
            };
            found.feasible += 1;
            let bound_nm = 0.005 * torque_nm.max(LITTLE * case.largest_nm());
            found.torque.meet((given_nm - wanted_nm).abs() / bound_nm, place);
            if limited {
                found.early.meet(1.0 - torque_nm / most_nm, place);
            } else if *torque_nm >= LITTLE * case.largest_nm() {
                found.excess.meet(given.current_a() / least_a - 1.0, place);
            } else {
                found.little.meet(given.current_a() - least_a, place);
            }
        }
    }
    found
}

/// Another small one, which saturates.
const SATURATING: Analytic = Analytic {
    truth: CoEnergy {
        ldl_h: 0.003,
        lql_h: 0.006,
        psi_m_wb: 0.15,
        a_j: 0.6,
        im_a: 10.0,
        ida_a: 6.0,
        iqa_a: 8.0,
        b_j: 0.5,
        iqb_a: 5.0,
    },
    pole_pairs: 3,
    max_torque_nm: 20.0,
    max_current_a: 20.0,
    max_speed_rpm: 6000.0,
    dc_link_v: 560.0,
    step_a: 1.0,
};

fn others() -> Vec<Case> {
    let saturating = Case::analytic("small, saturating", &SATURATING);
    linear::MACHINES.iter().map(Case::linear).chain([saturating]).collect()
}

/// What a map of nodes leaves open: by how much flux linkage between them may differ from the truth, as a share, anywhere within
/// the current limit where weakening happens.
fn between_nodes(case: &Case) -> f64 {
    const STEPS: u32 = 150;
    let map = SmoothMap::new(&case.machine.folder.map);
    let largest = case.truth.max_current_a;
    let raster = (0..=STEPS).flat_map(|d| (0..=STEPS).map(move |q| (d, q)));
    let raster = raster.map(|(d, q)| {
        (-largest * f64::from(d) / f64::from(STEPS), largest * f64::from(q) / f64::from(STEPS))
    });
    let inside = raster.filter(|(id, iq)| id.hypot(*iq) <= largest);
    let low = {
        let weakening = &case.machine.tables.weakening;
        weakening.flux_knee_wb * weakening.torque.first / (1.0 - weakening.torque.first)
    };
    let off = inside.map(|(id, iq)| {
        let (at, (psi_d, psi_q)) = (map.at(id, iq), case.truth.co_energy.flux(id, iq));
        let flux = psi_d.hypot(psi_q);
        if flux < f64::from(low) { 0.0 } else { (at.psi_d_wb.hypot(at.psi_q_wb) - flux).abs() / flux }
    });
    off.fold(0.0, f64::max)
}

#[test]
fn weakening_keeps_the_limits_and_gives_what_there_is() {
    let found = survey(&Case::reference(), &Raster { speeds: 60, links: 16, torques: &TORQUES });
    println!("{found}between {:.2e}", between_nodes(&Case::reference()));
}

#[test]
fn weakening_of_other_machines() {
    for case in others() {
        let found = survey(&case, &Raster { speeds: 30, links: 8, torques: &TORQUES });
        println!("{}: {found}between {:.2e}", case.name, between_nodes(&case));
    }
}

fn mtpa(case: &Case, steps: u32) -> (Worst, Worst) {
    let supply = Supply::new(0.0, case.truth.pole_pairs, 1.0);
    let at = |step: u32| {
        let least = LITTLE * case.largest_nm();
        let torque_nm = least + (case.largest_nm() - least) * f64::from(step) / f64::from(steps);
        let optimum_a = case.truth.optimum_a(torque_nm);
        let mut found = (Worst::default(), Worst::default());
        for sign in [1.0, -1.0] {
            let point = case.point(sign * torque_nm, &supply, 1e6);
            assert_eq!(point.region, Region::Mtpa);
            let given = case.truth.point(point.current.d.into(), point.current.q.into());
            let place = || format!("{:.1} N·m: {:?}, least {optimum_a:.4} A", sign * torque_nm, point.current);
            let bound_nm = (0.003 * torque_nm).max(0.5 / 1235.0 * case.largest_nm());
            let off_nm = (case.truth.torque_nm(&given) - sign * torque_nm).abs();
            found.0.meet(off_nm / bound_nm, place);
            found.1.meet((given.current_a() / optimum_a - 1.0).abs(), place);
        }
        found
    };
    let both = |a: (Worst, Worst), b: (Worst, Worst)| (a.0.max(b.0), a.1.max(b.1));
    (0..=steps).into_par_iter().map(at).reduce(Default::default, both)
}

#[test]
fn mtpa_gives_its_torque_with_the_least_current() {
    for (case, steps) in [(Case::reference(), 484)].into_iter().chain(others().into_iter().map(|case| (case, 121))) {
        let (torque, current) = mtpa(&case, steps);
        println!("{}:\n  torque off, share of its bound    {torque}\n  current off the optimum, share    {current}", case.name);
    }
}
