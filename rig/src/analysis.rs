//! Figures from a recording.

use crate::options::RunOptions;
use crate::rows::{between, mean};
use crate::trace::{Recording, Row, Switch};
use crate::verdict::{FALLS_SHORT, Verdict, bound, torque_bound, worst};
use serde::Serialize;
use serde_json::{Map, Value};
use tractive::modulation::Mode;
use tractive_tablegen::MachineFolder;

/// A scenario's figures, each with its unit in its name.
#[derive(Clone, Debug, Default)]
pub struct Figures(Map<String, Value>);

impl Figures {
    /// Adds a figure.
    pub fn set(&mut self, name: &str, value: impl Serialize) {
        self.0.insert(name.to_owned(), serde_json::to_value(value).unwrap_or(Value::Null));
    }

    /// A figure by name.
    pub fn get(&self, name: &str) -> Option<&Value> {
        self.0.get(name)
    }

    /// All figures.
    pub fn values(&self) -> &Map<String, Value> {
        &self.0
    }

    /// Whether one of the verdicts says that a bound is not kept.
    pub fn fall_short(&self) -> bool {
        let verdicts = self.get("verdicts").and_then(Value::as_array);
        verdicts.is_some_and(|verdicts| verdicts.iter().any(|one| one["verdict"] == FALLS_SHORT))
    }
}

/// What every scenario reports.
pub fn common(recording: &Recording) -> Figures {
    let mut figures = Figures::default();
    let rows = &recording.rows;
    figures.set("simulated_s", rows.last().map_or(0.0, |row| row.t_s));
    figures.set("fault", recording.trip().map_or("", |trip| trip.fault.name()));
    if let Some(trip) = recording.trip() {
        figures.set("fault_value", trip.value);
        figures.set("fault_limit", trip.limit);
    }
    figures.set("peak_current_a", rows.iter().map(Row::peak_current_a).fold(0.0, f64::max));
    let told: Vec<_> = rows.iter().map(|row| row.map_error).filter(|share| *share != 0.0).collect();
    figures.set("map_error_estimate_percent", 100.0 * told.iter().sum::<f64>() / told.len().max(1) as f64);
    figures.set("most_turn_ons_in_100_ms", most_turn_ons(recording, 0.1));
    figures
}

/// The rows from `from_s` (included) to `to_s` (excluded).
pub fn window(recording: &Recording, from_s: f64, to_s: f64) -> &[Row] {
    between(&recording.rows, from_s, to_s)
}

/// The largest number of times that any one device turns on in any window of this length.
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

/// A step of the demand.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// When, in s.
    pub at_s: f64,
    /// Torque before, in N·m.
    pub from_nm: f64,
    /// Torque after, in N·m.
    pub to_nm: f64,
    /// Until when the torque holds, in s.
    pub until_s: f64,
}

/// What a step did. Torque is averaged over one carrier period (1/900 s, centred).
#[derive(Clone, Copy, Debug, Serialize)]
pub struct StepResponse {
    /// Torque before, in N·m.
    pub from_nm: f64,
    /// Torque after, in N·m.
    pub to_nm: f64,
    /// From the step to 90 % of it, in ms.
    pub t90_ms: f64,
    /// Beyond the final mean, as a share of the step, in percent.
    pub overshoot_percent: f64,
    /// Until the torque stays within 5 % of the step about the final mean, in ms.
    pub settling_5_percent_ms: f64,
    /// The same with 2 %.
    pub settling_2_percent_ms: f64,
    /// Mean of the last 40 ms less the demand, in N·m.
    pub final_error_nm: f64,
}

/// Measures a step.
pub fn step_response(recording: &Recording, step: &Step) -> StepResponse {
    let torque = carrier_averaged(recording, step.at_s, step.until_s, |row| row.te_nm);
    let final_mean = mean(window(recording, step.until_s - 0.04, step.until_s), |row| row.te_nm);
    let size = step.to_nm - step.from_nm;
    let start = final_mean - size;
    let progress = |torque_nm: f64| (torque_nm - start) / size;
    let reached = torque.iter().find(|(_, value)| progress(*value) >= 0.9);
    let settled = |band: f64| {
        let last_outside = torque.iter().rev().find(|(_, value)| (progress(*value) - 1.0).abs() > band);
        last_outside.map_or(0.0, |(t_s, _)| (t_s - step.at_s) * 1e3)
    };
    let highest = torque.iter().map(|(_, value)| progress(*value)).fold(0.0, f64::max);
    StepResponse {
        from_nm: step.from_nm,
        to_nm: step.to_nm,
        t90_ms: reached.map_or(f64::INFINITY, |(t_s, _)| (t_s - step.at_s) * 1e3),
        overshoot_percent: (highest - 1.0) * 100.0,
        settling_5_percent_ms: settled(0.05),
        settling_2_percent_ms: settled(0.02),
        final_error_nm: final_mean - step.to_nm,
    }
}

/// A quantity averaged over one carrier period (1/900 s) around each row of the window.
fn carrier_averaged(
    recording: &Recording,
    from_s: f64,
    to_s: f64,
    value: impl Fn(&Row) -> f64,
) -> Vec<(f64, f64)> {
    const HALF_WIDTH_S: f64 = 0.5 / 900.0;
    let rows = &recording.rows;
    let step_s = if rows.len() > 1 { rows[1].t_s - rows[0].t_s } else { HALF_WIDTH_S };
    let reach = (HALF_WIDTH_S / step_s).round() as usize;
    let first = rows.partition_point(|row| row.t_s < from_s);
    let last = rows.partition_point(|row| row.t_s < to_s - HALF_WIDTH_S);
    (first..last)
        .map(|k| {
            let around = &rows[k.saturating_sub(reach)..(k + reach + 1).min(rows.len())];
            (rows[k].t_s, mean(around, &value))
        })
        .collect()
}

/// What a switch of mode did to the current.
#[derive(Clone, Debug, Serialize)]
pub struct SwitchFigures {
    /// When, in s.
    pub t_s: f64,
    /// The mode that ended.
    pub from: &'static str,
    /// The mode that began.
    pub to: &'static str,
    /// Mechanical speed, in r/min.
    pub speed_rpm: f64,
    /// Pulse angle, in degrees; absent where the old carrier was not locked.
    pub pulse_angle_deg: Option<f64>,
    /// Largest |phase current| from 2 ms before to 30 ms after, in A.
    pub peak_current_a: f64,
    /// Larger of the largest |phase current| 100 to 20 ms before and 60 to 140 ms after, in A.
    pub steady_current_a: f64,
    /// By how much the first exceeds the second, in percent.
    pub excess_percent: f64,
    /// Torque beyond the steady ripple band of the same windows, from 2 ms before to 30 ms after, in N·m.
    pub torque_excursion_nm: f64,
    /// The same for torque averaged over 1/900 s. That is not a whole number of ripple periods in every mode, so where the ripple
    /// changes its shape this shows more than there is.
    pub averaged_torque_excursion_nm: f64,
}

/// Every switch between pulsing modes in the recording.
pub fn mode_switches(recording: &Recording) -> Vec<SwitchFigures> {
    recording
        .switches
        .iter()
        .filter(|switch| switch.is_between_pulses())
        .map(|switch| at_switch(recording, switch))
        .collect()
}

fn at_switch(recording: &Recording, switch: &Switch) -> SwitchFigures {
    let peak = |from_s: f64, to_s: f64| {
        let rows = window(recording, switch.t_s + from_s, switch.t_s + to_s);
        rows.iter().map(Row::peak_current_a).fold(0.0, f64::max)
    };
    let steady = peak(-0.1, -0.02).max(peak(0.06, 0.14));
    let now = peak(-0.002, 0.03);
    let instantaneous = |from_s: f64, to_s: f64| {
        let rows = window(recording, switch.t_s + from_s, switch.t_s + to_s);
        rows.iter().map(|row| row.te_nm - row.te_ref_nm).collect()
    };
    let averaged = |from_s: f64, to_s: f64| {
        carrier_averaged(recording, switch.t_s + from_s, switch.t_s + to_s, |row| row.te_nm - row.te_ref_nm)
            .into_iter()
            .map(|(_, error)| error)
            .collect()
    };
    SwitchFigures {
        t_s: switch.t_s,
        from: switch.from.name(),
        to: switch.to.name(),
        speed_rpm: switch.speed_rpm,
        pulse_angle_deg: switch.pulse_angle_deg,
        peak_current_a: now,
        steady_current_a: steady,
        excess_percent: (now / steady - 1.0) * 100.0,
        torque_excursion_nm: excursion(instantaneous),
        averaged_torque_excursion_nm: excursion(averaged),
    }
}

/// How far a torque error at a switch goes beyond its steady band before and after.
fn excursion(error_nm: impl Fn(f64, f64) -> Vec<f64>) -> f64 {
    let extent = |from_s: f64, to_s: f64| {
        let errors = error_nm(from_s, to_s);
        let low = errors.iter().copied().fold(f64::INFINITY, f64::min);
        (low, errors.iter().copied().fold(f64::NEG_INFINITY, f64::max))
    };
    let (before, after, during) = (extent(-0.1, -0.02), extent(0.06, 0.14), extent(-0.002, 0.03));
    let (low, high) = (before.0.min(after.0), before.1.max(after.1));
    (low - during.0).max(during.1 - high).max(0.0)
}

/// How long each mode was in use, in s, in order of first use.
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

/// A steady operating point, averaged.
#[derive(Clone, Debug, Serialize)]
pub struct SteadyPoint {
    /// Mechanical speed, in r/min.
    pub speed_rpm: f64,
    /// Torque demanded, in N·m.
    pub demand_nm: f64,
    /// What the drive says that it gives of it, in N·m: less where current or voltage do not allow more.
    pub reference_nm: f64,
    /// Mean air-gap torque, in N·m.
    pub torque_nm: f64,
    /// Its error, in percent of the demand.
    pub torque_error_percent: f64,
    /// Its error, in percent of what the drive says.
    pub reference_error_percent: f64,
    /// Phase current, rms, in A.
    pub current_rms_a: f64,
    /// Peak to peak torque ripple, in N·m.
    pub torque_ripple_nm: f64,
    /// Shaft power over electrical power, with the machine folder's speed-dependent loss, in percent.
    pub efficiency_percent: f64,
    /// Mode in use at the end.
    pub mode: &'static str,
}

/// The rows of a window at constant speed, shortened to whole turns of the stator field where one fits.
pub fn whole_turns(recording: &Recording, (from_s, to_s): (f64, f64), pole_pairs: u32) -> &[Row] {
    let rows = window(recording, from_s, to_s);
    let speed_rpm = rows.last().map_or(0.0, |row| row.speed_rpm);
    let turn_s = 60.0 / (speed_rpm.abs() * f64::from(pole_pairs));
    let turns = ((to_s - from_s) / turn_s).floor();
    if turns >= 1.0 { window(recording, to_s - turns * turn_s, to_s) } else { rows }
}

/// Averages over a window, shortened to whole turns of the stator field.
pub fn steady_point(
    recording: &Recording,
    within: (f64, f64),
    demand_nm: f64,
    machine: &MachineFolder,
) -> SteadyPoint {
    let parameters = &machine.parameters;
    let rows = whole_turns(recording, within, parameters.pole_pairs);
    let speed_rpm = rows.last().map_or(0.0, |row| row.speed_rpm);
    let torque_nm = mean(rows, |row| row.te_nm);
    let reference_nm = mean(rows, |row| row.te_ref_nm);
    let current_squared = mean(rows, |row| row.id_a * row.id_a + row.iq_a * row.iq_a);
    let omega = speed_rpm * core::f64::consts::TAU / 60.0;
    let air_gap_w = torque_nm * omega;
    let copper_w = 1.5 * parameters.stator_resistance_ohm * current_squared;
    let shaft_w = air_gap_w - parameters.speed_loss_w(speed_rpm);
    let low = rows.iter().map(|row| row.te_nm).fold(f64::INFINITY, f64::min);
    let high = rows.iter().map(|row| row.te_nm).fold(f64::NEG_INFINITY, f64::max);
    SteadyPoint {
        speed_rpm,
        demand_nm,
        reference_nm,
        torque_nm,
        torque_error_percent: (torque_nm / demand_nm - 1.0) * 100.0,
        reference_error_percent: (torque_nm / reference_nm - 1.0) * 100.0,
        current_rms_a: (current_squared / 2.0).sqrt(),
        torque_ripple_nm: high - low,
        efficiency_percent: shaft_w / (air_gap_w + copper_w) * 100.0,
        mode: rows.last().map_or("off", |row| row.mode.name()),
    }
}

/// What a change did to the current, beside the steady states before and after it.
#[derive(Clone, Debug, Serialize)]
pub struct Transition {
    /// When, in s.
    pub at_s: f64,
    /// Mechanical speed, in r/min.
    pub speed_rpm: f64,
    /// Mode at the end.
    pub mode: &'static str,
    /// Torque demanded at the end, in N·m.
    pub demand_nm: f64,
    /// Largest |phase current| from the change on, in A.
    pub peak_current_a: f64,
    /// Larger of the largest |phase current| in the 60 ms before and in the last 60 ms, in A.
    pub steady_current_a: f64,
    /// Ratio of the two.
    pub peak_ratio: f64,
    /// Mean torque of the last 60 ms less the demand, in N·m.
    pub final_error_nm: f64,
}

/// Measures a change at `at_s` whose steady state ends at `until_s`.
pub fn transition(recording: &Recording, at_s: f64, until_s: f64) -> Transition {
    const WINDOW_S: f64 = 0.06;
    let peak = |from_s: f64, to_s: f64| {
        window(recording, from_s, to_s).iter().map(Row::peak_current_a).fold(0.0, f64::max)
    };
    let last = window(recording, until_s - WINDOW_S, until_s);
    let steady_current_a = peak(at_s - WINDOW_S, at_s).max(peak(until_s - WINDOW_S, until_s));
    let peak_current_a = peak(at_s, until_s);
    Transition {
        at_s,
        speed_rpm: last.last().map_or(0.0, |row| row.speed_rpm),
        mode: last.last().map_or("off", |row| row.mode.name()),
        demand_nm: last.last().map_or(0.0, |row| row.te_ref_nm),
        peak_current_a,
        steady_current_a,
        peak_ratio: peak_current_a / steady_current_a,
        final_error_nm: mean(last, |row| row.te_nm - row.te_ref_nm),
    }
}

/// How a coasting machine was caught.
#[derive(Clone, Debug, Serialize)]
pub struct Catch {
    /// Mechanical speed, in r/min.
    pub speed_rpm: f64,
    /// First mode in which pulses were made.
    pub first_mode: &'static str,
    /// Mode 30 ms later.
    pub then_mode: &'static str,
    /// Largest |phase current| in the 20 ms before, in A: of the diodes.
    pub coasting_current_a: f64,
    /// Largest |phase current| in the first 30 ms, in A.
    pub catching_current_a: f64,
    /// The latter as a share of the machine's largest current.
    pub share_of_largest: f64,
    /// Largest |torque| in these 30 ms, in N·m.
    pub catching_torque_nm: f64,
    /// Torque demanded at the end of driving, in N·m.
    pub demand_nm: f64,
    /// Mean torque of the last 60 ms of driving less that, in N·m.
    pub final_error_nm: f64,
}

/// Measures a catch at `at_s`, with no torque demanded until 30 ms later, and what the drive gave until `until_s`.
pub fn catch(recording: &Recording, (at_s, until_s): (f64, f64), max_current_a: f64) -> Catch {
    const CATCH_S: f64 = 0.03;
    let peak = |rows: &[Row]| rows.iter().map(Row::peak_current_a).fold(0.0, f64::max);
    let rows = window(recording, at_s, at_s + CATCH_S);
    let driven = window(recording, until_s - 0.06, until_s);
    let catching_current_a = peak(rows);
    Catch {
        speed_rpm: rows.first().map_or(0.0, |row| row.speed_rpm),
        first_mode: rows.iter().find(|row| row.mode != Mode::Off).map_or("off", |row| row.mode.name()),
        then_mode: rows.last().map_or("off", |row| row.mode.name()),
        coasting_current_a: peak(window(recording, at_s - 0.02, at_s)),
        catching_current_a,
        share_of_largest: catching_current_a / max_current_a,
        catching_torque_nm: rows.iter().map(|row| row.te_nm.abs()).fold(0.0, f64::max),
        demand_nm: driven.last().map_or(0.0, |row| row.te_ref_nm),
        final_error_nm: mean(driven, |row| row.te_nm - row.te_ref_nm),
    }
}

/// What is wanted of every switch of mode.
pub fn switch_verdicts(
    switches: &[SwitchFigures],
    recording: &Recording,
    options: &RunOptions,
) -> Vec<Verdict> {
    let excess = worst(switches.iter().map(|switch| switch.excess_percent));
    let torque_nm = worst(switches.iter().map(|switch| switch.torque_excursion_nm));
    vec![
        Verdict::at_most(
            "current over the larger steady envelope in %",
            excess,
            // Of a wrong map it is asked that nothing trips.
            if options.map_error == 0.0 { bound(options, 1.5, 3.0) } else { f64::INFINITY },
            "3.3 at 12 to 7, 2.35 at 3 to square",
        ),
        Verdict::at_most(
            "torque beyond the steady ripple band in N·m",
            torque_nm,
            bound(options, 25.0, f64::INFINITY),
            "31 up, 71 braking",
        ),
        Verdict::at_most(
            "hunting: switches back without a cause",
            hunts(recording) as f64,
            0.0,
            "41 switches in a sweep",
        ),
        Verdict::at_most("turn-ons in 100 ms", most_turn_ons(recording, 0.1) as f64, 91.0, "900 Hz"),
    ]
}

/// Switches that take the one before back although neither speed nor demand has come back in between. At the power limit
/// the demand falls while the speed rises: that is no cause.
fn hunts(recording: &Recording) -> usize {
    const SPEED_SHARE: f64 = 0.005;
    const DEMAND_SHARE: f64 = 0.01;
    let counted: Vec<_> = recording.switches.iter().filter(|switch| switch.is_between_pulses()).collect();
    let taken_back = counted.windows(2).filter(|pair| pair[0].from == pair[1].to);
    let without_cause = taken_back.filter(|pair| {
        let between = window(recording, pair[0].t_s, pair[1].t_s);
        let (Some(first), Some(last)) = (between.first(), between.last()) else { return true };
        // How far each has gone the way that the second switch goes, as a share.
        let sign = if pair[1].to > pair[1].from { 1.0 } else { -1.0 };
        let gone = |value: fn(&Row) -> f64| sign * (value(last) / value(first) - 1.0);
        let (speed, demand) = (gone(|row| row.speed_rpm.abs()), gone(|row| row.te_ref_nm));
        let demand_alone = demand > DEMAND_SHARE && speed > -SPEED_SHARE;
        speed <= SPEED_SHARE && !demand_alone
    });
    without_cause.count()
}

/// What is wanted of the mean torque in square wave; nothing where there is none.
pub fn square_verdict(recording: &Recording, options: &RunOptions) -> Option<Verdict> {
    let error = square_torque_error_percent(recording)?;
    let others = "0.5; 14 to 33 with an id trim";
    let most = torque_bound(options, 0.5, 1.5);
    Some(Verdict::at_most("mean torque error in square wave in %", error, most, others))
}

/// Largest error of the mean torque in square wave over tenths of a second, in percent; nothing without square wave.
fn square_torque_error_percent(recording: &Recording) -> Option<f64> {
    const WINDOW_S: f64 = 0.1;
    let end_s = recording.rows.last().map_or(0.0, |row| row.t_s);
    let windows = (0..(end_s / WINDOW_S) as usize)
        .map(|k| window(recording, k as f64 * WINDOW_S, (k + 1) as f64 * WINDOW_S));
    let square = windows.filter(|rows| !rows.is_empty() && rows.iter().all(|row| row.mode == Mode::Square));
    square
        .map(|rows| (mean(rows, |row| row.te_nm) / mean(rows, |row| row.te_ref_nm) - 1.0).abs() * 100.0)
        .reduce(f64::max)
}
