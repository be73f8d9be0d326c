//! The PWM interrupt on every instruction of the control interrupt, in the emulator, with the real images.
//!
//! An undisturbed run is logged, which shows what each control interrupt executes, and how many instructions after its beginning. Then the same run is
//! repeated many times. Each control interrupt that a carrier boundary comes near enough begins so many instructions later that the PWM interrupt lands
//! on the wanted instruction; the interrupt's instant stays the same. The emulator's time is a count of instructions, so one landing in a control
//! interrupt tells which delay reaches each other instruction. Where it landed is the return address on its stack. Nothing may change: trace and edges
//! of each pass are those of the undisturbed run, byte for byte. Every instruction must be hit except those that no boundary can reach; [`reach`] says
//! which, [`search`] chooses the delays.

mod reach;
mod search;

use crate::build::System;
use crate::elf::Image;
use crate::fault_injector::{FaultInjector, Found};
use crate::image;
use crate::setup::Setup;
use crate::timing::drive::Bench;
use crate::timing::statistics::INTERRUPTS;
use anyhow::{Context, Result};
use rayon::prelude::*;
use reach::{Reached, Stand};
use search::Search;
use std::collections::HashSet;
use std::path::Path;

/// The course of runs through which one system is driven.
struct Course {
    system: System,
    /// Scenarios and options of the rig, one run each: the first goes through every mode.
    runs: &'static [(&'static str, &'static [&'static str])],
    /// The control period, and from a control interrupt to its deadline, in ticks.
    control_ticks: u32,
    deadline_ticks: u32,
    /// The most instructions that may be left without an excuse: instructions that are executed a few times a run, mostly far from a boundary. Each is
    /// named.
    most_missing: usize,
}

/// 4 ns an instruction, ten of them a tick: all of a control interrupt lies between its timer and the ZS9's first peak behind it.
const QUICK: [&str; 2] = ["--qemu-arg=-icount", "--qemu-arg=shift=2"];
const INSTRUCTIONS_PER_TICK: u32 = 10;

const COURSES: [Course; 2] = [
    Course {
        system: System::Traction,
        // With control so slow that a carrier half is shorter than two of its periods: each half then contains all stages of the law, so a boundary
        // comes at each. With phases of the timers where a boundary meets what control does every fifty periods, and once a switch.
        runs: &[
            ("timing", &["--to=2500", "--control-hz=3125"]),
            ("borders-timing", &["--pwm-delay-us=25", "--control-hz=3125"]),
            ("borders-timing", &["--pwm-delay-us=175", "--control-hz=3125"]),
            ("borders-timing", &["--pwm-delay-us=250", "--control-hz=3125"]),
            ("borders-timing", &["--pwm-delay-us=100", "--control-hz=3125"]),
        ],
        control_ticks: 8_000,
        deadline_ticks: 8_000,
        // 83 are left, at the end of a measurement of the position sensor's errors: where a boundary could come, twice a run.
        most_missing: 88,
    },
    // At 10 kHz the PWM interrupt comes at control's deadline.
    Course {
        system: System::Zs9,
        runs: &[("zs9-timing", &["--scheme=s", "--carrier-hz=20000", "--uin=800"])],
        control_ticks: 2_500,
        deadline_ticks: 1_875,
        most_missing: 0,
    },
];

/// Passes of a run that are made at once, and the largest number of rounds.
const AT_ONCE: usize = 2;
const MOST_ROUNDS: usize = 24;
/// A run that is followed by another one ends with a round that has hit fewer new instructions than this.
const LEAST_NEW: usize = 12;
/// The link's shortest path, in instructions.
const LINK: u32 = 20;

/// One control interrupt of the undisturbed run.
struct Call {
    mode: String,
    /// Its own instructions in their order, and the number executed before each of them since it began.
    path: Vec<(u32, u32)>,
    /// Instructions before its samples.
    sampled: u32,
}

/// The step of the tests; what is wrong is printed, `true` is good.
pub fn check(setup: &mut Setup) -> Result<bool> {
    let folder = tempfile::tempdir().context("no temporary folder")?;
    let built = COURSES.iter().map(|course| Ok((course, FaultInjector::build(setup, course.system)?)));
    let built: Vec<_> = built.collect::<Result<_>>()?;
    let courses = built.into_par_iter().map(|(course, injector)| course.check(injector, folder.path()));
    let mut good = true;
    for (text, is_good) in courses.collect::<Result<Vec<_>>>()? {
        print!("{text}");
        good &= is_good;
    }
    Ok(good)
}

impl Course {
    /// The lines to print, and whether the result is good.
    fn check(&self, mut injector: FaultInjector, folder: &Path) -> Result<(String, bool)> {
        let folder = folder.join(self.system.image());
        let image = image::read(&injector.image)?;
        let mut reached = Reached::default();
        let mut findings = Vec::new();
        for (number, (scenario, options)) in self.runs.iter().enumerate() {
            let is_last = number + 1 == self.runs.len();
            injector.scenario = scenario;
            let options = [&QUICK, *options].concat();
            let run =
                Run { course: self, injector: &injector, image: &image, options, folder: &folder, is_last };
            findings.extend(run.check(&mut reached)?);
        }
        let (image_name, Reached { preemption, passes, .. }) = (self.system.image(), &reached);
        let mut text =
            format!("{image_name}: {preemption} preemption in {passes} passes\n{}", reached.table());
        let missing = reached.findings(&image);
        if missing.len() > self.most_missing {
            findings.push(format!("{} were not hit, more than {}", missing.len(), self.most_missing));
        }
        for finding in missing.iter().chain(&findings) {
            text += &format!("{finding}\n");
        }
        Ok((text, findings.is_empty()))
    }
}

/// A run of a course.
struct Run<'a> {
    course: &'a Course,
    injector: &'a FaultInjector,
    image: &'a Image,
    options: Vec<&'a str>,
    folder: &'a Path,
    is_last: bool,
}

impl Run<'_> {
    /// Adds what it reaches; returns its findings.
    fn check(&self, reached: &mut Reached) -> Result<Vec<String>> {
        let folder = |name: &str| self.folder.join(name);
        let undisturbed = || self.undisturbed(&folder("undisturbed"));
        let prompt = || self.injector.delay(&[], &self.options, &folder("prompt"));
        let (calls, (undisturbed, seen)) =
            rayon::join(|| self.calls(&folder("logged")), || rayon::join(undisturbed, prompt));
        let (calls, (undisturbed, undisturbed_files), seen) = (calls?, undisturbed?, seen?.seen);
        let prompt = vec![0; calls.len()];
        let mut search =
            Search::new(Stand::all(&calls, &seen, self.course.control_ticks, self.course.deadline_ticks));
        search.take(&prompt, &seen, &mut Reached::default());
        let mut findings = Vec::new();
        for _ in 0..MOST_ROUNDS {
            let before = reached.hit_in_any().len();
            let Some(delays) = search.delays(calls.len(), AT_ONCE, reached) else { break };
            for (delays, (found, files)) in delays.iter().zip(self.passes(&delays)?) {
                reached.passes += 1;
                let pass = reached.passes;
                let wanted = &undisturbed.fault;
                if found.fault != *wanted {
                    findings.push(format!("pass {pass}: fault `{}`, not `{wanted}`", found.fault));
                } else if files != undisturbed_files {
                    findings
                        .push(format!("pass {pass}: trace or edges are not those of the undisturbed run"));
                }
                search.take(delays, &found.seen, reached);
            }
            let new = reached.hit_in_any().len() - before;
            if !self.is_last && new < LEAST_NEW {
                break;
            }
        }
        reached.judge(&search.stands);
        Ok(findings)
    }

    /// Makes the passes with these delays, all at once; returns for each its outcome and what must not change.
    fn passes(&self, delays: &[Vec<u16>]) -> Result<Vec<(Found, [Vec<u8>; 2])>> {
        let passes = delays.par_iter().enumerate().map(|(number, delays)| {
            let folder = self.folder.join(number.to_string());
            let found = self.injector.delay(delays, &self.options, &folder)?;
            Ok((found, files(&folder)?))
        });
        passes.collect()
    }

    /// The outcome of a run whose interrupts are left alone, and the files that must not change.
    fn undisturbed(&self, folder: &Path) -> Result<(Found, [Vec<u8>; 2])> {
        let found = self.injector.run(("none", 0, 0), &self.options, folder)?;
        Ok((found, files(folder)?))
    }

    /// The control interrupts of an undisturbed run.
    fn calls(&self, folder: &Path) -> Result<Vec<Call>> {
        let injector = self.injector;
        let bench = Bench {
            rig: injector.rig.clone(),
            qemu: injector.qemu.clone(),
            command: vec!["run".to_owned(), injector.scenario.to_owned()],
            path: injector.image.clone(),
            image: self.image.clone(),
            keeps_paths: true,
        };
        std::fs::create_dir_all(folder)?;
        let log = folder.join("log");
        // No delays.
        std::fs::write(&log, [])?;
        // The path into control is the same as in the passes.
        let orders = FaultInjector::orders("landing", 0, 0, &log);
        let options: Vec<_> = orders.iter().map(String::as_str).chain(self.options.iter().copied()).collect();
        let drive = bench.drive(&options)?;
        let [(control, exception), _] = INTERRUPTS;
        let paths = drive.calls.iter().zip(drive.paths).filter(|(call, _)| call.exception == exception);
        let served = drive.served.into_iter().filter(|served| served.interrupt == control);
        let modes = served.map(|served| served.mode);
        let foreign = foreign(self.image);
        let calls = paths.zip(modes).map(|((_, path), mode)| {
            let steps = path.addresses.into_iter().zip(path.elapsed);
            let path: Vec<_> = steps.filter(|(address, _)| !foreign.contains(address)).collect();
            // The link is the first gap.
            let gap = path.windows(2).find(|pair| pair[1].1 > pair[0].1 + LINK);
            let sampled = gap.map_or(0, |pair| pair[1].1);
            Call { mode, path, sampled }
        });
        Ok(calls.collect())
    }
}

/// The beginning of the names of the injector's own functions.
const INJECTOR: &str = "tractive_fault_injector::";

/// Half-words of code that leads to the interrupt and is not its own.
fn foreign(image: &Image) -> HashSet<u32> {
    let functions = image.functions.iter();
    let injectors =
        functions.filter(|(_, function)| function.names.iter().any(|name| name.starts_with(INJECTOR)));
    injectors.flat_map(|(start, function)| (*start..start + function.size).step_by(2)).collect()
}

/// The files that must not change.
fn files(folder: &Path) -> Result<[Vec<u8>; 2]> {
    let read = |name: &str| {
        let path = folder.join(name);
        std::fs::read(&path).with_context(|| path.display().to_string())
    };
    Ok([read("trace.csv")?, read("edges.csv")?])
}
