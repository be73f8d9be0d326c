//! What passes between the idle loop, which serves the bus, and the control interrupt.

use super::position::PositionState;
use crate::operator::{Desk, DualDesk};

/// Permit in, observations and the position sensors' state out.
pub struct Operator<D = Desk> {
    /// Permit in, observations out.
    pub desk: D,
    /// The position sensors' word of themselves.
    pub position: PositionState,
}

/// The same for the ZS9.
pub type DualOperator = Operator<DualDesk>;

impl<D> Operator<D> {
    /// Over a desk at which nothing is permitted yet.
    pub const fn new(desk: D) -> Self {
        Self { desk, position: PositionState::new() }
    }
}
