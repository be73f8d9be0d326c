//! The inputs of a scenario.

use crate::bench::{Encoder, LinePlan, Operator};
use crate::inject::Injection;
use crate::inject::traction::Kind;
use crate::plant::{DcLinkSettings, LineFilter, Source, SpeedSource};
use tractive::control::Demand;
use tractive::operator::TrainLimits;

/// The usual lead, in s.
pub(super) const LEAD_S: f64 = 0.1;

/// Step of the trace unless a scenario needs a finer one, in s.
pub(super) const STEP_S: f64 = 50e-6;

/// A scenario's inputs.
pub struct Plan {
    /// Time in which the drive settles before the recording begins, in s.
    pub lead_s: f64,
    /// Length of the recording, in s.
    pub duration_s: f64,
    /// Step of the rows that figures are taken from, in s, however densely the trace is written.
    pub judged_step_s: f64,
    /// The rotor's drive, from the run's beginning on.
    pub speed: SpeedSource,
    /// DC-link voltages: (time in s, V), each from its time on; the run's own before the first.
    pub link: Vec<(f64, f64)>,
    /// The operator.
    pub operator: Box<dyn Operator + Send>,
    /// The line side, where the scenario is about it; otherwise the link is stiff and the drive is commanded directly.
    pub line: Option<LinePlan>,
    /// The operator's limits of line and acceleration.
    pub train: TrainLimits,
    /// The fault, if there is one.
    pub injection: Option<Injection<Kind>>,
    /// Time from which control is given the same currents again and again, in s.
    pub freeze_at_s: Option<f64>,
    /// The incremental encoder that the rotor has instead of an absolute one.
    pub encoder: Option<Encoder>,
}

impl Plan {
    /// A plan for a drive that is commanded directly at a prescribed speed: (time in s, r/min), straight lines between the points; before the
    /// first point its speed holds.
    pub fn driven(
        lead_s: f64,
        duration_s: f64,
        speed: Vec<(f64, f64)>,
        operator: impl Operator + Send + 'static,
    ) -> Self {
        let later = speed.into_iter().map(|(t_s, rpm)| (t_s + lead_s, rpm)).collect();
        Self {
            lead_s,
            duration_s,
            judged_step_s: STEP_S,
            speed: SpeedSource::profile(later),
            link: Vec::new(),
            operator: Box::new(operator),
            line: None,
            train: TrainLimits::NONE,
            injection: None,
            freeze_at_s: None,
            encoder: None,
        }
    }

    /// The same with a line filter in front of the link's contactors, if the scenario has them: precharge and discharge of its capacitor take
    /// as long as before.
    pub(super) fn behind(mut self, filter: Option<LineFilter>) -> Self {
        if let (Some(line), Some(filter)) = (&mut self.line, filter) {
            let LineFilter { inductance_h, resistance_ohm, capacitance_f } = filter;
            let source = Source { inductance_h, resistance_ohm, ..line.link.source };
            let longer = line.link.capacitance_f / capacitance_f;
            let precharge_ohm = line.link.precharge_ohm * longer;
            let discharge_ohm = line.link.discharge_ohm * longer;
            line.link = DcLinkSettings { capacitance_f, source, precharge_ohm, discharge_ohm, ..line.link };
        }
        self
    }

    /// For a drive with a line side, whose operator permits what is driven.
    pub fn operated(duration_s: f64, speed: Vec<(f64, f64)>, line: LinePlan) -> Self {
        // Replaced by what the operator permits.
        let nothing = |_: f64| (Demand::default(), true);
        Self { line: Some(line), ..Self::driven(0.0, duration_s, speed, nothing) }
    }
}
