//! Iron loss, as a torque that brakes the rotor.

/// Electrical speed below which hysteresis fades, in rad/s.
const LEAST_RAD_S: f32 = 2.0;

/// The iron of a machine: `T = |ψ|² (h sign ω + e ω)`. Hysteresis loses the same in every turn, eddy currents the more the faster it turns, both with the
/// square of the flux linkage. The currents show nothing of it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct IronLoss {
    /// Torque of hysteresis over the square of the flux linkage, `h`, in N·m/Wb².
    pub hysteresis: f32,
    /// Torque of eddy currents over the same and the electrical speed, `e`, in N·m·s/(Wb²·rad).
    pub eddy: f32,
}

impl IronLoss {
    /// Without loss.
    pub const NONE: Self = Self { hysteresis: 0.0, eddy: 0.0 };

    /// The torque against the rotor, positive forward, in N·m, at a square of the flux linkage in Wb² and an electrical speed in rad/s.
    #[inline(always)]
    pub fn torque_nm(&self, square_wb2: f32, omega: f32) -> f32 {
        let sign = (omega * (1.0 / LEAST_RAD_S)).clamp(-1.0, 1.0);
        square_wb2 * (self.hysteresis * sign + self.eddy * omega)
    }
}
