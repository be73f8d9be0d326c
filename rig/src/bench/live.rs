//! Changes made to a bench while it runs, and the rows taken from it.

use super::{Bench, Limits, LineSide, Observed, Tick};
use crate::inject::Injection;
use crate::inject::traction::{Kind, Spoiler};
use crate::plant::{DcLink, Motor, Plant};
use crate::trace::{Edge, Row};

impl Bench {
    /// The same without an end.
    pub fn endless(mut self) -> Self {
        self.end = Tick::MAX;
        self
    }

    /// The rows and edges since the last call; changes of mode and the operator's status are discarded.
    pub fn take(&mut self) -> (Vec<Row>, Vec<Edge>) {
        self.switches.clear();
        self.slots.clear();
        (self.rows.take(), self.inverter.take_edges())
    }

    /// Time of a tick from the recording's beginning, in s.
    pub fn seconds(&self, tick: Tick) -> f64 {
        self.time.seconds(tick)
    }

    /// The machine.
    pub fn motor(&self) -> &Motor {
        &self.plant.motor
    }

    /// Machine and legs.
    pub fn plant_mut(&mut self) -> &mut Plant {
        &mut self.plant
    }

    /// The line side, if there is one.
    pub fn line(&self) -> Option<&LineSide> {
        self.dc.operated()
    }

    /// Its link.
    pub fn link_mut(&mut self) -> Option<&mut DcLink> {
        self.dc.operated_mut().map(|line| &mut line.link)
    }

    /// Injects a fault from the next instant on. The fault before this one is removed.
    pub fn inject(&mut self, kind: Kind) {
        self.mend();
        let from = self.time.now + 1;
        self.spoiler = Spoiler::new(Some(Injection { kind, at_s: self.time.seconds(from) }));
        self.observed = Observed::new(from, Limits::NONE);
    }

    /// Removes the injected fault; what the drive has latched stays latched.
    pub fn mend(&mut self) {
        self.spoiler = Spoiler::new(None);
        self.inverter.mend();
    }
}
