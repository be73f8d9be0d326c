//! The operator's and the drive's status, as JSON.

use crate::driven::number;
use serde_json::{Value, json};
use tractive::operator::Status;
use tractive::protection::Trip;

/// At a time in s, with the fault that is latched; the demands are of the system's own kind.
pub fn state<T>(t_s: f64, trip: Option<Trip>, status: Option<&Status<T>>, demands: Option<Value>) -> Value {
    let trip = trip.map(|trip| {
        json!({
            "fault": trip.fault.name(),
            "value": number(trip.value),
            "limit": number(trip.limit),
            "safe": format!("{:?}", trip.safe),
        })
    });
    let status = status.map(|status| {
        json!({
            "state": status.state.name(),
            "refusal": status.refusal.map(|refusal| refusal.name()),
            "torque": demands,
            "precharge": status.switches.precharge,
            "main": status.switches.main,
            "discharge": status.switches.discharge,
            "chopper": number(status.switches.chopper),
        })
    });
    json!({ "t": t_s, "trip": trip, "status": status })
}
