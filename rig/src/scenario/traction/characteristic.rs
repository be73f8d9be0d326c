//! Torque accuracy, efficiency and current at the characteristic points: the paper's figure 10.

use super::host::true_machine;
use super::plan::LEAD_S;
use super::prelude::*;
use super::scaled::{of_rated_rpm, scaled_nm};
use crate::analysis::SteadyPoint;
use crate::{bound, figures, mtpa_methods, spectrum};

/// The points one after another in one run: ramp, settle, measure.
#[derive(Clone, Copy, Debug, Args, Serialize)]
pub struct Characteristic;

/// Speed in r/min and torque in N·m, of a machine rated at 2,000 r/min.
const POINTS: [(f64, f64); 7] = [
    (200.0, 1235.0),
    (500.0, 1235.0),
    (1000.0, 1235.0),
    (1500.0, 1235.0),
    (1905.0, 1235.0),
    (2000.0, 859.4),
    (2000.0, 1174.6),
];
/// Slope from one of these speeds to the next, in r/min per s.
const SLOPE_RPM_S: f64 = 1000.0;
const SETTLE_S: f64 = 0.6;
const MEASURE_S: f64 = 0.3;

/// A point's times in the run.
struct Slot {
    speed_rpm: f64,
    torque_nm: f64,
    begins_s: f64,
    steady_s: f64,
    ends_s: f64,
}

/// The points at this machine's own speeds and torques.
fn slots(machine: &Machine) -> Vec<Slot> {
    let (mut t_s, mut last_rpm) = (0.0, POINTS[0].0);
    POINTS
        .iter()
        .map(|&(speed_rpm, torque_nm)| {
            let begins_s = t_s;
            let steady_s = begins_s + (speed_rpm - last_rpm).abs() / SLOPE_RPM_S;
            let ends_s = steady_s + SETTLE_S + MEASURE_S;
            (t_s, last_rpm) = (ends_s, speed_rpm);
            let speed_rpm = of_rated_rpm(speed_rpm, machine);
            let torque_nm = scaled_nm(torque_nm, machine).min(machine.envelope_nm(speed_rpm));
            Slot { speed_rpm, torque_nm, begins_s, steady_s, ends_s }
        })
        .collect()
}

/// Measurements at each point.
pub fn points(recording: &Recording, machine: &Machine) -> Vec<SteadyPoint> {
    let point = |slot: Slot| {
        let window = (slot.ends_s - MEASURE_S, slot.ends_s);
        analysis::steady_point(recording, window, slot.torque_nm, &machine.folder)
    };
    slots(machine).into_iter().map(point).collect()
}

impl Scenario<Traction> for Characteristic {
    fn plan(&self, _options: &Options, machine: &Machine) -> Plan {
        let slots = slots(machine);
        let speed =
            slots.iter().flat_map(|slot| [(slot.steady_s, slot.speed_rpm), (slot.ends_s, slot.speed_rpm)]);
        let speed = speed.collect();
        let duration_s = slots.last().map_or(0.0, |slot| slot.ends_s);
        let operator = move |t_s: f64| {
            let slot = slots.iter().rev().find(|slot| t_s >= slot.begins_s);
            let torque_nm = slot.map_or(0.0, |slot| slot.torque_nm as f32);
            (Demand { torque_nm, slew_limited: true }, true)
        };
        Plan::driven(LEAD_S, duration_s, speed, operator)
    }

    fn figures(&self, recording: &Recording, options: &Options, machine: &Machine) -> Figures {
        let points = points(recording, machine);
        let truth = true_machine(options, machine);
        let beside = slots(machine).into_iter().map(|slot| {
            let window = (slot.ends_s - MEASURE_S, slot.ends_s);
            bound::beside(recording, window, options.pulse_limits(&truth), &truth)
        });
        let beside: Vec<_> = beside.flatten().collect();
        let mut figures = analysis::common(recording);
        let mut verdicts = torque_verdicts(&points, options);
        verdicts.extend(bound::verdicts(&beside, options));
        let methods = mtpa_methods::compare(machine);
        verdicts.extend(mtpa_methods::verdicts(&methods));
        figures.set("verdicts", verdicts);
        figures.set("points", points);
        figures.set("distortion", beside);
        figures.set("mtpa_methods", methods);
        figures
    }

    fn plots(&self, recording: &Recording, options: &Options, machine: &Machine, page: &mut Page) {
        // The paper's figure shows the points, not the waveforms at them.
        page.answers(None);
        page.torque(recording);
        page.plot("speed", "r/min", recording, &[("speed", |row| row.speed_rpm)]);
        page.phase_current(recording);
        for slot in slots(machine) {
            let window = (slot.ends_s - 0.04, slot.ends_s);
            page.zoom(&format!("{} r/min, {} N·m", slot.speed_rpm, slot.torque_nm), recording, window);
        }
        let truth = true_machine(options, machine);
        for slot in slots(machine) {
            let title = format!("{} r/min, {} N·m", slot.speed_rpm, slot.torque_nm);
            let window = (slot.ends_s - MEASURE_S, slot.ends_s);
            spectrum::draw(page, recording, (&title, window), options.pulse_limits(&truth), &truth);
        }
        figures::draw(page, recording, &points(recording, machine), options.own.control_hz, machine);
    }
}

/// Share of its demand above which a point is not limited: the rest is due to single precision.
const WHOLE: f64 = 0.999;

/// Bounds of the mean torque, against the demand or, if the link does not allow that, against the torque that the drive reports.
fn torque_verdicts(points: &[SteadyPoint], options: &RunOptions) -> Vec<Verdict> {
    let most = torque_bound(options, 0.3, 1.5);
    let (given, limited): (Vec<_>, Vec<_>) =
        points.iter().partition(|point| (point.reference_nm / point.demand_nm) > WHOLE);
    let error = worst(given.iter().map(|point| point.torque_error_percent.abs()));
    let mut verdicts = vec![Verdict::at_most("mean torque error in %", error, most)];
    if !limited.is_empty() {
        let error = worst(limited.iter().map(|point| point.reference_error_percent.abs()));
        let what = "mean torque off what the drive says, where the link gives less, in %";
        verdicts.push(Verdict::at_most(what, error, most));
    }
    verdicts
}
