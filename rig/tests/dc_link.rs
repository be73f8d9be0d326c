//! The DC link against what physics says: charging, discharging, and every joule between source, resistors and machine.

use std::path::Path;
use tractive_rig::plant::{
    DcLink, DcLinkSettings, Leg, LinkSwitches, Plant, PlantSettings, Source, SpeedSource,
};
use tractive_tablegen::MachineFolder;

const LINK: DcLinkSettings = DcLinkSettings {
    capacitance_f: 6e-3,
    source: Source {
        voltage_v: 1_500.0,
        resistance_ohm: 0.05,
        inductance_h: 0.0,
        reversible: false,
        live: true,
    },
    precharge_ohm: 50.0,
    discharge_ohm: 100.0,
    auxiliary_ohm: f64::INFINITY,
    chopper_ohm: 12.0,
};

fn plant_at(speed_rpm: f64) -> Plant {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tables/pmasynrm-180kw");
    let machine = MachineFolder::read(&folder).unwrap();
    Plant::new(&machine, SpeedSource::profile(vec![(0.0, speed_rpm)]), &PlantSettings::default())
}

const OPEN: [Leg; 3] = [Leg::Open; 3];

fn run(plant: &mut Plant, link: &mut DcLink, seconds: f64) {
    for _ in 0..(seconds * 1e4).round() as u32 {
        plant.advance_on(link, OPEN, 1e-4);
    }
}

#[test]
fn precharge_and_discharge_are_exponential() {
    let (mut plant, mut link) = (plant_at(0.0), DcLink::new(LINK));
    link.switches = LinkSwitches { precharge: true, ..LinkSwitches::default() };
    run(&mut plant, &mut link, 0.5);
    let wanted = 1_500.0 * (1.0 - (-0.5 / (50.05 * 6e-3_f64)).exp());
    assert!((link.udc_v - wanted).abs() < 1e-6, "{} V, wanted {wanted} V", link.udc_v);
    link.switches = LinkSwitches { discharge: true, ..LinkSwitches::default() };
    run(&mut plant, &mut link, 1.0);
    let wanted = wanted * (-1.0 / 0.6_f64).exp();
    assert!((link.udc_v - wanted).abs() < 1e-6, "{} V, wanted {wanted} V", link.udc_v);
    // Half of the source's energy stays in the resistor.
    assert!(link.energies.discharge_j > 0.0);
}

#[test]
fn a_rectifier_takes_nothing_back_and_a_reversible_source_does() {
    for (reversible, ends_v) in [(false, 1_800.0), (true, 1_500.0)] {
        let settings = DcLinkSettings { source: Source { reversible, ..LINK.source }, ..LINK };
        let (mut plant, mut link) = (plant_at(0.0), DcLink::new(settings));
        link.udc_v = 1_800.0;
        link.switches = LinkSwitches { main: true, ..LinkSwitches::default() };
        run(&mut plant, &mut link, 0.1);
        assert!((link.udc_v - ends_v).abs() < 1e-3, "{} V", link.udc_v);
    }
}

/// The energy that the link has got and not given: source − heat − inverter − what is stored.
fn missing_j(link: &DcLink, stored_before_j: f64) -> f64 {
    let energies = link.energies;
    energies.source_j
        - energies.path_j
        - energies.discharge_j
        - energies.chopper_j
        - energies.inverter_j
        - (link.stored_j() - stored_before_j)
}

#[test]
fn energy_is_kept_between_source_link_chopper_and_machine() {
    // A machine at 1,500 r/min on a square wave that turns with it and slips through every load angle, motoring and braking.
    let (mut plant, mut link) = (plant_at(1_500.0), DcLink::new(LINK));
    link.udc_v = 1_500.0;
    let stored_j = link.stored_j();
    let mut moved_j: f64 = 0.0;
    for k in 0..60_000_u32 {
        let t_s = f64::from(k) * 10e-6;
        let turns = 100.5 * t_s;
        let legs = [0.0, 1.0 / 3.0, 2.0 / 3.0].map(|lag| {
            let phase = (turns - lag + 0.3_f64).rem_euclid(1.0);
            if phase < 0.5 { Leg::Upper } else { Leg::Lower }
        });
        let legs = if (20_000..25_000).contains(&k) { OPEN } else { legs };
        link.switches = LinkSwitches {
            main: true,
            chopper: k % 100 < 30,
            discharge: (30_000..40_000).contains(&k),
            precharge: false,
        };
        plant.advance_on(&mut link, legs, 10e-6);
        moved_j = moved_j.max(link.energies.inverter_j.abs());
    }
    let electrical_j = plant.motor.energies.electrical_j;
    let inverter_j = link.energies.inverter_j;
    assert!(moved_j > 1_000.0 && link.energies.chopper_j > 1_000.0, "{moved_j} J: too little moved to tell");
    assert!(
        missing_j(&link, stored_j).abs() < 1e-5 * moved_j,
        "{} J of {moved_j} J",
        missing_j(&link, stored_j)
    );
    assert!((inverter_j - electrical_j).abs() < 1e-6 * moved_j, "{inverter_j} J into {electrical_j} J");
}

#[test]
fn a_stiff_link_is_the_limit_of_a_large_one() {
    let settings = DcLinkSettings { capacitance_f: 1e9, ..LINK };
    let (mut on_link, mut stiff, mut link) = (plant_at(800.0), plant_at(800.0), DcLink::new(settings));
    // So little voltage that the currents stay on the map.
    link.udc_v = 250.0;
    for k in 0..20_000_u32 {
        let turns = 53.0 * f64::from(k) * 10e-6;
        let legs = [0.0, 1.0 / 3.0, 2.0 / 3.0]
            .map(|lag| if (turns - lag).rem_euclid(1.0) < 0.5 { Leg::Upper } else { Leg::Lower });
        on_link.advance_on(&mut link, legs, 10e-6);
        stiff.advance(legs, 250.0, 10e-6);
    }
    let (a, b) = (on_link.motor.currents_dq(), stiff.motor.currents_dq());
    assert!((a.0 - b.0).abs() < 1e-6 && (a.1 - b.1).abs() < 1e-6, "{a:?} {b:?}");
}

#[test]
fn an_emf_above_the_link_charges_it_through_the_diodes() {
    // 0.448 Wb · 2π · 100 Hz · √3 = 488 V; through the machine's inductance an empty capacitor swings to less than twice that.
    let (mut plant, mut link) = (plant_at(1_500.0), DcLink::new(LINK));
    run(&mut plant, &mut link, 2.0);
    assert!((488.0..976.0).contains(&link.udc_v), "{} V", link.udc_v);
    assert!(link.energies.inverter_j < 0.0);
}
