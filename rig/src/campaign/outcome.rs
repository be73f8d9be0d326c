//! The outcome of one case.

use super::Action;
use super::fault::Named;
use super::judge::{self, Bounded, Verdict};
use crate::bench::Observed;
use serde::{Deserialize, Deserializer, Serialize};
use tractive::protection::{Fault, SafeState, Trip};

/// One line of the table.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Outcome {
    /// `pmasynrm` or `zs9`.
    #[serde(deserialize_with = "system")]
    pub system: SystemName,
    /// The fault.
    pub fault: String,
    /// Mode of the pulses when the fault occurred; the ZS9's scheme.
    pub mode: String,
    /// Speed then, in r/min.
    pub speed_rpm: f64,
    /// The drive's action.
    pub action: Action,
    /// The verdict.
    pub verdict: Verdict,
    /// The fault that the drive named; empty if none.
    pub named: String,
    /// The safe state that it chose; empty if none.
    pub safe_state: String,
    /// Carrier periods from the fault's first effect until the gates were safe.
    pub carrier_periods: Option<f64>,
    /// The same time, in ms.
    pub time_ms: Option<f64>,
    /// Time from the fault itself, in ms: a stuck sensor shows once the current goes elsewhere.
    pub since_fault_ms: Option<f64>,
    /// Largest phase current from the fault until the gates were safe, in A.
    pub current_until_a: f64,
    /// And after that.
    pub current_after_a: f64,
    /// The limit: 1.5 times the trip level.
    pub current_limit_a: f64,
    /// Largest DC voltage until the gates were safe, in V; the ZS9's link outside shoot-through.
    pub udc_until_v: f64,
    /// And after that.
    pub udc_after_v: f64,
    /// The limit after that: what the stored energies and the supply force.
    pub udc_limit_v: f64,
    /// The ZS9's largest capacitor voltage until the gates were safe, in V.
    pub uc_until_v: Option<f64>,
    /// And after that.
    pub uc_after_v: Option<f64>,
    /// The limit.
    pub uc_limit_v: Option<f64>,
    /// Lowest i_d from the fault on, in A; for the ZS9 of both motors.
    pub lowest_id_a: f64,
    /// Mean torque less demand if the drive went on, in N·m: the worst of both demands, and for the ZS9 of both motors.
    pub torque_error_nm: f64,
    /// The reason why it is uncaught; empty otherwise.
    pub why: String,
}

/// The name of a system.
type SystemName = &'static str;

/// One of the names.
fn system<'de, D: Deserializer<'de>>(from: D) -> Result<SystemName, D::Error> {
    let name = String::deserialize(from)?;
    ["pmasynrm", "zs9"]
        .into_iter()
        .find(|system| *system == name)
        .ok_or_else(|| serde::de::Error::custom(format!("no system {name}")))
}

/// The case of a line.
#[derive(Clone, Debug)]
pub struct Setting {
    /// `pmasynrm` or `zs9`.
    pub system: &'static str,
    /// Mode of the pulses, or the scheme.
    pub mode: &'static str,
    /// In r/min.
    pub speed_rpm: f64,
    /// The drive's action.
    pub action: Action,
}

/// The results of a run.
#[derive(Clone, Debug)]
pub struct Seen {
    /// On the bench.
    pub observed: Observed,
    /// The latched fault.
    pub trip: Option<Trip>,
    /// Mean torque less demand, in N·m: the worst of both demands, and for the ZS9 of both motors.
    pub torque_error_nm: f64,
    /// Length of a tick of the observations, in s.
    pub tick_s: f64,
    /// Length of a carrier at the fault's instant, in s.
    pub carrier_s: f64,
}

impl Seen {
    /// `true` if this fault is the one that is latched.
    pub fn names(&self, fault: Fault) -> bool {
        self.trip.is_some_and(|trip| trip.fault == fault)
    }
}

/// The consequences that a fault may have.
#[derive(Clone, Debug)]
pub struct Allowed {
    /// The longest time from a fault's first effect until the gates are safe, in s.
    pub longest_s: f64,
    /// Phase current, in A.
    pub current_a: f64,
    /// DC voltage with safe gates, in V.
    pub udc_v: f64,
    /// The ZS9's capacitor voltage with safe gates, in V.
    pub uc_v: Option<f64>,
    /// Torque of which the fault's rule allows a share as mean torque error, in N·m.
    pub torque_nm: f64,
    /// Mean torque error that the case's conditions explain, in N·m.
    pub explained_nm: f64,
    /// Further bounds if the drive stopped.
    pub stopped: Vec<Bounded>,
    /// Further bounds if it went on.
    pub went_on: Vec<Bounded>,
}

impl Outcome {
    /// The head of its CSV.
    pub const COLUMNS: &str = "system,fault,mode,speed_rpm,action,verdict,named,safe_state,carrier_periods,time_ms,\
        since_fault_ms,current_until_a,current_after_a,current_limit_a,udc_until_v,udc_after_v,udc_limit_v,\
        uc_until_v,uc_after_v,uc_limit_v,lowest_id_a,torque_error_nm,why";

    /// All its numbers.
    pub fn numbers(&self) -> impl Iterator<Item = f64> + use<> {
        let always = [
            self.speed_rpm,
            self.current_until_a,
            self.current_after_a,
            self.current_limit_a,
            self.udc_until_v,
            self.udc_after_v,
            self.udc_limit_v,
            self.lowest_id_a,
            self.torque_error_nm,
        ];
        let times = [self.carrier_periods, self.time_ms, self.since_fault_ms];
        let of_zs9 = [self.uc_until_v, self.uc_after_v, self.uc_limit_v];
        always.into_iter().chain(times.into_iter().chain(of_zs9).flatten())
    }

    /// The line of a case.
    pub fn new<C>(setting: &Setting, fault: &Named<C>, seen: &Seen, allowed: Allowed) -> Self {
        let Seen { observed, trip, torque_error_nm, tick_s, carrier_s } = seen;
        let time_s = observed.ticks_to_safe().map(|ticks| ticks as f64 * tick_s);
        let mut stopped = vec![
            Bounded::new(
                "ms until the gates are safe",
                time_s.map_or(f64::NAN, |time_s| time_s * 1e3),
                allowed.longest_s * 1e3,
            ),
            Bounded::new("A until the gates are safe", observed.until.current_a, allowed.current_a),
            Bounded::new("A with safe gates", observed.after.current_a, allowed.current_a),
        ];
        stopped.extend(allowed.stopped);
        let mut went_on = allowed.went_on;
        let torque_share = fault.rule.torque_share.unwrap_or(0.0);
        went_on.push(Bounded::new(
            "N·m off",
            *torque_error_nm,
            torque_share * allowed.torque_nm + allowed.explained_nm,
        ));
        let named = trip.map(|trip| trip.fault);
        let (verdict, why) = judge::verdict(&fault.rule, named, &stopped, &went_on);
        let since_ticks = observed.safe.map(|(safe, _)| safe as f64 - observed.from as f64);
        Self {
            system: setting.system,
            fault: fault.name.clone(),
            mode: setting.mode.to_owned(),
            speed_rpm: setting.speed_rpm,
            action: setting.action,
            verdict,
            named: named.map_or("", Fault::name).to_owned(),
            safe_state: observed.safe.map_or("", |(_, safe)| safe_state_name(safe)).to_owned(),
            carrier_periods: time_s.map(|time_s| time_s / carrier_s),
            time_ms: time_s.map(|time_s| time_s * 1e3),
            since_fault_ms: since_ticks.map(|ticks| ticks * tick_s * 1e3),
            current_until_a: observed.until.current_a,
            current_after_a: observed.after.current_a,
            current_limit_a: allowed.current_a,
            udc_until_v: observed.until.udc_v,
            udc_after_v: observed.after.udc_v,
            udc_limit_v: allowed.udc_v,
            uc_until_v: allowed.uc_v.map(|_| observed.until.uc_v),
            uc_after_v: allowed.uc_v.map(|_| observed.after.uc_v),
            uc_limit_v: allowed.uc_v,
            lowest_id_a: observed.until.lowest_id_a.min(observed.after.lowest_id_a),
            torque_error_nm: *torque_error_nm,
            why,
        }
    }
}

/// The name in tables.
fn safe_state_name(safe: SafeState) -> &'static str {
    match safe {
        SafeState::GatesOff => "gates off",
        SafeState::ShortCircuit => "short circuit, lower",
        SafeState::UpperShortCircuit => "short circuit, upper",
    }
}
