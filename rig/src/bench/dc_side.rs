//! The inverter's DC side: a stiff link, one behind a line filter, or one that an operator switches.

use super::LineSide;
use crate::inject::traction::SupplyFault;
use crate::plant::stopwatch::in_plant;
use crate::plant::{FilteredLink, Leg, LineFilter, Plant};

/// The supply of the inverter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Supply {
    /// A link whose voltage is prescribed.
    Stiff,
    /// A capacitor, fed from a line that takes braking energy back.
    Line(LineFilter),
    /// A link that is simulated elsewhere; its voltage is given from outside.
    Shared,
}

/// A link's terminals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Terminal {
    /// Its voltage, in V.
    pub udc_v: f64,
    /// Current out of the line, in A.
    pub line_a: f64,
}

/// The line as a function of time in s: its healthy voltage in V, its fault and the fault's duration, in s.
pub type LineState = (f64, Option<(SupplyFault, f64)>);

/// The link and what is in front of it.
pub enum DcSide {
    /// Its voltage is the line's.
    Stiff,
    /// A capacitor behind a choke.
    Filtered(FilteredLink),
    /// A link of which only the terminals are modelled here.
    Shared(Terminal),
    /// A capacitor behind contactors.
    Operated(Box<LineSide>),
}

impl DcSide {
    /// With a link at a voltage, in V.
    pub fn new(supply: Supply, udc_v: f64) -> Self {
        match supply {
            Supply::Stiff => Self::Stiff,
            Supply::Line(filter) => Self::Filtered(FilteredLink::new(filter, udc_v)),
            Supply::Shared => Self::Shared(Terminal { udc_v, line_a: 0.0 }),
        }
    }

    /// The contactors' side, if there is one.
    pub fn operated(&self) -> Option<&LineSide> {
        match self {
            Self::Operated(line) => Some(line),
            _ => None,
        }
    }

    /// The same.
    pub fn operated_mut(&mut self) -> Option<&mut LineSide> {
        match self {
            Self::Operated(line) => Some(line),
            _ => None,
        }
    }

    /// The link's true voltage, in V, for a healthy line of this voltage.
    pub fn udc_v(&self, healthy_v: impl FnOnce() -> f64) -> f64 {
        match self {
            Self::Stiff => healthy_v(),
            Self::Filtered(link) => link.udc_v,
            Self::Shared(terminal) => terminal.udc_v,
            Self::Operated(line) => line.link.udc_v,
        }
    }

    /// Current out of the line, in A; `None` if there is no line filter.
    pub fn line_a(&self) -> Option<f64> {
        match self {
            Self::Filtered(link) => Some(link.choke_a),
            Self::Shared(terminal) => Some(terminal.line_a),
            Self::Operated(line) => line.choke_a(),
            Self::Stiff => None,
        }
    }

    /// Lets the plant run on it for `dt_s`.
    pub fn advance(
        &mut self,
        plant: &mut Plant,
        legs: [Leg; 3],
        dt_s: f64,
        line: impl FnOnce() -> LineState,
    ) {
        match self {
            Self::Stiff => in_plant(|| plant.advance(legs, line().0, dt_s)),
            Self::Shared(terminal) => in_plant(|| plant.advance(legs, terminal.udc_v, dt_s)),
            Self::Filtered(link) => {
                let before_j = plant.motor.energies.electrical_j;
                in_plant(|| plant.advance(legs, link.udc_v, dt_s));
                let drawn_j = plant.motor.energies.electrical_j - before_j;
                link.advance(drawn_j, dt_s, line_v(line()));
            }
            Self::Operated(line) => in_plant(|| line.advance(plant, legs, dt_s)),
        }
    }

    /// The highest voltage that the link would have over the next tenth of a second without the inverter, in V; `line` is evaluated at the time from
    /// now, in s. 0 if only the inverter charges it.
    pub fn unloaded_v(&self, line: impl Fn(f64) -> LineState) -> f64 {
        const STEPS: u32 = 1_000;
        const STEP_S: f64 = 0.1e-3;
        let Self::Filtered(mut link) = *self else { return 0.0 };
        (0..STEPS).fold(0.0_f64, |highest_v, k| {
            link.advance(0.0, STEP_S, line_v(line(f64::from(k) * STEP_S)));
            highest_v.max(link.udc_v)
        })
    }
}

/// The target of the line's voltage, in V; `None` if it is disconnected.
pub(super) fn line_v((healthy_v, fault): LineState) -> Option<f64> {
    match fault {
        None => Some(healthy_v),
        Some((SupplyFault::Lost, _)) => None,
        Some((SupplyFault::To(line_v), _)) => Some(line_v),
        Some((SupplyFault::Swinging(amplitude_v, hz), since_s)) => {
            Some(healthy_v + amplitude_v * libm::sin(core::f64::consts::TAU * hz * since_s))
        }
    }
}
