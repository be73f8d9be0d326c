//! The consequences that a fault of the PMaSynRM drive may have.

use super::cases::Case;
use super::faults::Cause;
use super::{Drive, Last, STAGES, sensors};
use crate::bench::Observed;
use crate::campaign::judge::{Bounded, CURRENT_SHARE, FORCED, half_turn_s};
use crate::campaign::outcome::{Allowed, Seen};
use crate::inject::traction::Kind;
use crate::plant::Stator;
use core::f64::consts::TAU;
use tractive::protection::{Fault, SafeState};

impl Drive {
    pub(super) fn allowed(&self, case: &Case, seen: &Seen, last: Last) -> Allowed {
        let parameters = &self.machine.folder.parameters;
        let observed = &seen.observed;
        let flaws = &case.conditions.flaws;
        // True values at which the drive reads its trip levels.
        let trip_a = parameters.trip_current_a / (1.0 + flaws.current_gain);
        let over_v = parameters.trip_dc_over_v / (1.0 + flaws.udc_gain);
        // Between two samples a current rises in proportion to the link voltage: by half the trip level at the nominal one.
        let line_share = case.conditions.line_v.map_or(1.0, |line_v| line_v / parameters.dc_link_nominal_v);
        let most_a = trip_a + (CURRENT_SHARE - 1.0) * trip_a * line_share.max(1.0);
        let current_a = match case.fault.cause {
            // The flux linkage present when a device fails cannot leave a shorted machine; nothing that the gates do is better.
            Cause::Bench(Kind::Device(_)) => most_a.max(FORCED * observed.stored.short_circuit_a),
            // Nor can the flux linkage of magnets that alone drive more than the trip level through a short circuit.
            _ if self.most_rpm().is_some() && is_shorted(seen) => {
                most_a.max(FORCED * observed.stored.short_circuit_a)
            }
            _ => most_a,
        };
        let udc_v = self.forced_udc_v(case, observed);
        let capacitance_f = case.conditions.filter.capacitance_f;
        Allowed {
            longest_s: self.longest_s(case, seen),
            current_a,
            udc_v,
            uc_v: None,
            torque_nm: parameters.max_torque_nm,
            explained_nm: case.conditions.torque_share() * parameters.max_torque_nm,
            stopped: vec![
                Bounded::new(
                    "V until the gates are safe",
                    observed.until.udc_v,
                    over_v + self.link_rise_v(capacitance_f),
                ),
                Bounded::new("V with safe gates", observed.after.udc_v, udc_v),
                Bounded::new(
                    "N·m with safe gates",
                    last.torque_nm.abs(),
                    self.safe_torque_limit_nm(case, seen, last.speed_rpm),
                ),
            ],
            went_on: vec![
                Bounded::new("A", observed.until.current_a, BETWEEN_SAMPLES * trip_a),
                Bounded::new("V", observed.until.udc_v, over_v),
            ],
        }
    }

    /// The longest time from a fault's first effect until the gates are safe, in s: three carriers, or half an electrical turn if the fault
    /// shows with the rotor's angle.
    fn longest_s(&self, case: &Case, seen: &Seen) -> f64 {
        let carrier_s = seen.carrier_s;
        let carriers_s = 3.0 * carrier_s;
        if case.fault.needs_rest() {
            return STAGES.end_s;
        }
        match case.fault.cause {
            Cause::Bench(Kind::Current(..) | Kind::Angle(_)) => {
                let pole_pairs = self.machine.folder.parameters.pole_pairs;
                // A rotor that slows down takes longer.
                let speed_rpm = case.point.speed_rpm.abs();
                let lost_rpm = case.conditions.acceleration_rpm_s.abs() * half_turn_s(speed_rpm, pole_pairs);
                carriers_s.max(half_turn_s(speed_rpm - lost_rpm, pole_pairs))
            }
            // If no current flows, only the voltage tells, and its volt-seconds have to add up.
            Cause::Bench(Kind::Gate(_, false)) if seen.names(Fault::VoltageUnexplained) => STAGES.end_s,
            Cause::Runaway => carriers_s + TRACKING_S,
            Cause::Sensor(..) => {
                let turn_s =
                    2.0 * half_turn_s(case.point.speed_rpm, self.machine.folder.parameters.pole_pairs);
                sensors::longest_s(carrier_s, seen.trip.map(|trip| trip.safe), turn_s)
            }
            _ => carriers_s,
        }
    }

    /// The most torque that safe gates may leave at a speed in r/min, in N·m: a tenth of the largest, so that nobody is braked unasked. A stuck leg
    /// leaves no such choice, and the short circuit's torque peaks at a few per cent of the speed. Where the EMF leaves no safe state but the short
    /// circuit, it is what that forces on the machine, if that is more.
    fn safe_torque_limit_nm(&self, case: &Case, seen: &Seen, speed_rpm: f64) -> f64 {
        let usual_nm = 0.1 * self.machine.folder.parameters.max_torque_nm;
        match case.fault.cause {
            // A line that goes on falling after the gates are off finally drops below the EMF.
            Cause::Bench(Kind::Gate(..) | Kind::Device(_) | Kind::Supply(_)) => f64::INFINITY,
            _ if is_shorted(seen) && self.must_be_shorted(case, speed_rpm) => {
                usual_nm.max(FORCED * self.short_circuit_nm(case, speed_rpm))
            }
            _ => usual_nm,
        }
    }

    /// `true` if the drive's rule for the safe state leaves no other at a speed in r/min. A drive that has lost the angle may choose it elsewhere, too.
    fn must_be_shorted(&self, case: &Case, speed_rpm: f64) -> bool {
        let nominal_v = self.machine.folder.parameters.dc_link_nominal_v;
        let link_share = case.conditions.line_v.map_or(1.0, |line_v| line_v / nominal_v);
        speed_rpm.abs() > SHORTED_FROM * link_share.min(1.0) * self.rectifying_rpm()
    }

    /// The torque by which the case's machine brakes in a short circuit at a speed in r/min, in N·m: that of steady state. The flux linkage from before
    /// decays with L/R, which is a few turns wherever this torque exceeds a tenth: over before the torque is averaged, but for the margin.
    fn short_circuit_nm(&self, case: &Case, speed_rpm: f64) -> f64 {
        let stator = Stator::new(&self.machine.folder, &case.machine());
        let omega = speed_rpm * TAU / 60.0 * f64::from(self.machine.folder.parameters.pole_pairs);
        let (id_a, iq_a) = stator.short_circuit_a(omega);
        stator.torque_nm(id_a, iq_a).abs()
    }

    /// The rise of the link between a sample at the trip level and safe gates, in V.
    fn link_rise_v(&self, capacitance_f: f64) -> f64 {
        let most_a = 2.0 * CURRENT_SHARE * self.machine.folder.parameters.trip_current_a;
        let time_s = f64::from(self.clock.control_s()) + SAFE_STATE_S;
        most_a / capacitance_f * time_s
    }

    /// The highest link voltage to expect once the gates are safe, in V: that to which the line and its choke charge the capacitor, plus the
    /// energy in the machine's field and the energy that its rotor gives while the field decays; or that which the diodes rectify. Below
    /// its trip level the link is not restricted.
    fn forced_udc_v(&self, case: &Case, observed: &Observed) -> f64 {
        let pole_pairs = f64::from(self.machine.folder.parameters.pole_pairs);
        let omega = case.fastest_rpm() * TAU / 60.0 * pole_pairs;
        let rectified_v = 3.0_f64.sqrt()
            * omega
            * case.conditions.flux_scale
            * f64::from(self.machine.tables.ratings.magnet_flux_wb);
        let capacitance_f = case.conditions.filter.capacitance_f;
        let field_v = (2.0 * observed.stored.field_j / capacitance_f).sqrt();
        let braked_v = (2.0 * observed.stored.braked_j / capacitance_f).sqrt();
        let charged_v = observed.stored.unloaded_v.hypot(field_v).hypot(braked_v);
        let highest_v = self.machine.folder.parameters.trip_dc_over_v;
        (FORCED * charged_v.max(rectified_v)).max(highest_v)
    }
}

/// `true` if the safe state is a short circuit.
fn is_shorted(seen: &Seen) -> bool {
    seen.trip.is_some_and(|trip| trip.safe != SafeState::GatesOff)
}

/// Share of the speed at which the diodes begin to rectify from which on the drive shorts the machine.
const SHORTED_FROM: f64 = 0.9;
/// The speed tracker's lag, in s: 2/500 rad/s.
const TRACKING_S: f64 = 4e-3;
/// The largest current between two samples of which neither is above the trip level, as a ratio to that level.
const BETWEEN_SAMPLES: f64 = 1.1;
/// Delay from an interrupt's instant to the gates, in s.
const SAFE_STATE_S: f64 = 25e-6;
