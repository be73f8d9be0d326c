//! Machines of other kinds, from their linear inductances, driven on the host.

use clap::Parser;
use std::fmt::Write as _;
use tractive_rig::machine::Machine;
use tractive_rig::options::RunOptions;
use tractive_rig::scenario;

#[derive(Parser)]
struct Line {
    scenario: String,
    #[command(flatten)]
    options: RunOptions,
}

/// A linear machine and its ratings.
struct Linear {
    name: &'static str,
    pole_pairs: u32,
    resistance_ohm: f64,
    ld_h: f64,
    lq_h: f64,
    magnet_wb: f64,
    current_a: f64,
    torque_nm: f64,
    power_w: f64,
    speed_rpm: f64,
    link_v: f64,
}

const MACHINES: [Linear; 4] = [
    Linear {
        name: "interior magnets",
        pole_pairs: 4,
        resistance_ohm: 0.12,
        ld_h: 2.5e-3,
        lq_h: 5e-3,
        magnet_wb: 0.33,
        current_a: 85.0,
        torque_nm: 120.0,
        power_w: 14e3,
        speed_rpm: 2000.0,
        link_v: 667.0,
    },
    Linear {
        name: "surface magnets, no saliency",
        pole_pairs: 4,
        resistance_ohm: 0.12,
        ld_h: 3e-3,
        lq_h: 3e-3,
        magnet_wb: 0.33,
        current_a: 85.0,
        torque_nm: 120.0,
        power_w: 14e3,
        speed_rpm: 2000.0,
        link_v: 667.0,
    },
    Linear {
        name: "reluctance alone, no magnets",
        pole_pairs: 2,
        resistance_ohm: 0.5,
        ld_h: 12e-3,
        lq_h: 60e-3,
        magnet_wb: 0.0,
        current_a: 32.0,
        torque_nm: 45.0,
        power_w: 5e3,
        speed_rpm: 3000.0,
        link_v: 540.0,
    },
    Linear {
        name: "5 kW, reluctance assisted by magnets",
        pole_pairs: 2,
        resistance_ohm: 0.6,
        ld_h: 20e-3,
        lq_h: 60e-3,
        magnet_wb: 0.4,
        current_a: 21.0,
        torque_nm: 38.0,
        power_w: 6e3,
        speed_rpm: 3500.0,
        link_v: 540.0,
    },
];

impl Linear {
    fn write(&self, folder: &std::path::Path) {
        let toml = format!(
            "name = \"{}\"\npole_pairs = {}\nstator_resistance_ohm = {}\nmax_torque_nm = {}\nmax_power_w = {}\n\
             max_current_a = {}\nmax_speed_rpm = {}\nrated_torque_nm = {}\nrated_speed_rpm = {}\ndc_link_min_v = {}\n\
             dc_link_nominal_v = {}\ndc_link_max_v = {}\nmax_switching_hz = 4000\n",
            self.name,
            self.pole_pairs,
            self.resistance_ohm,
            self.torque_nm,
            self.power_w,
            self.current_a,
            self.speed_rpm,
            0.5 * self.torque_nm,
            0.4 * self.speed_rpm,
            0.8 * self.link_v,
            self.link_v,
            1.2 * self.link_v,
        );
        let mut map = String::from("id_a,iq_a,psi_d_wb,psi_q_wb\n");
        let step = self.current_a / 20.0;
        for d in -22..=4 {
            for q in 0..=22 {
                let (id, iq) = (step * f64::from(d), step * f64::from(q));
                let _ = writeln!(map, "{id},{iq},{},{}", self.magnet_wb + self.ld_h * id, self.lq_h * iq);
            }
        }
        std::fs::write(folder.join("machine.toml"), toml).unwrap();
        std::fs::write(folder.join("flux_map.csv"), map).unwrap();
    }
}

#[test]
fn any_machine_folder_drives() {
    for linear in MACHINES {
        let folder = tempfile::tempdir().unwrap();
        linear.write(folder.path());
        let path = folder.path().display().to_string();
        let run = |line: &str| {
            let words = ["test"].into_iter().chain(line.split(' ')).chain(["--machine", &path]);
            let parsed = Line::parse_from(words);
            let machine = Machine::load(&path).unwrap();
            let scenario = scenario::find(&parsed.scenario).unwrap();
            let recording = scenario::drive(scenario.as_ref(), &parsed.options, &machine).unwrap();
            assert!(recording.trip().is_none(), "{}: {line}: {:?}", linear.name, recording.trip());
            scenario.figures(&recording, &parsed.options, &machine)
        };
        for (speed_share, torque_share) in [(0.1, 1.0), (0.1, -0.5), (0.35, 0.9), (1.0, 0.3), (-0.6, 0.5)] {
            let (speed, torque) = (speed_share * linear.speed_rpm, torque_share * linear.torque_nm);
            let figures = run(&format!("steady --speed {speed} --torque {torque}"));
            let point = &figures.get("point").unwrap()[0];
            println!("{}: {point}", linear.name);
            let error = point["torque_error_percent"].as_f64().unwrap();
            assert!(error.abs() < 0.5, "{}: {error} % at {speed} r/min, {torque} N·m", linear.name);
        }
        run(&format!("sweep --down --to {}", linear.speed_rpm));
    }
}
