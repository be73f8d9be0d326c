//! Coasting with the gates off, and flying restart.

use super::script::{BEGIN_S, Script};
use super::{Plan, Scenario};
use crate::analysis::{self, Figures};
use crate::machine::Machine;
use crate::options::RunOptions;
use crate::report::Page;
use crate::trace::Recording;

/// At each speed: coast, catch the machine, half of the envelope's torque, release, coast.
pub struct Restart;

const SPEEDS_RPM: [f64; 9] = [0.0, 300.0, 800.0, 1050.0, 1500.0, 2000.0, 3000.0, 4500.0, 6000.0];
const COAST_S: f64 = 0.25;
const DRIVE_S: f64 = 0.25;
const SLOT_S: f64 = COAST_S + DRIVE_S;

fn begins_s(slot: usize) -> f64 {
    BEGIN_S + slot as f64 * SLOT_S
}

impl Scenario for Restart {
    fn name(&self) -> &'static str {
        "restart"
    }

    fn figure(&self) -> &'static str {
        "figure 9: the modes, here each caught from coasting"
    }

    fn plan(&self, _options: &RunOptions, machine: &Machine) -> Plan {
        let mut script = Script {
            enable: vec![(0.0, false)],
            slew_limited: true,
            duration_s: begins_s(SPEEDS_RPM.len()),
            ..Script::default()
        };
        let parameters = &machine.folder.parameters;
        for (slot, speed_rpm) in SPEEDS_RPM.into_iter().enumerate() {
            let begin = begins_s(slot);
            let (catch, release) = (begin + COAST_S, begin + SLOT_S - 0.06);
            let omega = speed_rpm * core::f64::consts::TAU / 60.0;
            let envelope_nm = (parameters.max_power_w / omega.max(1.0)).min(parameters.max_torque_nm);
            // The speed changes in the first part of the coasting.
            script.speed.extend([(begin + 0.1, speed_rpm), (begin + SLOT_S, speed_rpm)]);
            script.enable.extend([(catch, true), (begin + SLOT_S, false)]);
            script.torque.extend([(catch + 0.03, 0.5 * envelope_nm), (release, 0.0)]);
        }
        script.plan()
    }

    fn figures(&self, recording: &Recording, _options: &RunOptions, machine: &Machine) -> Figures {
        let catches = SPEEDS_RPM.iter().enumerate().map(|(slot, _)| {
            analysis::catch(recording, begins_s(slot) + COAST_S, machine.folder.parameters.max_current_a)
        });
        let catches: Vec<_> = catches.collect();
        let mut figures = analysis::common(recording);
        figures.set("catches", catches);
        figures
    }

    fn plots(&self, recording: &Recording, page: &mut Page) {
        page.overview(recording);
        for (slot, speed_rpm) in SPEEDS_RPM.iter().enumerate() {
            let at_s = begins_s(slot) + COAST_S;
            let title = format!("{speed_rpm} r/min caught: phase current u");
            page.plot_window(&title, "A", recording, (at_s - 0.01, at_s + 0.06), &[("ia", |row| row.ia_a)]);
        }
    }
}
