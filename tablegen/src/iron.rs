//! Iron loss, as a torque that brakes the rotor.
//!
//! `T = T_rated (ψ/ψ_rated)² (f n/n_rated + (1 − f) sign n)`: the hysteresis loss is the same in every turn, the eddy-current loss per turn grows with
//! speed, and both grow with the square of the flux linkage. The currents are not affected.

use crate::{FluxMap, Optimum, Parameters, SmoothMap};
use tractive_control::machine::IronLoss;

/// Speed below which hysteresis fades, electrical, in rad/s.
const LEAST_RAD_S: f64 = 2.0;

/// The iron of a machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iron {
    /// Torque of hysteresis over the square of the flux linkage, in N·m/Wb².
    hysteresis: f64,
    /// Torque of eddy currents over the same and the electrical speed, in N·m·s/(Wb²·rad).
    eddy: f64,
}

impl Iron {
    /// No loss.
    pub const NONE: Self = Self { hysteresis: 0.0, eddy: 0.0 };

    /// The iron of a machine that causes this share of the loss named in its folder, at rated speed and rated torque. The part that grows with the square
    /// of speed is attributed to eddy currents.
    pub fn of(parameters: &Parameters, map: &FluxMap, share: f64) -> Self {
        if share == 0.0 {
            return Self::NONE;
        }
        let rated_rad_s = parameters.rated_speed_rpm * core::f64::consts::TAU / 60.0;
        let torque_nm = share * parameters.loss_rated_w / rated_rad_s;
        let per_square = torque_nm / rated_square(parameters, &SmoothMap::new(map));
        let eddy_share = parameters.loss_quadratic_fraction;
        Self {
            hysteresis: (1.0 - eddy_share) * per_square,
            eddy: eddy_share * per_square / (rated_rad_s * f64::from(parameters.pole_pairs)),
        }
    }

    /// `true` if there is any loss.
    #[inline]
    pub fn is_some(&self) -> bool {
        *self != Self::NONE
    }

    /// The loss in the form that a drive knows it.
    pub fn known(&self) -> IronLoss {
        IronLoss { hysteresis: self.hysteresis as f32, eddy: self.eddy as f32 }
    }

    /// The torque against the rotor, positive forward, in N·m, for the square of the flux linkage, in Wb², and an electrical speed, in rad/s.
    pub fn torque_nm(&self, square: f64, omega: f64) -> f64 {
        square * (self.hysteresis * (omega / LEAST_RAD_S).clamp(-1.0, 1.0) + self.eddy * omega)
    }
}

/// Square of the flux linkage at rated torque with the least current, in Wb².
fn rated_square(parameters: &Parameters, map: &SmoothMap) -> f64 {
    let (id_a, iq_a) = Optimum::new(map, parameters).least_current(parameters.rated_torque_nm);
    let at = map.at(id_a, iq_a);
    at.psi_d_wb * at.psi_d_wb + at.psi_q_wb * at.psi_q_wb
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::MachineFolder;

    #[test]
    fn its_machine_loses_what_its_folder_names_and_the_less_the_slower_it_is() {
        for name in ["pmasynrm-180kw", "ipm-zs9"] {
            let folder = format!("{}/../tables/{name}", env!("CARGO_MANIFEST_DIR"));
            let MachineFolder { parameters, map, .. } =
                MachineFolder::read(std::path::Path::new(&folder)).unwrap();
            let iron = Iron::of(&parameters, &map, 0.5);
            let smooth = SmoothMap::new(&map);
            let (id_a, iq_a) = Optimum::new(&smooth, &parameters).least_current(parameters.rated_torque_nm);
            let square = smooth.at(id_a, iq_a).psi_d_wb.hypot(smooth.at(id_a, iq_a).psi_q_wb).powi(2);
            let rated_rad_s = parameters.rated_speed_rpm * core::f64::consts::TAU / 60.0;
            for (speed, share) in [
                (1.0, 1.0),
                (0.25, 0.25 * parameters.loss_quadratic_fraction + 1.0 - parameters.loss_quadratic_fraction),
            ] {
                let torque_nm =
                    iron.torque_nm(square, speed * rated_rad_s * f64::from(parameters.pole_pairs));
                let asked_nm = 0.5 * share * parameters.loss_rated_w / rated_rad_s;
                assert!(
                    (torque_nm - asked_nm).abs() <= 1e-9 * asked_nm,
                    "{name}: {torque_nm} N·m, {asked_nm} N·m"
                );
            }
        }
    }

    #[test]
    fn a_drive_knows_the_same_torque() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../tables/pmasynrm-180kw");
        let machine = MachineFolder::read(std::path::Path::new(folder)).unwrap();
        let iron = Iron::of(&machine.parameters, &machine.map, 1.0);
        let known = iron.known();
        assert_eq!(machine.tables().ratings.iron, known);
        for (d, q, omega) in [(0.4, -1.2, 838.0), (0.9, 0.3, -1_500.0), (1.0, 0.2, 0.8), (0.7, 0.0, 0.0)] {
            let exact = iron.torque_nm(f64::from(d * d + q * q), f64::from(omega));
            let told = known.torque_nm(d * d + q * q, omega);
            assert!((f64::from(told) - exact).abs() <= 1e-5 * exact.abs(), "{told} N·m, {exact} N·m");
            assert!(exact.abs() > 1.0 || omega == 0.0, "{exact} N·m");
        }
        let none = Iron::of(&machine.parameters, &machine.map, 0.0);
        assert_eq!(none.known(), IronLoss::NONE);
        assert!(iron.is_some() && !none.is_some());
    }
}
