//! A flux map from nameplate values.

use super::given::{ABOVE_ZERO, Given, Range, check};
use super::ratings::Ratings;
use super::write;
use crate::options::finite;
use anyhow::{Result, ensure};
use clap::Args;
use tractive::start_up::PULSE_SHARE;
use tractive_tablegen::FluxMap;

/// Nameplate values.
#[derive(Clone, Debug, Args)]
pub struct Nameplate {
    /// Inductance along the magnets' flux, in H.
    #[arg(long, value_name = "H", value_parser = finite, allow_negative_numbers = true)]
    pub ld: f64,
    /// Inductance across the magnets' flux, in H.
    #[arg(long, value_name = "H", value_parser = finite, allow_negative_numbers = true)]
    pub lq: f64,
    /// Flux linkage of the magnets, peak, in Wb: peak phase voltage of the turning machine without current, divided by its electrical angular speed;
    /// 0 without magnets.
    #[arg(long, value_name = "WB", value_parser = finite, allow_negative_numbers = true)]
    pub psi_f: f64,
    /// Share of the larger inductance that remains when the largest current flows along its axis, 0.2 ..= 1; both inductances fall with the energy of
    /// the current, L = L₀/√(1 + E/E₀) with E = ½ (L_d i_d² + L_q i_q²), and the magnets' flux stays.
    #[arg(long, value_name = "SHARE", default_value_t = 1.0, value_parser = finite, allow_negative_numbers = true)]
    pub saturation: f64,
    /// The limits of machine and inverter.
    #[command(flatten)]
    pub given: Given,
}

/// Steps of the grid up to the largest current.
const STEPS: i32 = 25;
/// Steps beyond it.
const BEYOND: i32 = 2;
/// Steps along +d: as far as the pulses that find the angle at standstill go. Beyond the grid the map continues straight, which would make them detect
/// magnets on the wrong side.
const POSITIVE: i32 = (PULSE_SHARE * STEPS as f32) as i32 + 1;

impl Nameplate {
    /// Makes the folder.
    pub fn make(&self) -> Result<()> {
        self.check()?;
        let map = self.map();
        let mut ratings = Ratings::of(&map, &self.given)?;
        let contents = ratings.contents(&self.given, &self.told(), self.csv(&map))?;
        write::folder(&self.given.out, &contents)?;
        ratings.say(&self.given, &[])
    }

    fn check(&self) -> Result<()> {
        self.given.check()?;
        check(&[
            Range("--ld", self.ld, ABOVE_ZERO, 10.0, "H"),
            Range("--lq", self.lq, ABOVE_ZERO, 10.0, "H"),
            Range("--psi-f", self.psi_f, 0.0, 100.0, "Wb"),
            Range("--saturation", self.saturation, 0.2, 1.0, ""),
        ])?;
        ensure!(
            self.ld <= self.lq,
            "--ld {}: must be at most --lq {}: d lies along the magnets; where the data has d along the least reluctance, give its L_q as --ld and its L_d as --lq",
            self.ld,
            self.lq
        );
        ensure!(
            self.psi_f > 0.0 || self.ld < self.lq,
            "--psi-f {}: must be above 0: without magnets and with --ld equal to --lq there is no torque",
            self.psi_f
        );
        Ok(())
    }

    /// Energy E₀ at which saturation begins, in J: infinite without it.
    fn knee_j(&self) -> f64 {
        let most_j = 0.5 * self.lq * self.given.max_current.powi(2);
        let square = self.saturation.powi(2);
        most_j * square / (1.0 - square)
    }

    /// Flux linkages along d and q in Wb at a current in A: the gradient of the co-energy
    /// `W' = ψ_f i_d + 2 E₀ (√(1 + E/E₀) − 1)`, so that ∂ψ_d/∂i_q = ∂ψ_q/∂i_d.
    fn flux(&self, id_a: f64, iq_a: f64) -> (f64, f64) {
        let energy_j = 0.5 * (self.ld * id_a * id_a + self.lq * iq_a * iq_a);
        let left = (1.0 + energy_j / self.knee_j()).sqrt().recip();
        (self.psi_f + left * self.ld * id_a, left * self.lq * iq_a)
    }

    /// The map on the grid.
    fn map(&self) -> FluxMap {
        let current_a =
            |step: i32| write::digits(self.given.max_current * f64::from(step) / f64::from(STEPS));
        let id_a: Vec<_> = (-STEPS - BEYOND..=POSITIVE).map(current_a).collect();
        let iq_a: Vec<_> = (-STEPS - BEYOND..=STEPS + BEYOND).map(current_a).collect();
        let nodes = || id_a.iter().flat_map(|id| iq_a.iter().map(|iq| self.flux(*id, *iq)));
        let (psi_d_wb, psi_q_wb) = nodes().map(|(d, q)| (write::digits(d), write::digits(q))).unzip();
        FluxMap { psi_d_wb, psi_q_wb, id_a, iq_a }
    }

    fn csv(&self, map: &FluxMap) -> String {
        let saturation = if self.saturation < 1.0 {
            format!(
                "the gradient of W' = psi_f id + 2 E0 (sqrt(1 + E/E0) - 1), E = (Ld id^2 + Lq iq^2)/2, E0 = {} J",
                write::digits(self.knee_j())
            )
        } else {
            "psi_d = psi_f + Ld id, psi_q = Lq iq".to_owned()
        };
        let Self { ld, lq, psi_f, .. } = self;
        write::csv(map, &format!("# Ld = {ld} H, Lq = {lq} H, psi_f = {psi_f} Wb: {saturation}.\n"))
    }

    /// The command that makes this folder.
    fn told(&self) -> String {
        let Self { ld, lq, psi_f, saturation, given } = self;
        let saturation =
            if *saturation < 1.0 { format!(" --saturation {saturation}") } else { String::new() };
        format!("new{} --ld {ld} --lq {lq} --psi-f {psi_f}{saturation}", given.told())
    }
}
