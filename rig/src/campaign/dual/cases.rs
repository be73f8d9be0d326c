//! The operating points at which the faults of the ZS9 occur.

use super::faults::{Cause, faults};
use crate::campaign::Action;
use crate::campaign::action::{LEAD_S, fault_s};
use crate::campaign::fault::Named;
use tractive::nine_switch::Scheme;

/// Speeds of the upper and the lower motor, in r/min.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    pub(super) speeds_rpm: [f64; 2],
    fast: bool,
}

const fn point(upper_rpm: f64, lower_rpm: f64, fast: bool) -> Point {
    Point { speeds_rpm: [upper_rpm, lower_rpm], fast }
}

const POINTS: [Point; 5] = [
    point(100.0, 100.0, false),
    point(700.0, 700.0, false),
    point(1000.0, 1000.0, true),
    point(1000.0, -600.0, false),
    point(1300.0, 1300.0, true),
];

/// Schemes of the fast campaign, one after the other; the full one has every scheme.
pub(super) const SCHEMES: [Scheme; 4] = [Scheme::S, Scheme::Rs, Scheme::Rthd, Scheme::Zvo];

/// Speed from which on a rotor runs away, in r/min.
const RUNAWAY_FROM_RPM: f64 = 1_200.0;

/// One run.
#[derive(Clone, Debug)]
pub struct Case {
    pub(super) fault: Named<Cause>,
    pub(super) point: Point,
    pub(super) action: Action,
    pub(super) scheme: Scheme,
    /// The time of the fault, in s.
    pub(super) at_s: f64,
}

impl Case {
    /// The name that a filter searches.
    pub fn name(&self) -> String {
        let Self { fault, point, action, scheme, .. } = self;
        format!("zs9 {} {} {} {}", fault.name, point.speeds_rpm[0], scheme.name(), action.name())
    }
}

/// Every case; the fast ones are each fault of each kind.
pub fn cases(fast: bool) -> Vec<Case> {
    let mut list = Vec::new();
    for fault in faults() {
        for point in POINTS {
            for action in Action::ALL {
                let count = list.len();
                if (matches!(fault.cause, Cause::Runaway(_)) && point.speeds_rpm[0] < RUNAWAY_FROM_RPM)
                    || (fast && !(fault.fast && point.fast))
                {
                    continue;
                }
                let schemes = if fast { &SCHEMES[count % SCHEMES.len()..][..1] } else { &Scheme::ALL[..] };
                for (number, scheme) in (count..).zip(schemes) {
                    let at_s = match fault.cause {
                        Cause::Flux(_) => -LEAD_S,
                        _ => fault_s(number),
                    };
                    list.push(Case { fault: fault.clone(), point, action, scheme: *scheme, at_s });
                }
            }
        }
    }
    list
}
