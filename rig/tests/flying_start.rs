//! Flying starts at every angle, with more and with less flux than the map.

mod nameplate;
mod stiff;

use nameplate::made;
use rayon::prelude::*;
use tractive::control::Demand;
use tractive::time::Instant;
use tractive_rig::machine::Machine;
use tractive_rig::plant::{Plant, PlantSettings, SpeedSource};
use tractive_rig::run::Interrupts;
use tractive_rig::trace::Row;

const STARTS: usize = 12;
/// Starts after which a wrong map has been noticed.
const UNKNOWN: usize = 6;
const DRIVEN_S: f64 = 0.04;
const COASTING_S: f64 = 0.02;

struct Case {
    map_error: f64,
    udc_v: f64,
    speed_rpm: f64,
}

/// Largest phase current of each start without torque and of the coasting just before it, in A; nothing if the drive trips. Each begins a twelfth of a turn of the
/// stator later than the one before.
fn peaks_a(machine: &Machine, case: &Case) -> Option<[(f64, f64); STARTS]> {
    let turn_s = 60.0 / (case.speed_rpm * f64::from(machine.folder.parameters.pole_pairs));
    let turns = ((DRIVEN_S + COASTING_S) / turn_s).ceil() + 1.0 / STARTS as f64;
    let begins = move |start: usize| 0.05 + start as f64 * turns * turn_s;
    let operator = move |t_s: f64| {
        let on = (0..STARTS).any(|start| (0.0..DRIVEN_S).contains(&(t_s - begins(start))));
        (Demand { torque_nm: 0.0, slew_limited: true }, on)
    };
    let motor = PlantSettings { flux_scale: 1.0 + case.map_error, ..PlantSettings::default() };
    let plant = Plant::new(&machine.folder, SpeedSource::profile(vec![(0.0, case.speed_rpm)]), &motor);
    let run = stiff::Run { lead_s: 0.0, duration_s: begins(STARTS), trace_step_s: 20e-6, udc_v: case.udc_v };
    let mut bench = stiff::bench(machine, plant, operator, run).without_edges();
    let mut tasks = stiff::tasks(machine, Instant(0));
    tasks.drive(&mut bench, |_| true).unwrap();
    let tripped = bench.rows().iter().any(|row| row.trip.is_some());
    let peaks = std::array::from_fn(|start| {
        let peak_a = |from_s: f64, until_s: f64| {
            let rows = bench.rows().iter().filter(|row| (from_s..until_s).contains(&row.t_s));
            rows.map(Row::peak_current_a).fold(0.0, f64::max)
        };
        let at_s = begins(start);
        (peak_a(at_s, at_s + DRIVEN_S), peak_a(at_s - 0.5 * COASTING_S, at_s))
    });
    (!tripped).then_some(peaks)
}

/// Once the drive knows the error of the map, it keeps to the machine's largest current, and before that it does not trip, on any link.
#[test]
fn a_machine_with_other_flux_than_the_map_is_caught_within_its_current() {
    let machine = Machine::load("pmasynrm-180kw").unwrap();
    let parameters = &machine.folder.parameters;
    let mut cases = Vec::new();
    for udc_v in [parameters.dc_link_min_v, parameters.dc_link_nominal_v, parameters.dc_link_max_v] {
        for speed_rpm in [2000.0, 4500.0] {
            cases.extend([-0.15, 0.15].map(|map_error| Case { map_error, udc_v, speed_rpm }));
        }
    }
    let found: Vec<_> = cases.par_iter().map(|case| peaks_a(&machine, case)).collect();
    let most_a = |peaks: &[(f64, f64)]| peaks.iter().map(|(driven_a, _)| *driven_a).fold(0.0, f64::max);
    let mut over = 0;
    for (Case { map_error, udc_v, speed_rpm }, peaks) in cases.iter().zip(found) {
        let most = peaks.map(|peaks| (most_a(&peaks[..UNKNOWN]), most_a(&peaks[UNKNOWN..])));
        println!("{map_error:+} {udc_v:.0} V {speed_rpm:.0} r/min: {most:.0?} A unknown and known");
        over += usize::from(most.is_none_or(|(_, known_a)| known_a > 1.02 * parameters.max_current_a));
    }
    assert_eq!(over, 0, "of {} cases", cases.len());
}

/// Machines whose magnets drive current through the diodes into the link, with magnets on the surface and buried, are caught with no more current
/// than the machine's or the diodes' own, at twelve angles each. The first tripped when a carrier led it, as did the third with a carrier that was
/// cut off. At a still higher speed, the second one's diodes trip it as it coasts.
#[test]
fn a_machine_whose_diodes_conduct_is_caught_as_it_coasts() {
    for (values, speeds_rpm) in [
        (
            "--pole-pairs 4 --rs 0.248 --ld 0.00109 --lq 0.00109 --psi-f 0.143 --max-current 80 --udc 750 --max-speed-rpm 10465 --max-switching-hz 3206",
            [7_849.0, 10_465.0],
        ),
        (
            "--pole-pairs 3 --rs 0.199 --ld 0.00132 --lq 0.00312 --psi-f 0.00792 --saturation 0.8 --max-current 4.82 --udc 24 --max-speed-rpm 9345 --max-switching-hz 2000",
            [7_009.0, 8_200.0],
        ),
        (
            // Its diodes just conduct: a carrier leads the flux linkage over as much as 100°, 18 halves of 8 kHz.
            "--pole-pairs 4 --rs 1.1 --ld 0.0055 --lq 0.0065 --psi-f 0.155 --max-current 35 --udc 560 --max-speed-rpm 6600 --max-switching-hz 8000",
            [5_600.0, 5_800.0],
        ),
    ] {
        let folder = made(values);
        let machine = Machine::load(folder.path().to_str().unwrap()).unwrap();
        let parameters = &machine.folder.parameters;
        let udc_v = parameters.dc_link_nominal_v;
        for speed_rpm in speeds_rpm {
            let peaks = peaks_a(&machine, &Case { map_error: 0.0, udc_v, speed_rpm });
            println!("{speed_rpm:.0} r/min: {peaks:.0?} A");
            let peaks = peaks.expect("no trip");
            let own_a = parameters.max_current_a;
            let conducts = peaks.iter().any(|(_, coasting_a)| *coasting_a > 0.05 * own_a);
            let over =
                peaks.iter().filter(|(driven_a, coasting_a)| *driven_a > 1.02 * own_a.max(*coasting_a));
            assert!(conducts && over.count() == 0, "{speed_rpm} r/min: {peaks:?}");
        }
    }
}
