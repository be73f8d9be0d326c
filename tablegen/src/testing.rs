//! A machine without saturation: each of its tables has a closed form.

use crate::MachineFolder;
use std::fmt::Write as _;

/// Inductances and magnet flux of a machine without saturation.
#[derive(Clone, Copy)]
pub struct Linear {
    pub ld_h: f64,
    pub lq_h: f64,
    pub psi_m_wb: f64,
}

/// With 3 pole pairs and 20 A.
pub const IPM: Linear = Linear { ld_h: 0.006, lq_h: 0.015, psi_m_wb: 0.2 };
pub const POLE_PAIRS: u32 = 3;
pub const MOST_A: f64 = 20.0;
pub const RESISTANCE_OHM: f64 = 0.7;

const KEYS: &str = "name = \"linear\"
pole_pairs = 3
stator_resistance_ohm = 0.7
max_torque_nm = 22.0
max_power_w = 4e3
max_current_a = 20.0
max_speed_rpm = 3000.0
rated_torque_nm = 15.0
rated_speed_rpm = 1500.0
dc_link_min_v = 250.0
dc_link_nominal_v = 300.0
dc_link_max_v = 350.0
max_switching_hz = 5000.0
";

impl Linear {
    /// The folder, with some keys' lines replaced.
    pub fn folder(&self, lines: &[&str]) -> MachineFolder {
        let mut toml = String::new();
        let key = |line: &str| line.split(' ').next().unwrap_or_default().to_owned();
        let kept = KEYS.lines().filter(|line| lines.iter().all(|own| key(own) != key(line)));
        kept.chain(lines.iter().copied()).for_each(|line| writeln!(toml, "{line}").unwrap());
        let mut map = String::from("id_a,iq_a,psi_d_wb,psi_q_wb\n");
        for (d, q) in (0..=12).flat_map(|d| (0..=10).map(move |q| (d, q))) {
            let (id, iq) = (2.0 * f64::from(d) - 22.0, 2.0 * f64::from(q));
            let (psi_d, psi_q) = self.flux_wb(id, iq);
            writeln!(map, "{id},{iq},{psi_d:.15},{psi_q:.15}").unwrap();
        }
        MachineFolder::parse(&toml, &map).unwrap()
    }

    pub fn flux_wb(&self, id: f64, iq: f64) -> (f64, f64) {
        (self.psi_m_wb + self.ld_h * id, self.lq_h * iq)
    }

    pub fn torque_nm(&self, id: f64, iq: f64) -> f64 {
        1.5 * f64::from(POLE_PAIRS) * (self.psi_m_wb + (self.ld_h - self.lq_h) * id) * iq
    }

    /// The current of a magnitude with the largest torque, from the derivative's zero.
    pub fn best(&self, current_a: f64) -> (f64, f64) {
        let saliency = self.lq_h - self.ld_h;
        let root = (self.psi_m_wb.powi(2) + 8.0 * (saliency * current_a).powi(2)).sqrt();
        let id = (self.psi_m_wb - root) / (4.0 * saliency);
        (id, (current_a * current_a - id * id).sqrt())
    }
}

/// Checks that a value is within a share of the one expected.
#[track_caller]
pub fn near(value: f64, expected: f64, share: f64) {
    assert!((value - expected).abs() <= share * expected.abs().max(1e-9), "{value}, not {expected}");
}
