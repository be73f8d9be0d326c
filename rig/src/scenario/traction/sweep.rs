//! Full torque from standstill through every mode: the paper's figure 9.

use super::host::true_machine;
use super::plan::LEAD_S;
use super::prelude::*;
use super::scaled::sweep_rpm_s;
use super::switches;
use crate::options::On;
use crate::pictures::chai::runs::change;
use crate::{scenario, spectrum};

/// 0 → rated speed in 8 s (2,000 r/min: 250 r/min a second) and 1 s hold, at the torque envelope.
#[derive(Clone, Copy, Debug, Args, Serialize)]
pub struct Sweep {
    /// Add the way back.
    #[arg(long)]
    down: bool,
    /// Brake instead of pulling.
    #[arg(long)]
    brake: bool,
    /// Share of the full torque.
    #[arg(long, default_value_t = 1.0, value_parser = finite, allow_negative_numbers = true)]
    torque_scale: f64,
    /// Last speed, in r/min; default the machine's rated one.
    #[arg(long, value_parser = finite, allow_negative_numbers = true)]
    to: Option<f64>,
    /// Slope of the speed, in r/min a second, from a twentieth to a hundred times the default, which is an eighth of the machine's rated speed.
    #[arg(long, value_parser = crate::options::positive)]
    slope: Option<f64>,
}

impl Default for Sweep {
    /// As on the command line without options.
    fn default() -> Self {
        Self { down: false, brake: false, torque_scale: 1.0, to: None, slope: None }
    }
}

const HOLD_S: f64 = 1.0;

impl Scenario<Traction> for Sweep {
    fn plan(&self, _options: &Options, machine: &Machine) -> Plan {
        let to_rpm = self.to.unwrap_or(machine.folder.parameters.rated_speed_rpm);
        let slope_rpm_s = self.slope.unwrap_or(sweep_rpm_s(machine));
        let ramp_s = to_rpm.abs() / slope_rpm_s;
        let mut speed = vec![(0.0, 0.0), (ramp_s, to_rpm)];
        let mut duration_s = ramp_s + HOLD_S;
        if self.down {
            speed.extend([(duration_s, to_rpm), (duration_s + ramp_s, 0.0)]);
            duration_s += ramp_s;
        }
        let direction = if self.brake { -1.0 } else { 1.0 } * to_rpm.signum();
        let torque_nm = machine.folder.parameters.max_torque_nm * self.torque_scale * direction;
        let operator = move |t_s: f64| {
            let torque_nm = if t_s < 0.0 { 0.0 } else { torque_nm as f32 };
            (Demand { torque_nm, slew_limited: true }, true)
        };
        Plan::driven(LEAD_S, duration_s, speed, operator)
    }

    fn figures(&self, recording: &Recording, options: &Options, machine: &Machine) -> Figures {
        let mut figures = analysis::common(recording);
        let switches = analysis::mode_switches(recording);
        let mut verdicts = analysis::switch_verdicts(&switches, recording, options, machine);
        verdicts.extend(analysis::square_verdict(
            recording,
            options,
            machine.folder.parameters.max_torque_nm,
        ));
        if options.map_error != 0.0 {
            verdicts.extend(self.map_verdicts(recording, options, machine));
        }
        figures.set("verdicts", verdicts);
        figures.set("mode_switches", switches);
        figures.set("modes", analysis::modes(recording));
        figures
    }

    fn plots(&self, recording: &Recording, options: &Options, machine: &Machine, page: &mut Page) {
        // The paper's figure shows the mode changes alone.
        page.answers(None);
        page.overview(recording);
        page.rotor_currents(recording);
        // The paper shows full torque, motoring.
        let figure: switches::Figure =
            if self.brake || self.torque_scale != 1.0 { |_, _| None } else { change };
        switches::plots(recording, page, figure);
        // The hold at the last speed, wherever it is.
        let fastest = recording.rows.iter().map(|row| row.speed_rpm.abs()).fold(0.0, f64::max);
        let hold = |row: &&Row| fastest > 0.0 && row.speed_rpm.abs() > 0.999_999 * fastest;
        if let Some(end) = recording.rows.iter().rev().find(hold) {
            let (title, window) = (format!("{fastest:.0} r/min"), (end.t_s - 0.5 * HOLD_S, end.t_s));
            let truth = true_machine(options, machine);
            spectrum::draw(page, recording, (&title, window), options.pulse_limits(&truth), &truth);
        }
    }
}

impl Sweep {
    /// Bounds for a wrong flux map: the current is little larger than with the right one, and the drive notices the error.
    fn map_verdicts(&self, recording: &Recording, options: &Options, machine: &Machine) -> [Verdict; 2] {
        let run = RunOptions { on: On::Host, map_error: 0.0, ..options.run.clone() };
        let right = Options { run, own: options.own.clone() };
        let peak_a = |recording: &Recording| worst(recording.rows.iter().map(Row::peak_current_a));
        let with_the_right_one = scenario::drive("sweep", self, &right, machine).ok();
        let ratio = with_the_right_one.and_then(|run| Some(peak_a(recording)? / peak_a(&run)?));
        let told = recording.rows.last().map(|row| (100.0 * row.map_error - options.map_error).abs());
        // A wrong resistance or angle looks like a wrong map, too.
        let told_within = if right.is_ideal() { 1.0 } else { f64::INFINITY };
        [
            Verdict::at_most("peak current over that with the right map", ratio, 1.1),
            Verdict::at_most("map error told less the true one in % of the flux", told, told_within),
        ]
    }
}
