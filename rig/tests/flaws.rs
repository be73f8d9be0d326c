//! Flaws of inverter, sensors and machine, one by one and all at once.

use tractive::protection::Fault;
use tractive_rig::bench::{Converter, Flaws};
use tractive_rig::plant::{DeviceDrops, Leg, Plant, PlantSettings, SpeedSource};
use tractive_rig::scenario::catalogue;
use tractive_rig::scenario::traction::flaws::{Drops, Phases};
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
    // All three currents through one device each: what the drops take is heat.
    let machine = catalogue::of_traction("sweep").unwrap().machine().unwrap();
    let settings = PlantSettings { drops, ..PlantSettings::default() };
    let mut plant = Plant::new(&machine.folder, SpeedSource::profile(vec![(0.0, 0.0)]), &settings);
    plant.motor.set_currents(100.0, 0.0);
    plant.advance([Leg::Lower; 3], 1_500.0, 10e-6);
    let taken_w = plant.motor.energies.electrical_j / 10e-6;
    let wanted_w = -(100.0 * 1.8 + 2.0 * 50.0 * 2.25);
    assert!((taken_w / wanted_w - 1.0).abs() < 0.01, "{taken_w} W, {wanted_w} W");
}

#[test]
fn all_at_once_leaves_what_was_given() {
    let chosen = catalogue::of_traction("load-steps --real --noise-a 0.1 --current-offset 0,0,1").unwrap();
    let options = chosen.filled(&chosen.machine().unwrap());
    assert_eq!((options.noise_a, options.own.flaws.current_offset), (0.1, Some(Phases([0.0, 0.0, 1.0]))));
    assert_eq!((options.dead_time_us, options.adc_bits, options.rs_error), (5.0, Some(12), 20.0));
    let flaws = &options.own.flaws;
    assert_eq!((flaws.slots, flaws.device_drop), (2.0, Some(Drops([2.0, 5.0, 1.5, 3.0]))));
    assert_eq!((options.own.angle_1f_deg, options.own.angle_2f_deg, options.own.udc_gain), (1.0, 0.5, 1.0));
    // Devices that switch faster have shorter times, on a lower link lower voltages.
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

/// By how much current THD and torque ripple are over their bounds, in percent: of the steady point that the line names.
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

/// Without what is learnt 1° costs 110 % of THD at 3,000 r/min, 3° 537 %.
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

/// Without what is learnt at rest an offset of 2 % costs 116 % of THD and 69 % of torque ripple, and no step settles.
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

/// Without what is learnt of them gains of 2 % and −2 % cost 27 % of torque ripple at 200 r/min, and no step settles. The first step of `load-steps` is
/// before anything flows that could teach it.
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
        assert!(times.iter().skip(1).all(|ms| *ms < 5.0), "{gains}: {times:?}");
    }
}

/// Without what is learnt of it a link that is read 3 % too small costs 20.9 ms at a step; in a sweep 3.2 % of current and 53 N·m at a switch, and a switch back.
/// The first step of `load-steps` is 0.2 s after the first pulses, where two thirds are learnt.
#[test]
fn a_link_sensors_gain_is_learnt() {
    for gain in [-3, 3] {
        let times = settling_ms(&format!("--udc-gain {gain}"));
        assert!(times.iter().skip(1).all(|ms| *ms < 5.0), "{gain} %: {times:?}");
        let chosen = catalogue::of_traction(&format!("sweep --down --udc-gain {gain}")).unwrap();
        let machine = chosen.machine().unwrap();
        let recording = chosen.drive(&machine).unwrap();
        let figures = chosen.figures(&recording, &machine);
        for verdict in figures.values()["verdicts"].as_array().unwrap() {
            assert_ne!(verdict["verdict"], "falls short", "{gain} %: {verdict}");
        }
    }
}

/// Unknown, drops of devices cost 19.7 ms at a step. The first step, out of no current, takes 15.9 ms still: there the sixth harmonic is followed until then.
#[test]
fn drops_of_devices_that_are_known_are_made_up_for() {
    let times = settling_ms("--device-drop 2,5,1.5,3 --device-drop-known");
    assert!(times.iter().skip(1).all(|ms| *ms < 5.0), "{times:?}");
}

/// By how much torque is off after each catch of `restart`, in percent, up to this speed in r/min.
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

/// Unknown, a filter of 100 µs costs 5.1 % of torque after a flying start at 2,000 r/min, and 70 % in square wave at 6,000; there 22 % are left, because it is no delay for
/// the ripple of square wave.
#[test]
fn a_filter_of_the_current_sensors_that_is_known_is_made_up_for() {
    let known = "--current-filter-us 100 --current-filter-known";
    assert!(torque_off(known, 3_100.0) < 1.0);
    assert!(torque_off(known, f64::INFINITY) < 25.0);
}

#[test]
fn an_offset_that_is_too_large_has_its_name() {
    let chosen = catalogue::of_traction("load-steps --current-offset 0,0,4").unwrap();
    let recording = chosen.drive(&chosen.machine().unwrap()).unwrap();
    let trip = recording.trip().unwrap();
    assert_eq!(trip.fault, Fault::CurrentOffset);
    assert!((trip.value / 15.2 - 1.0).abs() < 0.01, "{} A", trip.value);
}
