//! The sums over a step of the trace.

/// The sums over a step of the trace, each value times its time, in steps.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sums {
    pub steps: f64,
    pub torque_refs: [f64; 2],
    pub loads: [f64; 2],
    pub source_v: f64,
    pub shorted: f64,
}
