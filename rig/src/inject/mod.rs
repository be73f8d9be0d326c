//! Injected faults and their times: the part common to both systems here, the kinds of each beside it.
#![cfg_attr(not(test), deny(clippy::disallowed_methods))]

pub mod network;
pub mod sensor;
pub mod traction;
pub mod zs9;

/// A fault to inject, and its time.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Injection<K> {
    /// The fault.
    pub kind: K,
    /// From this instant of the recording on, in s.
    pub at_s: f64,
}

/// The fault of the control interrupt.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ControlFault {
    /// The interrupt ends this many ticks after its deadline.
    Late(u32),
    /// The interrupt no longer comes: no new commands.
    Stopped,
}

/// Something that goes wrong.
pub trait GoesWrong: Copy {
    /// The fault of the control interrupt, if it is one.
    fn control(self) -> Option<ControlFault>;
}

/// An injection, or none.
#[derive(Clone, Copy, Debug)]
pub struct Injected<K>(pub Option<Injection<K>>);

impl<K> Default for Injected<K> {
    fn default() -> Self {
        Self(None)
    }
}

impl<K: GoesWrong> Injected<K> {
    /// The fault at an instant, if there is one.
    pub fn kind(&self, t_s: f64) -> Option<K> {
        self.0.as_ref().filter(|injection| t_s >= injection.at_s - 1e-9).map(|injection| injection.kind)
    }

    /// Time since the fault began, in s; since the recording's beginning if there is none.
    pub fn since_s(&self, t_s: f64) -> f64 {
        t_s - self.0.as_ref().map_or(0.0, |injection| injection.at_s)
    }

    /// Lateness of the control interrupt, in ticks.
    pub fn late_ticks(&self, t_s: f64) -> u32 {
        match self.kind(t_s).and_then(K::control) {
            Some(ControlFault::Late(ticks)) => ticks,
            _ => 0,
        }
    }

    /// `true` if the control interrupt comes at all.
    pub fn has_control(&self, t_s: f64) -> bool {
        self.kind(t_s).and_then(K::control) != Some(ControlFault::Stopped)
    }
}
