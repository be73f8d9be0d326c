//! What can go wrong with the ZS9.

use crate::campaign::fault::{BENT, Named, SensorErrors, UNFELT};
use crate::inject::ControlFault;
use crate::inject::sensor::{AngleFault, CurrentFault};
use crate::inject::zs9::Kind;
use tractive::nine_switch::GATES;
use tractive::protection::Fault;

/// What a fault is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Cause {
    /// Something on the bench.
    Bench(Kind),
    /// True flux linkage over the map's.
    Flux(f64),
    /// The rotor of motor 0 or 1 runs away.
    Runaway(usize),
}

/// What the current sensors do wrong; their converters' range is a quarter above the trip level.
const SENSORS: SensorErrors = SensorErrors { offset_a: 25.0, scale: 1.6, noise_a: 12.0, range_a: 138.1 };

/// Mean torque error where the machine differs by a fifth from its map, as a share of the largest torque. At 1,000 r/min a fifth more
/// flux needs more voltage than there is; the torque is then what is left.
const ANOTHER_MACHINE: f64 = 0.45;

/// Every fault, in its order.
pub(super) fn faults() -> Vec<Named<Cause>> {
    let mut list = Vec::new();
    let mut add = |name: &str, cause, names, torque_share, fast| {
        list.push(Named::new(name, cause, names, torque_share, fast));
    };
    add("none", Cause::Bench(Kind::Elsewhere), &[], Some(UNFELT), true);
    const LOST: [&[Fault]; 2] = [&[Fault::SensorLost1], &[Fault::SensorLost2]];
    for (motor, lost) in LOST.into_iter().enumerate() {
        for (phase, letter) in ["u", "v", "w"].into_iter().enumerate() {
            for (what, fault, names, share) in SENSORS.failures() {
                let cause = Cause::Bench(Kind::Current(motor, phase, fault));
                add(&format!("current-{letter}{}-{what}", motor + 1), cause, names, share, motor == phase);
            }
        }
        let angle = |fault| Cause::Bench(Kind::Angle(motor, fault));
        let number = motor + 1;
        let mut sensor = |what: &str, fault, names, share| {
            add(&format!("angle-{number}-{what}"), angle(fault), names, share, true);
        };
        sensor("frozen", AngleFault::Frozen, lost, None);
        sensor("jump", AngleFault::Jump(90.0), lost, None);
        sensor("glitches", AngleFault::Glitches(60.0, 50), lost, None);
        sensor("reversed", AngleFault::Reversed, lost, None);
        sensor("late", AngleFault::Late(10), lost, Some(BENT));
    }
    add("angle-1-lost", Cause::Bench(Kind::SensorLost1), LOST[0], None, true);
    add("angle-2-lost", Cause::Bench(Kind::SensorLost2), LOST[1], None, true);
    add("current-v2-not-finite", Cause::Bench(Kind::NotFinite), &[Fault::NotFinite], None, true);
    let small = |fault| Cause::Bench(Kind::Current(1, 1, fault));
    add("current-v2-offset-2A", small(CurrentFault::Offset(2.0)), &[], Some(BENT), true);
    add("current-v2-noisy-0.5A", small(CurrentFault::Noisy(0.5)), &[], Some(UNFELT), true);
    const SOURCE: &[Fault] = &[Fault::SourceUndervoltage];
    add("source-low", Cause::Bench(Kind::SourceLow), SOURCE, None, true);
    const HIGH: &[Fault] = &[Fault::CapacitorOvervoltage, Fault::DutyRange];
    add("source-high", Cause::Bench(Kind::SourceHigh), HIGH, None, true);
    const CUT: &[Fault] = &[Fault::SourceUndervoltage, Fault::CapacitorOvervoltage, Fault::DutyRange];
    // Where a motor gives what the other losses take, nothing changes.
    add("source-lost", Cause::Bench(Kind::SourceLost), CUT, Some(UNFELT), true);
    add("source-shorted", Cause::Bench(Kind::SourceShort), SOURCE, None, true);
    add("source-swings", Cause::Bench(Kind::SourceSwings(30.0, 50.0)), HIGH, Some(UNFELT), true);
    add("source-switch-open", Cause::Bench(Kind::SourceSwitchOpen), HIGH, Some(UNFELT), true);
    add("capacitors-halved", Cause::Bench(Kind::CapacitorsHalved), HIGH, Some(UNFELT), true);
    add("link-out-of-range", Cause::Bench(Kind::LinkOutOfRange), &[Fault::DutyRange], None, true);
    const STUCK: &[Fault] = &[Fault::LegStuck];
    for (gate, name) in (0_u8..).zip(GATES) {
        let name = name.to_lowercase();
        let fast = usize::from(gate).is_multiple_of(4);
        add(&format!("{name}-stuck-on"), Cause::Bench(Kind::Gate(gate, true)), STUCK, None, fast);
        add(&format!("{name}-stuck-off"), Cause::Bench(Kind::Gate(gate, false)), STUCK, None, fast);
    }
    for (leg, letter) in (0_u8..).zip(["u", "v", "w"]) {
        let cause = Cause::Bench(Kind::ShootThrough(leg));
        add(&format!("shoot-through-{letter}"), cause, STUCK, None, leg == 1);
    }
    add("leg-v-feedback", Cause::Bench(Kind::LegStuckOn), STUCK, None, true);
    add("leg-w-feedback", Cause::Bench(Kind::LegStuckOff), STUCK, None, true);
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
    for motor in [0, 1] {
        let name = format!("overspeed-{}", motor + 1);
        add(&name, Cause::Runaway(motor), &[Fault::Overspeed], None, true);
    }
    const CURRENT: &[Fault] = &[Fault::Overcurrent];
    add("flux-20%-more", Cause::Flux(1.2), CURRENT, Some(ANOTHER_MACHINE), true);
    add("flux-20%-less", Cause::Flux(0.8), CURRENT, Some(ANOTHER_MACHINE), true);
    list
}
