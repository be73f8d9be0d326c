//! The ZS9 behind line filters of choke, capacitor and hardly any resistance: no fault, no swing of the source that stays, and motors that notice
//! nothing. TRACTIVE_LINE_FILTERS=all tries the whole map of the guide.

use rayon::prelude::*;
use tractive::control::Demand;

use tractive::ports::MotorDemand;
use tractive::protection::Fault;
use tractive_rig::bench::{Flaws, Limits, Simulated};
use tractive_rig::machine::Machine;
use tractive_rig::plant::zs9::{NetworkState, Zs9Plant, Zs9Settings};
use tractive_rig::plant::{LineFilter, SpeedSource};
use tractive_rig::run::{CLOCK, Interrupts};
use tractive_rig::scenario::catalogue;

use tractive_rig::trace::Recorded;
use tractive_rig::zs9::bench::{Bench, BenchSettings, Course};
use tractive_rig::zs9::run::Tasks;
use tractive_rig::zs9::trace::Recording;
use tractive_rig::zs9::{Orders, SeenMotors, figures, settings};

const SOURCE_V: f64 = 400.0;
const LINK_V: f64 = 667.0;
/// Both motors' full power.
const FULL_W: f64 = 2.0 * 12.57e3;

/// Runs motors at speeds, in r/min, with torques, in N·m, behind a filter, with steps of the line; damped or not.
fn run(
    filter: LineFilter,
    speeds_rpm: [f64; 2],
    torques_nm: [f32; 2],
    steps: &[(f64, f64)],
    damped: bool,
) -> Recording {
    let machine = Machine::load("ipm-zs9").unwrap();
    let plant_settings = Zs9Settings::default();
    let speeds = speeds_rpm.map(|rpm| SpeedSource::profile(vec![(0.0, rpm)]));
    let mut plant = Zs9Plant::new([&machine.folder; 2], speeds, &plant_settings);
    plant.network = NetworkState::even(0.0, SOURCE_V);
    let operator = move |t_s: f64, _: SeenMotors| Orders {
        demands: torques_nm.map(|torque_nm| MotorDemand::Torque(Demand { torque_nm, slew_limited: true })),
        loads_nm: [0.0; 2],
        enable: t_s > -0.05,
    };
    let drive = settings::drive(CLOCK, 10_000, machine.tables).behind_line_filter(damped, machine.tables);
    let settings = BenchSettings {
        drive,
        lead_s: 0.1,
        duration_s: steps.last().map_or(0.8, |(at_s, _)| at_s + 0.5),
        trace_step_s: 1e-3,
        link_ref_v: LINK_V,
        scheme: tractive::nine_switch::Scheme::Rthd,
        flaws: Flaws::default(),
        injection: None,
        limits: Limits::NONE,
        edges: false,
        dead_time_s: 0.0,
    };
    let course = Course { source_v: steps.to_vec(), ..Course::default() };
    let mut bench = Bench::new(plant, Box::new(operator), settings).following(course).behind(Some(filter));
    Tasks::new(machine.tables, drive).drive(&mut bench, |_| true).unwrap();
    bench.into_recording(Vec::new())
}

/// Corners, and the filter of the guide, or all of them.
fn filters() -> Vec<LineFilter> {
    let named = ["1,2,10", "8,2,10", "1,8,10", "8,8,10", "3,4,30"].map(|text| text.parse().unwrap());
    if std::env::var("TRACTIVE_LINE_FILTERS").is_err() {
        return named.to_vec();
    }
    let each = |r: f64| {
        [1.0, 3.0, 8.0]
            .map(|l| [2.0, 4.0, 8.0].map(|c| format!("{l},{c},{r}").parse::<LineFilter>().unwrap()))
    };
    [10.0, 30.0, 100.0, 300.0].into_iter().flat_map(each).flatten().collect()
}

/// Speeds in r/min and torques in N·m: full power, braking, both at once, weakening, and little power.
const POINTS: [([f64; 2], [f32; 2]); 6] = [
    ([1_000.0, 1_000.0], [120.0, 120.0]),
    ([1_000.0, 1_000.0], [-120.0, -120.0]),
    ([1_000.0, 1_000.0], [120.0, -120.0]),
    ([1_300.0, 1_300.0], [90.0, 90.0]),
    ([1_300.0, -1_300.0], [90.0, -90.0]),
    ([300.0, 300.0], [120.0, 120.0]),
];

/// 0.5 s after steps of the line by a tenth, each at another moment of the swing that the last one left.
#[test]
fn no_line_filter_swings() {
    let stepping: &[_] = &[(0.2, 360.0), (0.35, 400.0), (0.5, 440.0), (0.65, 400.0)];
    let runs: Vec<_> = filters().into_iter().flat_map(|filter| POINTS.map(|point| (filter, point))).collect();
    let lines: Vec<_> = runs
        .into_par_iter()
        .map(|(filter, (speeds_rpm, torques_nm))| {
            let damped = filter.needs_damping(FULL_W, SOURCE_V);
            let recording = run(filter, speeds_rpm, torques_nm, stepping, damped);
            let last = &recording.rows[recording.rows.len() - 100..];
            let off_nm = [0, 1].map(|k| {
                let sum_nm: f64 = last.iter().map(|row| row.motors[k].torque_nm).sum();
                (sum_nm / 100.0 - f64::from(torques_nm[k])).abs()
            });
            let (swing, trip) = (figures::swing(last), recording.trip().map(|trip| trip.fault));
            let off_nm = off_nm[0].max(off_nm[1]);
            let line = format!(
                "{filter:?} {speeds_rpm:?} r/min {torques_nm:?} N·m: swing {:.3} %, {off_nm:.2} N·m off, {trip:?}",
                100.0 * swing
            );
            (trip.is_none() && swing < 0.003 && off_nm < 0.12, line)
        })
        .collect();
    lines.iter().for_each(|(_, line)| println!("{line}"));
    let bad: Vec<_> = lines.iter().filter(|(good, _)| !good).collect();
    assert!(bad.is_empty(), "{bad:#?}");
}

/// Without the damping both motors' full power makes the filter of the guide swing ever more, until the drive trips.
#[test]
fn without_damping_the_source_swings() {
    let (speeds_rpm, torques_nm) = POINTS[0];
    let filter = "3,4,30".parse().unwrap();
    let [damped, undamped] = [true, false].map(|damped| run(filter, speeds_rpm, torques_nm, &[], damped));
    assert!(damped.trip().is_none(), "{:?}", damped.trip());
    let swings = [0, 100, 200].map(|from| figures::swing(&undamped.rows[from..from + 100]));
    assert!(2.0 * swings[0] < swings[1] && 2.0 * swings[1] < swings[2], "{swings:?}");
    assert_eq!(undamped.trip().map(|trip| trip.fault), Some(Fault::SourceUndervoltage));
}

/// Every scenario has the option; its bounds are kept with the guide's filter, whatever the link's voltage. A filter that is far too soft ends in a fault with
/// a name: while the bridge's diodes hold the link at zero, the network follows the source.
#[test]
fn every_scenario_keeps_its_bounds_behind_a_filter() {
    let kept = [
        "zs9-steady --line 3,4,30",
        "zs9-reverse --line 8,8,10",
        "zs9-timing --line 1,2,10",
        "zs9-load-step --uin 800 --line 8,2,10",
        "zs9-cycle --line 3,4,30 --real",
        "zs9-cycle --line 3,4,300",
    ];
    let falling = ["zs9-load-step --line 60,2,10", "zs9-load-step --line 3,4,30 --inject source-low@0.3"];
    kept.into_par_iter().map(|line| (line, false)).chain(falling.map(|line| (line, true))).for_each(
        |(line, trips)| {
            let chosen = catalogue::of_zs9(line).unwrap();
            let machine = chosen.machine().unwrap();
            let recording = chosen.drive(&machine).unwrap();
            assert_eq!(recording.trip().is_some(), trips, "{line}: {:?}", recording.trip());
            let figures = chosen.figures(&recording, &machine);
            assert!(trips || !figures.fall_short(), "{line}: {:?}", figures.get("verdicts"));
            let least_v = recording.rows.iter().map(|row| row.link_v).fold(f64::INFINITY, f64::min);
            assert!(least_v > -0.5, "{line}: {least_v} V");
        },
    );
}

/// A load step of one motor is not felt by the other one, whatever the source does meanwhile; the line's current is in the trace.
#[test]
fn a_load_step_behind_a_filter_is_not_felt_by_the_other_motor() {
    for (line, most_nm) in [("3,4,30", 0.1), ("1,2,10", 0.05)] {
        let chosen = catalogue::of_zs9(&format!("zs9-load-step --line {line}")).unwrap();
        let machine = chosen.machine().unwrap();
        let recording = chosen.drive(&machine).unwrap();
        let figures = chosen.figures(&recording, &machine);
        let number = |name: &str| figures.number(name).unwrap();
        assert!(number("motor1_torque_deviation_nm") < most_nm, "{line}: {figures:?}");
        assert!(number("highest_source_v") - number("lowest_source_v") > 5.0, "{line}: {figures:?}");
        assert!((40.0..70.0).contains(&number("peak_line_current_a")), "{line}: {figures:?}");
        assert!(!figures.fall_short() && number("source_swing_percent") < 0.01, "{line}: {figures:?}");
    }
}
