//! Machines of other kinds, from their linear inductances.

use std::fmt::Write as _;

/// A linear machine and its ratings.
pub struct Linear {
    pub name: &'static str,
    pub pole_pairs: u32,
    pub resistance_ohm: f64,
    pub ld_h: f64,
    pub lq_h: f64,
    pub magnet_wb: f64,
    pub current_a: f64,
    pub torque_nm: f64,
    pub power_w: f64,
    pub speed_rpm: f64,
    pub link_v: f64,
    pub switching_hz: f64,
}

const INTERIOR: Linear = Linear {
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
    switching_hz: 4e3,
};

/// Magnets inside, magnets on the surface, none, and a small one with few of them.
pub const MACHINES: [Linear; 4] = [
    INTERIOR,
    Linear { name: "surface magnets, no saliency", ld_h: 3e-3, lq_h: 3e-3, ..INTERIOR },
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
        switching_hz: 4e3,
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
        switching_hz: 4e3,
    },
];

impl Linear {
    /// Writes the machine's folder.
    pub fn write(&self, folder: &std::path::Path) {
        let toml = format!(
            "name = \"{}\"\npole_pairs = {}\nstator_resistance_ohm = {}\nmax_torque_nm = {}\nmax_power_w = {}\n\
             max_current_a = {}\nmax_speed_rpm = {}\nrated_torque_nm = {}\nrated_speed_rpm = {}\ndc_link_min_v = {}\n\
             dc_link_nominal_v = {}\ndc_link_max_v = {}\nmax_switching_hz = {}\n",
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
            self.switching_hz,
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
