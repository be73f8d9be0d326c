//! The faults of the ZS9.

use crate::campaign::fault::{BENT, Faults, Named, SensorErrors, UNFELT};
use crate::inject::network::NetworkFault;
use crate::inject::sensor::{AngleFault, CurrentFault};
use crate::inject::zs9::Kind;
use tractive::nine_switch::GATES;
use tractive::protection::Fault;

/// The cause of a fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cause {
    /// Something on the bench.
    Bench(Kind),
    /// True flux linkage over the map's.
    Flux(f64),
    /// The rotor of motor 0 or 1 runs away.
    Runaway(usize),
}

/// The errors of the current sensors; their converters' range is a quarter above the trip level.
const SENSORS: SensorErrors = SensorErrors { offset_a: 25.0, scale: 1.6, noise_a: 12.0, range_a: 138.1 };

/// Mean torque error if the machine differs by a fifth from its map, as a share of the largest torque. At 1,000 r/min a fifth more
/// flux needs more voltage than is available; the torque is then what remains possible.
const ANOTHER_MACHINE: f64 = 0.45;

impl From<Kind> for Cause {
    fn from(kind: Kind) -> Self {
        Self::Bench(kind)
    }
}

/// Every fault, in its order.
pub fn faults() -> Vec<Named<Cause>> {
    let mut list = Faults::beginning_with(Kind::Elsewhere);
    sensors(&mut list);
    source(&mut list);
    legs(&mut list);
    list.add_control(Kind::Control, Kind::DemandNotFinite);
    for motor in [0, 1] {
        let name = format!("overspeed-{}", motor + 1);
        list.add(&name, Cause::Runaway(motor), &[Fault::Overspeed], None, true);
    }
    const CURRENT: &[Fault] = &[Fault::Overcurrent];
    list.add("flux-20%-more", Cause::Flux(1.2), CURRENT, Some(ANOTHER_MACHINE), true);
    list.add("flux-20%-less", Cause::Flux(0.8), CURRENT, Some(ANOTHER_MACHINE), true);
    // At the end: a case's place decides the instant of its fault.
    network(&mut list);
    list.0
}

/// Both motors' sensors.
fn sensors(list: &mut Faults<Cause>) {
    const LOST: [&[Fault]; 2] = [&[Fault::SensorLost1], &[Fault::SensorLost2]];
    for (motor, lost) in LOST.into_iter().enumerate() {
        let number = motor + 1;
        for (phase, letter) in ["u", "v", "w"].into_iter().enumerate() {
            for (what, fault, names, share) in SENSORS.failures() {
                let name = format!("current-{letter}{number}-{what}");
                list.add(&name, Kind::Current(motor, phase, fault), names, share, motor == phase);
            }
        }
        for (what, fault, share) in [
            ("frozen", AngleFault::Frozen, None),
            ("jump", AngleFault::Jump(90.0), None),
            ("glitches", AngleFault::Glitches(60.0, 50), None),
            ("reversed", AngleFault::Reversed, None),
            ("late", AngleFault::Late(10), Some(BENT)),
        ] {
            list.add(&format!("angle-{number}-{what}"), Kind::Angle(motor, fault), lost, share, true);
        }
    }
    list.add("angle-1-lost", Kind::SensorLost1, LOST[0], None, true);
    list.add("angle-2-lost", Kind::SensorLost2, LOST[1], None, true);
    list.add("current-v2-not-finite", Kind::NotFinite, &[Fault::NotFinite], None, true);
    let small = |fault| Kind::Current(1, 1, fault);
    list.add("current-v2-offset-2A", small(CurrentFault::Offset(2.0)), &[], Some(BENT), true);
    list.add("current-v2-noisy-0.5A", small(CurrentFault::Noisy(0.5)), &[], Some(UNFELT), true);
}

/// Source and network.
fn source(list: &mut Faults<Cause>) {
    const SOURCE: &[Fault] = &[Fault::SourceUndervoltage];
    const HIGH: &[Fault] = &[Fault::CapacitorOvervoltage, Fault::DutyRange];
    // Without the switch the link voltage is not the one that capacitors and source imply.
    const OPEN: &[Fault] = &[Fault::CapacitorOvervoltage, Fault::DutyRange, Fault::VoltageUnexplained];
    const CUT: &[Fault] = &[Fault::SourceUndervoltage, Fault::CapacitorOvervoltage, Fault::DutyRange];
    list.add("source-low", Kind::SourceLow, SOURCE, None, true);
    list.add("source-high", Kind::SourceHigh, HIGH, None, true);
    // If a motor supplies what the other losses take, nothing changes.
    list.add("source-lost", Kind::SourceLost, CUT, Some(UNFELT), true);
    list.add("source-shorted", Kind::SourceShort, SOURCE, None, true);
    list.add("source-swings", Kind::SourceSwings(30.0, 50.0), HIGH, Some(UNFELT), true);
    list.add("source-switch-open", Kind::SourceSwitchOpen, OPEN, Some(UNFELT), true);
    list.add("capacitors-halved", Kind::CapacitorsHalved, HIGH, Some(UNFELT), true);
    list.add("link-out-of-range", Kind::LinkOutOfRange, &[Fault::DutyRange], None, true);
}

/// The network's sensors.
fn network(list: &mut Faults<Cause>) {
    const LOW: &[Fault] = &[Fault::LinkImplausible];
    // The current loop drives the inductors blindly, and overcharges the capacitors.
    const BLIND: &[Fault] = &[Fault::CapacitorOvervoltage];
    for (what, fault, names, share) in [
        ("capacitor-75%", NetworkFault::CapacitorScaled(0.75), LOW, None),
        // Less than what dead times that nobody tells may hide, and far from the trip level.
        ("capacitor-90%", NetworkFault::CapacitorScaled(0.9), LOW, Some(BENT)),
        // As long as nothing changes, the duty is right.
        ("capacitor-frozen", NetworkFault::CapacitorFrozen, LOW, Some(UNFELT)),
        ("source-125%", NetworkFault::SourceScaled(1.25), LOW, None),
        ("source-75%", NetworkFault::SourceScaled(0.75), LOW, Some(UNFELT)),
        ("inductor-dead", NetworkFault::InductorDead, BLIND, None),
        ("inductor-reversed", NetworkFault::InductorReversed, BLIND, None),
        ("inductor-not-finite", NetworkFault::InductorNotFinite, &[Fault::NotFinite], None),
    ] {
        list.add(&format!("network-{what}"), Kind::Network(fault), names, share, true);
    }
}

/// Gates, legs, and what watches them.
fn legs(list: &mut Faults<Cause>) {
    const STUCK: &[Fault] = &[Fault::LegStuck];
    for (gate, name) in (0_u8..).zip(GATES.map(str::to_lowercase)) {
        let fast = usize::from(gate).is_multiple_of(4);
        list.add(&format!("{name}-stuck-on"), Kind::Gate(gate, true), STUCK, None, fast);
        list.add(&format!("{name}-stuck-off"), Kind::Gate(gate, false), STUCK, None, fast);
    }
    for (leg, letter) in (0_u8..).zip(["u", "v", "w"]) {
        list.add(&format!("shoot-through-{letter}"), Kind::ShootThrough(leg), STUCK, None, leg == 1);
    }
    list.add("leg-v-feedback", Kind::LegStuckOn, STUCK, None, true);
    list.add("leg-w-feedback", Kind::LegStuckOff, STUCK, None, true);
}
