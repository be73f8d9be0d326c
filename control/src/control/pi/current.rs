//! Two PIs in the rotor's frame, decoupled, limited by the circle of the largest voltage.

use super::super::Regulated;
use crate::frames::Dq;

/// The loops' design for a mode, by what that mode can follow.
#[derive(Clone, Copy, Debug)]
pub struct Design {
    /// Carrier halves from a sample to the middle of its command's effect. The textbook's are 1.5; a pattern follows later.
    pub delay_halves: f32,
    /// Integral time, in these delays: L/R with the largest current under carriers, longer if the angle alone follows.
    integral_delays: f32,
    /// Share of the reference in the current that decouples; the rest is measured. In square wave the measured current alone is too old.
    pub set_share: f32,
}

impl Design {
    /// The design for a mode.
    pub const fn of(follows: Regulated) -> Self {
        match follows {
            Regulated::Mean => Self { delay_halves: 1.5, integral_delays: 40.0, set_share: 0.0 },
            #[cfg(feature = "optimal")]
            Regulated::Path => Self::of(Regulated::Mean),
            Regulated::Fundamental => Self { delay_halves: 2.25, integral_delays: 40.0, set_share: 0.0 },
            Regulated::Angle => Self { delay_halves: 3.0, integral_delays: 80.0, set_share: 0.5 },
        }
    }
}

/// The two integrators.
#[derive(Clone, Copy, Debug)]
pub struct Loop {
    /// In V.
    integral: Dq,
}

/// The inputs of a step.
pub struct Input {
    /// Reference, the newest sample and the current without ripple, in A.
    pub reference: Dq,
    pub measured: Dq,
    pub without_ripple: Dq,
    /// The decoupling voltage and the resistive drop of the reference, in V.
    pub forward: Dq,
    /// Incremental inductances.
    pub inductance: Inductance,
    /// The loops' design, and the length of a carrier half in s.
    pub design: Design,
    pub half_s: f32,
    /// Time since the last step, in s.
    pub passed_s: f32,
    /// Largest voltage, in V, and `true` if it is to be used whatever is asked for.
    pub limit_v: f32,
    pub fills: bool,
}

/// Voltages, in V.
pub struct Output {
    /// Voltage to be made.
    pub voltage: Dq,
    /// Its length.
    pub length_v: f32,
    /// Length of the voltage that was asked for.
    pub wanted_v: f32,
    /// Voltage without the proportional part.
    pub steady: Dq,
}

impl Loop {
    /// Both integrators empty.
    pub const AT_REST: Self = Self { integral: Dq { d: 0.0, q: 0.0 } };

    /// One step. Modulus optimum: with T the sum of the delays the gain is L/(2 T). The proportional part takes the newest sample, the
    /// integral part the current without ripple.
    pub fn step(&mut self, input: &Input) -> Output {
        let Input { reference, inductance, design, limit_v, .. } = *input;
        let delay_s = design.delay_halves * input.half_s;
        let per_s = 0.5 / delay_s;
        let proportional = inductance.of(reference - input.measured) * per_s;
        let steady = input.forward + self.integral;
        let wanted = steady + proportional;
        let wanted_v = wanted.length();
        let fits = (wanted_v <= limit_v && !input.fills) || wanted_v == 0.0;
        let (voltage, length_v) =
            if fits { (wanted, wanted_v) } else { (wanted * (limit_v / wanted_v), limit_v) };
        // Held back by the voltage that is not available.
        let error = inductance.of(reference - input.without_ripple) * per_s;
        let share = input.passed_s / (design.integral_delays * delay_s);
        self.integral = self.integral + (error + voltage - wanted) * share;
        Output { voltage, length_v, wanted_v, steady }
    }
}

/// Incremental inductances, in H: the flux linkage of both axes for the current of one axis.
#[derive(Clone, Copy, Debug)]
pub struct Inductance {
    /// For the d-axis current.
    pub by_d: Dq,
    /// For the q-axis current.
    pub by_q: Dq,
}

impl Inductance {
    /// The flux linkage of a current, in Wb.
    fn of(self, current: Dq) -> Dq {
        self.by_d * current.d + self.by_q * current.q
    }
}
