//! The PWM interrupt on every instruction of the control interrupt, in the emulator, with the real images.
//!
//! Control waits for a pseudo-random time before the next carrier boundary, with its entry and again with its samples in hand: so the PWM
//! interrupt lands anywhere in it, at an unchanged instant. Every pass has other random numbers. Nothing may change: trace and edges of
//! each pass are those of the undisturbed run, byte for byte. What an undisturbed run executes in each mode is the emulator's log; where
//! the PWM interrupt landed is the return address on its stack.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use anyhow::{Context, Result};

use crate::build::System;
use crate::elf::Image;
use crate::image;
use crate::saboteur::{Folder, Saboteur};
use crate::setup::Setup;
use crate::timing::drive::Bench;
use crate::timing::statistics::INTERRUPTS;

/// What one system is driven through, and how often.
struct Course {
    system: System,
    scenario: &'static str,
    options: &'static [&'static str],
    passes: u32,
    /// Names of the modes by the image's numbers; one for all where it does not tell them apart.
    modes: &'static [&'static str],
    /// Share of the executed instructions that must have been hit, in percent.
    least_percent: f64,
}

const COURSES: [Course; 2] = [
    Course {
        system: System::Traction,
        scenario: "timing",
        options: &["--to=6000"],
        passes: 60,
        modes: &["off", "async", "sync15", "sync12", "mid7", "mid3", "square"],
        least_percent: 90.0,
    },
    Course {
        system: System::Zs9,
        scenario: "zs9-timing",
        options: &["--scheme=s", "--carrier-hz=20000", "--uin=800"],
        passes: 6,
        modes: &[""],
        least_percent: 80.0,
    },
];

/// Addresses by mode.
type Addresses = BTreeMap<String, BTreeSet<u32>>;

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
        let executed = self.executed(&saboteur, &image, &folder.join("found"))?;
        let undisturbed = saboteur.run(("none", 0, 0), self.options, folder)?;
        let files = files(folder)?;
        let (mut landed, mut findings) = (Addresses::new(), Vec::new());
        for pass in 1..=self.passes {
            let found = saboteur.run(("landing", 0, pass), self.options, folder)?;
            if found.fault != undisturbed.fault {
                findings.push(format!("pass {pass}: fault `{}`, not `{}`", found.fault, undisturbed.fault));
            } else if self::files(folder)? != files {
                findings.push(format!("pass {pass}: trace or edges are not those of the undisturbed run"));
            }
            for (mode, address) in found.landed {
                let mode = self.modes.get(mode).or(self.modes.last()).copied().unwrap_or_default();
                landed.entry(mode.to_owned()).or_default().insert(address);
            }
        }
        println!("{}, {} passes, each with the same trace and edges:", self.system.image(), self.passes);
        let (text, percent) = table(&executed, &landed);
        print!("{text}");
        if percent < self.least_percent {
            findings.push(format!("{percent:.1} % were hit, at least {} are wanted", self.least_percent));
        }
        print!("{}", spared(&image, &executed, &landed));
        for finding in &findings {
            println!("{finding}");
        }
        Ok(findings.is_empty())
    }

    /// The instructions of the control interrupt that an undisturbed run executes, by mode.
    fn executed(&self, saboteur: &Saboteur, image: &Image, found: &Path) -> Result<Addresses> {
        let bench = Bench {
            rig: saboteur.rig.clone(),
            qemu: saboteur.qemu.clone(),
            scenario: self.scenario,
            path: saboteur.image.clone(),
            image: image.clone(),
            keeps_addresses: true,
        };
        std::fs::create_dir_all(found.parent().unwrap_or(found))?;
        let orders = Saboteur::orders("none", 0, 0, found);
        let options: Vec<_> = orders.iter().map(String::as_str).chain(self.options.iter().copied()).collect();
        let drive = bench.drive(&options)?;
        let [(control, exception), _] = INTERRUPTS;
        let calls = drive.calls.iter().zip(&drive.addresses).filter(|(call, _)| call.exception == exception);
        let modes = drive.modes.iter().filter(|(name, ..)| name == control).map(|(_, mode, _)| mode);
        let mut executed = Addresses::new();
        for ((_, addresses), mode) in calls.zip(modes) {
            let mode = if self.modes.contains(&mode.as_str()) { mode.as_str() } else { "" };
            let own = addresses.iter().filter(|address| !is_saboteurs(image, **address));
            executed.entry(mode.to_owned()).or_default().extend(own);
        }
        Ok(executed)
    }
}

/// Whether it is an instruction of what leads to the interrupt, and not its own.
fn is_saboteurs(image: &Image, address: u32) -> bool {
    let function = image.function_at(address).and_then(|start| image.functions.get(&start));
    function.is_some_and(|function| function.names.iter().any(|name| name.contains("saboteur")))
}

/// What must not change.
fn files(folder: &Path) -> Result<[Vec<u8>; 2]> {
    let read = |name: &str| {
        let path = folder.join(name);
        std::fs::read(&path).with_context(|| path.display().to_string())
    };
    Ok([read("trace.csv")?, read("edges.csv")?])
}

fn union(addresses: &Addresses) -> BTreeSet<u32> {
    addresses.values().flatten().copied().collect()
}

/// Executed and hit, by mode; the share hit of those executed in any mode, in percent.
fn table(executed: &Addresses, landed: &Addresses) -> (String, f64) {
    let mut text = format!("{:<10} {:>12} {:>8} {:>8}\n", "mode", "instructions", "hit", "%");
    let mut percent = 0.0;
    let none = BTreeSet::new();
    let (all, hit_in_any) = (union(executed), union(landed));
    let by_mode = executed.iter().map(|(mode, own)| (mode.as_str(), own, landed.get(mode).unwrap_or(&none)));
    for (mode, own, hit) in by_mode.filter(|(mode, ..)| !mode.is_empty()).chain([("any", &all, &hit_in_any)])
    {
        let count = own.intersection(hit).count();
        percent = 100.0 * count as f64 / own.len().max(1) as f64;
        text += &format!("{mode:<10} {:>12} {count:>8} {percent:>8.1}\n", own.len());
    }
    (text, percent)
}

/// Where the instructions stand that were never hit.
fn spared(image: &Image, executed: &Addresses, landed: &Addresses) -> String {
    let (all, hit) = (union(executed), union(landed));
    let mut by_function: BTreeMap<&str, usize> = BTreeMap::new();
    for address in all.difference(&hit) {
        let function = image.function_at(*address).and_then(|start| image.functions.get(&start));
        let name = function.and_then(|function| function.names.first()).map_or("?", String::as_str);
        *by_function.entry(name).or_default() += 1;
    }
    by_function.into_iter().map(|(name, count)| format!("  {count:>4} never hit in {name}\n")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_share_is_that_of_what_was_executed() {
        let addresses = |mode: &str, own: &[u32]| (mode.to_owned(), own.iter().copied().collect());
        let executed = Addresses::from([addresses("async", &[2, 4, 6]), addresses("off", &[2, 8])]);
        let landed = Addresses::from([addresses("async", &[2, 4, 100]), addresses("off", &[])]);
        let (text, percent) = table(&executed, &landed);
        assert!((percent - 50.0).abs() < 1e-9, "{text}");
        assert!(text.contains("async                 3        2     66.7"), "{text}");
        assert!(text.contains("off                   2        0      0.0"), "{text}");
    }
}
