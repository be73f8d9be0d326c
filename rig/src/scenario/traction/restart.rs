//! Coasting with the gates off, and flying restart.

use super::prelude::*;
use super::scaled::{ramp_scale, scaled_rpm};
use super::script::{BEGIN_S, Script};
use crate::analysis::FlyingStart;

/// At each speed: coast, catch the machine, half of the envelope's torque, release, coast.
#[derive(Clone, Copy, Debug, Args, Serialize)]
pub struct Restart;

const SPEEDS_RPM: [f64; 9] = [0.0, 300.0, 800.0, 1050.0, 1500.0, 2000.0, 3000.0, 4500.0, 6000.0];
/// Times of coasting while the speed changes, and at the new speed, in s.
const RAMP_S: f64 = 0.1;
const HOLD_S: f64 = 0.15;
const DRIVE_S: f64 = 0.25;
/// Time without torque before coasting, in s.
const RELEASE_S: f64 = 0.06;
/// Deviation of the magnets that stays within the bounds unknown, in percent.
const SLIGHT_PERCENT: f64 = 1.0;

/// Times of the slots.
struct Slots {
    ramp_s: f64,
    coast_s: f64,
    slot_s: f64,
}

impl Slots {
    fn of(machine: &Machine) -> Self {
        let ramp_s = RAMP_S * ramp_scale(machine);
        let coast_s = ramp_s + HOLD_S;
        Self { ramp_s, coast_s, slot_s: coast_s + DRIVE_S }
    }

    fn begins_s(&self, slot: usize) -> f64 {
        BEGIN_S + slot as f64 * self.slot_s
    }
}

impl Scenario<Traction> for Restart {
    fn plan(&self, _options: &Options, machine: &Machine) -> Plan {
        let slots = Slots::of(machine);
        let mut script = Script {
            enable: vec![(0.0, false)],
            slew_limited: true,
            duration_s: slots.begins_s(SPEEDS_RPM.len()),
            ..Script::default()
        };
        let speeds_rpm = SPEEDS_RPM.map(|speed_rpm| scaled_rpm(speed_rpm, machine));
        for (slot, speed_rpm) in speeds_rpm.into_iter().enumerate() {
            let begin = slots.begins_s(slot);
            let (catch, release) = (begin + slots.coast_s, begin + slots.slot_s - RELEASE_S);
            let envelope_nm = machine.envelope_nm(speed_rpm);
            // The speed changes in the first part of the coasting.
            script.speed.extend([(begin + slots.ramp_s, speed_rpm), (begin + slots.slot_s, speed_rpm)]);
            script.enable.extend([(catch, true), (begin + slots.slot_s, false)]);
            script.torque.extend([(catch + 0.03, 0.5 * envelope_nm), (release, 0.0)]);
        }
        script.plan()
    }

    fn figures(&self, recording: &Recording, options: &Options, machine: &Machine) -> Figures {
        let slots = Slots::of(machine);
        let catches = SPEEDS_RPM.iter().enumerate().map(|(slot, _)| {
            let driven =
                (slots.begins_s(slot) + slots.coast_s, slots.begins_s(slot) + slots.slot_s - RELEASE_S);
            analysis::catch(recording, driven, machine.folder.parameters.max_current_a)
        });
        let catches: Vec<_> = catches.collect();
        let mut figures = analysis::common(recording);
        figures.set("verdicts", verdicts(&catches, options));
        figures.set("catches", catches);
        figures
    }

    fn plots(&self, recording: &Recording, _: &Options, machine: &Machine, page: &mut Page) {
        page.overview(recording);
        let slots = Slots::of(machine);
        for slot in 0..SPEEDS_RPM.len() {
            let at_s = slots.begins_s(slot) + slots.coast_s;
            let speed_rpm =
                analysis::window(recording, at_s, at_s + 1.0).first().map_or(0.0, |row| row.speed_rpm);
            let title = format!("{speed_rpm:.0} r/min caught");
            page.zoom(&title, recording, (at_s - 0.01, at_s + 0.06));
        }
    }
}

fn verdicts(catches: &[FlyingStart], options: &Options) -> Vec<Verdict> {
    let other_mode = catches.iter().filter(|catch| catch.first_mode != catch.then_mode).count();
    // When the machine coasts fast, the diodes' current may exceed the largest current.
    let over = |catch: &FlyingStart| {
        let allowed_a = (catch.catching_current_a / catch.share_of_largest).max(catch.coasting_current_a);
        if catch.catching_current_a > 0.0 { catch.catching_current_a / allowed_a } else { 0.0 }
    };
    let error = |catch: &FlyingStart| (catch.final_error_nm / catch.demand_nm).abs() * 100.0;
    // Without speed, magnets make no voltage by which the drive could learn that they are others.
    let are_others = options.own.flaws.magnets.abs() > SLIGHT_PERCENT;
    let magnets_hide = |catch: &FlyingStart| are_others && catch.speed_rpm.abs() < 1.0;
    let driven = || catches.iter().filter(|catch| catch.demand_nm != 0.0);
    let unknown = driven().filter(|catch| magnets_hide(catch));
    let known = driven().filter(|catch| !magnets_hide(catch));
    let (over, error, unknown) =
        (worst(catches.iter().map(over)), worst(known.map(error)), worst(unknown.map(error)));
    let most = torque_bound(options, 0.5, 1.5);
    let hidden = "the same at standstill in %, not judged: wrong magnets do not show there";
    let mut verdicts = vec![
        Verdict::at_most("catches in another mode than the speed needs", other_mode as f64, 0.0),
        Verdict::at_most("current at a catch over the larger of the machine's and the diodes'", over, 1.02),
        Verdict::at_most("mean torque error after a catch in %", error, most),
    ];
    verdicts.extend(unknown.map(|error| Verdict::at_most(hidden, error, f64::INFINITY)));
    verdicts
}
