//! Drives that somebody drives by hand: the parts that both systems share.

use tractive::operator::{Levels, State};

/// Period in which the person driving looks and gives orders once, in s: the operator's slot.
pub const TURN_S: f64 = 1e-3;
/// Time for which an acknowledge is set, in s, so that a slot sees it.
pub const ACKNOWLEDGE_S: f64 = 3e-3;
/// Time after which a command that was refused is given again, in s.
const AGAIN_S: f64 = 50e-3;

/// The command: a torque in N·m, or a speed in r/min.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Command {
    /// A torque.
    Torque(f64),
    /// A speed, held by a loop like that of a vehicle's computer.
    Speed(f64),
}

/// The rotor's state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Turning {
    /// Held at a speed, in r/min.
    Held(f64),
    /// Free, with an inertia in kg·m² and a load in N·m.
    Free(f64, f64),
}

/// The state in which a drive is switched on, and the rows that it leaves.
#[derive(Clone, Copy, Debug)]
pub struct Start {
    /// Mechanical speed, in r/min.
    pub speed_rpm: f64,
    /// Step of the rows, in s.
    pub step_s: f64,
}

/// The wishes for the drive, as levels.
#[derive(Clone, Copy, Debug, Default)]
pub struct Wanted {
    /// The link charged and the drive enabled; otherwise stopped.
    pub on: bool,
    /// Gates off, to be caught again.
    pub coast: bool,
    /// The link discharged once the drive has stopped.
    pub discharge: bool,
}

impl Wanted {
    /// The operator's levels in a state, at a time in s.
    pub fn levels(&self, state: State, now_s: f64, acknowledge: bool) -> Levels {
        // A refused edge is given again some slots later.
        let again = now_s % AGAIN_S < ACKNOWLEDGE_S;
        let closed = !matches!(state, State::Init | State::SelfTest | State::Ready | State::Precharge);
        Levels {
            enable: self.on && closed && state != State::Fault && (state != State::Charged || !again),
            with_torque: true,
            coast: self.coast,
            charge: self.on && state == State::Ready && !again,
            discharge: !self.on && self.discharge && state == State::Charged && !again,
            acknowledge,
            ..Levels::NONE
        }
    }
}
