//! The operating points at which the faults of the PMaSynRM drive occur.

use super::conditions::Conditions;
use super::faults::{Cause, faults};
use super::{Drive, STAGES};
use crate::campaign::Action;
use crate::campaign::action::{LEAD_S, fault_s};
use crate::campaign::fault::Named;
use crate::inject::sensor::AngleFault;
use crate::inject::traction::Kind;
use crate::plant::PlantSettings;

/// A speed, and the share of the torque envelope that is demanded there.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// In r/min.
    pub speed_rpm: f64,
    /// Share of the envelope, motoring and braking.
    pub share: f64,
    /// `true` if the point belongs to the fast campaign.
    pub fast: bool,
}

const fn point(speed_rpm: f64, share: f64, fast: bool) -> Point {
    Point { speed_rpm, share, fast }
}

/// The points at which the faults occur, for a machine of 6,000 r/min: every mode of the 180 kW machine at several speeds. Square-wave
/// patterns need torque below 4,455 r/min.
const POINTS: [Point; 18] = [
    point(0.0, 0.8, false),
    point(100.0, 0.8, false),
    point(300.0, 0.8, true),
    point(550.0, 0.8, false),
    point(640.0, 0.8, false),
    point(850.0, 0.8, true),
    point(930.0, 0.5, false),
    point(1080.0, 0.5, true),
    point(1200.0, 0.5, false),
    point(1700.0, 0.5, true),
    point(-1700.0, 0.5, false),
    point(1950.0, 0.4, false),
    point(2800.0, 0.4, true),
    point(2000.0, 1.0, false),
    point(3000.0, 0.8, false),
    point(4500.0, 0.8, false),
    point(5500.0, 0.8, false),
    point(6000.0, 0.8, true),
];

/// Speed from which on a rotor runs away, in r/min of such a machine: it must exceed 6,600 in time.
pub(super) const RUNAWAY_FROM_RPM: f64 = 5_000.0;

impl Named<Cause> {
    /// `true` if the fault occurs at rest and the rotor is then pushed.
    pub(super) fn needs_rest(&self) -> bool {
        self.name.ends_with("at-rest")
    }

    /// `true` if the fault can occur at a point of a machine of 6,000 r/min.
    fn fits(&self, point: &Point) -> bool {
        let speed_rpm = point.speed_rpm.abs();
        match self.cause {
            Cause::Runaway => speed_rpm >= RUNAWAY_FROM_RPM,
            Cause::Bench(Kind::Angle(AngleFault::Frozen | AngleFault::Reversed)) => {
                self.needs_rest() == (speed_rpm == 0.0)
            }
            _ => true,
        }
    }
}

/// One run.
#[derive(Clone, Debug)]
pub struct Case {
    pub(super) fault: Named<Cause>,
    pub(super) point: Point,
    pub(super) action: Action,
    /// The time of the fault, in s.
    pub(super) at_s: f64,
    /// Everything else about it.
    pub(super) conditions: Conditions,
}

impl Case {
    /// The name that a filter searches.
    pub fn name(&self) -> String {
        format!("pmasynrm {} {} {}", self.fault.name, self.point.speed_rpm, self.action.name())
    }

    /// The true machine of the case, as it deviates from its folder.
    pub(super) fn machine(&self) -> PlantSettings {
        let (flux_scale, resistance_scale) = match self.fault.cause {
            Cause::Machine(flux_scale, resistance_scale) => (flux_scale, resistance_scale),
            _ => (self.conditions.flux_scale, self.conditions.resistance_scale),
        };
        PlantSettings { flux_scale, resistance_scale, ..PlantSettings::default() }
    }

    /// The highest speed of the rotor as prescribed for the case, in r/min.
    pub(super) fn fastest_rpm(&self) -> f64 {
        let gained = self.conditions.acceleration_rpm_s * (STAGES.end_s - self.at_s);
        self.point.speed_rpm.abs().max((self.point.speed_rpm + gained).abs())
    }
}

impl Drive {
    /// Every case of its machine; the fast ones are each fault of each kind in each mode.
    pub fn cases(&self, fast: bool) -> Vec<Case> {
        // Above this speed the EMF exceeds the link, and the drive shorts the machine before its operator can enable it.
        let operated_to_rpm = self.rectifying_rpm();
        let most_rpm = self.most_rpm().unwrap_or(f64::INFINITY);
        let can_come = |fault: &Named<Cause>, speed_rpm: f64| {
            let is_operated = matches!(fault.cause, Cause::Sensor(..));
            speed_rpm.abs() <= most_rpm && !(is_operated && speed_rpm.abs() > operated_to_rpm)
        };
        let mut list = Vec::new();
        let places = POINTS.into_iter().flat_map(|point| Action::ALL.map(|action| (point, action)));
        for fault in faults(&self.scale) {
            for (point, action) in places.clone() {
                let speed_rpm = self.scale.speed * point.speed_rpm;
                let slow = fault.needs_rest() || fault.cause == Cause::Runaway;
                let chosen = !fast || (fault.fast && (point.fast || slow));
                if !chosen || !fault.fits(&point) || !can_come(&fault, speed_rpm) {
                    continue;
                }
                let at_s = match fault.cause {
                    // The machine differs from the beginning.
                    Cause::Machine(..) => -LEAD_S,
                    _ => fault_s(list.len()),
                };
                let conditions = Conditions { filter: self.scale.filter(), ..Conditions::SOUND };
                let point = Point { speed_rpm, ..point };
                list.push(Case { fault: fault.clone(), point, action, at_s, conditions });
            }
        }
        list
    }
}
