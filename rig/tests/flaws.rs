//! Flaws of inverter, sensors and machine, one by one and all at once.

use tractive::protection::Fault;
use tractive_rig::bench::{Converter, Flaws};
use tractive_rig::compare;
use tractive_rig::folder;
use tractive_rig::machine::Machine;
use tractive_rig::plant::{DeviceDrops, Leg, Plant, PlantSettings, ShaftSettings, SpeedSource};
use tractive_rig::scenario::catalogue;
use tractive_rig::scenario::traction::flaws::{Drops, Phases, Times};
use tractive_rig::trace::Recorded;

fn plant(speed_rpm: f64) -> Plant {
    let chosen = catalogue::of_traction("sweep").unwrap();
    let speed = SpeedSource::profile(vec![(0.0, speed_rpm)]);
    Plant::new(&chosen.machine().unwrap().folder, speed, &PlantSettings::default())
}

#[test]
fn each_phase_has_its_own_offset_and_gain() {
    let mut plant = plant(0.0);
    plant.motor.set_currents(100.0, 30.0);
    let [a, b, c] = plant.motor.currents_abc();
    let (current_offsets_a, current_gains) = ([1.0, -2.0, 0.0], [0.02, 0.0, -0.01]);
    let flaws = Flaws { current_offsets_a, current_gains, ..Flaws::NONE };
    let read = Converter::new(flaws).currents(&plant.motor);
    for (read, wanted) in [(read.a, 1.02 * a + 1.0), (read.b, b - 2.0), (read.c, 0.99 * c)] {
        assert!((f64::from(read) - wanted).abs() < 1e-4, "{read} {wanted}");
    }
}

#[test]
fn a_harmonic_of_the_angle_has_its_phase() {
    let mut plant = plant(0.0);
    for turns in [0.0, 0.1, 0.4, 0.8] {
        plant.motor.rotor_mut().turn_to(turns);
        let flaws = Flaws { angle_harmonics_deg: [3.0, 1.0], angle_phases_deg: [50.0, -70.0], ..Flaws::NONE };
        let read_deg = f64::from(Converter::new(flaws).angle(&plant.motor).turns()) * 360.0;
        let at = |degrees: f64| degrees.to_radians().sin();
        let wanted_deg = 360.0 * turns + 3.0 * at(360.0 * turns + 50.0) + at(720.0 * turns - 70.0);
        assert!((read_deg - wanted_deg).abs() < 1e-3, "{read_deg}° {wanted_deg}°");
    }
}

#[test]
fn whatever_conducts_drops_voltage_in_the_currents_direction() {
    let drops = DeviceDrops { igbt_v: 2.0, igbt_ohm: 0.005, diode_v: 1.5, diode_ohm: 0.003 };
    for (leg, current_a, wanted_v) in [
        (Leg::Upper, 100.0, 2.5),
        (Leg::Upper, -100.0, -1.8),
        (Leg::Lower, 100.0, 1.8),
        (Leg::Lower, -100.0, -2.5),
        (Leg::Open, 100.0, 1.8),
    ] {
        let found_v = drops.drop_v(leg, current_a, current_a.signum());
        assert!((found_v - wanted_v).abs() < 1e-12, "{leg:?} {current_a} A: {found_v} V");
    }
    // Each of the three currents flows through one device: the power lost in the drops is heat.
    let machine = catalogue::of_traction("sweep").unwrap().machine().unwrap();
    let settings = PlantSettings { drops, ..PlantSettings::default() };
    let mut plant = Plant::new(&machine.folder, SpeedSource::profile(vec![(0.0, 0.0)]), &settings);
    plant.motor.set_currents(100.0, 0.0);
    plant.advance([Leg::Lower; 3], 1_500.0, 10e-6);
    let taken_w = plant.motor.energies.electrical_j / 10e-6;
    let wanted_w = -(100.0 * 1.8 + 2.0 * 50.0 * 2.25);
    assert!((taken_w / wanted_w - 1.0).abs() < 0.01, "{taken_w} W, {wanted_w} W");
}

/// Missing torque at a current, in N·m, if the iron has half of the loss that machine.toml names.
fn missing_nm(speed_rpm: f64, (id_a, iq_a): (f64, f64)) -> f64 {
    let machine = catalogue::of_traction("sweep").unwrap().machine().unwrap();
    let [with, without] = [0.5, 0.0].map(|iron_share| {
        let settings = PlantSettings { iron_share, ..PlantSettings::default() };
        let speed = SpeedSource::profile(vec![(0.0, speed_rpm)]);
        let mut plant = Plant::new(&machine.folder, speed, &settings);
        plant.motor.set_currents(id_a, iq_a);
        plant.advance([Leg::Lower; 3], 1_500.0, 1e-6);
        let worked = plant.motor.energies.mechanical_j / (1e-6 * speed_rpm.abs().max(1e-9) * 0.104_72);
        (plant.motor.torque_nm(), worked)
    });
    if speed_rpm != 0.0 {
        // The rotor gets the torque that is left.
        assert!(((without.1 - with.1).abs() / (without.0 - with.0).abs() - 1.0).abs() < 0.02);
    }
    without.0 - with.0
}

#[test]
fn iron_takes_its_loss_as_torque() {
    // At the rated point half of 5,409 W, of which eddy currents make 0.6.
    let rated = (-121.0, 112.7);
    let torque_nm = 0.5 * 5_409.0 / (2_000.0 * 0.104_72);
    let found = missing_nm(2_000.0, rated);
    assert!((found / torque_nm - 1.0).abs() < 0.02, "{found} N·m, {torque_nm} N·m");
    assert!((missing_nm(-2_000.0, rated) / -found - 1.0).abs() < 0.01);
    let (slow, fast) = (missing_nm(1_000.0, rated) / found, missing_nm(4_000.0, rated) / found);
    assert!((slow - 0.7).abs() < 0.01 && (fast - 1.6).abs() < 0.01, "{slow}, {fast}");
    let (none, weak) = (missing_nm(0.0, rated), missing_nm(2_000.0, (-60.0, 0.0)));
    assert!(none == 0.0 && weak > 0.0 && weak < 0.5 * found, "{none} N·m, {weak} N·m");
}

/// Half of the loss, if unknown, takes 10 N·m of 784 from the rotor.
#[test]
fn iron_loss_that_is_known_is_made_up_for() {
    let short_nm = |flaw: &str| {
        let chosen = catalogue::of_traction(&format!("steady --speed 3000 --torque 784 {flaw}")).unwrap();
        let machine = chosen.machine().unwrap();
        let figures = chosen.figures(&chosen.drive(&machine).unwrap(), &machine);
        784.0 - figures.values()["point"][0]["torque_nm"].as_f64().unwrap()
    };
    let [unknown, known] = ["", "--iron-loss-known"].map(|told| short_nm(&format!("--iron-loss 50 {told}")));
    println!("{unknown:.2} N·m missing, {known:.2} where it is known");
    assert!((9.0..11.0).contains(&unknown), "{unknown} N·m");
    assert!(known.abs() < 1.0, "{known} N·m");
}

/// A shaft of 40 Hz and a damping ratio of 0.05, whose far end is held.
fn on_shaft(speed: SpeedSource) -> Plant {
    let machine = catalogue::of_traction("sweep").unwrap().machine().unwrap();
    let shaft = Some(ShaftSettings { hz: 40.0, damping: 0.05, rotor_kg_m2: 2.0 });
    Plant::new(&machine.folder, speed, &PlantSettings { shaft, ..PlantSettings::default() })
}

/// Speed in r/min every 40 µs, while a current of the magnets alone turns the rotor against its shaft.
fn swings(mut plant: Plant, steps: usize) -> Vec<f64> {
    let settle = |plant: &mut Plant| {
        plant.motor.set_currents(0.0, 100.0);
        plant.advance([Leg::Lower; 3], 1_500.0, 40e-6);
        plant.motor.speed_rpm()
    };
    (0..steps).map(|_| settle(&mut plant)).collect()
}

/// Times at which a swing passes its middle upward, in s, and the largest in each turn of it.
fn passes(speeds: &[f64], middle: impl Fn(usize) -> f64) -> Vec<f64> {
    let above: Vec<_> = speeds.iter().enumerate().map(|(k, speed)| speed - middle(k)).collect();
    let passed = |k: &usize| above[*k] <= 0.0 && above[*k + 1] > 0.0;
    (0..above.len() - 1).filter(passed).map(|k| 40e-6 * k as f64).collect()
}

#[test]
fn a_shaft_swings_at_its_frequency_and_decays_by_its_damping() {
    let speeds = swings(on_shaft(SpeedSource::profile(vec![(0.0, 0.0)])), 2_500);
    let times = passes(&speeds, |_| 0.0);
    let hz = (times.len() - 1) as f64 / (times.last().unwrap() - times[0]);
    let natural = 40.0 * (1.0_f64 - 0.05 * 0.05).sqrt();
    assert!((hz / natural - 1.0).abs() < 0.02, "{hz} Hz");
    let most =
        |from: usize, to: usize| speeds[from..to].iter().fold(0.0_f64, |most, speed| most.max(speed.abs()));
    // A turn lasts 25 ms, 625 steps.
    let decay = (most(0, 625) / most(1_250, 1_875)).ln() / (2.0 / natural);
    let wanted = 0.05 * std::f64::consts::TAU * 40.0;
    assert!((decay / wanted - 1.0).abs() < 0.1, "{decay} 1/s, {wanted} 1/s");
}

#[test]
fn a_free_rotor_and_its_load_swing_against_each_other() {
    let speeds = swings(on_shaft(SpeedSource::Inertia { inertia_kg_m2: 8.0, load_nm: 0.0 }), 2_500);
    // Both together gain speed evenly; the rotor of 2 kg·m² swings against 6 kg·m².
    let gained = speeds[2_499] - speeds[2_499 - 2_165];
    let times = passes(&speeds, |k| gained * k as f64 / 2_165.0);
    let hz = (times.len() - 1) as f64 / (times.last().unwrap() - times[0]);
    assert!((hz / (40.0 * (8.0_f64 / 6.0).sqrt()) - 1.0).abs() < 0.05, "{hz} Hz");
}

#[test]
fn all_at_once_leaves_what_was_given() {
    let chosen = catalogue::of_traction("load-steps --real --noise-a 0.1 --current-offset 0,0,1").unwrap();
    let options = chosen.filled(&chosen.machine().unwrap());
    assert_eq!((options.noise_a, options.own.flaws.current_offset), (0.1, Some(Phases([0.0, 0.0, 1.0]))));
    assert_eq!((options.dead_time_us, options.adc_bits, options.rs_error), (5.0, Some(12), 20.0));
    let flaws = &options.own.flaws;
    assert_eq!((flaws.slots, flaws.device_drop), (2.0, Some(Drops([2.0, 5.0, 1.5, 3.0]))));
    assert_eq!((flaws.iron_loss, flaws.adc_skew_us), (50.0, Some(Times([2.0, 1.0, 0.0]))));
    assert!(flaws.shaft.is_some());
    assert_eq!((options.own.angle_1f_deg, options.own.angle_2f_deg, options.own.udc_gain), (1.0, 0.5, 1.0));
    // Devices that switch faster have shorter times; on a lower link the voltages are lower.
    let chosen = catalogue::of_traction("load-steps --real --machine pmsm-48v-1kw").unwrap();
    let small = chosen.filled(&chosen.machine().unwrap());
    assert!(small.dead_time_us < 0.5 && small.own.flaws.device_drop.unwrap().0[0] < 0.1, "{small:?}");
}

#[test]
fn without_the_word_for_all_there_is_none() {
    let chosen = catalogue::of_traction("load-steps").unwrap();
    let machine = chosen.machine().unwrap();
    let options = chosen.filled(&machine);
    assert!(options.is_ideal() && !options.own.flaws.drops().is_some(), "{options:?}");
    assert_eq!((options.own.flaws.offsets(), options.own.flaws.gains()), ([0.0; 3], [0.0; 3]));
}

/// Every scenario with all flaws: no fault, and the mean torque at the characteristic points within 2 %: at the voltage limit nothing is left to make
/// up for the iron loss.
#[test]
fn no_scenario_trips_with_all_flaws() {
    for line in [
        "load-steps",
        "sweep --down",
        "sweep --down --brake",
        "characteristic",
        "full-step",
        "mode-borders",
        "reversal",
        "restart",
        "link-steps",
        "precharge",
        "chopper",
        "gaps",
        "line-limits",
        "wheel",
        "start",
    ] {
        let chosen = catalogue::of_traction(&format!("{line} --real")).unwrap();
        let machine = chosen.machine().unwrap();
        let recording = chosen.drive(&machine).unwrap();
        assert!(recording.trip().is_none(), "{line}: {:?}", recording.trip());
        let figures = chosen.figures(&recording, &machine);
        let points = figures.get("points").and_then(|points| points.as_array()).cloned().unwrap_or_default();
        for point in points.iter().filter(|_| line == "characteristic") {
            let off = point["torque_error_percent"].as_f64().unwrap();
            println!("{line}: {} r/min: {off:.2} %", point["speed_rpm"]);
            assert!(off.abs() < 2.0, "{line}: {point}");
        }
    }
}

/// The guide's table of what each flaw costs, as the command writes it. TRACTIVE_FLAWS=write renews it.
#[test]
fn the_guide_has_what_each_idealisation_is_worth() {
    const MARKS: [&str; 2] = ["<!-- flaws -->\n", "<!-- end of flaws -->"];
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/flaws.md");
    let page = std::fs::read_to_string(&path).unwrap();
    let (before, rest) = page.split_once(MARKS[0]).unwrap();
    let (stands, after) = rest.split_once(MARKS[1]).unwrap();
    let table = format!("\n{}\n", compare::flaws_table(&compare::flaws().unwrap()));
    if std::env::var("TRACTIVE_FLAWS").is_ok_and(|what| what == "write") {
        std::fs::write(&path, [before, MARKS[0], &table, MARKS[1], after].concat()).unwrap();
    } else {
        assert_eq!(stands, table, "TRACTIVE_FLAWS=write renews docs/flaws.md");
    }
}

/// Excess of current THD and torque ripple over their bounds, in percent, at the steady point that the line names.
fn excess(line: &str) -> [f64; 2] {
    let chosen = catalogue::of_traction(&format!("steady {line}")).unwrap();
    let machine = chosen.machine().unwrap();
    let recording = chosen.drive(&machine).unwrap();
    assert!(recording.trip().is_none(), "{line}");
    let figures = chosen.figures(&recording, &machine);
    let beside = &figures.values()["distortion"][0];
    let found = ["thd_excess_percent", "ripple_rms_excess_percent"].map(|key| beside[key].as_f64().unwrap());
    println!("{line}: THD {:.2} %, torque ripple {:.2} % over the bound", found[0], found[1]);
    found
}

/// A folder of the 180 kW machine with its ψ_q scaled; a smaller one allows less torque.
fn with_psi_q(scale: f64) -> tempfile::TempDir {
    let tables = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../tables/pmasynrm-180kw");
    let mut map = Machine::load("pmasynrm-180kw").unwrap().folder.map;
    map.psi_q_wb.iter_mut().for_each(|psi_wb| *psi_wb *= scale);
    let toml = std::fs::read_to_string(tables.join("machine.toml")).unwrap();
    let toml = toml.replace("max_torque_nm = 1235.0", "max_torque_nm = 1100.0");
    let made = tempfile::tempdir().unwrap();
    std::fs::write(made.path().join("machine.toml"), toml).unwrap();
    std::fs::write(made.path().join("flux_map.csv"), folder::csv(&map, "")).unwrap();
    made
}

/// The operating points: free carrier, twelve and seven pulses, three pulses, square wave.
const POINTS: [&str; 5] = [
    "200 --torque 1000",
    "1000 --torque 1000",
    "1500 --torque 600",
    "2000 --torque 859.4",
    "3000 --torque 784",
];

/// The bound is that of the pulses on the true map. By the map that the drive knows, torque ripple would be 20 % over it at 200 r/min with 10 % more of
/// ψ_q, and 61 % with three pulses and 10 % less.
#[test]
fn another_psi_q_than_the_maps_leaves_distortion_and_ripple_at_their_bounds() {
    for scale in [1.1, 0.9] {
        let truth = with_psi_q(scale);
        for point in POINTS {
            let [thd, ripple] = excess(&format!("--speed {point} --plant {}", truth.path().display()));
            assert!(thd.abs() < 1.0 && ripple.abs() < 1.0, "{scale}, {point}: {thd} %, {ripple} %");
        }
    }
}

/// The same for flux linkage, magnets and resistance that are off by themselves.
#[test]
fn bounds_are_those_of_the_true_machine() {
    for flaw in ["--map-error 10", "--map-error -10", "--magnets -18", "--magnets 11", "--rs-error 50"] {
        for point in POINTS {
            let [thd, ripple] = excess(&format!("--speed {point} {flaw}"));
            assert!(thd.abs() < 1.0 && ripple.abs() < 1.0, "{flaw}, {point}: {thd} %, {ripple} %");
        }
    }
}

/// Without learning, 1° costs 110 % of THD at 3,000 r/min, and 3° costs 537 %.
#[test]
fn a_resolvers_errors_are_learnt_and_taken_out() {
    for point in ["--speed 3000 --torque 784", "--speed -3000 --torque -784", "--speed 1500 --torque 1235"] {
        for flaw in [
            "--angle-1f-deg 1",
            "--angle-1f-deg 3",
            "--angle-1f-deg 2 --angle-2f-deg 1 --angle-1f-phase-deg 70",
        ] {
            let [thd, ripple] = excess(&format!("{point} {flaw}"));
            assert!(thd < 1.0 && ripple < 1.0, "{point} {flaw}: {thd} %, {ripple} %");
        }
    }
}

#[test]
fn an_encoders_counts_are_no_errors_of_a_resolver() {
    for lines in [256, 1024, 2048] {
        let [thd, ripple] = excess(&format!("--speed 3000 --torque 784 --encoder-lines {lines}"));
        assert!(thd < 10.0 && ripple < 10.0, "{lines} lines: {thd} %, {ripple} %");
    }
}

/// Times until each step of `load-steps` stays within 2 %, in ms.
fn settling_ms(flaw: &str) -> Vec<f64> {
    let chosen = catalogue::of_traction(&format!("load-steps {flaw}")).unwrap();
    let machine = chosen.machine().unwrap();
    let recording = chosen.drive(&machine).unwrap();
    assert!(recording.trip().is_none(), "{flaw}");
    let figures = chosen.figures(&recording, &machine);
    let steps = figures.values()["steps"].as_array().unwrap();
    let times: Vec<_> = steps.iter().map(|step| step["settling_2_percent_ms"].as_f64().unwrap()).collect();
    println!("{flaw}: steps settle in {times:.2?} ms");
    times
}

/// Without learning at rest, an offset of 2 % costs 116 % of THD and 69 % of torque ripple, and no step settles.
#[test]
fn offsets_of_current_sensors_are_learnt_at_rest() {
    for point in ["--speed 200 --torque 1235", "--speed 1500 --torque 1235", "--speed 3000 --torque 784"] {
        for offsets in ["2,0,0", "0,-2,1"] {
            let [thd, ripple] = excess(&format!("{point} --current-offset {offsets}"));
            assert!(thd < 3.0 && ripple < 3.0, "{point}, {offsets}: {thd} %, {ripple} %");
        }
    }
    for offsets in ["2,0,0", "0,-2,1"] {
        let times = settling_ms(&format!("--current-offset {offsets}"));
        assert!(times.iter().all(|ms| *ms < 5.0), "{offsets}: {times:?}");
    }
}

/// Without learning them, gains of 2 % and −2 % cost 27 % of torque ripple at 200 r/min, and no step settles.
#[test]
fn differences_between_the_gains_of_current_sensors_are_learnt() {
    for point in ["--speed 200 --torque 1235", "--speed 1500 --torque 1235", "--speed 3000 --torque 784"] {
        for gains in ["2,-2,0", "0,-1,3"] {
            let [thd, ripple] = excess(&format!("{point} --current-gains {gains}"));
            assert!(thd < 3.0 && ripple < 3.0, "{point}, {gains}: {thd} %, {ripple} %");
        }
    }
    for gains in ["2,-2,0", "0,-2,2"] {
        let times = settling_ms(&format!("--current-gains {gains}"));
        assert!(times.iter().all(|ms| *ms < 5.0), "{gains}: {times:?}");
    }
}

/// Without learning it, a link that is read 3 % too small costs 12.5 ms at a step, and in a sweep 3.2 % of current, 53 N·m at a switch, and a switch
/// back. The first step of `load-steps` is 0.2 s after the first pulses, when errors of link and magnets cannot be told apart yet: with the error
/// taken for the magnets', it took 9.2 ms.
#[test]
fn a_link_sensors_gain_is_learnt() {
    for gain in [-3, 3] {
        let times = settling_ms(&format!("--udc-gain {gain}"));
        assert!(times.iter().all(|ms| *ms < 5.0), "{gain} %: {times:?}");
        let chosen = catalogue::of_traction(&format!("sweep --down --udc-gain {gain}")).unwrap();
        let machine = chosen.machine().unwrap();
        let recording = chosen.drive(&machine).unwrap();
        let figures = chosen.figures(&recording, &machine);
        for verdict in figures.values()["verdicts"].as_array().unwrap() {
            assert_ne!(verdict["verdict"], "falls short", "{gain} %: {verdict}");
        }
    }
}

/// Drops of devices, if unknown, cost 14.2 ms at the first step, from zero current, until the sixth harmonic is learnt.
#[test]
fn drops_of_devices_that_are_known_are_made_up_for() {
    let times = settling_ms("--device-drop 2,5,1.5,3 --device-drop-known");
    assert!(times.iter().all(|ms| *ms < 5.0), "{times:?}");
}

/// Torque error after each catch of `restart`, in percent, up to this speed in r/min.
fn torque_off(flaw: &str, until_rpm: f64) -> f64 {
    let chosen = catalogue::of_traction(&format!("restart {flaw}")).unwrap();
    let machine = chosen.machine().unwrap();
    let recording = chosen.drive(&machine).unwrap();
    assert!(recording.trip().is_none(), "{flaw}");
    let figures = chosen.figures(&recording, &machine);
    let catches = figures.values()["catches"].as_array().unwrap().clone();
    let value = |catch: &serde_json::Value, key: &str| catch[key].as_f64().unwrap();
    let slow = catches.iter().filter(|catch| value(catch, "speed_rpm") < until_rpm);
    let off = |catch| 100.0 * (value(catch, "final_error_nm") / value(catch, "demand_nm")).abs();
    let worst = slow.map(off).fold(0.0, f64::max);
    println!("{flaw}: torque off by {worst:.2} % up to {until_rpm} r/min");
    worst
}

/// A filter of 100 µs, if unknown, costs 7 % of torque after a flying start at 2,000 r/min, and 78 % in square wave at 6,000.
#[test]
fn a_filter_of_the_current_sensors_that_is_known_is_made_up_for() {
    assert!(torque_off("--current-filter-us 100 --current-filter-known", f64::INFINITY) < 1.0);
}

/// Late angles and currents, if unknown, cost 7.3 and 1.6 % of torque at 6,000 r/min.
#[test]
fn instants_of_the_angle_and_of_the_currents_are_known_on_average() {
    assert!(torque_off("--angle-jitter-us 8 --angle-late-known", f64::INFINITY) < 1.0);
    assert!(torque_off("--adc-skew-us 2,1,0 --current-filter-known", f64::INFINITY) < 1.0);
}

#[test]
fn an_offset_that_is_too_large_has_its_name() {
    let chosen = catalogue::of_traction("load-steps --current-offset 0,0,4").unwrap();
    let recording = chosen.drive(&chosen.machine().unwrap()).unwrap();
    let trip = recording.trip().unwrap();
    assert_eq!(trip.fault, Fault::CurrentOffset);
    assert!((trip.value / 15.2 - 1.0).abs() < 0.01, "{} A", trip.value);
}

/// The figures of a run.
fn figures(line: &str) -> serde_json::Value {
    let chosen = catalogue::of_traction(line).unwrap();
    let machine = chosen.machine().unwrap();
    let recording = chosen.drive(&machine).unwrap();
    assert!(recording.trip().is_none(), "{line}: {:?}", recording.trip());
    serde_json::to_value(chosen.figures(&recording, &machine).values()).unwrap()
}

/// Without the observer and its estimate, 6 to 71 % of torque is missing with hot magnets, and cold ones give 3 to 30 % too much.
#[test]
fn torque_is_corrected_for_hot_and_for_cold_magnets() {
    for percent in [-18, 11] {
        for point in [
            "--speed 400 --torque 400",
            "--speed 400 --torque 900",
            "--speed 1500 --torque 900",
            "--speed 3000 --torque 400",
        ] {
            let figures = figures(&format!("steady {point} --magnets {percent}"));
            let point_of = |name: &str| figures["point"][0][name].as_f64().unwrap();
            let (off, told) = (point_of("torque_error_percent"), point_of("told_error_percent"));
            println!("{point}, {percent} %: {off:.2} %, told {told:.2} %");
            assert!(off.abs() < 0.5 && told.abs() < 0.5, "{point}, {percent} %: {off} %, told {told} %");
        }
    }
}

/// Magnets are identified with a slow rotor as well, though the dead time hides them until a current flows: 16 % were missing while that was taken
/// for another flux linkage.
#[test]
fn hot_magnets_are_known_behind_a_dead_time() {
    for (percent, most) in [(-18, 2.5), (11, 1.5)] {
        let figures =
            figures(&format!("steady --speed 200 --torque 900 --magnets {percent} --dead-time-us 5"));
        let off = figures["point"][0]["torque_error_percent"].as_f64().unwrap();
        println!("{percent} %: {off:.2} %");
        assert!(off.abs() < most, "{percent} %: {off} %");
    }
}

/// Resistance, magnets and both gains at once: the torque that is told, in percent of the largest, from 5 % of rated speed on.
#[test]
fn torque_is_told_whatever_is_off() {
    for gains in ["1 --current-gain 1", "-1 --current-gain 1", "1 --current-gain -1", "-1 --current-gain -1"]
    {
        for point in [
            "100 --torque 1235",
            "200 --torque 1235",
            "400 --torque -600",
            "1500 --torque 1235",
            "3000 --torque 400",
        ] {
            let figures =
                figures(&format!("steady --speed {point} --rs-error 50 --magnets -10 --udc-gain {gains}"));
            let told = figures["point"][0]["told_error_percent"].as_f64().unwrap();
            println!("{point} {gains}: told {told:.2} %");
            assert!(told < 2.0, "{point} {gains}: {told} %");
        }
    }
}

/// A map that is off by up to 15 %: torque within 3 % from the second catch on, after 0.2 s. At standstill, the first catch, the flux linkage cannot be seen.
#[test]
fn torque_is_corrected_for_a_wrong_map() {
    for percent in [-15, -10, -5, 5, 10, 15] {
        let figures = figures(&format!("restart --udc 1800 --map-error {percent}"));
        for catch in &figures["catches"].as_array().unwrap()[1..] {
            let off =
                100.0 * catch["final_error_nm"].as_f64().unwrap() / catch["demand_nm"].as_f64().unwrap();
            assert!(off.abs() < 3.0, "{percent} %: {catch}");
        }
    }
}
