//! The keys of the file.

use serde::Deserialize;
use tractive::thermal::{Derating, DeviceLosses, Element, Magnets, Rise, Sensor, Thermal};

/// The keys of the file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Keys {
    pub control_hz: Option<u32>,
    pub dead_time_ns: u32,
    pub min_pulse_ns: Option<u32>,
    pub current_range_a: f64,
    pub zero_code: u16,
    pub zero_tolerance: u16,
    pub dc_link_range_v: f64,
    pub break_current_a: f64,
    pub encoder_counts: Option<u32>,
    pub encoder_index_ab: Option<u32>,
    pub encoder_zeros_deg: Vec<f64>,
    pub precharge_s: f64,
    pub behind_line_filter: Option<bool>,
    pub angle_late_us: Option<f64>,
    pub current_filter_us: Option<f64>,
    pub device_threshold_v: Option<f64>,
    pub device_slope_mohm: Option<f64>,
    pub discharge_s: f64,
    pub z_source: Option<ZSource>,
    pub absolute: Option<Absolute>,
    pub biss: Option<Biss>,
    pub resolver: Option<Resolver>,
    pub thermal: Option<ThermalKeys>,
}

/// An absolute encoder in the place of one that counts.
#[derive(Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Absolute {
    pub bits: u32,
    pub gray: bool,
}

/// An absolute encoder with BiSS-C in its place.
#[derive(Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Biss {
    pub bits: u32,
    pub turns_bits: u32,
}

/// A resolver in its place.
#[derive(Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Resolver {
    pub pole_pairs: u32,
    pub amplitude_v: f64,
    pub lag_us: f64,
}

/// The keys that the ZS9's stage has besides.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ZSource {
    pub inductor_range_a: f64,
    pub source_range_v: f64,
    pub link_ref_v: f64,
}

/// The position sensor of a stage.
pub enum PositionSensor {
    Encoder,
    Absolute(Absolute),
    Biss(Biss),
    Resolver(Resolver),
}

/// The keys of temperature sensors and thermal data.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ThermalKeys {
    winding_sensor: SensorKeys,
    heat_sink_sensor: SensorKeys,
    winding: RiseKeys,
    junction: RiseKeys,
    losses: LossKeys,
    winding_derating_c: [f32; 3],
    junction_derating_c: [f32; 3],
    magnets: Option<MagnetKeys>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SensorKeys {
    ntc: Option<[f32; 2]>,
    series_ohm: f32,
    range_c: [f32; 2],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RiseKeys {
    k_per_w: f32,
    time_s: f32,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LossKeys {
    threshold_v: f32,
    slope_ohm: f32,
    switching_share: f32,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MagnetKeys {
    per_k: f32,
    map_c: f32,
    derating_c: [f32; 2],
}

impl SensorKeys {
    fn sensor(&self) -> Sensor {
        let element =
            self.ntc.map_or(Element::Pt1000, |[at_25_ohm, beta_k]| Element::Ntc { at_25_ohm, beta_k });
        Sensor { element, series_ohm: self.series_ohm, range_c: self.range_c }
    }
}

impl ThermalKeys {
    pub fn thermal(&self, resistance_ohm: f32) -> Thermal {
        let rise = |keys: &RiseKeys| Rise { k_per_w: keys.k_per_w, time_s: keys.time_s };
        let LossKeys { threshold_v, slope_ohm, switching_share } = self.losses;
        let (
            [winding_from_c, winding_none_c, winding_trip_c],
            [junction_from_c, junction_none_c, junction_trip_c],
        ) = (self.winding_derating_c, self.junction_derating_c);
        Thermal {
            winding_sensor: self.winding_sensor.sensor(),
            heat_sink_sensor: self.heat_sink_sensor.sensor(),
            resistance_ohm,
            winding: rise(&self.winding),
            junction: rise(&self.junction),
            losses: DeviceLosses { threshold_v, slope_ohm, switching_share },
            winding_derating: Derating { from_c: winding_from_c, none_c: winding_none_c },
            winding_trip_c,
            junction_derating: Derating { from_c: junction_from_c, none_c: junction_none_c },
            junction_trip_c,
            magnets: self.magnets.as_ref().map(
                |&MagnetKeys { per_k, map_c, derating_c: [from_c, none_c] }| Magnets {
                    per_k,
                    map_c,
                    derating: Derating { from_c, none_c },
                },
            ),
        }
    }
}
