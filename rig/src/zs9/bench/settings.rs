//! The settings of the ZS9's bench.

use crate::bench::{Flaws, Limits};
use crate::inject::Injection;
use crate::inject::zs9::Kind;
use tractive::drive::dual::Settings;
use tractive::nine_switch::Scheme;

/// Fixed properties of a bench.
#[derive(Clone, Copy, Debug)]
pub struct BenchSettings {
    /// The drive's, without a dead time.
    pub drive: Settings,
    /// Before the recording, in s.
    pub lead_s: f64,
    /// Length of the recording, in s.
    pub duration_s: f64,
    /// Step of the trace, in s.
    pub trace_step_s: f64,
    /// Demanded link voltage, in V.
    pub link_ref_v: f64,
    /// The place of the zero vectors.
    pub scheme: Scheme,
    /// Imperfections of the sensors and of the source.
    pub flaws: Flaws,
    /// The fault that is injected.
    pub injection: Option<Injection<Kind>>,
    /// Limits beyond which a fault counts as making a difference.
    pub limits: Limits,
    /// `true` if edges are kept.
    pub edges: bool,
    /// Time for which a gate has to wait that turns on while another gate of its leg turns off, in s.
    pub dead_time_s: f64,
}

/// The changes that occur by themselves during the run: times in s from the recording's beginning, each value from its time on.
#[derive(Clone, Debug, Default)]
pub struct Course {
    /// Voltages of the source, in V; the plant's own before the first.
    pub source_v: Vec<(f64, f64)>,
    /// Schemes; the settings' before the first.
    pub schemes: Vec<(f64, Scheme)>,
}
