//! Machine folders to test with: the reference machine's, and analytic ones.
#![allow(dead_code)] // each test file uses its part

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use tempfile::TempDir;
use tractive_tablegen::{InputError, MachineFolder};

/// The reference machine's folder.
pub fn reference_folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../tables/pmasynrm-180kw")
}

/// A folder that goes with the test.
pub struct Folder(TempDir);

impl Folder {
    /// With these two files.
    pub fn new(machine: &str, map: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("machine.toml"), machine).unwrap();
        std::fs::write(folder.path().join("flux_map.csv"), map).unwrap();
        Self(folder)
    }

    pub fn path(&self) -> &Path {
        self.0.path()
    }

    pub fn read(&self) -> Result<MachineFolder, InputError> {
        MachineFolder::read(self.path())
    }

    /// The error of a reading that must refuse.
    #[track_caller]
    pub fn refusal(&self) -> String {
        match self.read() {
            Ok(_) => panic!("must be refused"),
            Err(error) => error.to_string(),
        }
    }
}

/// Co-energy `W' = ½ Ldl id² + ½ Lql iq² + psi_m id + A √(1+((id+Im)/Ida)²+(iq/Iqa)²) + B √(1+(iq/Iqb)²)`, ψ = ∇W'.
#[derive(Clone, Copy)]
pub struct CoEnergy {
    pub ldl_h: f64,
    pub lql_h: f64,
    pub psi_m_wb: f64,
    pub a_j: f64,
    pub im_a: f64,
    pub ida_a: f64,
    pub iqa_a: f64,
    pub b_j: f64,
    pub iqb_a: f64,
}

/// The reference machine, as published in the head of its `flux_map.csv`.
pub const REFERENCE: CoEnergy = CoEnergy {
    ldl_h: 0.0008,
    lql_h: 0.002925,
    psi_m_wb: 0.0,
    a_j: 22.081,
    im_a: 210.0,
    ida_a: 48.0,
    iqa_a: 104.55,
    b_j: 25.914,
    iqb_a: 46.225,
};

/// A machine without saturation.
pub const fn linear(ld_h: f64, lq_h: f64, psi_m_wb: f64) -> CoEnergy {
    CoEnergy {
        ldl_h: ld_h,
        lql_h: lq_h,
        psi_m_wb,
        a_j: 0.0,
        im_a: 1.0,
        ida_a: 1.0,
        iqa_a: 1.0,
        b_j: 0.0,
        iqb_a: 1.0,
    }
}

impl CoEnergy {
    /// ψd, ψq in Wb at a current in A.
    pub fn flux(&self, id: f64, iq: f64) -> (f64, f64) {
        let (x, y, z) = ((id + self.im_a) / self.ida_a, iq / self.iqa_a, iq / self.iqb_a);
        let (root, root_q) = ((1.0 + x * x + y * y).sqrt(), (1.0 + z * z).sqrt());
        let psi_d = self.psi_m_wb + self.ldl_h * id + self.a_j * x / (self.ida_a * root);
        let psi_q =
            self.lql_h * iq + self.a_j * y / (self.iqa_a * root) + self.b_j * z / (self.iqb_a * root_q);
        (psi_d, psi_q)
    }

    /// Torque in N·m.
    pub fn torque_nm(&self, pole_pairs: u32, id: f64, iq: f64) -> f64 {
        let (psi_d, psi_q) = self.flux(id, iq);
        1.5 * f64::from(pole_pairs) * (psi_d * iq - psi_q * id)
    }

    /// `flux_map.csv` on a grid.
    pub fn map(&self, id: &[f64], iq: &[f64]) -> String {
        let mut text = String::from("id_a,iq_a,psi_d_wb,psi_q_wb\n");
        for d in id {
            for q in iq {
                let (psi_d, psi_q) = self.flux(*d, *q);
                writeln!(text, "{d},{q},{psi_d:.9},{psi_q:.9}").unwrap();
            }
        }
        text
    }
}

/// Evenly spaced values from `first`, `count` of them.
pub fn axis(first: f64, step: f64, count: usize) -> Vec<f64> {
    (0..count).map(|k| first + step * k as f64).collect()
}

/// A good `machine.toml` with one key's line replaced, or left out where `line` is empty.
pub fn toml_with(key: &str, line: &str) -> String {
    let good = std::fs::read_to_string(reference_folder().join("machine.toml")).unwrap();
    let mut found = false;
    let lines = good.lines().map(|old| {
        let here = old.starts_with(&format!("{key} ="));
        found |= here;
        if here { line } else { old }
    });
    let text = lines.collect::<Vec<_>>().join("\n");
    assert!(found, "{key} is not in the good file");
    text
}

/// The good `machine.toml`.
pub fn good_toml() -> String {
    std::fs::read_to_string(reference_folder().join("machine.toml")).unwrap()
}

/// The good `flux_map.csv`.
pub fn good_map() -> String {
    std::fs::read_to_string(reference_folder().join("flux_map.csv")).unwrap()
}

/// A folder of an analytic machine.
pub struct Analytic {
    pub truth: CoEnergy,
    pub pole_pairs: u32,
    pub max_torque_nm: f64,
    pub max_current_a: f64,
    pub max_speed_rpm: f64,
    pub dc_link_v: f64,
    pub step_a: f64,
}

/// A small machine that saturates, on a fine grid.
pub const SMALL: Analytic = Analytic {
    truth: CoEnergy {
        ldl_h: 0.003,
        lql_h: 0.006,
        psi_m_wb: 0.15,
        a_j: 0.6,
        im_a: 10.0,
        ida_a: 6.0,
        iqa_a: 8.0,
        b_j: 0.5,
        iqb_a: 5.0,
    },
    pole_pairs: 3,
    max_torque_nm: 20.0,
    max_current_a: 20.0,
    max_speed_rpm: 6000.0,
    dc_link_v: 560.0,
    step_a: 1.0,
};

impl Analytic {
    /// `machine.toml` with only what is required, in tidy proportions.
    pub fn toml(&self) -> String {
        let rated_speed_rpm = self.max_speed_rpm / 3.0;
        let rated_torque_nm = 0.7 * self.max_torque_nm;
        let max_power_w = self.max_torque_nm * rated_speed_rpm * std::f64::consts::TAU / 60.0;
        format!(
            "name = \"analytic\"\npole_pairs = {}\nstator_resistance_ohm = 0.1\nmax_torque_nm = {}\n\
             max_power_w = {max_power_w}\nmax_current_a = {}\nmax_speed_rpm = {}\n\
             rated_torque_nm = {rated_torque_nm}\nrated_speed_rpm = {rated_speed_rpm}\ndc_link_min_v = {}\n\
             dc_link_nominal_v = {}\ndc_link_max_v = {}\nmax_switching_hz = 5000\n",
            self.pole_pairs,
            self.max_torque_nm,
            self.max_current_a,
            self.max_speed_rpm,
            0.8 * self.dc_link_v,
            self.dc_link_v,
            1.2 * self.dc_link_v,
        )
    }

    /// With the map on a grid from below −i_max to a little above 0, iq ≥ 0.
    pub fn folder(&self) -> Folder {
        let steps = (self.max_current_a / self.step_a).ceil();
        let id = axis(-(steps + 1.0) * self.step_a, self.step_a, steps as usize + 4);
        let iq = axis(0.0, self.step_a, steps as usize + 1);
        Folder::new(&self.toml(), &self.truth.map(&id, &iq))
    }
}
