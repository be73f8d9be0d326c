//! The consequences that a fault of the ZS9 may have.

use super::cases::Case;
use super::faults::Cause;
use super::{CARRIER_HZ, Drive, STAGES};
use crate::bench::Observed;
use crate::campaign::judge::{Bounded, CURRENT_SHARE, FORCED, half_turn_s};
use crate::campaign::outcome::{Allowed, Seen};
use crate::inject::ControlFault;
use crate::inject::zs9::Kind;
use crate::plant::zs9::ZNetwork;
use crate::run::CLOCK;
use crate::zs9::settings;
use tractive::protection::Fault;

impl Drive {
    pub(super) fn allowed(&self, case: &Case, seen: &Seen) -> Allowed {
        let parameters = &self.machine.folder.parameters;
        let observed = &seen.observed;
        let trip_a = parameters.trip_current_a;
        let current_a = match case.fault.cause {
            // The diodes of a bridge on a shorted source short the motors, whatever the gates do.
            Cause::Bench(Kind::SourceShort) => {
                (CURRENT_SHARE * trip_a).max(FORCED * observed.stored.short_circuit_a)
            }
            _ => CURRENT_SHARE * trip_a,
        };
        let highest_v =
            f64::from(settings::drive(CLOCK, CARRIER_HZ, self.machine.tables).limits.capacitor_max_v);
        let uc_v = forced_uc_v(observed).max(highest_v);
        Allowed {
            longest_s: self.longest_s(case, seen),
            current_a,
            // The source is given; the capacitors decide.
            udc_v: 2.0 * uc_v,
            uc_v: Some(uc_v),
            torque_nm: parameters.max_torque_nm,
            explained_nm: 0.0,
            stopped: vec![
                Bounded::new(
                    "V at a capacitor until the gates are safe",
                    observed.until.uc_v,
                    highest_v + RISE_V,
                ),
                Bounded::new("V at a capacitor with safe gates", observed.after.uc_v, uc_v),
            ],
            went_on: vec![
                Bounded::new("A", observed.until.current_a, trip_a),
                Bounded::new("V at a capacitor", observed.until.uc_v, highest_v),
            ],
        }
    }

    /// The longest time from a fault's first effect until the gates are safe, in s: three carriers, or half an electrical turn if the fault
    /// shows with the rotor's angle; an overcharged capacitor and a rotor that runs away are found by their levels.
    fn longest_s(&self, case: &Case, seen: &Seen) -> f64 {
        let carriers_s = 3.0 * seen.carrier_s;
        let pole_pairs = self.machine.folder.parameters.pole_pairs;
        match case.fault.cause {
            Cause::Bench(Kind::Current(motor, ..) | Kind::Angle(motor, _)) => {
                carriers_s.max(half_turn_s(case.point.speeds_rpm[motor], pole_pairs))
            }
            // The currents are produced all the same, so only the voltage tells, and its volt-seconds have to add up.
            Cause::Bench(Kind::SourceSwitchOpen) if seen.names(Fault::VoltageUnexplained) => STAGES.end_s,
            Cause::Bench(Kind::Network(_)) => NETWORK_S,
            Cause::Bench(Kind::Gate(..)) => STUCK_S,
            Cause::Bench(Kind::Control(ControlFault::Stopped)) => carriers_s + STALE_S,
            Cause::Runaway(_) => carriers_s + TRACKING_S,
            _ => carriers_s,
        }
    }
}

/// Time until a stuck gate has made a difference to the feedback, in s: five carriers.
const STUCK_S: f64 = 5e-4;
/// Time until a voltage that is a quarter off is found, in s: the duty rises on it, and the watch takes a mean over 20 ms; or a capacitor is overcharged.
const NETWORK_S: f64 = 0.025;
/// The largest age of a command, in s.
const STALE_S: f64 = 5e-4;
/// The speed tracker's lag, in s: 2/4000 rad/s.
const TRACKING_S: f64 = 0.5e-3;
/// The rise of a capacitor between a sample at its trip level and gates that are off, in V: 300 A for 175 µs.
const RISE_V: f64 = 300.0 * 175e-6 / ZNetwork::ZS9.capacitance_f;

/// The highest capacitor voltage to expect once the gates are off, in V: that of the network's own oscillation, plus the energies of
/// the motors.
fn forced_uc_v(observed: &Observed) -> f64 {
    let stored = &observed.stored;
    // Both capacitors share it.
    let charged_v = ((stored.field_j + stored.braked_j) / ZNetwork::ZS9.capacitance_f).sqrt();
    FORCED * stored.unloaded_v.hypot(charged_v)
}
