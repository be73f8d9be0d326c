//! Mode borders crossed at constant speed, by a change of torque alone.

use super::prelude::*;
use super::scaled::scaled_rpm;
use super::script::{BEGIN_S, Script};
use super::switches;

/// Torque up to the envelope and back, slowly: small steps that the slew limit smooths. At `--speed`, or at two speeds one after the
/// other.
#[derive(Clone, Copy, Debug, Args, Serialize)]
pub struct ModeBorders {
    /// Speed, in r/min.
    #[arg(long, value_parser = finite, allow_negative_numbers = true)]
    speed: Option<f64>,
}

/// Speeds at which torque alone leads from 7 to 3 pulses and back, and from 7 through 3 pulses into square wave and out of it.
const SPEEDS_RPM: [f64; 2] = [1750.0, 1888.0];
const LEVELS: usize = 800;
/// Time at each level, in s: so long that the envelopes beside a switch, 100 ms away, match those of its torque within a percent.
const LEVEL_S: f64 = 0.01;
/// Time at the envelope, in s.
const HOLD_S: f64 = 0.6;
/// Time for up, hold, down and a little without torque, and time from one speed to the next, in s.
const SLOT_S: f64 = 2.0 * LEVELS as f64 * LEVEL_S + HOLD_S + 0.2;
const RAMP_S: f64 = 0.3;

impl Scenario<Traction> for ModeBorders {
    fn plan(&self, _options: &Options, machine: &Machine) -> Plan {
        let most = machine.folder.parameters.max_torque_nm;
        let usual = SPEEDS_RPM.map(|speed_rpm| scaled_rpm(speed_rpm, machine));
        let speeds = self.speed.map_or(usual.to_vec(), |speed_rpm| vec![speed_rpm]);
        let mut script = Script { slew_limited: true, ..Script::default() };
        for (slot, speed_rpm) in speeds.iter().enumerate() {
            let begin_s = BEGIN_S + slot as f64 * (SLOT_S + RAMP_S);
            let level = |from_s: f64, k: usize, level: usize| {
                (from_s + k as f64 * LEVEL_S, most * level as f64 / LEVELS as f64)
            };
            let down_s = begin_s + LEVELS as f64 * LEVEL_S + HOLD_S;
            script.torque.extend((0..=LEVELS).map(|k| level(begin_s, k, k)));
            script.torque.extend((0..=LEVELS).map(|k| level(down_s, k, LEVELS - k)));
            script.speed.extend([(begin_s, *speed_rpm), (begin_s + SLOT_S, *speed_rpm)]);
            script.duration_s = begin_s + SLOT_S;
        }
        script.plan()
    }

    fn figures(&self, recording: &Recording, options: &Options, machine: &Machine) -> Figures {
        let mut figures = analysis::common(recording);
        let switches = analysis::mode_switches(recording);
        let verdicts = analysis::switch_verdicts(&switches, recording, options, machine);
        figures.set("verdicts", verdicts);
        figures.set("mode_switches", switches);
        figures.set("modes", analysis::modes(recording));
        figures
    }

    fn plots(&self, recording: &Recording, _: &Options, _: &Machine, page: &mut Page) {
        page.overview(recording);
        switches::plots(recording, page, |_, _| None);
    }
}
