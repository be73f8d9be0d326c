//! The faults of the PMaSynRM drive.

use super::scale::Scale;
use crate::campaign::fault::{BENT, Faults, Named, SensorErrors, UNFELT};
use crate::inject::sensor::{AngleFault, CurrentFault};
use crate::inject::traction::{Kind, SupplyFault};
use crate::plant::Wire;
use crate::trace::GATES;
use tractive::protection::Fault;

/// The cause of a fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cause {
    /// Something on the bench.
    Bench(Kind),
    /// True flux linkage over the map's, resistance over the rating.
    Machine(f64, f64),
    /// The rotor runs away.
    Runaway,
    /// The wire of a temperature sensor: the winding's (0) or the heat sink's (1).
    Sensor(usize, Wire),
}

/// The errors of the 180 kW machine's current sensors; their converters' range is a quarter above the trip level.
const SENSORS: SensorErrors = SensorErrors { offset_a: 60.0, scale: 1.5, noise_a: 30.0, range_a: 379.2 };
/// The errors of one of them that need not be noticeable, in A.
const SMALL_OFFSET_A: f64 = 5.0;
const SMALL_NOISE_A: f64 = 2.0;

/// Mean torque error if the machine differs by a fifth from its map, as a share of the largest torque.
const ANOTHER_MACHINE: f64 = 0.25;

impl From<Kind> for Cause {
    fn from(kind: Kind) -> Self {
        Self::Bench(kind)
    }
}

/// Every fault of a machine, in its order.
pub fn faults(scale: &Scale) -> Vec<Named<Cause>> {
    let mut list = Faults::beginning_with(Kind::Elsewhere);
    currents(&mut list, scale.current);
    angles(&mut list);
    supply(&mut list, scale.voltage);
    list.add("overspeed", Cause::Runaway, &[Fault::Overspeed], None, true);
    legs(&mut list);
    list.add_control(Kind::Control, Kind::DemandNotFinite);
    const CURRENT: &[Fault] = &[Fault::Overcurrent];
    list.add("flux-20%-more", Cause::Machine(1.2, 1.0), CURRENT, Some(ANOTHER_MACHINE), true);
    list.add("flux-20%-less", Cause::Machine(0.8, 1.0), CURRENT, Some(ANOTHER_MACHINE), true);
    list.add("resistance-doubled", Cause::Machine(1.0, 2.0), CURRENT, Some(BENT), true);
    temperatures(&mut list);
    list.0
}

/// The temperature sensors, a thermistor and a PT1000, so that each way of failing looks cold once and hot once.
fn temperatures(list: &mut Faults<Cause>) {
    const WINDING: &[Fault] = &[Fault::WindingSensor];
    const SINK: &[Fault] = &[Fault::HeatSinkSensor];
    for (place, sensor, names) in [(0, "winding", WINDING), (1, "heat-sink", SINK)] {
        let wires = [
            ("unplugged", Wire::Unplugged),
            ("shorted", Wire::Shorted),
            ("too-cold", Wire::Shows(-45.0)),
            ("too-hot", Wire::Shows(230.0)),
        ];
        for (what, wire) in wires {
            let name = format!("{sensor}-sensor-{what}");
            list.add(&name, Cause::Sensor(place, wire), names, None, what == "unplugged");
        }
    }
}

/// The current sensors, for this multiple of the 180 kW machine's currents.
fn currents(list: &mut Faults<Cause>, scale: f64) {
    let sensors = SENSORS.times(scale);
    for (phase, letter) in ["u", "v", "w"].into_iter().enumerate() {
        let not_finite = ("not-finite", CurrentFault::NotFinite, &[Fault::NotFinite][..], None);
        for (what, fault, names, share) in sensors.failures().into_iter().chain([not_finite]) {
            let name = format!("current-{letter}-{what}");
            list.add(&name, Kind::Current(phase, fault), names, share, phase == 0);
        }
    }
    let small = |fault| Kind::Current(1, fault);
    let [offset_a, noise_a] = [SMALL_OFFSET_A, SMALL_NOISE_A].map(|of_a| two_digits(scale * of_a));
    let offset = small(CurrentFault::Offset(offset_a));
    list.add(&format!("current-v-offset-{offset_a}A"), offset, &[], Some(BENT), true);
    list.add("current-v-scaled-3%", small(CurrentFault::Scaled(1.03)), &[], Some(BENT), true);
    let noisy = small(CurrentFault::Noisy(noise_a));
    list.add(&format!("current-v-noisy-{noise_a}A"), noisy, &[], Some(UNFELT), true);
}

/// A value above 0, to two digits.
fn two_digits(value: f64) -> f64 {
    let steps_per_one = 10.0_f64.powi(1 - value.log10().floor() as i32);
    (value * steps_per_one).round() / steps_per_one
}

/// The angle sensor.
fn angles(list: &mut Faults<Cause>) {
    const LOST: &[Fault] = &[Fault::AngleLost, Fault::Frozen, Fault::VoltageUnexplained];
    const PUSHED: &[Fault] =
        &[Fault::AngleLost, Fault::Frozen, Fault::VoltageUnexplained, Fault::Overcurrent];
    list.add("angle-frozen", Kind::Angle(AngleFault::Frozen), LOST, None, true);
    list.add("angle-jump", Kind::Angle(AngleFault::Jump(90.0)), LOST, None, true);
    list.add("angle-glitches", Kind::Angle(AngleFault::Glitches(40.0, 50)), LOST, None, true);
    list.add("angle-reversed", Kind::Angle(AngleFault::Reversed), LOST, None, true);
    // At rest these cannot be told from a standing rotor, so here the rotor is pushed.
    list.add("angle-frozen-at-rest", Kind::Angle(AngleFault::Frozen), PUSHED, None, true);
    list.add("angle-reversed-at-rest", Kind::Angle(AngleFault::Reversed), PUSHED, None, true);
    list.add("angle-late", Kind::Angle(AngleFault::Late(5)), LOST, Some(BENT), true);
    list.add("angle-missing", Kind::AngleMissing, &[Fault::PositionSensor], None, true);
    list.add("angle-off-2deg", Kind::Angle(AngleFault::Jump(2.0)), &[], Some(BENT), true);
}

/// The line and its link, for this multiple of the 180 kW machine's voltage.
fn supply(list: &mut Faults<Cause>, scale: f64) {
    const LINK: &[Fault] = &[Fault::DcOvervoltage, Fault::DcUndervoltage];
    const OVER: &[Fault] = &[Fault::DcOvervoltage, Fault::Overcurrent];
    // The EMF that the link no longer holds back drives as much current in the same period.
    const UNDER: &[Fault] = &[Fault::DcUndervoltage, Fault::Overcurrent];
    const SWINGS: &[Fault] = &[Fault::DcOvervoltage, Fault::DcUndervoltage, Fault::Overcurrent];
    let swinging = |amplitude_v, hz| Kind::Supply(SupplyFault::Swinging(scale * amplitude_v, hz));
    list.add("link-lost", Kind::Supply(SupplyFault::Lost), LINK, Some(UNFELT), true);
    list.add("link-over", Kind::Supply(SupplyFault::To(scale * 2_300.0)), OVER, None, true);
    list.add("link-under", Kind::Supply(SupplyFault::To(scale * 600.0)), UNDER, None, true);
    list.add("link-swings", swinging(300.0, 40.0), SWINGS, Some(UNFELT), true);
    list.add("link-sways", swinging(150.0, 16.7), &[], Some(BENT), true);
}

/// Gates, devices, and what watches them.
fn legs(list: &mut Faults<Cause>) {
    const BLOCKED: &[Fault] = &[Fault::DriverBlocked];
    const STUCK: &[Fault] = &[Fault::LegStuck];
    // With three pulses a turn a boundary comes every 0.6 ms: the phase current may reach its trip level before a boundary sees the leg.
    // Without current the leg shows nothing, and its phase takes no part in the voltage.
    const OPEN: &[Fault] = &[Fault::LegStuck, Fault::Overcurrent, Fault::VoltageUnexplained];
    for (gate, name) in (0_u8..).zip(GATES) {
        let first = gate < 2;
        list.add(&format!("{name}-stuck-on"), Kind::Gate(gate, true), BLOCKED, None, first);
        list.add(&format!("{name}-stuck-off"), Kind::Gate(gate, false), OPEN, Some(UNFELT), first);
        list.add(&format!("{name}-shorted"), Kind::Device(gate), BLOCKED, None, first);
    }
    for (leg, letter) in ["u", "v", "w"].into_iter().enumerate() {
        list.add(&format!("leg-{letter}-feedback"), Kind::Feedback(leg), STUCK, None, leg == 0);
    }
}
