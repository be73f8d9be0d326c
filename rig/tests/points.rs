//! Operating points by the firmware's own code, judged by brute force on the machines' own equations.

mod brute_force;
#[path = "../../tablegen/tests/common/mod.rs"]
mod folders;
mod linear;

use brute_force::{Supply, TorqueCurve, Truth};
use folders::{Analytic, CoEnergy, REFERENCE, SMALL};
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
    /// The flux linkage between the nodes of its folder: the plant's map.
    map: SmoothMap,
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
        let map = SmoothMap::new(&machine.folder.map);
        Self { name, machine, truth, map }
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
        let limit = VoltageLimit { udc_v: udc_v as f32, modulation_index: 1.0, filled: false };
        operating_point(torque_nm as f32, supply.omega as f32, &limit, self.machine.tables)
    }

    /// Voltage in steady state by the plant's map, in V.
    fn map_voltage_v(&self, point: &OperatingPoint, omega: f64) -> f64 {
        let (id, iq) = (f64::from(point.current.d), f64::from(point.current.q));
        let at = self.map.at(id, iq);
        let resistance_ohm = self.truth.resistance_ohm;
        (resistance_ohm * id - omega * at.psi_q_wb).hypot(resistance_ohm * iq + omega * at.psi_d_wb)
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
        struct Found { points: usize, feasible: usize, unweakened: usize, $($(#[$doc])* $name: Worst),* }

        impl Found {
            fn and(self, other: Self) -> Self {
                Self {
                    points: self.points + other.points,
                    feasible: self.feasible + other.feasible,
                    unweakened: self.unweakened + other.unweakened,
                    $($name: self.$name.max(other.$name)),*
                }
            }
        }

        impl fmt::Display for Found {
            fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
                let Self { points, feasible, unweakened, .. } = self;
                writeln!(out, "{points} points, {feasible} of them feasible, {unweakened} without weakening")?;
                $(writeln!(out, "  {:<52} {}", $text, self.$name)?;)*
                Ok(())
            }
        }
    };
}

worst! {
    voltage: "voltage over its limit by the plant's map, share",
    equations: "the same by the machine's equations, share",
    current: "current over its limit, share",
    told: "torque told less torque given, share of the largest",
    torque: "feasible: torque off, share of its bound",
    excess: "feasible: current over the least, share",
    little: "feasible, little torque: the same, of the largest",
    early: "feasible, but told limited: torque left, share",
    short: "not feasible: short of the most torque, share",
    unsaid: "not feasible, but not told: torque over, share",
}

/// From this share of the largest torque on (25 N·m of the reference machine) torque and least current are judged as shares of
/// themselves; below it, where they are next to nothing, as shares of the largest.
const LITTLE: f64 = 0.02;

#[derive(Clone, Copy)]
struct Raster {
    speeds: u32,
    links: u32,
    torques: &'static [f64],
}

/// Shares of the largest torque: 0, 5, 10, 25, 35, 50 … 1,235 N·m of the reference machine.
const TORQUES: [f64; 29] = [
    0.0, 0.00405, 0.0081, 0.020243, 0.0283, 0.0405, 0.0607, 0.081, 0.101, 0.1215, 0.162, 0.2024, 0.243,
    0.283, 0.324, 0.364, 0.405, 0.445, 0.486, 0.526, 0.567, 0.607, 0.648, 0.6885, 0.7287, 0.81, 0.891,
    0.9717, 1.0,
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
            let place = || {
                format!(
                    "{wanted_nm:.1} N·m, {speed_rpm:.0} r/min, {udc_v:.0} V: {:?} {:?}",
                    point.region, point.current
                )
            };
            let given = truth.point(point.current.d.into(), point.current.q.into());
            let given_nm = truth.torque_nm(&given);
            found.points += 1;
            found.unweakened += usize::from(point.region == Region::Mtpa);
            found.voltage.meet(case.map_voltage_v(&point, supply.omega) / supply.voltage_v - 1.0, place);
            found.equations.meet(truth.voltage_v(&given, supply.omega) / supply.voltage_v - 1.0, place);
            found.current.meet(given.current_a() / truth.max_current_a - 1.0, place);
            found.told.meet((f64::from(point.torque_nm) - given_nm).abs() / case.largest_nm(), place);
            let limited = point.region == Region::Limit;
            let Some(least_a) = truth.least_current_a(curve, sign, &supply) else {
                found.short.meet(1.0 - given_nm.abs() / most_nm, place);
                if !limited {
                    found.unsaid.meet(torque_nm / most_nm - 1.0, place);
                }
                continue;
            };
            found.feasible += 1;
            let little = *torque_nm < LITTLE * case.largest_nm();
            let bound_nm = if little { 0.001 * case.largest_nm() } else { 0.005 * torque_nm };
            found.torque.meet((given_nm - wanted_nm).abs() / bound_nm, place);
            if limited {
                found.early.meet(1.0 - torque_nm / most_nm, place);
            } else if !little {
                found.excess.meet(given.current_a() / least_a - 1.0, place);
            } else {
                found.little.meet((given.current_a() - least_a) / truth.max_current_a, place);
            }
        }
    }
    found
}

/// The machines of other kinds. Those with magnets alone are asked for three times the speed that they drive at elsewhere, so
/// that they must be weakened too.
fn others() -> Vec<Case> {
    let linear = linear::MACHINES.iter().map(|machine| {
        let times = if machine.magnet_wb > 0.0 && machine.lq_h <= 2.0 * machine.ld_h { 3.0 } else { 1.0 };
        let (speed_rpm, power_w) = (times * machine.speed_rpm, times * machine.power_w);
        Case::linear(&Linear { speed_rpm, power_w, ..*machine })
    });
    linear.chain([Case::analytic("small, saturating", &SMALL)]).collect()
}

/// The freedom that a folder's nodes leave: the largest difference of the flux linkage between them from the machine's, as a share,
/// anywhere within the current limit where the flux linkage is at least what the lowest link leaves.
fn between_nodes(case: &Case) -> f64 {
    const STEPS: u32 = 200;
    let parameters = &case.machine.folder.parameters;
    let slowest = Supply::new(parameters.max_speed_rpm, parameters.pole_pairs, parameters.dc_link_min_v);
    let least_wb = 0.9 * slowest.voltage_v / slowest.omega;
    let largest = case.truth.max_current_a;
    let share = |k: u32| largest * f64::from(k) / f64::from(STEPS);
    let raster = (0..=STEPS).flat_map(|d| (0..=STEPS).map(move |q| (-share(d), share(q))));
    let off = raster.filter(|(id, iq)| id.hypot(*iq) <= largest).map(|(id, iq)| {
        let (at, (psi_d, psi_q)) = (case.map.at(id, iq), case.truth.co_energy.flux(id, iq));
        let flux_wb = psi_d.hypot(psi_q);
        if flux_wb < least_wb { 0.0 } else { (at.psi_d_wb.hypot(at.psi_q_wb) - flux_wb).abs() / flux_wb }
    });
    off.fold(0.0, f64::max)
}

/// Single precision: a current is off by 2⁻²⁴, an index among the tables' rows by some 2⁻¹⁷ cells of 1.6 % of flux linkage each.
const ROUNDING: f64 = 5e-7;

fn judge(case: &Case, raster: &Raster) {
    let (found, between) = (survey(case, raster), between_nodes(case));
    println!("{}: {found}  the map's nodes leave {between:.1e} of the flux linkage open", case.name);
    assert!(found.voltage.0 < ROUNDING, "{}: voltage {}", case.name, found.voltage);
    assert!(found.equations.0 < between + ROUNDING, "{}: voltage {}", case.name, found.equations);
    assert!(found.current.0 < ROUNDING, "{}: current {}", case.name, found.current);
    assert!(found.told.0 < 1e-3, "{}: told {}", case.name, found.told);
    assert!(found.torque.0 < 1.0, "{}: torque {}", case.name, found.torque);
    assert!(found.excess.0 < 5e-3, "{}: above the least current {}", case.name, found.excess);
    assert!(found.little.0 < 5e-4, "{}: above the least current {}", case.name, found.little);
    // As much torque as the bound of torque itself would forgive.
    assert!(found.early.0 < 5e-3, "{}: limited too early {}", case.name, found.early);
    assert!(found.short.0 < 5e-3, "{}: short of the most torque {}", case.name, found.short);
    assert!(found.unsaid.0 < ROUNDING, "{}: not told {}", case.name, found.unsaid);
    let weakened = found.points - found.unweakened;
    assert!(weakened > found.points / 20, "{}: only {weakened} points are weakened", case.name);
}

#[test]
fn weakening_keeps_the_limits_and_gives_what_there_is() {
    judge(&Case::reference(), &Raster { speeds: 60, links: 16, torques: &TORQUES });
}

#[test]
fn other_machines_are_weakened_as_well() {
    for case in others() {
        judge(&case, &Raster { speeds: 30, links: 8, torques: &TORQUES });
    }
}

/// The errors of torque, as a share of its bound, and of current off the optimum, as a share, at even steps of torque.
fn mtpa(case: &Case, steps: u32) -> (Worst, Worst) {
    let standing = Supply::new(0.0, case.truth.pole_pairs, 1.0);
    let at = |step: u32| {
        let least = LITTLE * case.largest_nm();
        let torque_nm = least + (case.largest_nm() - least) * f64::from(step) / f64::from(steps);
        let optimum_a = case.truth.optimum_a(torque_nm);
        let mut found = (Worst::default(), Worst::default());
        for sign in [1.0, -1.0] {
            let point = case.point(sign * torque_nm, &standing, 1e6);
            assert_eq!(point.region, Region::Mtpa);
            let given = case.truth.point(point.current.d.into(), point.current.q.into());
            let place =
                || format!("{:.1} N·m: {:?}, least {optimum_a:.4} A", sign * torque_nm, point.current);
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
    // Steps of 2.5 N·m of the reference machine, of 1 % of the others'.
    let others = others().into_iter().map(|case| (case, 98));
    for (case, steps) in [(Case::reference(), 484)].into_iter().chain(others) {
        let (torque, current) = mtpa(&case, steps);
        println!("{}:", case.name);
        println!("  torque off, share of its bound  {torque}");
        println!("  current off the optimum, share  {current}");
        assert!(torque.0 < 1.0, "{}: torque {torque}", case.name);
        assert!(current.0 < 5e-4, "{}: current {current}", case.name);
    }
}

/// A folder that `machine new` makes; its co-energy in the form of the truth, with the saturation that the command's help states.
fn nameplate(values: &str, [ld_h, lq_h, magnet_wb, current_a, saturation]: [f64; 5]) -> Case {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("made");
    let line = format!(
        "machine new --ld {ld_h} --lq {lq_h} --psi-f {magnet_wb} --max-current {current_a} --saturation {saturation} {values}"
    );
    let rig = std::process::Command::new(env!("CARGO_BIN_EXE_tractive-rig"))
        .args(line.split_whitespace())
        .arg("--out")
        .arg(&out)
        .output()
        .unwrap();
    assert!(rig.status.success(), "{line}: {}", String::from_utf8_lossy(&rig.stderr));
    let machine = Machine::load(&out.display().to_string()).unwrap();
    let truth = match saturation {
        1.0 => folders::linear(ld_h, lq_h, magnet_wb),
        left => {
            let knee_j = 0.5 * lq_h * current_a * current_a * left * left / (1.0 - left * left);
            let (ida_a, iqa_a) = ((2.0 * knee_j / ld_h).sqrt(), (2.0 * knee_j / lq_h).sqrt());
            let none = folders::linear(0.0, 0.0, magnet_wb);
            CoEnergy { a_j: 2.0 * knee_j, im_a: 0.0, ida_a, iqa_a, ..none }
        }
    };
    Case::new("from nameplate values", machine, truth)
}

#[test]
fn a_machine_from_its_nameplate_has_the_operating_points_of_its_values() {
    let raster = Raster { speeds: 20, links: 4, torques: &TORQUES };
    let small = "--pole-pairs 4 --rs 0.05 --udc 48 --max-switching-hz 20000 --max-speed-rpm";
    let large = "--pole-pairs 2 --rs 0.5 --udc 540 --max-speed-rpm 6000 --max-switching-hz 4000";
    let cases = [
        nameplate(&format!("{small} 9000"), [0.3e-3, 0.45e-3, 0.0135, 32.0, 1.0]),
        nameplate(&format!("{small} 7000"), [0.3e-3, 0.45e-3, 0.0135, 32.0, 0.7]),
        nameplate(large, [12e-3, 60e-3, 0.1, 32.0, 1.0]),
    ];
    for case in cases {
        let found = survey(&case, &raster);
        println!("{}: {found}", case.name);
        let limits = [&found.voltage, &found.equations, &found.current, &found.unsaid];
        // Single precision where the circle of the flux linkage is as large as the magnets'.
        assert!(limits.iter().all(|over| over.0 < 2.0 * ROUNDING + between_nodes(&case)), "{found}");
        let within = [&found.excess, &found.little, &found.early, &found.short];
        assert!(found.torque.0 < 1.0 && within.iter().all(|off| off.0 < 5e-3), "{found}");
        assert!(found.feasible > found.points / 4 && found.unweakened < found.points, "{found}");
        let (torque, current) = mtpa(&case, 98);
        assert!(torque.0 < 1.0 && current.0 < 5e-4, "{torque}, {current}");
    }
}
