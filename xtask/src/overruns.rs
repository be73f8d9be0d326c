//! Interrupts slow, late and lost in the emulator, with the real images: each mishap is called by its name, and the gates are off within
//! a carrier period.

use anyhow::{Context, Result};
use indicatif::ParallelProgressIterator;
use rayon::prelude::*;

use crate::build::System;
use crate::process;
use crate::saboteur::{Found, Saboteur};
use crate::setup::Setup;

/// Ticks of 40 ns.
const TICKS_PER_S: f64 = 25e6;
const CONTROL_TICKS: u32 = 2_500;

/// A system where it is struck.
struct Case {
    system: System,
    /// Options of the rig.
    options: &'static [&'static str],
    /// When, in s from the run's beginning.
    at_s: f64,
    /// What runs then.
    name: &'static str,
    /// From a control tick to its deadline.
    deadline_ticks: u32,
    /// For how long a PWM interrupt may be late.
    late_ticks: u32,
    /// Halves, or carrier periods of the ZS9, that the gates may stay on.
    within_halves: u32,
}

const TRACTION: Case = Case {
    system: System::Traction,
    options: &["--to", "2000"],
    at_s: 0.0,
    name: "",
    deadline_ticks: CONTROL_TICKS,
    late_ticks: CONTROL_TICKS + CONTROL_TICKS / 4,
    within_halves: 2,
};

/// The ZS9 with two carrier periods a control period.
const QUICK: Case = Case {
    system: System::Zs9,
    options: &["--scheme", "s", "--carrier-hz", "20000", "--uin", "800"],
    at_s: 0.0,
    name: "",
    deadline_ticks: 1_875,
    late_ticks: 625,
    within_halves: 1,
};

/// Each mode once, and both carriers of the ZS9.
const CASES: [Case; 9] = [
    Case { at_s: 0.050, name: "async", ..TRACTION },
    Case { at_s: 0.090, name: "sync15", ..TRACTION },
    Case { at_s: 0.140, name: "sync12", ..TRACTION },
    Case { at_s: 0.200, name: "mid7", ..TRACTION },
    Case { at_s: 0.270, name: "mid3", ..TRACTION },
    Case { at_s: 0.340, name: "square", ..TRACTION },
    Case {
        system: System::Zs9,
        options: &["--scheme", "s"],
        at_s: 0.060,
        name: "10 kHz",
        deadline_ticks: 1_250,
        late_ticks: 1_250,
        within_halves: 1,
    },
    // The first and the second peak behind a control tick.
    Case { at_s: 0.060, name: "20 kHz", ..QUICK },
    Case { at_s: 0.060_05, name: "20 kHz", ..QUICK },
];

/// A mishap, what it is to be called, and from when on its time counts.
struct Mishap {
    kind: &'static str,
    /// In ticks, or interrupts.
    amount: u32,
    fault: &'static str,
    /// From the tick that is struck to what is amiss, in ticks: 0, or the missed deadline.
    amiss_after_ticks: u32,
}

impl Case {
    fn mishaps(&self) -> Vec<Mishap> {
        let mishap = |kind, amount, fault| Mishap { kind, amount, fault, amiss_after_ticks: 0 };
        vec![
            mishap("none", 0, ""),
            Mishap {
                amiss_after_ticks: self.deadline_ticks,
                ..mishap("control-slow", self.deadline_ticks + 100, "control_deadline")
            },
            mishap("control-lost", 1, "stale_command"),
            mishap("pwm-lost", 1, "pwm_deadline"),
            mishap("pwm-late", self.late_ticks + 100, "pwm_deadline"),
        ]
    }

    /// A line about the run, and what is wrong with it.
    fn judge(&self, mishap: &Mishap, found: &Found) -> (String, Vec<String>) {
        let name = format!("{} {} {}", self.system.image(), self.name, mishap.kind);
        let mut findings = Vec::new();
        if found.fault != mishap.fault {
            findings.push(format!("{name}: called `{}`, not `{}`", found.fault, mishap.fault));
        }
        let line = |after: String, bound: String| {
            format!(
                "{:<9} {:<7} {:<13} {:<17} {after:>6} {bound:>7}\n",
                self.system.image(),
                self.name,
                mishap.kind,
                found.fault
            )
        };
        if mishap.fault.is_empty() {
            if found.gates_off.is_some() {
                findings.push(format!("{name}: the gates were turned off"));
            }
            return (line(String::new(), String::new()), findings);
        }
        let Some(off) = found.gates_off else {
            findings.push(format!("{name}: the gates stayed on"));
            return (line("never".to_owned(), String::new()), findings);
        };
        let bound = self.within_halves * off.loaded_ticks;
        // A slow interrupt does nothing wrong before its deadline.
        let after = i64::from(off.after_ticks) - i64::from(mishap.amiss_after_ticks);
        if off.struck != 1 {
            findings.push(format!("{name}: {} interrupts were struck, not one", off.struck));
        }
        if after < 0 || after > i64::from(bound) {
            findings.push(format!("{name}: gates off after {after} ticks, at most {bound} are allowed"));
        }
        (line(after.to_string(), bound.to_string()), findings)
    }
}

/// A run: where the mishap's time and amount make no difference, they are 0, so that it is the same for many cases.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Run {
    system: System,
    options: &'static [&'static str],
    orders: (&'static str, u32, u32),
}

impl Run {
    fn of(case: &Case, mishap: &Mishap) -> Self {
        let at_ticks = if mishap.fault.is_empty() { 0 } else { (case.at_s * TICKS_PER_S) as u32 };
        let orders = (mishap.kind, at_ticks, mishap.amount);
        Self { system: case.system, options: case.options, orders }
    }

    fn perform(&self, images: &[Saboteur]) -> Result<(Self, Found)> {
        let image = images.iter().find(|image| image.system == self.system).context("no such image")?;
        let folder = tempfile::tempdir().context("no temporary folder")?;
        Ok((*self, image.run(self.orders, self.options, folder.path())?))
    }
}

/// The step of the tests; what is wrong is printed, `true` is good.
pub fn check(setup: &mut Setup) -> Result<bool> {
    let images: Vec<_> =
        System::ALL.into_iter().map(|system| Saboteur::build(setup, system)).collect::<Result<_>>()?;
    let cases: Vec<_> =
        CASES.iter().flat_map(|case| case.mishaps().into_iter().map(move |mishap| (case, mishap))).collect();
    let mut runs: Vec<Run> = Vec::new();
    for run in cases.iter().map(|(case, mishap)| Run::of(case, mishap)) {
        if !runs.contains(&run) {
            runs.push(run);
        }
    }
    let bar = process::bar("overruns", runs.len());
    let done = runs.par_iter().progress_with(bar).map(|run| run.perform(&images));
    let done: Vec<_> = done.collect::<Result<_>>()?;
    let mut findings = Vec::new();
    println!("{:<9} {:<7} {:<13} {:<17} {:>6} {:>7}", "image", "in", "mishap", "fault", "ticks", "allowed");
    for (case, mishap) in &cases {
        let run = Run::of(case, mishap);
        let (_, found) = done.iter().find(|(of, _)| *of == run).context("a run was left out")?;
        let (line, wrong) = case.judge(mishap, found);
        print!("{line}");
        findings.extend(wrong);
    }
    for finding in &findings {
        println!("{finding}");
    }
    Ok(findings.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::saboteur::GatesOff;

    fn judged(kind: &str, fault: &str, off: Option<(u32, u32)>) -> Vec<String> {
        let case = &CASES[0];
        let mishap = case.mishaps().into_iter().find(|mishap| mishap.kind == kind).unwrap();
        let gates_off =
            off.map(|(struck, after_ticks)| GatesOff { struck, loaded_ticks: 5_000, after_ticks, call: 0 });
        case.judge(&mishap, &Found { fault: fault.to_owned(), gates_off, ..Found::default() }).1
    }

    #[test]
    fn a_good_run_has_no_findings() {
        assert_eq!(judged("none", "", None), [""; 0]);
        assert_eq!(judged("control-lost", "stale_command", Some((1, 10_000))), [""; 0]);
        assert_eq!(judged("control-slow", "control_deadline", Some((1, 12_500))), [""; 0]);
    }

    #[test]
    fn every_way_to_fail_is_found() {
        let lost = "tractive async control-lost";
        for (kind, fault, off, finding) in [
            ("none", "", Some((0, 1)), "tractive async none: the gates were turned off".to_owned()),
            ("control-lost", "stale_command", None, format!("{lost}: the gates stayed on")),
            ("control-lost", "", Some((1, 9)), format!("{lost}: called ``, not `stale_command`")),
            (
                "control-lost",
                "stale_command",
                Some((2, 9)),
                format!("{lost}: 2 interrupts were struck, not one"),
            ),
            (
                "control-lost",
                "stale_command",
                Some((1, 10_001)),
                format!("{lost}: gates off after 10001 ticks, at most 10000 are allowed"),
            ),
        ] {
            assert_eq!(judged(kind, fault, off), [finding]);
        }
        assert!(!judged("control-slow", "control_deadline", Some((1, 2_400))).is_empty());
    }
}
