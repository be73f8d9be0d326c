//! Tables of machines of other kinds and sizes: no saturation, no saliency, no magnets, small; other grids.
#![allow(missing_docs)]

mod common;
#[path = "common/judge.rs"]
mod judge;

use common::{Analytic, Folder, REFERENCE, SMALL, axis, good_map, good_toml, linear, reference_folder};
use judge::Judge;
use tractive_tablegen::MachineFolder;

/// Bounds as shares: torque and current of MTPA; torque and flux linkage of weakening.
struct Bounds {
    mtpa: (f64, f64),
    weakening: (f64, f64),
    /// Torque of weakening, of the largest one.
    of_largest: f64,
}

fn check(name: &str, machine: MachineFolder, bounds: &Bounds) {
    let judge = Judge::new(machine);
    check_nodes(name, &judge);
    let (mtpa, weakening) = (judge.mtpa(), judge.weakening());
    println!("{name}: MTPA {mtpa:?}");
    println!("{name}: weakening {weakening:?}");
    let most = 1.000_001 * judge.machine.parameters.max_current_a;
    assert!(mtpa.torque < bounds.mtpa.0 && mtpa.other < bounds.mtpa.1, "{name}");
    assert!(weakening.torque < bounds.weakening.0 && weakening.other < bounds.weakening.1, "{name}");
    // Of single precision.
    assert!(weakening.above < 1e-6, "{name}: more flux linkage than asked for");
    assert!(mtpa.torque_of_largest < 1e-3 && weakening.torque_of_largest < bounds.of_largest, "{name}");
    assert!(mtpa.current_a < most && weakening.current_a < most, "{name}");
}

/// The rules that hold at every node.
fn check_nodes(name: &str, judge: &Judge) {
    let (tables, map) = (&judge.tables, &judge.machine.map);
    let parameters = &judge.machine.parameters;
    let positive = |node: &[f32; 2]| node.iter().all(|value| value.is_finite() && *value > 0.0);
    assert!(tables.mtpa.parameters.nodes.iter().all(positive), "{name}: nothing to divide by zero with");
    let last_id = *map.id_a.last().unwrap();
    for [id, effective] in tables.weakening.currents.nodes {
        assert!(f64::from(*id) < last_id + 1e-4, "{name}: id {id} beyond the map");
        assert!(f64::from(*id) > -1.0005 * parameters.max_current_a, "{name}: id {id}");
        assert!(*effective > 0.0, "{name}: nothing to divide by zero with");
    }
    for pair in tables.weakening.torque.nodes.windows(2) {
        assert!(pair[1][1] >= pair[0][1], "{name}: a wider circle allows no less");
    }
    let flux = &tables.flux;
    let last_iq =
        f64::from(flux.first_column) + (flux.columns - 1) as f64 / f64::from(flux.inverse_column_step);
    assert!((last_iq - map.iq_a.last().unwrap()).abs() < 1e-3, "{name}: ends at {last_iq}");
    assert!((20..=65).contains(&flux.columns), "{name}: {} columns", flux.columns);
}

/// The highest demagnetisation limit of the reference machine, in A.
const MOST_ID_A: f64 = -152.1;

const TIGHT: Bounds = Bounds { mtpa: (0.003, 5e-4), weakening: (0.003, 0.003), of_largest: 1e-3 };

#[test]
fn the_reference_machine() {
    check("reference", MachineFolder::read(&reference_folder()).unwrap(), &TIGHT);
}

#[test]
fn a_linear_machine_without_saliency() {
    let machine = Analytic {
        truth: linear(0.002, 0.002, 0.3),
        pole_pairs: 4,
        max_torque_nm: 150.0,
        max_current_a: 100.0,
        max_speed_rpm: 6000.0,
        dc_link_v: 600.0,
        step_a: 5.0,
    };
    check("linear", machine.folder().read().unwrap(), &TIGHT);
}

#[test]
fn a_linear_machine_with_saliency() {
    let machine = Analytic {
        truth: linear(0.001, 0.003, 0.2),
        pole_pairs: 4,
        max_torque_nm: 150.0,
        max_current_a: 100.0,
        max_speed_rpm: 6000.0,
        dc_link_v: 600.0,
        step_a: 5.0,
    };
    // Near the point of no flux linkage, in reach here, the circles are too small for even rows.
    let bounds = Bounds { weakening: (0.003, 0.005), ..TIGHT };
    check("salient", machine.folder().read().unwrap(), &bounds);
}

#[test]
fn a_reluctance_machine_without_magnets() {
    let machine = Analytic {
        truth: linear(0.004, 0.02, 0.0),
        pole_pairs: 3,
        max_torque_nm: 80.0,
        max_current_a: 50.0,
        max_speed_rpm: 6000.0,
        dc_link_v: 600.0,
        step_a: 2.5,
    };
    check("reluctance", machine.folder().read().unwrap(), &TIGHT);
}

#[test]
fn a_small_machine_on_a_fine_grid() {
    check("small", SMALL.folder().read().unwrap(), &TIGHT);
}

#[test]
fn the_reference_machine_on_other_grids() {
    for (step, id_steps, iq_steps) in [(2.0, 126, 120), (5.0, 60, 48), (20.0, 14, 12)] {
        let id = axis(-f64::from(iq_steps) * step, step, id_steps as usize);
        let map = REFERENCE.map(&id, &axis(0.0, step, iq_steps as usize + 1));
        let machine = Folder::new(&good_toml(), &map).read().unwrap();
        check(&format!("{step} A"), machine, &TIGHT);
    }
}

#[test]
fn a_grid_of_both_signs_that_passes_zero_between_two_nodes() {
    let map = REFERENCE.map(&axis(-245.0, 10.0, 30), &axis(-245.0, 10.0, 50));
    check("odd", Folder::new(&good_toml(), &map).read().unwrap(), &TIGHT);
}

#[test]
fn a_grid_that_reaches_as_far_above_zero_as_below() {
    // Wide circles at small torque lie beyond the current limit, not beyond the map.
    let map = REFERENCE.map(&axis(-250.0, 10.0, 51), &axis(0.0, 10.0, 26));
    let judge = Judge::new(Folder::new(&good_toml(), &map).read().unwrap());
    check_nodes("wide", &judge);
}

/// With a demagnetisation limit no node and nothing read between nodes is below it, and what is left is the best above it.
#[test]
fn the_reference_machine_with_a_demagnetisation_limit() {
    for least_a in [-200.0, -160.0, MOST_ID_A] {
        let machine =
            Folder::new(&format!("{}\nmin_id_a = {least_a}\n", good_toml()), &good_map()).read().unwrap();
        let (name, judge) = (format!("{least_a} A"), Judge::new(machine.clone()));
        // Beside the narrowest circle that the limit leaves, torque rises as a root, which one cell shows as a line.
        let root = Bounds { weakening: (0.003, 0.02), of_largest: 2e-3, ..TIGHT };
        check(&name, machine, if least_a == MOST_ID_A { &root } else { &TIGHT });
        let least = least_a as f32 * 1.000_001;
        assert!(judge.tables.weakening.currents.nodes.iter().all(|[id, _]| *id >= least), "{name}: a node");
        let starts = judge.tables.mtpa.start.nodes;
        assert!(starts.iter().all(|[id, ..]| *id >= least), "{name}: a start of MTPA");
        let reaches = starts.iter().any(|[id, ..]| *id <= 0.999 * least);
        assert_eq!(reaches, least_a > -180.0, "{name}: MTPA itself is limited");
    }
}

#[test]
fn two_texts_are_the_machine_that_their_folder_is() {
    let folder = reference_folder();
    let [toml, csv] =
        ["machine.toml", "flux_map.csv"].map(|name| std::fs::read_to_string(folder.join(name)).unwrap());
    let told = |machine: MachineFolder| format!("{machine:?}");
    assert_eq!(told(MachineFolder::parse(&toml, &csv).unwrap()), told(MachineFolder::read(&folder).unwrap()));
    let error = MachineFolder::parse(&toml.replace("pole_pairs = ", "pole_pairs = -"), &csv).unwrap_err();
    assert!(error.to_string().starts_with("machine.toml:"), "{error}");
    let error = MachineFolder::parse(&toml, "id_a,iq_a\n").unwrap_err();
    assert!(error.to_string().starts_with("flux_map.csv:1:"), "{error}");
}
