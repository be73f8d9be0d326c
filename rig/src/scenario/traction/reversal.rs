//! Full power reversed in one step in square wave, released in deep weakening, and applied again.

use super::host::true_machine;
use super::prelude::*;
use super::scaled::scaled_rpm;
use super::script::{BEGIN_S, Script};
use crate::spectrum;

/// At `--speed`: full power, full braking power, no power, full power; each for 0.4 s, in steps.
#[derive(Clone, Copy, Debug, Args, Serialize)]
pub struct Reversal {
    /// Speed, in r/min.
    #[arg(long, value_parser = finite, allow_negative_numbers = true)]
    speed: Option<f64>,
}

const SPEED_RPM: f64 = 4000.0;
const HOLD_S: f64 = 0.4;
const SHARES: [f64; 4] = [1.0, -1.0, 0.0, 1.0];

impl Scenario<Traction> for Reversal {
    fn plan(&self, _options: &Options, machine: &Machine) -> Plan {
        // The envelope turns full torque into full power.
        let most = machine.folder.parameters.max_torque_nm;
        let torque = SHARES.iter().enumerate().map(|(k, share)| (BEGIN_S + k as f64 * HOLD_S, share * most));
        Script {
            speed: vec![(0.0, self.speed.unwrap_or(scaled_rpm(SPEED_RPM, machine)))],
            torque: torque.collect(),
            duration_s: BEGIN_S + SHARES.len() as f64 * HOLD_S,
            ..Script::default()
        }
        .plan()
    }

    fn figures(&self, recording: &Recording, options: &Options, machine: &Machine) -> Figures {
        let at = |k: usize| BEGIN_S + k as f64 * HOLD_S;
        let steps = (0..SHARES.len()).map(|k| analysis::transition(recording, at(k), at(k + 1)));
        let holds = (0..SHARES.len()).filter(|k| SHARES[*k] != 0.0).map(|k| {
            let window = (at(k + 1) - 0.5 * HOLD_S, at(k + 1));
            let demand_nm =
                analysis::window(recording, window.0, window.1).last().map_or(0.0, |row| row.te_ref_nm);
            analysis::steady_point(recording, window, demand_nm, &machine.folder)
        });
        let (steps, holds): (Vec<_>, Vec<_>) = (steps.collect(), holds.collect());
        let mut figures = analysis::common(recording);
        let ratio = worst(steps.iter().map(|step| step.peak_ratio));
        let error = worst(holds.iter().map(|hold| hold.torque_error_percent.abs()));
        let most = torque_bound(options, 0.5, 1.5);
        let verdicts = [
            Verdict::at_most("peak current over the larger steady peak", ratio, 1.15),
            Verdict::at_most("mean torque error at full power in %", error, most),
        ];
        figures.set("verdicts", verdicts);
        figures.set("transitions", steps);
        figures.set("points", holds);
        figures
    }

    fn plots(&self, recording: &Recording, options: &Options, machine: &Machine, page: &mut Page) {
        page.overview(recording);
        page.rotor_currents(recording);
        for k in 0..SHARES.len() {
            let at_s = BEGIN_S + k as f64 * HOLD_S;
            let title = format!("at {at_s:.1} s");
            page.zoom(&title, recording, (at_s - 0.01, at_s + 0.05));
        }
        let end_s = BEGIN_S + HOLD_S;
        let window = (end_s - 0.5 * HOLD_S, end_s);
        let truth = true_machine(options, machine);
        spectrum::draw(page, recording, ("full power", window), options.pulse_limits(&truth), &truth);
    }
}
