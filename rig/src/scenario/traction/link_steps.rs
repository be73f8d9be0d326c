//! Steps of the DC link under full load.

use super::prelude::*;
use super::scaled::scaled_rpm;
use super::script::{BEGIN_S, Script};
use super::setup::udc_v;

/// At several speeds: the link falls by 2/15 of its nominal voltage, comes back, rises by as much, comes back.
#[derive(Clone, Copy, Debug, Args, Serialize)]
pub struct LinkSteps;

const SPEEDS_RPM: [f64; 5] = [300.0, 1000.0, 1500.0, 1800.0, 3000.0];
const SETTLE_S: f64 = 0.5;
const HOLD_S: f64 = 0.15;
/// Time after a step from which the link behind a line filter is judged, until the next step.
const CALM_S: f64 = 0.11;
/// Step for a nominal voltage of 1,500 V.
const STEP_V: f64 = 200.0;
const SHARES: [f64; 4] = [-1.0, 0.0, 1.0, 0.0];
const SLOT_S: f64 = SETTLE_S + SHARES.len() as f64 * HOLD_S;

fn begins_s(slot: usize) -> f64 {
    BEGIN_S + slot as f64 * SLOT_S
}

/// The instants of all steps, in s.
fn steps_s() -> impl Iterator<Item = f64> {
    let of_slot = |slot| (0..SHARES.len()).map(move |k| begins_s(slot) + SETTLE_S + k as f64 * HOLD_S);
    (0..SPEEDS_RPM.len()).flat_map(of_slot)
}

/// The swing of the link that is left of a step before the next one.
#[derive(Clone, Copy, Debug, Serialize)]
struct LeftSwing {
    /// Instant of the step, in s.
    at_s: f64,
    /// Mechanical speed, in r/min.
    speed_rpm: f64,
    /// Half the link's peak-to-peak swing, as a share of its voltage.
    link_swing: f64,
}

impl LeftSwing {
    /// Measured from 110 ms after a step to the next one; not a number if the run ended before.
    fn of(recording: &Recording, at_s: f64) -> Self {
        let rows = analysis::window(recording, at_s + CALM_S, at_s + HOLD_S);
        let speed_rpm = rows.last().map_or(f64::NAN, |row| row.speed_rpm);
        Self { at_s, speed_rpm, link_swing: analysis::link_swing(rows) }
    }
}

impl Scenario<Traction> for LinkSteps {
    fn plan(&self, options: &Options, machine: &Machine) -> Plan {
        let nominal_v = udc_v(options, machine);
        let step_v = STEP_V * (machine.folder.parameters.dc_link_nominal_v / 1500.0);
        let mut script = Script {
            torque: vec![(0.0, machine.folder.parameters.max_torque_nm)],
            slew_limited: true,
            duration_s: begins_s(SPEEDS_RPM.len()),
            ..Script::default()
        };
        let speeds_rpm = SPEEDS_RPM.map(|speed_rpm| scaled_rpm(speed_rpm, machine));
        for (slot, speed_rpm) in speeds_rpm.into_iter().enumerate() {
            let begin = begins_s(slot);
            script.speed.extend([(begin + 0.5 * SETTLE_S, speed_rpm), (begin + SLOT_S, speed_rpm)]);
            let steps = SHARES.iter().enumerate();
            script.link.extend(
                steps.map(|(k, share)| (begin + SETTLE_S + k as f64 * HOLD_S, nominal_v + share * step_v)),
            );
        }
        script.plan()
    }

    fn figures(&self, recording: &Recording, options: &Options, machine: &Machine) -> Figures {
        let mut figures = analysis::common(recording);
        let steps: Vec<_> = steps_s().map(|at| analysis::transition(recording, at, at + HOLD_S)).collect();
        let trip_a = machine.folder.parameters.trip_current_a;
        let peak_a = worst(recording.rows.iter().map(Row::peak_current_a));
        let ratio = worst(steps.iter().map(|step| step.peak_ratio));
        let mut verdicts = vec![
            Verdict::at_most("peak current over the trip level", peak_a.map(|peak_a| peak_a / trip_a), 1.0),
            Verdict::at_most("peak current over the larger steady peak", ratio, f64::INFINITY),
        ];
        if options.own.line.is_some() {
            let swings: Vec<_> = steps_s().map(|at_s| LeftSwing::of(recording, at_s)).collect();
            let left = swings.iter().map(|left| left.link_swing);
            verdicts.push(analysis::swing_verdict("swing of the link 110 ms after a step", left));
            figures.set("link_swings", swings);
        }
        figures.set("verdicts", verdicts);
        figures.set("transitions", steps);
        figures
    }

    fn plots(&self, recording: &Recording, _: &Options, _: &Machine, page: &mut Page) {
        page.overview(recording);
    }
}
