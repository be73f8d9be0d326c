//! Figures from a recording.

mod steady;
mod step;
mod switches;
mod transition;

pub use steady::{SteadyPoint, square_verdict, steady_point};
pub use step::{Step, StepResponse, step_response};
pub use switches::{SwitchFigures, mode_switches, switch_verdicts};
pub use transition::{FlyingStart, Transition, catch, transition};

use crate::rows::{between, centred_means};
use crate::trace::{Recorded, Recording, Row, name_of};
use crate::verdict::{FALLS_SHORT, Verdict, worst};
use serde::Serialize;
use serde_json::{Map, Value};
use tractive::protection::Trip;

/// A scenario's figures, each with its unit in its name.
#[derive(Clone, Debug, Default)]
pub struct Figures(Map<String, Value>);

impl Figures {
    /// Figures of every run of either system: its length in s, the fault, the largest phase current in A.
    pub fn of_run(simulated_s: f64, trip: Option<Trip>, peak_current_a: f64) -> Self {
        let mut figures = Self::default();
        figures.set("simulated_s", simulated_s);
        figures.set("fault", name_of(trip));
        if let Some(trip) = trip {
            figures.set("fault_value", trip.value);
            // A value that is not a number violates any limit.
            if trip.limit < f32::MAX {
                figures.set("fault_limit", trip.limit);
            }
        }
        figures.set("peak_current_a", peak_current_a);
        figures
    }

    /// Adds a figure.
    pub fn set(&mut self, name: &str, value: impl Serialize) {
        self.0.insert(name.to_owned(), serde_json::to_value(value).unwrap_or(Value::Null));
    }

    /// A figure by name.
    pub fn get(&self, name: &str) -> Option<&Value> {
        self.0.get(name)
    }

    /// A figure that is a number; `None` otherwise.
    pub fn number(&self, name: &str) -> Option<f64> {
        self.get(name).and_then(Value::as_f64)
    }

    /// All figures.
    pub fn values(&self) -> &Map<String, Value> {
        &self.0
    }

    /// `true` if one of the verdicts says that a bound is violated.
    pub fn fall_short(&self) -> bool {
        let verdicts = self.get("verdicts").and_then(Value::as_array);
        verdicts.is_some_and(|verdicts| verdicts.iter().any(|one| one["verdict"] == FALLS_SHORT))
    }
}

/// The figures that every scenario reports.
pub fn common(recording: &Recording) -> Figures {
    let rows = &recording.rows;
    let simulated_s = rows.last().map_or(0.0, |row| row.t_s);
    let peak_a = rows.iter().map(Row::peak_current_a).fold(0.0, f64::max);
    let mut figures = Figures::of_run(simulated_s, recording.trip(), peak_a);
    let told: Vec<_> = rows.iter().map(|row| row.map_error).filter(|share| *share != 0.0).collect();
    figures.set("map_error_estimate_percent", 100.0 * told.iter().sum::<f64>() / told.len().max(1) as f64);
    figures.set("most_turn_ons_in_100_ms", most_turn_ons(recording, 0.1));
    let line_a = rows.iter().filter_map(|row| row.line_a).map(f64::abs).reduce(f64::max);
    if let Some(line_a) = line_a {
        let link_v = rows.iter().map(|row| row.udc_v);
        figures.set("peak_line_current_a", line_a);
        figures.set("lowest_link_v", link_v.clone().fold(f64::INFINITY, f64::min));
        figures.set("highest_link_v", link_v.fold(0.0, f64::max));
    }
    let peak_a = |drive: &Recording| drive.rows.iter().map(Row::peak_current_a).fold(0.0, f64::max);
    if let Some(others_a) = recording.beside.iter().map(peak_a).reduce(f64::max) {
        figures.set("other_drives_peak_current_a", others_a);
    }
    figures
}

/// The rows from `from_s` (included) to `to_s` (excluded).
pub fn window(recording: &Recording, from_s: f64, to_s: f64) -> &[Row] {
    between(&recording.rows, from_s, to_s)
}

/// Half the peak-to-peak swing of the link in some rows, as a share of its voltage.
pub fn link_swing(rows: &[Row]) -> f64 {
    swing(rows.iter().map(|row| row.udc_v))
}

/// Half the peak-to-peak swing of voltages, as a share of their middle.
pub fn swing(voltages: impl Iterator<Item = f64> + Clone) -> f64 {
    let (low_v, high_v) = (voltages.clone().fold(f64::INFINITY, f64::min), voltages.fold(0.0, f64::max));
    (high_v - low_v) / (high_v + low_v)
}

/// Largest swing of the link behind a line filter in steady state, as a share of its voltage.
pub const MOST_LINK_SWING: f64 = 0.03;

/// The verdict on the largest of some swings of the link, each as a share of its voltage, under the name of what is judged.
pub fn swing_verdict(what: &str, swings: impl Iterator<Item = f64>) -> Verdict {
    Verdict::at_most(&format!("{what} (share of its voltage)"), worst(swings), MOST_LINK_SWING)
}

/// The largest number of turn-ons of any one device in any window of this length.
pub fn most_turn_ons(recording: &Recording, length_s: f64) -> usize {
    let length = (length_s / recording.tick_s).round() as u64;
    (0..6)
        .map(|gate| {
            let ons: Vec<_> = recording
                .edges
                .iter()
                .filter(|edge| edge.on && edge.gate == gate)
                .map(|edge| edge.tick)
                .collect();
            let mut first = 0;
            let mut most = 0;
            for (last, tick) in ons.iter().enumerate() {
                while tick - ons[first] > length {
                    first += 1;
                }
                most = most.max(last + 1 - first);
            }
            most
        })
        .max()
        .unwrap_or(0)
}

/// A quantity averaged over one carrier period around each row of the window.
fn carrier_averaged(
    recording: &Recording,
    (from_s, to_s): (f64, f64),
    carrier_s: f64,
    value: impl Fn(&Row) -> f64,
) -> Vec<(f64, f64)> {
    let half_width_s = 0.5 * carrier_s;
    let around = window(recording, from_s - carrier_s, to_s + carrier_s);
    let step_s = if around.len() > 1 { around[1].t_s - around[0].t_s } else { half_width_s };
    let values: Vec<_> = around.iter().map(value).collect();
    let means = centred_means(&values, |_| half_width_s / step_s);
    let within = |t_s: &f64| (from_s..to_s - half_width_s).contains(t_s);
    around.iter().map(|row| row.t_s).zip(means).filter(|(t_s, _)| within(t_s)).collect()
}

/// The rows of a window at constant speed, shortened to whole turns of the stator field if one fits.
pub fn whole_turns(recording: &Recording, (from_s, to_s): (f64, f64), pole_pairs: u32) -> &[Row] {
    let rows = window(recording, from_s, to_s);
    let speed_rpm = rows.last().map_or(0.0, |row| row.speed_rpm);
    let turn_s = 60.0 / (speed_rpm.abs() * f64::from(pole_pairs));
    let turns = ((to_s - from_s) / turn_s).floor();
    if turns >= 1.0 { window(recording, to_s - turns * turn_s, to_s) } else { rows }
}

/// The time for which each mode was in use, in s, in order of first use.
#[derive(Clone, Debug, Serialize)]
pub struct ModeUse {
    /// The mode.
    pub mode: &'static str,
    /// First instant, in s.
    pub first_s: f64,
    /// Total, in s.
    pub total_s: f64,
}

/// The use of the modes.
pub fn modes(recording: &Recording) -> Vec<ModeUse> {
    let mut uses: Vec<ModeUse> = Vec::new();
    for pair in recording.rows.windows(2) {
        let name = pair[0].mode.name();
        let length_s = pair[1].t_s - pair[0].t_s;
        match uses.iter_mut().find(|found| found.mode == name) {
            Some(found) => found.total_s += length_s,
            None => uses.push(ModeUse { mode: name, first_s: pair[0].t_s, total_s: length_s }),
        }
    }
    uses
}
