//! The temperatures of winding, heat sink, junction and magnets: the sensors' readings, the rise from losses at places without a sensor, and the
//! share of the torque that they leave.
//!
//! One pure step per slot of the operator. A sensor that is unplugged, shorted or out of its range is a named fault. A hot part reduces the torque;
//! the drive trips only beyond the temperature at which no torque is left.

#![forbid(unsafe_code)]

mod check;
mod derate;
mod magnet;
mod model;
mod sensor;

pub use derate::Derating;
pub use magnet::Magnets;
pub use model::{DeviceLosses, Rise, copper_factor};
pub use sensor::{Element, Sensor};

use crate::control::Warmth;
use crate::machine::Ratings;
use crate::protection::{FailedCheck, Fault};
use magnet::MagnetState;
use model::RiseState;

/// The thermal properties of machine and power stage.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Thermal {
    /// The sensor in the winding.
    pub winding_sensor: Sensor,
    /// The sensor on the heat sink.
    pub heat_sink_sensor: Sensor,
    /// Stator resistance of a phase at 20 °C, in ohm.
    pub resistance_ohm: f32,
    /// The rise of the winding's hottest place above its sensor, from the copper loss of all phases.
    pub winding: Rise,
    /// The rise of a device's junction above the heat sink, from the loss of one device.
    pub junction: Rise,
    /// Losses of a device.
    pub losses: DeviceLosses,
    /// The torque that a hot winding leaves.
    pub winding_derating: Derating,
    /// The winding's temperature that trips the drive, above the end of derating, in °C.
    pub winding_trip_c: f32,
    /// The torque that a hot junction leaves.
    pub junction_derating: Derating,
    /// The junction's temperature that trips the drive, in °C.
    pub junction_trip_c: f32,
    /// The magnets; `None`: nothing is known of them.
    pub magnets: Option<Magnets>,
}

impl Thermal {
    /// The warmth of a machine's winding, for the control law.
    pub fn warmth(&self, temperatures: &Temperatures, ratings: &Ratings) -> Warmth {
        let resistance_ohm = self.resistance_ohm * copper_factor(temperatures.winding_c);
        Warmth::new(resistance_ohm / ratings.stator_resistance_ohm)
    }
}

/// Time for which a sensor must be wrong, or a part too hot, in s: far below the time that either takes, and longer than a disturbed conversion
/// lasts.
pub const PERSISTENCE_S: f32 = 0.01;

/// The ratios of the voltage across each sensor to the voltage across sensor and series resistor together, in 65,536ths.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Ratios {
    /// The winding's sensor.
    pub winding: u16,
    /// The heat sink's.
    pub heat_sink: u16,
}

/// The drive's load in a slot.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Load {
    /// Largest magnitude of a phase current, in A.
    pub current_a: f32,
    /// Sum of the squares of the phase currents, in A²: the copper loss over the resistance.
    pub squares_a2: f32,
    /// Magnitude of the current's reference, in A: the fundamental's, without ripple.
    pub reference_a: f32,
    /// Voltage of the DC link, in V.
    pub udc_v: f32,
    /// Share by which the flux linkage seems to exceed the map's; 0 while that is not known.
    pub map_error: f32,
    /// The machine's largest current, in A.
    pub max_current_a: f32,
}

/// The temperatures, and the torque that they leave.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Temperatures {
    /// The winding's hottest place, in °C.
    pub winding_c: f32,
    /// Heat sink, in °C.
    pub heat_sink_c: f32,
    /// The hottest junction, in °C.
    pub junction_c: f32,
    /// The magnets, in °C, as last estimated; `None` before.
    pub magnets_c: Option<f32>,
    /// The share of the torque that they leave, 0 ..= 1.
    pub torque_share: f32,
}

/// The state of the temperatures.
#[derive(Clone, Copy, Debug)]
pub struct ThermalState {
    /// The last valid readings, in °C: winding, heat sink.
    read_c: [Option<f32>; 2],
    winding: RiseState,
    junction: RiseState,
    magnets: MagnetState,
    /// Slots for which each failed check has persisted: the sensors in the order of `read_c`, winding, junction.
    lasted: [u32; 4],
}

impl ThermalState {
    /// The state before the first reading, with nothing warmer than its sensor.
    pub const fn new() -> Self {
        let (winding, junction) = (RiseState::NONE, RiseState::NONE);
        Self { read_c: [None; 2], winding, junction, magnets: MagnetState::UNKNOWN, lasted: [0; 4] }
    }

    /// One slot. Returns the temperatures once both sensors have been read, and the first failed check that persists.
    #[inline(never)]
    pub fn step(
        &mut self,
        load: &Load,
        ratios: Ratios,
        thermal: &Thermal,
        slot_s: f32,
    ) -> (Option<Temperatures>, Option<FailedCheck>) {
        let sensors = [
            (Fault::WindingSensor, thermal.winding_sensor.read(ratios.winding)),
            (Fault::HeatSinkSensor, thermal.heat_sink_sensor.read(ratios.heat_sink)),
        ];
        let mut found = [None; 4];
        for ((found, read_c), (fault, read)) in found.iter_mut().zip(&mut self.read_c).zip(sensors) {
            match read {
                Ok(celsius) => *read_c = Some(celsius),
                Err((value_c, limit_c)) => *found = Some((fault, value_c, limit_c)),
            }
        }
        let temperatures = self.temperatures(load, thermal, slot_s);
        if let Some(Temperatures { winding_c, junction_c, .. }) = temperatures {
            let (winding_trip_c, junction_trip_c) = (thermal.winding_trip_c, thermal.junction_trip_c);
            let [.., winding, junction] = &mut found;
            if winding_c > winding_trip_c {
                *winding = Some((Fault::WindingTemperature, winding_c, winding_trip_c));
            }
            if junction_c > junction_trip_c {
                *junction = Some((Fault::JunctionTemperature, junction_c, junction_trip_c));
            }
        }
        (temperatures, self.persistent(&found, slot_s))
    }

    fn temperatures(&mut self, load: &Load, thermal: &Thermal, slot_s: f32) -> Option<Temperatures> {
        let [Some(sensor_c), Some(heat_sink_c)] = self.read_c else {
            return None;
        };
        let ohm = thermal.resistance_ohm * copper_factor(sensor_c + self.winding.kelvin());
        let winding_k = self.winding.step(ohm * load.squares_a2, &thermal.winding, slot_s);
        let device_w = thermal.losses.watts(load.current_a, load.udc_v);
        let junction_k = self.junction.step(device_w, &thermal.junction, slot_s);
        let (winding_c, junction_c) = (sensor_c + winding_k, heat_sink_c + junction_k);
        let magnets_c = thermal.magnets.as_ref().and_then(|magnets| self.magnets.step(load, magnets, slot_s));
        let of_magnets = match (&thermal.magnets, magnets_c) {
            (Some(magnets), Some(celsius)) => magnets.derating.share(celsius),
            _ => 1.0,
        };
        let shares = [thermal.junction_derating.share(junction_c), of_magnets];
        let torque_share =
            shares.into_iter().fold(thermal.winding_derating.share(winding_c), |least, share| {
                if share < least { share } else { least }
            });
        Some(Temperatures { winding_c, heat_sink_c, junction_c, magnets_c, torque_share })
    }

    /// The first failed check that has persisted long enough.
    fn persistent(&mut self, found: &[Option<FailedCheck>; 4], slot_s: f32) -> Option<FailedCheck> {
        let mut first = None;
        for (failed, lasted) in found.iter().zip(&mut self.lasted) {
            *lasted = if failed.is_some() { lasted.saturating_add(1) } else { 0 };
            if first.is_none() && *lasted as f32 * slot_s >= PERSISTENCE_S {
                first = *failed;
            }
        }
        first
    }
}
