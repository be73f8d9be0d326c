//! The images with the fault injector, driven by the rig.

use crate::build::{self, System};
use crate::process;
use crate::setup::Setup;
use anyhow::{Context, Result, bail, ensure};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The file that the image reads and writes.
const FOUND: &str = "found";

/// Everything that is needed to run one.
pub struct FaultInjector {
    pub rig: PathBuf,
    pub qemu: PathBuf,
    pub image: PathBuf,
    pub system: System,
    /// The rig's scenario: initially the one for `cargo xtask timing`.
    pub scenario: &'static str,
}

/// The outcome of a run.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Found {
    /// The fault's name as it came over the link; empty without one.
    pub fault: String,
    pub gates_off: Option<GatesOff>,
    /// Control interrupts, if they were asked for.
    pub seen: Vec<Seen>,
}

/// A control interrupt.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seen {
    /// Its number, from 0.
    pub number: usize,
    /// Time from its arrival to the next carrier boundary, in ticks.
    pub left_ticks: u32,
    /// The address at which a PWM interrupt landed in it.
    pub landed: Option<u32>,
}

/// The instant at which the gates were turned off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GatesOff {
    /// Interrupts that a fault was injected into.
    pub injected: u32,
    /// Length of the half, or of the ZS9's carrier period, that was loaded when the first of them was due, in ticks.
    pub loaded_ticks: u32,
    /// From then until the gates were turned off, in ticks.
    pub after_ticks: u32,
    /// Number of the control interrupt that was under way, or came next.
    pub call: usize,
}

impl FaultInjector {
    /// Builds the image.
    pub fn build(setup: &mut Setup, system: System) -> Result<Self> {
        let (qemu, rig) = (setup.qemu()?, build::rig()?);
        let image = build::fault_injector(&setup.toolchain()?, system)?;
        let scenario = if system == System::Traction { "timing" } else { "zs9-timing" };
        Ok(Self { rig, qemu, image, system, scenario })
    }

    /// The argument that gives the image its orders: the fault, and the file for the outcome.
    pub fn orders(kind: &str, at_ticks: u32, amount: u32, found: &Path) -> [String; 2] {
        let orders = format!("{kind} {at_ticks} {amount} {}", found.display());
        ["--qemu-arg=-append".to_owned(), format!("--qemu-arg={orders}")]
    }

    /// Runs the scenario; each control interrupt begins so many instructions after it arrived.
    pub fn delay(&self, instructions: &[u16], options: &[&str], out: &Path) -> Result<Found> {
        let bytes: Vec<u8> = instructions.iter().flat_map(|count| count.to_le_bytes()).collect();
        std::fs::create_dir_all(out).with_context(|| out.display().to_string())?;
        std::fs::write(out.join(FOUND), bytes)?;
        self.run(("landing", 0, 0), options, out)
    }

    /// Runs the scenario with these options of the rig; its files go to `out`.
    pub fn run(&self, orders: (&str, u32, u32), options: &[&str], out: &Path) -> Result<Found> {
        std::fs::create_dir_all(out).with_context(|| out.display().to_string())?;
        let found = out.join(FOUND);
        let (kind, at_ticks, amount) = orders;
        let mut rig = Command::new(&self.rig);
        rig.args(["run", self.scenario, "--on", "qemu", "--dt", "1e-3", "--out"]).arg(out);
        rig.arg("--image").arg(&self.image).arg("--qemu").arg(&self.qemu);
        rig.args(Self::orders(kind, at_ticks, amount, &found)).args(options);
        let output = rig.output().with_context(|| process::cannot_start(&rig))?;
        // 1: the drive tripped.
        if !matches!(output.status.code(), Some(0 | 1)) {
            bail!("{kind}: the rig failed: {}", String::from_utf8_lossy(&output.stderr).trim());
        }
        let bytes = std::fs::read(&found).with_context(|| found.display().to_string())?;
        let summary = std::fs::read_to_string(out.join("summary.json"))?;
        let summary: serde_json::Value = serde_json::from_str(&summary)?;
        let fault =
            summary["figures"]["fault"].as_str().context("the summary names no fault, not even none")?;
        Ok(Found { fault: fault.to_owned(), ..read(&bytes)? })
    }
}

/// The account of an image, read from its file: records of five words.
fn read(bytes: &[u8]) -> Result<Found> {
    let mut found = Found::default();
    let (words, rest) = bytes.as_chunks::<4>();
    let words: Vec<_> = words.iter().map(|word| u32::from_le_bytes(*word)).collect();
    let (records, incomplete) = words.as_chunks::<5>();
    ensure!(rest.is_empty() && incomplete.is_empty(), "the image did not end its last record");
    for record in records {
        match *record {
            [1, injected, loaded_ticks, after_ticks, call] => {
                found.gates_off = Some(GatesOff { injected, loaded_ticks, after_ticks, call: call as usize });
            }
            [2, number, left_ticks, landed, 0] => {
                let landed = (landed != 0).then_some(landed);
                found.seen.push(Seen { number: number as usize, left_ticks, landed });
            }
            _ => bail!("the image says {record:?}"),
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bytes(words: &[u32]) -> Vec<u8> {
        words.iter().flat_map(|word| word.to_le_bytes()).collect()
    }

    #[test]
    fn what_the_image_writes_is_read_and_what_it_does_not_is_refused() {
        let found = read(&bytes(&[1, 1, 13_889, 2_588, 7, 2, 3, 9, 0x41C, 0, 2, 4, 8, 0, 0])).unwrap();
        let gates_off = GatesOff { injected: 1, loaded_ticks: 13_889, after_ticks: 2_588, call: 7 };
        assert_eq!(found.gates_off, Some(gates_off));
        let seen = |number, left_ticks, landed| Seen { number, left_ticks, landed };
        assert_eq!(found.seen, [seen(3, 9, Some(0x41C)), seen(4, 8, None)]);
        assert_eq!(read(&[]).unwrap(), Found::default());
        for words in [&[1, 2, 3, 4][..], &[3, 0, 0, 0, 0], &[2, 0, 0, 0, 1]] {
            assert!(read(&bytes(words)).is_err(), "{words:?}");
        }
        assert!(read(&[0; 19]).is_err());
    }
}
