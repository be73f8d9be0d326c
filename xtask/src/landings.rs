//! The PWM interrupt on every instruction of the control interrupt, in the emulator, with the real images.
//!
//! An undisturbed run is logged: so it is known what each control interrupt executes. Then the same is run again and again, and control
//! waits before a carrier boundary, at its entry or with its samples in hand, for as long as it takes the PWM interrupt to land on an
//! instruction that it has not hit yet; its instant stays what it was. Where it landed is the return address on its stack. Nothing may
//! change: trace and edges of each pass are those of the undisturbed run, byte for byte.

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::path::Path;

use anyhow::{Context, Result};

use crate::build::System;
use crate::elf::Image;
use crate::image;
use crate::saboteur::{Folder, Saboteur};
use crate::setup::Setup;
use crate::timing::drive::Bench;
use crate::timing::statistics::INTERRUPTS;

/// What one system is driven through.
struct Course {
    system: System,
    scenario: &'static str,
    options: &'static [&'static str],
    /// Share of the executed instructions that must be hit, in percent.
    least_percent: f64,
}

const COURSES: [Course; 2] = [
    Course { system: System::Traction, scenario: "timing", options: &["--to=6000"], least_percent: 95.0 },
    // At 10 kHz the PWM interrupt comes at control's deadline.
    Course {
        system: System::Zs9,
        scenario: "zs9-timing",
        options: &["--scheme=s", "--carrier-hz=20000", "--uin=800"],
        least_percent: 80.0,
    },
];

/// Passes at most, and passes without anything new after which no other follows.
const MOST_PASSES: usize = 24;
const IDLE_PASSES: usize = 4;
/// Bit of a wish that counts from the interrupt's entry; the value of none.
const AT_ENTRY: u16 = 1 << 15;
const ANYWHERE: u16 = u16::MAX;
/// By how many instructions a landing may miss its mark.
const NEAR: usize = 3;

/// One control interrupt of the undisturbed run.
struct Call {
    mode: String,
    /// Its own instructions in their order, and how many of them before its samples.
    path: Vec<u32>,
    sampled: usize,
}

/// An instruction in a mode.
type Place = (String, u32);

/// The step of the tests; what is wrong is printed, `true` is good.
pub fn check(setup: &mut Setup) -> Result<bool> {
    let folder = Folder::new("landings");
    let mut good = true;
    for course in &COURSES {
        good &= course.check(setup, &folder.0)?;
    }
    Ok(good)
}

impl Course {
    fn check(&self, setup: &mut Setup, folder: &Path) -> Result<bool> {
        let saboteur = Saboteur::build(setup, self.system)?;
        let image = image::read(&saboteur.image)?;
        let calls = self.calls(&saboteur, &image, folder)?;
        let undisturbed = saboteur.run(("none", 0, 0), self.options, folder)?;
        let files = files(folder)?;
        let mut hunt = Hunt::new(&calls);
        let (mut findings, mut passes, mut idle) = (Vec::new(), 0, 0);
        while passes < MOST_PASSES && idle < IDLE_PASSES && !hunt.missing.is_empty() {
            let wanted = hunt.wanted(passes);
            let found = saboteur.land(&wanted, self.options, folder)?;
            passes += 1;
            if found.fault != undisturbed.fault {
                findings.push(format!("pass {passes}: fault `{}`, not `{}`", found.fault, undisturbed.fault));
            } else if self::files(folder)? != files {
                findings.push(format!("pass {passes}: trace or edges are not those of the undisturbed run"));
            }
            idle = if hunt.take(&wanted, &found.landed) { 0 } else { idle + 1 };
        }
        let (text, percent) = hunt.table();
        println!("{}: {} landings in {passes} passes", self.system.image(), hunt.landings);
        print!("{text}");
        if percent < self.least_percent {
            findings.push(format!("{percent:.1} % were hit, at least {} are wanted", self.least_percent));
        }
        for finding in &findings {
            println!("{finding}");
        }
        Ok(findings.is_empty())
    }

    /// The control interrupts of an undisturbed run.
    fn calls(&self, saboteur: &Saboteur, image: &Image, folder: &Path) -> Result<Vec<Call>> {
        let bench = Bench {
            rig: saboteur.rig.clone(),
            qemu: saboteur.qemu.clone(),
            scenario: self.scenario,
            path: saboteur.image.clone(),
            image: image.clone(),
            keeps_paths: true,
        };
        std::fs::create_dir_all(folder)?;
        let orders = Saboteur::orders("none", 0, 0, &folder.join("log"));
        let options: Vec<_> = orders.iter().map(String::as_str).chain(self.options.iter().copied()).collect();
        let drive = bench.drive(&options)?;
        let [(control, exception), _] = INTERRUPTS;
        let paths = drive.calls.iter().zip(drive.paths).filter(|(call, _)| call.exception == exception);
        let modes = drive.modes.into_iter().filter(|(name, ..)| name == control).map(|(_, mode, _)| mode);
        let foreign = foreign(image);
        let calls = paths.zip(modes).map(|((_, path), mode)| {
            let own = |addresses: &[u32]| {
                addresses.iter().copied().filter(|at| !foreign.contains(at)).collect::<Vec<_>>()
            };
            let sampled = own(&path.addresses[..path.linked]).len();
            Call { mode, path: own(&path.addresses), sampled }
        });
        Ok(calls.collect())
    }
}

/// Half-words of what leads to the interrupt and is not its own.
fn foreign(image: &Image) -> HashSet<u32> {
    let functions = image.functions.iter();
    let saboteurs =
        functions.filter(|(_, function)| function.names.iter().any(|name| name.contains("saboteur")));
    saboteurs.flat_map(|(start, function)| (*start..start + function.size).step_by(2)).collect()
}

/// What must not change.
fn files(folder: &Path) -> Result<[Vec<u8>; 2]> {
    let read = |name: &str| {
        let path = folder.join(name);
        std::fs::read(&path).with_context(|| path.display().to_string())
    };
    Ok([read("trace.csv")?, read("edges.csv")?])
}

/// What was hit, and what is to be hit next.
struct Hunt<'a> {
    calls: &'a [Call],
    missing: BTreeSet<Place>,
    all: BTreeSet<Place>,
    hit: BTreeSet<u32>,
    /// Calls that have a boundary near enough behind their samples, or behind their entry.
    reached: [BTreeSet<usize>; 2],
    /// By how many instructions more than wanted it lands.
    late: [i32; 2],
    landings: usize,
}

impl<'a> Hunt<'a> {
    fn new(calls: &'a [Call]) -> Self {
        let places = calls.iter().flat_map(|call| call.path.iter().map(|at| (call.mode.clone(), *at)));
        let all: BTreeSet<Place> = places.collect();
        let reached = [BTreeSet::new(), BTreeSet::new()];
        Self { calls, missing: all.clone(), all, hit: BTreeSet::new(), reached, late: [0; 2], landings: 0 }
    }

    /// What each control interrupt of the next pass wants: in the first two anywhere behind the samples and behind the entry, to see
    /// which ones are reached, then what is still missing.
    fn wanted(&self, pass: usize) -> Vec<u16> {
        if let 0 | 1 = pass {
            let spread = |(number, call): (usize, &Call)| {
                let (from, to) = part(call, pass == 1);
                self.wish(pass == 1, number * 389 % (to - from).max(1), 0)
            };
            return self.calls.iter().enumerate().map(spread).collect();
        }
        let mut wanted = vec![ANYWHERE; self.calls.len()];
        let mut reserved = HashSet::new();
        for (entry, reached) in [(true, &self.reached[1]), (false, &self.reached[0])] {
            for number in reached {
                let call = &self.calls[*number];
                let (from, to) = part(call, entry);
                let missing = |at: &usize| {
                    let place = (call.mode.clone(), call.path[*at]);
                    self.missing.contains(&place) && !reserved.contains(&place)
                };
                // Nearer than it lands without waiting there is nothing to be had; from a place of its own on, so that no two passes
                // begin with the same.
                let nearest = (from + self.late[usize::from(entry)].max(0) as usize).min(to);
                let first = nearest + (pass * 131 + number * 389) % (to - nearest).max(1);
                let Some(at) = (first..to).chain(nearest..first).find(missing) else { continue };
                let near = from.max(at.saturating_sub(NEAR))..to.min(at + NEAR + 1);
                reserved.extend(call.path[near].iter().map(|address| (call.mode.clone(), *address)));
                // Where the same mark was missed before, another pass tries beside it.
                wanted[*number] = self.wish(entry, at - from, pass as i32 % 5 - 2);
            }
        }
        wanted
    }

    fn wish(&self, entry: bool, at: usize, beside: i32) -> u16 {
        let at =
            (at as i32 - self.late[usize::from(entry)] + beside).clamp(0, i32::from(AT_ENTRY) - 2) as u16;
        if entry { at | AT_ENTRY } else { at }
    }

    /// Takes what came of it; whether there was anything new.
    fn take(&mut self, wanted: &[u16], landed: &[(usize, u32)]) -> bool {
        let before = self.missing.len();
        let mut misses = [Vec::new(), Vec::new()];
        for (number, address) in landed {
            let Some(call) = self.calls.get(*number) else { continue };
            if !call.path.contains(address) {
                continue;
            }
            self.landings += 1;
            self.hit.insert(*address);
            self.missing.remove(&(call.mode.clone(), *address));
            let wish = wanted.get(*number).copied().unwrap_or(ANYWHERE);
            if wish == ANYWHERE {
                continue;
            }
            let entry = wish & AT_ENTRY != 0;
            let (from, to) = part(call, entry);
            let mark = i32::from(wish & !AT_ENTRY);
            let misses_by = |at: usize| at as i32 - from as i32 - mark;
            let places = (from..to).filter(|at| call.path[*at] == *address).map(misses_by);
            if let Some(miss) = places.min_by_key(|miss| (miss - self.late[usize::from(entry)]).abs()) {
                self.reached[usize::from(entry)].insert(*number);
                misses[usize::from(entry)].push(miss);
            }
        }
        for (late, misses) in self.late.iter_mut().zip(&mut misses) {
            misses.sort_unstable();
            *late = misses.get(misses.len() / 2).copied().unwrap_or(*late);
        }
        self.missing.len() < before
    }

    /// Executed, hit, and what could not be, by mode; the share hit of those executed in any mode, in percent.
    fn table(&self) -> (String, f64) {
        let reached = self.reached.iter().zip([false, true]).flat_map(|(numbers, entry)| {
            numbers.iter().flat_map(move |number| {
                let call = &self.calls[*number];
                let (from, to) = part(call, entry);
                call.path[from..to].iter().map(|at| (call.mode.clone(), *at))
            })
        });
        let reached: BTreeSet<Place> = reached.collect();
        let mut counts: BTreeMap<&str, [usize; 3]> = BTreeMap::new();
        for place in &self.all {
            let [all, hit, far] = counts.entry(&place.0).or_default();
            *all += 1;
            *hit += usize::from(!self.missing.contains(place));
            *far += usize::from(self.missing.contains(place) && !reached.contains(place));
        }
        let any: BTreeSet<u32> = self.all.iter().map(|(_, at)| *at).collect();
        let within: BTreeSet<u32> = reached.iter().map(|(_, at)| *at).collect();
        let far = any.iter().filter(|at| !self.hit.contains(at) && !within.contains(at)).count();
        let hit = any.intersection(&self.hit).count();
        let mut text = format!(
            "{:<16} {:>12} {:>6} {:>6} {:>12} {:>7}\n",
            "mode", "instructions", "hit", "%", "out of reach", "missed"
        );
        for (mode, [all, hit, far]) in counts.into_iter().chain([("any", [any.len(), hit, far])]) {
            let percent = percent(hit, all);
            text +=
                &format!("{mode:<16} {all:>12} {hit:>6} {percent:>6.1} {far:>12} {:>7}\n", all - hit - far);
        }
        (text, percent(hit, any.len()))
    }
}

fn percent(hit: usize, all: usize) -> f64 {
    100.0 * hit as f64 / all.max(1) as f64
}

/// The part of a path before the samples, or behind them.
fn part(call: &Call, entry: bool) -> (usize, usize) {
    if entry { (0, call.sampled) } else { (call.sampled, call.path.len()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn call(mode: &str, path: &[u32], sampled: usize) -> Call {
        Call { mode: mode.to_owned(), path: path.to_vec(), sampled }
    }

    #[test]
    fn what_is_missing_is_wanted_until_it_is_hit() {
        let path: Vec<u32> = (0..20).map(|n| n * 2).collect();
        let calls = [call("async", &path, 10), call("async", &path, 10)];
        let mut hunt = Hunt::new(&calls);
        assert_eq!(hunt.missing.len(), 20);
        // It lands two instructions behind the mark; the second call is out of reach.
        let first = hunt.wanted(0);
        let at = first[0] as usize + 2;
        assert!(hunt.take(&first, &[(0, path[10 + at])]));
        assert_eq!((hunt.late[0], hunt.missing.len()), (2, 19));
        let next = hunt.wanted(2);
        assert_eq!(next[1], ANYWHERE);
        assert!(!hunt.take(&next, &[(0, path[10 + at]), (0, 1_000)]));
        let (text, percent) = hunt.table();
        assert!((percent - 5.0).abs() < 1e-9, "{text}");
        assert!(text.contains("async                      20      1    5.0           10       9"), "{text}");
    }
}
