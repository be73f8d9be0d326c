//! The bounds of a good outcome.
//!
//! - *Caught*: a fault of a name that fits, the gates safe in bounded time, no phase current above 1.5 times the trip level, no DC
//!   voltage above its trip level by more than a sampling period makes until the gates are safe, and after that none above what
//!   the energies that are then in the machine, in the choke and in the line force upon the capacitor.
//! - *Ridden through*: no fault, no phase current above the trip level, the DC voltage inside its trip levels, and mean torque
//!   within the fault's tolerance of the demand, before and after a change of demand. There must be nothing that the
//!   drive should have noticed.
//! - *Uncaught*: anything else.

use serde::{Deserialize, Serialize};
use tractive::protection::Fault;

/// The end of a case.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// A fault of a fitting name, the gates safe in time, current and voltages within what is allowed.
    Caught,
    /// No fault; the drive went on with every limit kept and the torque that is wanted.
    RiddenThrough,
    /// Anything else.
    Uncaught,
}

/// Largest phase current after any single fault, over the trip level.
pub const CURRENT_SHARE: f64 = 1.5;

/// Room for the rounding of what is forced, and for what happens between two instants at which it is looked at.
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
    /// Mean torque error where the drive goes on, as a share of the largest torque; `None` where it must not go on.
    pub torque_share: Option<f64>,
}

/// A value, and what it may be.
#[derive(Clone, Copy, Debug)]
pub struct Bounded {
    /// The quantity's name in a message, with its unit.
    pub what: &'static str,
    /// It.
    pub value: f64,
    /// The most that it may be.
    pub limit: f64,
}

impl Bounded {
    /// A value with its limit.
    pub const fn new(what: &'static str, value: f64, limit: f64) -> Self {
        Self { what, value, limit }
    }

    /// The message if the value is beyond its bound; one that is no number is.
    fn broken(&self) -> Option<String> {
        let within = self.value <= self.limit;
        (!within).then(|| format!("{} {:.4} over {:.4}", self.what, self.value, self.limit))
    }
}

/// The verdict, and why where it is uncaught: `named` is the fault that the drive named, `trip` is to be kept where it stopped,
/// `go_on` where it did not.
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
