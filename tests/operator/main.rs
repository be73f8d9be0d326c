//! The operator's state machine: every transition, every refusal, every fault of its own, and what no sequence may do.

mod document;
mod dual;
mod faults;
mod limits;
mod line_gap;
mod properties;
mod ramp;
mod refusals;
mod temperatures;
mod transitions;
mod world;
