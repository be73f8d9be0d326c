//! Two PIs in the rotor's frame, decoupled, behind the circle of the largest voltage.

use crate::frames::Dq;

/// Longest integral time, in sums of the delays.
const INTEGRAL_DELAYS: f32 = 40.0;

/// The two integrators.
#[derive(Clone, Copy, Debug)]
pub struct Loop {
    /// In V.
    integral: Dq,
}

/// Everything that a step works on.
pub struct Input {
    /// Reference and measured current, in A.
    pub reference: Dq,
    pub measured: Dq,
    pub without_ripple: Dq,
    /// What decouples, and the drop of the reference, in V.
    pub forward: Dq,
    /// Incremental inductances of the axes, in H.
    pub inductance: Inductance,
    /// Sum of the delays from what is measured to the middle of the voltage that comes of it, in s.
    pub delay_s: f32,
    /// Time since the last step, in s.
    pub passed_s: f32,
    /// Largest voltage, in V, and `true` if it is to be used whatever is asked for.
    pub limit_v: f32,
    pub fills: bool,
}

/// Voltages, in V.
pub struct Output {
    /// To be made.
    pub voltage: Dq,
    /// Its length.
    pub length_v: f32,
    /// Length of what was asked for.
    pub wanted_v: f32,
    /// Without the proportional part.
    pub steady: Dq,
}

impl Loop {
    pub const AT_REST: Self = Self { integral: Dq { d: 0.0, q: 0.0 } };

    /// One step. Modulus optimum: gain L/(2 T) with the sum T of the delays, integral time L/R, but no more than twenty of T.
    pub fn step(&mut self, input: &Input) -> Output {
        let Input { reference, measured, inductance, delay_s, passed_s, limit_v, .. } = *input;
        let per_delay = 0.5 / delay_s;
        let proportional = inductance.of(reference - measured) * per_delay;
        let steady = input.forward + self.integral;
        let wanted = steady + proportional;
        let wanted_v = wanted.length();
        let fits = wanted_v <= limit_v && !input.fills || wanted_v == 0.0;
        let (voltage, length_v) =
            if fits { (wanted, wanted_v) } else { (wanted * (limit_v / wanted_v), limit_v) };
        // Held back by the voltage that is not to be had, as far as the integral time.
        let integrated = inductance.of(reference - input.without_ripple) * per_delay;
        let missing = integrated + voltage - wanted;
        self.integral = self.integral + missing * (passed_s / (INTEGRAL_DELAYS * delay_s));
        Output { voltage, length_v, wanted_v, steady }
    }
}

/// Incremental inductances, in H: the flux linkage of both axes for the current of one.
#[derive(Clone, Copy, Debug)]
pub struct Inductance {
    pub by_d: Dq,
    pub by_q: Dq,
}

impl Inductance {
    /// The flux linkage of a current, in Wb.
    fn of(self, current: Dq) -> Dq {
        self.by_d * current.d + self.by_q * current.q
    }
}
