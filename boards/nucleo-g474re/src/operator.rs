//! The exchange between the idle loop, which serves the bus, and the control interrupt.

use super::position::PositionState;
use tractive::operator::{DualMailboxes, Mailboxes};

/// Permit in, observations and the position sensors' state out.
pub struct Operator<D = Mailboxes> {
    /// Permit in, observations out.
    pub desk: D,
    /// The position sensors' word of themselves.
    pub position: PositionState,
}

/// The same for the ZS9.
pub type DualOperator = Operator<DualMailboxes>;

impl<D> Operator<D> {
    /// Over a desk at which nothing is permitted yet.
    pub const fn new(desk: D) -> Self {
        Self { desk, position: PositionState::new() }
    }
}
