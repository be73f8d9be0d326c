//! The cells in the emulator, with the higher-priority interrupt landing on every instruction of the other side's access.
//!
//! The image `cell_stress` sweeps the phase of two timers and reports what was read and where its interrupts landed. Here the report is judged: no
//! sound cell may have been torn, stale or empty; each broken one must have been torn; and every instruction of every access, as given by the image's
//! symbols and code, must have been hit.

use crate::elf::Image;
use crate::setup::Setup;
use crate::{build, emulator, image, process};
use anyhow::{Context, Result, bail};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// The image's name, and its module of accesses.
const NAME: &str = "cell_stress";
const ACCESSES: &str = "cell_stress::accesses::";
/// 64 ns an instruction: longer than a tick of the timers, 40 ns, by which the phase moves.
const NANOSECONDS_SHIFT: u32 = 6;

/// The image's account of a run.
#[derive(Debug, Default, PartialEq, Eq)]
struct Said {
    rounds: u32,
    /// Control interrupts that lasted longer than their period: then the sweep is not valid.
    late: u32,
    cells: BTreeMap<String, Counts>,
    /// The addresses at which interrupts landed.
    landed: BTreeSet<u32>,
}

/// The findings about a cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Counts {
    reads: u32,
    torn: u32,
    stale: u32,
    missing: u32,
}

/// The step of the tests; what is wrong is printed, `true` is good.
pub fn check(setup: &mut Setup) -> Result<bool> {
    let qemu = setup.qemu()?;
    let path = build::bench(&setup.toolchain()?, NAME)?;
    let said = said(&run(&qemu, &path)?)?;
    let extents = extents(&image::read(&path)?);
    print!("{}", table(&said, &extents));
    Ok(process::is_good(&findings(&said, &extents)))
}

fn run(qemu: &Path, path: &Path) -> Result<String> {
    let mut command = emulator::command(qemu, path, NANOSECONDS_SHIFT);
    let output = command.output().with_context(|| process::cannot_start(&command))?;
    if !output.status.success() {
        bail!("{NAME} failed in the emulator ({})", output.status);
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

fn said(text: &str) -> Result<Said> {
    let mut said = Said::default();
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        let number = |word: &str| word.parse::<u32>().with_context(|| format!("{NAME} says `{line}`"));
        match words[..] {
            ["rounds", rounds, "late", late] => (said.rounds, said.late) = (number(rounds)?, number(late)?),
            ["cell", name, reads, torn, stale, missing] => {
                let (reads, torn) = (number(reads)?, number(torn)?);
                let counts = Counts { reads, torn, stale: number(stale)?, missing: number(missing)? };
                said.cells.insert(name.to_owned(), counts);
            }
            ["landed", address] => {
                let address =
                    u32::from_str_radix(address, 16).with_context(|| format!("{NAME} says `{line}`"))?;
                said.landed.insert(address);
            }
            _ => bail!("{NAME} says `{line}`"),
        }
    }
    Ok(said)
}

/// The addresses of every access's instructions.
fn extents(image: &Image) -> BTreeMap<String, Vec<u32>> {
    let named = image.functions.iter().filter_map(|(start, function)| {
        let name = function.names.iter().find_map(|name| name.strip_prefix(ACCESSES))?;
        Some((name.to_owned(), image.instructions_of(*start).map(|(at, _)| at).collect()))
    });
    named.collect()
}

fn is_broken(name: &str) -> bool {
    name.starts_with("broken-")
}

/// A reader of these subjects finds nothing, or may give up.
fn may_miss(name: &str) -> bool {
    name.starts_with("burst-") || name.starts_with("ring-") || name.ends_with("-empty")
}

fn findings(said: &Said, extents: &BTreeMap<String, Vec<u32>>) -> Vec<String> {
    let mut findings = Vec::new();
    if said.late > 0 || said.rounds == 0 {
        findings.push(format!("{} rounds, {} of them late: no sweep of the phase", said.rounds, said.late));
    }
    let broken = said.cells.keys().filter(|name| is_broken(name)).count();
    if broken == 0 || said.cells.len() == broken {
        findings.push("the image must have sound cells and broken ones".to_owned());
    }
    for (name, counts) in &said.cells {
        let Counts { reads, torn, stale, missing } = *counts;
        if reads == 0 || (missing == reads && !name.ends_with("-empty")) {
            findings.push(format!("{name}: never read"));
        } else if is_broken(name) && torn == 0 {
            findings.push(format!("{name}: never torn, so the test cannot fail"));
        } else if !is_broken(name) && (torn > 0 || stale > 0 || (missing > 0 && !may_miss(name))) {
            findings.push(format!("{name}: {torn} torn, {stale} stale, {missing} missing of {reads}"));
        }
    }
    if extents.is_empty() {
        findings.push(format!("the image names no function {ACCESSES}…"));
    }
    for (name, instructions) in extents {
        let spared = instructions.iter().filter(|at| !said.landed.contains(at)).map(|at| format!("{at:#x}"));
        let spared: Vec<_> = spared.collect();
        if !spared.is_empty() {
            findings.push(format!("{name}: no interrupt landed on {}", spared.join(", ")));
        }
    }
    findings
}

fn table(said: &Said, extents: &BTreeMap<String, Vec<u32>>) -> String {
    let mut text = format!("{:<20} {:>7} {:>6} {:>6} {:>8}\n", "cell", "reads", "torn", "stale", "missing");
    for (name, Counts { reads, torn, stale, missing }) in &said.cells {
        text += &format!("{name:<20} {reads:>7} {torn:>6} {stale:>6} {missing:>8}\n");
    }
    text += &format!("\n{:<20} {:>12} {:>6}\n", "access", "instructions", "hit");
    for (name, instructions) in extents {
        let hit = instructions.iter().filter(|at| said.landed.contains(at)).count();
        text += &format!("{name:<20} {:>12} {hit:>6}\n", instructions.len());
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elf::tests::small_elf;

    const GOOD: &str = "rounds 5 late 0\ncell downlink-9 10 0 0 0\ncell burst-uplink-27 9 0 0 3\n\
        cell broken-plain-up 8 2 0 0\nlanded 100\nlanded 102\nlanded 106\n";

    /// One access: push {r4, lr}, bl, pop {r4, pc}.
    fn judged(text: &str) -> Vec<String> {
        let functions: [(&str, u32, &[u16]); 1] =
            [("cell_stress::accesses::read", 0x100, &[0xB510, 0xF000, 0xF805, 0xBD10])];
        let image = Image::parse(&small_elf(0x100, &functions)).unwrap();
        findings(&said(text).unwrap(), &extents(&image))
    }

    #[test]
    fn a_good_run_has_no_findings() {
        assert_eq!(judged(GOOD), [""; 0]);
    }

    #[test]
    fn every_way_to_fail_is_found() {
        for (from, to, finding) in [
            ("late 0", "late 1", "5 rounds, 1 of them late: no sweep of the phase"),
            ("9 10 0 0 0", "9 10 1 0 0", "downlink-9: 1 torn, 0 stale, 0 missing of 10"),
            ("9 10 0 0 0", "9 10 0 1 0", "downlink-9: 0 torn, 1 stale, 0 missing of 10"),
            ("9 10 0 0 0", "9 10 0 0 1", "downlink-9: 0 torn, 0 stale, 1 missing of 10"),
            ("9 10 0 0 0", "9 0 0 0 0", "downlink-9: never read"),
            ("27 9 0 0 3", "27 9 0 0 9", "burst-uplink-27: never read"),
            ("27 9 0 0 3", "27 9 1 0 3", "burst-uplink-27: 1 torn, 0 stale, 3 missing of 9"),
            ("up 8 2", "up 8 0", "broken-plain-up: never torn, so the test cannot fail"),
            ("cell broken-plain-up 8 2 0 0\n", "", "the image must have sound cells and broken ones"),
            ("landed 102\n", "", "read: no interrupt landed on 0x102"),
        ] {
            assert!(GOOD.contains(from), "{from}");
            assert_eq!(judged(&GOOD.replace(from, to)), [finding]);
        }
        assert!(said("cell x 1 2").is_err());
        assert!(said("landed x").is_err());
    }
}
