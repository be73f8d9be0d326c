//! The power stage: what its sensors make of currents and voltages, by the file from which the image is built.

use crate::chip::adc::REFERENCE_V;
use anyhow::{Context, Result};
use std::path::Path;

/// The keys of a power stage's file that are wanted. The error names the file.
pub fn keys<T: serde::de::DeserializeOwned>(path: &Path) -> Result<T> {
    let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
    toml::from_str(&text).with_context(|| path.display().to_string())
}

/// The scales.
#[derive(Clone, Copy, Debug, serde::Deserialize)]
pub struct PowerStage {
    current_range_a: f64,
    dc_link_range_v: f64,
    /// Counts of the encoder in a turn.
    pub encoder_counts: u32,
    /// Least dead time, in ns.
    pub dead_time_ns: u32,
    /// Phase current at which the comparators turn the gates off, in A.
    pub break_current_a: f64,
    z_source: Option<ZSource>,
}

/// The scales that only the ZS9 has.
#[derive(Clone, Copy, Debug, serde::Deserialize)]
struct ZSource {
    inductor_range_a: f64,
    source_range_v: f64,
}

impl PowerStage {
    /// Reads the file. The error names it.
    pub fn read(path: &Path) -> Result<Self> {
        keys(path)
    }

    /// A current sensor's output, in V.
    pub fn current_volts(&self, current_a: f64) -> f64 {
        0.5 * REFERENCE_V * (1.0 + current_a / self.current_range_a)
    }

    /// The link divider's output, in V.
    pub fn link_volts(&self, udc_v: f64) -> f64 {
        REFERENCE_V * udc_v / self.dc_link_range_v
    }

    /// The source divider's output, in V; 0 where there is none.
    pub fn source_volts(&self, source_v: f64) -> f64 {
        self.z_source.map_or(0.0, |scales| REFERENCE_V * source_v / scales.source_range_v)
    }

    /// The output of the inductors' sensor, in V; 0 where there is none.
    pub fn inductor_volts(&self, current_a: f64) -> f64 {
        self.z_source.map_or(0.0, |scales| 0.5 * REFERENCE_V * (1.0 + current_a / scales.inductor_range_a))
    }
}
