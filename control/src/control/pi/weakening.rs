//! Field weakening by voltage feedback: if the loops ask for more voltage than there is, i_d is moved.

use crate::frames::limit;

/// Bandwidth of the feedback, in rad/s: well below that of the current loops.
const BANDWIDTH_RAD_S: f32 = 30.0;
/// Share of the largest voltage that weakening leaves to the steady state; the rest is for regulation.
const STEADY_SHARE: f32 = 0.97;

/// The integrator on the voltage.
#[derive(Clone, Copy, Debug)]
pub struct Weakening {
    /// Shift of i_d from that of MTPA, in A.
    moved_a: f32,
}

/// The inputs of a step.
pub struct Input {
    /// The voltage that the loops ask for, and the largest voltage, in V.
    pub wanted_v: f32,
    pub limit_v: f32,
    /// `true` if the voltage is always the largest one: then i_d moves either way.
    pub filled: bool,
    /// Reactance and resistance of the d axis, in ohm.
    pub reactance_ohm: f32,
    pub resistance_ohm: f32,
    /// Largest current, and least i_d, in A.
    pub largest_a: f32,
    pub least_id_a: f32,
    /// Time since the last step, in s.
    pub passed_s: f32,
}

impl Weakening {
    pub const NONE: Self = Self { moved_a: 0.0 };

    /// Shift of i_d from that of MTPA, in A.
    pub const fn moved_a(&self) -> f32 {
        self.moved_a
    }

    /// One step.
    pub fn step(&mut self, input: &Input) {
        let share = if input.filled { 1.0 } else { STEADY_SHARE };
        let left_v = share * input.limit_v - input.wanted_v;
        let per_s = BANDWIDTH_RAD_S / (input.reactance_ohm + input.resistance_ohm);
        let highest_a = if input.filled { input.largest_a } else { 0.0 };
        self.moved_a = limit(self.moved_a + per_s * input.passed_s * left_v, input.least_id_a, highest_a);
    }
}
