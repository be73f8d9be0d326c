//! One operating point in steady state: distortion and torque ripple compared with what the pulses allow.

use super::TractionOptions;
use super::host::true_machine;
use super::prelude::*;
use super::scaled::{carrier_step_s, scaled_nm, scaled_rpm};
use super::script::Script;
use crate::distortion::{self, Distortion};
use crate::options::On;
use crate::{bound, scenario, spectrum};

/// `--speed` and `--torque`.
#[derive(Clone, Copy, Debug, Args, Serialize)]
pub struct Steady {
    /// Speed, in r/min.
    #[arg(long, value_parser = finite, allow_negative_numbers = true)]
    speed: Option<f64>,
    /// Torque, in N·m; default the machine's largest.
    #[arg(long, value_parser = finite, allow_negative_numbers = true)]
    torque: Option<f64>,
}

const SPEED_RPM: f64 = 1000.0;
/// Speed in r/min and torque in N·m at which the harmonics of the dead time are judged.
const DEAD_TIME_POINT: (f64, f64) = (200.0, 100.0);
/// Step, in s. Pulse edges fall anywhere between the samples: a coarser step would show more or less ripple than there is.
const STEP_S: f64 = 5e-6;
/// Lowest speed at which the torque reported by the drive is judged, as a share of the rated speed.
const TOLD_FROM: f64 = 0.05;
const SETTLE_S: f64 = 0.6;
const MEASURE_S: f64 = 0.5;

impl Scenario<Traction> for Steady {
    fn plan(&self, _options: &Options, machine: &Machine) -> Plan {
        let (speed_rpm, torque_nm) = self.point(machine);
        let script = Script {
            speed: vec![(0.0, speed_rpm)],
            torque: vec![(0.0, torque_nm)],
            slew_limited: true,
            duration_s: SETTLE_S + MEASURE_S,
            ..Script::default()
        };
        Plan { judged_step_s: STEP_S.min(carrier_step_s(machine)), ..script.plan() }
    }

    fn figures(&self, recording: &Recording, options: &Options, machine: &Machine) -> Figures {
        let (_, torque_nm) = self.point(machine);
        let window = (SETTLE_S, SETTLE_S + MEASURE_S);
        let mut figures = analysis::common(recording);
        let steady = analysis::steady_point(recording, window, torque_nm, &machine.folder);
        let measured = distortion::of_recording(recording, window, &machine.folder);
        figures.set("harmonics", measured.harmonics());
        let truth = true_machine(options, machine);
        let beside: Vec<_> =
            bound::beside(recording, window, options.pulse_limits(&truth), &truth).into_iter().collect();
        let mut verdicts = bound::verdicts(&beside, options).to_vec();
        if options.own.line.is_some() {
            let swing = analysis::link_swing(analysis::window(recording, window.0, window.1));
            verdicts.push(analysis::swing_verdict("swing of the link", [swing].into_iter()));
        }
        if options.dead_time_us > 0.0 {
            let (speed_rpm, point_nm) = DEAD_TIME_POINT;
            let point = (scaled_rpm(speed_rpm, machine), scaled_nm(point_nm, machine));
            let judged = !options.own.uncompensated && (steady.speed_rpm.abs(), torque_nm.abs()) == point;
            verdicts.extend(dead_time_verdicts(&measured, if judged { 0.5 } else { f64::INFINITY }, ""));
            if !options.own.uncompensated
                && let Ok(without) = self.without_compensation(window, options, machine)
            {
                verdicts.extend(dead_time_verdicts(&without, f64::INFINITY, ", without compensation"));
                figures.set("harmonics_without_compensation", without.harmonics());
            }
        }
        if steady.told_nm.is_finite() {
            let told = "torque that the drive tells, off the mean in % of the largest";
            let judged = steady.speed_rpm.abs() >= TOLD_FROM * machine.folder.parameters.rated_speed_rpm;
            let most = if judged { 2.0 } else { f64::INFINITY };
            verdicts.push(Verdict::at_most(told, steady.told_error_percent, most));
        }
        figures.set("point", vec![steady]);
        figures.set("verdicts", verdicts);
        figures.set("distortion", beside);
        figures
    }

    fn trace_step_s(&self, _own: &TractionOptions) -> f64 {
        STEP_S
    }

    fn plots(&self, recording: &Recording, options: &Options, machine: &Machine, page: &mut Page) {
        let window = (SETTLE_S, SETTLE_S + 0.04);
        page.zoom("steady state", recording, window);
        let window = (SETTLE_S, SETTLE_S + MEASURE_S);
        let truth = true_machine(options, machine);
        spectrum::draw(page, recording, ("steady state", window), options.pulse_limits(&truth), &truth);
    }
}

impl Steady {
    /// Speed in r/min and torque in N·m.
    fn point(&self, machine: &Machine) -> (f64, f64) {
        let torque_nm = self.torque.unwrap_or(machine.folder.parameters.max_torque_nm);
        (self.speed.unwrap_or(scaled_rpm(SPEED_RPM, machine)), torque_nm)
    }

    /// The same on the host without any compensation of the dead time.
    fn without_compensation(
        &self,
        window: (f64, f64),
        options: &Options,
        machine: &Machine,
    ) -> anyhow::Result<Distortion> {
        let run = RunOptions { on: On::Host, ..options.run.clone() };
        let own = TractionOptions { uncompensated: true, ..options.own.clone() };
        let recording = scenario::drive("steady", self, &Options { run, own }, machine)?;
        Ok(distortion::of_recording(&recording, window, &machine.folder))
    }
}

/// The remaining harmonics of the dead time.
fn dead_time_verdicts(measured: &Distortion, at_most: f64, how: &str) -> [Verdict; 2] {
    [5, 7].map(|order| {
        let share = measured.share_percent(order);
        Verdict::at_most(&format!("harmonic {order} in % of the fundamental{how}"), share, at_most)
    })
}
