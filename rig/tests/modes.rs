//! A mode that the paper does not have, 5 pulses between 7 and 3: its row and a ladder that names it are all that drive, campaign and
//! reports need.

mod stiff;

use tractive::control::Demand;
use tractive::modulation::{Ladder, Mode};
use tractive::time::Instant;
use tractive_rig::analysis::{self, Figures};
use tractive_rig::bench::Simulated;
use tractive_rig::campaign::judge::Verdict;
use tractive_rig::campaign::{report, traction};
use tractive_rig::figures;
use tractive_rig::machine::Machine;
use tractive_rig::plant::{Plant, PlantSettings, SpeedSource};
use tractive_rig::report::Page;
use tractive_rig::run::Interrupts;
use tractive_rig::scenario::traction::switches;
use tractive_rig::trace::{Recorded, Recording};

/// The paper's modes and that one.
const WITH_MID5: Ladder =
    Ladder::of(&[Mode::Sync15, Mode::Sync12, Mode::Mid7, Mode::Mid5, Mode::Mid3, Mode::Square]);

const LEAD_S: f64 = 0.1;
/// Up, and down again.
const RAMP_S: f64 = 2.0;
const TOP_RPM: f64 = 3_600.0;
const TORQUE_NM: f32 = 500.0;

fn drive(machine: &Machine) -> Recording {
    let speed = vec![(LEAD_S, 0.0), (LEAD_S + RAMP_S, TOP_RPM), (LEAD_S + 2.0 * RAMP_S, 0.0)];
    let plant = Plant::new(&machine.folder, SpeedSource::profile(speed), &PlantSettings::default());
    let demand = |_: f64| (Demand { torque_nm: TORQUE_NM, slew_limited: true }, true);
    let udc_v = machine.folder.parameters.dc_link_nominal_v;
    let run = stiff::Run { lead_s: LEAD_S, duration_s: 2.0 * RAMP_S, trace_step_s: 100e-6, udc_v };
    let mut bench = stiff::bench(machine, plant, demand, run);
    let mut tasks = stiff::tasks(machine, Instant(0)).on(WITH_MID5);
    tasks.drive(&mut bench, |_| true).unwrap();
    bench.into_recording(Vec::new())
}

#[test]
fn the_drive_goes_up_and_down_its_ladder() {
    let machine = Machine::load("pmasynrm-180kw").unwrap();
    let recording = drive(&machine);
    assert!(recording.trip().is_none(), "{:?}", recording.trip());
    let passed: Vec<_> =
        recording.switches.iter().filter(|switch| switch.t_s > 0.0).map(|switch| switch.to).collect();
    let ladder: Vec<_> = WITH_MID5.modes().collect();
    let up_and_down: Vec<_> =
        ladder[1..].iter().chain(ladder[..ladder.len() - 1].iter().rev()).copied().collect();
    assert_eq!(passed, up_and_down);
    // On its way up, from 2,000 to 2,500 r/min: 133 to 167 Hz.
    let window = [2_000.0, 2_500.0].map(|rpm| RAMP_S * rpm / TOP_RPM);
    let rows = analysis::window(&recording, window[0], window[1]);
    assert!(rows.iter().all(|row| row.mode == Mode::Mid5));
    let mean =
        |value: fn(&tractive_rig::trace::Row) -> f64| rows.iter().map(value).sum::<f64>() / rows.len() as f64;
    let (torque_nm, demand_nm) = (mean(|row| row.te_nm), mean(|row| row.te_ref_nm));
    println!("{torque_nm:.2} N·m of {demand_nm:.2} N·m");
    assert!((torque_nm / demand_nm - 1.0).abs() < 0.01, "{torque_nm} N·m of {demand_nm} N·m");

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("trace.csv");
    recording.write_trace(&path).unwrap();
    assert!(std::fs::read_to_string(&path).unwrap().contains(",mid5,"));
    let mut page = Page::new("modes", "no figure: a ladder of its own");
    figures::draw(&mut page, &recording, &[], None, &machine);
    switches::plots(&recording, &mut page, |_, _| None);
    let page = page.finish("", &Figures::default()).unwrap();
    for part in ["mid5: 5 pulses a turn", "mid7 → mid5", "mid5 → mid3", "\nmid5\n", "\nsquare\n"] {
        assert!(page.contains(part), "{part}");
    }
}

#[test]
fn the_campaign_counts_faults_in_it() {
    let drive = traction::Drive::new(None).unwrap().on(WITH_MID5);
    let mut cases = drive.cases(false);
    cases.retain(|case| case.name().starts_with("pmasynrm uh-stuck-off 1950 "));
    let outcomes: Vec<_> = cases.iter().map(|case| drive.run(case).unwrap()).collect();
    assert!(!outcomes.is_empty());
    for outcome in &outcomes {
        assert_eq!(outcome.mode, "mid5", "{outcome:?}");
        assert_ne!(outcome.verdict, Verdict::Uncaught, "{outcome:?}");
    }
    let text = report::text(&outcomes, None);
    assert!(text.contains("\n| mid5 motoring"), "{text}");
}
