//! The reasons for which a bench cannot continue.

use crate::plant::zs9::IllegalState;
use crate::trace::Tick;

/// The firmware broke the protocol, or asked for something that an inverter must not do.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// The playing pulses ended and nothing follows.
    #[error("at {at_s:.6} s the {what} ended and no next one had been loaded")]
    NothingToPlay {
        /// A carrier half or period.
        what: &'static str,
        /// The time, in s.
        at_s: f64,
    },
    /// A sample was asked for that is not there.
    #[error("the control sample of step {0} was asked for and is not there")]
    NoSample(Tick),
    /// The operator asked for a slot that is not there.
    #[error("the operator's slot of tick {0} was asked for and is not kept")]
    NoSlot(Tick),
    /// The operator fell behind.
    #[error("at {0:.6} s the operator has not finished its slot before the next one")]
    OperatorLate(f64),
    /// Control fell behind.
    #[error("at {0:.6} s the control interrupt has not reported within its period")]
    ControlLate(f64),
    /// The gates asked for a state that is not allowed for the bridge.
    #[error(transparent)]
    Illegal(#[from] IllegalState),
}
