//! Temperatures of a traction machine and its inverter, in the rig's simulation and in the drive's model.

use crate::plant::{HeatSettings, Node};
use tractive::thermal::{Derating, DeviceLosses, Element, Magnets, Rise, Sensor, Thermal};

/// The sensor in the winding.
pub const PT1000: Sensor = Sensor { element: Element::Pt1000, series_ohm: 1e3, range_c: [-40.0, 220.0] };
/// The sensor on the heat sink.
pub const NTC: Sensor = Sensor {
    element: Element::Ntc { at_25_ohm: 10e3, beta_k: 3_435.0 },
    series_ohm: 4.7e3,
    range_c: [-40.0, 130.0],
};
/// The devices' losses.
pub const LOSSES: DeviceLosses = DeviceLosses { threshold_v: 1.0, slope_ohm: 5e-3, switching_share: 1e-3 };

/// The drive's knowledge of the 180 kW machine and its inverter.
pub const THERMAL: Thermal = Thermal {
    winding_sensor: PT1000,
    heat_sink_sensor: NTC,
    resistance_ohm: 0.1,
    winding: Rise { k_per_w: 5e-3, time_s: 60.0 },
    junction: Rise { k_per_w: 0.06, time_s: 0.1 },
    losses: LOSSES,
    winding_derating: Derating { from_c: 180.0, none_c: 200.0 },
    winding_trip_c: 210.0,
    junction_derating: Derating { from_c: 125.0, none_c: 140.0 },
    junction_trip_c: 150.0,
    magnets: Some(Magnets { per_k: -1e-3, map_c: 20.0, derating: Derating { from_c: 150.0, none_c: 180.0 } }),
};

/// The true values of both, at 20 °C to begin with.
pub const HEAT: HeatSettings = HeatSettings {
    coolant_c: 20.0,
    hottest: Node { j_per_k: 60.0 / 5e-3, k_per_w: 5e-3 },
    stator: Node { j_per_k: 40e3, k_per_w: 0.02 },
    junction: Node { j_per_k: 0.1 / 0.06, k_per_w: 0.06 },
    heat_sink: Node { j_per_k: 10e3, k_per_w: 5e-3 },
    losses: LOSSES,
    magnets_per_k: -1e-3,
    magnets_c: 20.0,
    sensors: [PT1000, NTC],
};
