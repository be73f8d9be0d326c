//! What can go wrong with the PMaSynRM drive.

use crate::campaign::fault::{BENT, Named, SensorErrors, UNFELT};
use crate::inject::ControlFault;
use crate::inject::sensor::{AngleFault, CurrentFault};
use crate::inject::traction::{Kind, SupplyFault};
use crate::trace::GATES;
use tractive::protection::Fault;

/// What a fault is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Cause {
    /// Something on the bench.
    Bench(Kind),
    /// True flux linkage over the map's, resistance over the rating.
    Machine(f64, f64),
    /// The rotor runs away.
    Runaway,
}

/// What the current sensors do wrong; their converters' range is a quarter above the trip level.
const SENSORS: SensorErrors = SensorErrors { offset_a: 60.0, scale: 1.5, noise_a: 30.0, range_a: 379.2 };

/// Mean torque error where the machine differs by a fifth from its map, as a share of the largest torque.
const ANOTHER_MACHINE: f64 = 0.25;

/// Every fault, in its order.
pub(super) fn faults() -> Vec<Named<Cause>> {
    let mut list = Vec::new();
    let mut add = |name: &str, cause, names, torque_share, fast| {
        list.push(Named::new(name, cause, names, torque_share, fast));
    };
    add("none", Cause::Bench(Kind::Elsewhere), &[], Some(UNFELT), true);
    for (phase, letter) in ["u", "v", "w"].into_iter().enumerate() {
        let mut sensor = |what: &str, fault, names, share| {
            let cause = Cause::Bench(Kind::Current(phase, fault));
            add(&format!("current-{letter}-{what}"), cause, names, share, phase == 0);
        };
        for (what, fault, names, share) in SENSORS.failures() {
            sensor(what, fault, names, share);
        }
        sensor("not-finite", CurrentFault::NotFinite, &[Fault::NotFinite], None);
    }
    let small = |fault| Cause::Bench(Kind::Current(1, fault));
    add("current-v-offset-5A", small(CurrentFault::Offset(5.0)), &[], Some(BENT), true);
    add("current-v-scaled-3%", small(CurrentFault::Scaled(1.03)), &[], Some(BENT), true);
    add("current-v-noisy-2A", small(CurrentFault::Noisy(2.0)), &[], Some(UNFELT), true);
    const LOST: &[Fault] = &[Fault::AngleLost, Fault::Frozen];
    const PUSHED: &[Fault] = &[Fault::AngleLost, Fault::Frozen, Fault::Overcurrent];
    let angle = |fault| Cause::Bench(Kind::Angle(fault));
    add("angle-frozen", angle(AngleFault::Frozen), LOST, None, true);
    add("angle-jump", angle(AngleFault::Jump(90.0)), LOST, None, true);
    add("angle-glitches", angle(AngleFault::Glitches(40.0, 50)), LOST, None, true);
    add("angle-reversed", angle(AngleFault::Reversed), LOST, None, true);
    // At rest these cannot be told from a rotor that stands: they come with one that is pushed off.
    add("angle-frozen-at-rest", angle(AngleFault::Frozen), PUSHED, None, true);
    add("angle-reversed-at-rest", angle(AngleFault::Reversed), PUSHED, None, true);
    add("angle-late", angle(AngleFault::Late(5)), LOST, Some(BENT), true);
    add("angle-off-2deg", angle(AngleFault::Jump(2.0)), &[], Some(BENT), true);
    let supply = |fault| Cause::Bench(Kind::Supply(fault));
    const LINK: &[Fault] = &[Fault::DcOvervoltage, Fault::DcUndervoltage];
    add("link-lost", supply(SupplyFault::Lost), LINK, Some(UNFELT), true);
    const OVER: &[Fault] = &[Fault::DcOvervoltage, Fault::Overcurrent];
    add("link-over", supply(SupplyFault::To(2300.0)), OVER, None, true);
    add("link-under", supply(SupplyFault::To(600.0)), &[Fault::DcUndervoltage], None, true);
    const SWINGS: &[Fault] = &[Fault::DcOvervoltage, Fault::DcUndervoltage, Fault::Overcurrent];
    add("link-swings", supply(SupplyFault::Swinging(300.0, 40.0)), SWINGS, Some(UNFELT), true);
    add("link-sways", supply(SupplyFault::Swinging(150.0, 16.7)), &[], Some(BENT), true);
    add("overspeed", Cause::Runaway, &[Fault::Overspeed], None, true);
    for (gate, name) in (0_u8..).zip(GATES) {
        let gate_fault = |on| Cause::Bench(Kind::Gate(gate, on));
        let first = gate < 2;
        add(&format!("{name}-stuck-on"), gate_fault(true), &[Fault::DriverBlocked], None, first);
        add(&format!("{name}-stuck-off"), gate_fault(false), &[Fault::LegStuck], Some(UNFELT), first);
        add(
            &format!("{name}-shorted"),
            Cause::Bench(Kind::Device(gate)),
            &[Fault::DriverBlocked],
            None,
            first,
        );
    }
    for (leg, letter) in ["u", "v", "w"].into_iter().enumerate() {
        let cause = Cause::Bench(Kind::Feedback(leg));
        add(&format!("leg-{letter}-feedback"), cause, &[Fault::LegStuck], None, leg == 0);
    }
    let late = Cause::Bench(Kind::Control(ControlFault::Late(100)));
    add("control-late", late, &[Fault::ControlDeadline], None, true);
    add(
        "commands-lost",
        Cause::Bench(Kind::Control(ControlFault::Stopped)),
        &[Fault::StaleCommand],
        None,
        true,
    );
    add("demand-not-finite", Cause::Bench(Kind::DemandNotFinite), &[Fault::NotFinite], None, true);
    const CURRENT: &[Fault] = &[Fault::Overcurrent];
    add("flux-20%-more", Cause::Machine(1.2, 1.0), CURRENT, Some(ANOTHER_MACHINE), true);
    add("flux-20%-less", Cause::Machine(0.8, 1.0), CURRENT, Some(ANOTHER_MACHINE), true);
    add("resistance-doubled", Cause::Machine(1.0, 2.0), CURRENT, Some(BENT), true);
    list
}
