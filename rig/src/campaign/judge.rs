//! The bounds of a good outcome.
//!
//! - *Caught*: the drive names a fitting fault, the gates are safe in bounded time, no phase current is above 1.5 times the trip level, no
//!   DC voltage is above its trip level by more than one sampling period causes until the gates are safe, and after that none is above
//!   what the energies then in the machine, in the choke and in the line force upon the capacitor.
//! - *Ridden through*: no fault, no phase current above the trip level, the DC voltage within its trip levels, and the mean torque
//!   within the fault's tolerance of the demand, before and after a change of demand. There must be nothing that the
//!   drive should have noticed.
//! - *Uncaught*: anything else.

use serde::{Deserialize, Serialize};
use tractive::protection::Fault;

/// The end of a case.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// A fitting fault named, the gates safe in time, current and voltages within what is allowed.
    Caught,
    /// No fault; the drive went on within every limit and with the torque that is demanded.
    RiddenThrough,
    /// Anything else.
    Uncaught,
}

/// Largest phase current after any single fault, over the trip level.
pub const CURRENT_SHARE: f64 = 1.5;

/// Margin for the rounding of what is forced, and for what happens between two instants of observation.
pub const FORCED: f64 = 1.01;

/// The longest time of a fault that shows with the rotor's angle, in s: half an electrical turn, at most a tenth of a second.
pub fn half_turn_s(speed_rpm: f64, pole_pairs: u32) -> f64 {
    (0.5 / (speed_rpm.abs() / 60.0 * f64::from(pole_pairs))).min(0.1)
}

/// The names that a fault may get, and the consequences that it may have otherwise.
#[derive(Clone, Copy, Debug)]
pub struct Rule {
    /// Names that fit.
    pub names: &'static [Fault],
    /// Mean torque error if the drive goes on, as a share of the largest torque; `None` if it must not go on.
    pub torque_share: Option<f64>,
}

/// A value and its limit.
#[derive(Clone, Copy, Debug)]
pub struct Bounded {
    /// The quantity's name in a message, with its unit.
    pub what: &'static str,
    /// The value.
    pub value: f64,
    /// The most that it may be.
    pub limit: f64,
}

impl Bounded {
    /// A value with its limit.
    pub const fn new(what: &'static str, value: f64, limit: f64) -> Self {
        Self { what, value, limit }
    }

    /// The message if the value exceeds its bound; a value that is not a number does.
    fn broken(&self) -> Option<String> {
        let within = self.value <= self.limit;
        (!within).then(|| format!("{} {:.4} over {:.4}", self.what, self.value, self.limit))
    }
}

/// The verdict, and the reason if it is uncaught: `named` is the fault that the drive named, `trip` are the bounds if it stopped,
/// `go_on` those if it did not.
pub fn verdict(rule: &Rule, named: Option<Fault>, trip: &[Bounded], go_on: &[Bounded]) -> (Verdict, String) {
    let broken = |bounds: &[Bounded]| bounds.iter().find_map(Bounded::broken);
    let why = match named {
        Some(fault) if !rule.names.contains(&fault) => Some(format!("{} is no name for it", fault.name())),
        Some(_) => broken(trip),
        None if rule.torque_share.is_none() => Some("no fault".to_owned()),
        None => broken(go_on).map(|what| format!("no fault, {what}")),
    };
    match (why, named) {
        (Some(why), _) => (Verdict::Uncaught, why),
        (None, Some(_)) => (Verdict::Caught, String::new()),
        (None, None) => (Verdict::RiddenThrough, String::new()),
    }
}
