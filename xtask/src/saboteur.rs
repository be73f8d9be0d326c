//! The images whose board loses and delays interrupts when it is told to, driven by the rig.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::build::{self, System};
use crate::process;
use crate::setup::Setup;

/// The feature of the firmware's crate.
pub const FEATURE: &str = "saboteur";

/// The file that the image reads and writes.
const FOUND: &str = "found";

/// What it takes to run one.
pub struct Saboteur {
    pub rig: PathBuf,
    pub qemu: PathBuf,
    pub image: PathBuf,
    pub system: System,
    /// The rig's scenario: at first that for `cargo xtask timing`.
    pub scenario: &'static str,
}

/// What came of a run.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Found {
    /// The fault's name as it came over the link; empty without one.
    pub fault: String,
    pub gates_off: Option<GatesOff>,
    /// Control interrupts, where that was asked for.
    pub seen: Vec<Seen>,
}

/// A control interrupt.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seen {
    /// Its number, from 0.
    pub number: usize,
    /// From its coming to the next carrier boundary, in ticks.
    pub left_ticks: u32,
    /// Where a PWM interrupt landed in it.
    pub landed: Option<u32>,
}

/// When the gates were turned off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GatesOff {
    /// Interrupts that something was done to.
    pub struck: u32,
    /// Length of the half, or of the ZS9's carrier period, that was loaded when the first of them was due, in ticks.
    pub loaded_ticks: u32,
    /// From then until the gates were turned off, in ticks.
    pub after_ticks: u32,
    /// Number of the control interrupt that was under way, or came next.
    pub call: usize,
}

impl Saboteur {
    /// Builds the image. It stands beside the ordinary one, which the next build puts in its place.
    pub fn build(setup: &mut Setup, system: System) -> Result<Self> {
        let (qemu, rig) = (setup.qemu()?, build::rig()?);
        let built = build::image_with(&setup.toolchain()?, system, FEATURE)?;
        let image = built.with_file_name(format!("{}-{FEATURE}", system.image()));
        std::fs::copy(&built, &image).with_context(|| image.display().to_string())?;
        let scenario = if system == System::Traction { "timing" } else { "zs9-timing" };
        Ok(Self { rig, qemu, image, system, scenario })
    }

    /// The argument by which the image gets its orders: what is to go wrong, and where it writes what came of it.
    pub fn orders(kind: &str, at_ticks: u32, amount: u32, found: &Path) -> [String; 2] {
        let orders = format!("{kind} {at_ticks} {amount} {}", found.display());
        ["--qemu-arg=-append".to_owned(), format!("--qemu-arg={orders}")]
    }

    /// Runs the scenario with each control interrupt beginning so many instructions after it came.
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
        let text = std::fs::read_to_string(&found).with_context(|| found.display().to_string())?;
        let summary = std::fs::read_to_string(out.join("summary.json"))?;
        let summary: serde_json::Value = serde_json::from_str(&summary)?;
        let fault =
            summary["figures"]["fault"].as_str().context("the summary names no fault, not even none")?;
        Ok(Found { fault: fault.to_owned(), ..read(&text)? })
    }
}

/// What the image wrote.
fn read(text: &str) -> Result<Found> {
    let mut found = Found::default();
    let mut ended = false;
    for line in text.lines() {
        let number = |word: &str| word.parse::<u32>().with_context(|| format!("the image says `{line}`"));
        match line.split(' ').collect::<Vec<_>>()[..] {
            ["struck", struck, "loaded", loaded, "safe-after", after, "in", call] => {
                found.gates_off = Some(GatesOff {
                    struck: number(struck)?,
                    loaded_ticks: number(loaded)?,
                    after_ticks: number(after)?,
                    call: number(call)? as usize,
                });
            }
            ["call", call, "left", left, "landed", address] => {
                let address =
                    u32::from_str_radix(address, 16).with_context(|| format!("the image says `{line}`"))?;
                found.seen.push(Seen {
                    number: number(call)? as usize,
                    left_ticks: number(left)?,
                    landed: (address != 0).then_some(address),
                });
            }
            ["end"] => ended = true,
            _ => bail!("the image says `{line}`"),
        }
    }
    if !ended {
        bail!("the image did not come to its end");
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_image_writes_is_read_and_what_it_does_not_is_refused() {
        let found =
            read("struck 1 loaded 13889 safe-after 2588 in 7\ncall 2 left 9 landed 41c\nend\n").unwrap();
        let gates_off = GatesOff { struck: 1, loaded_ticks: 13_889, after_ticks: 2_588, call: 7 };
        assert_eq!(found.gates_off, Some(gates_off));
        assert_eq!(found.seen, [Seen { number: 2, left_ticks: 9, landed: Some(0x41C) }]);
        assert_eq!(read("end\n").unwrap(), Found::default());
        for text in [
            "",
            "call 2 left 9 landed 0\n",
            "struck 1\nend\n",
            "call 2 left 9 landed x\nend\n",
            "nonsense\nend\n",
        ] {
            assert!(read(text).is_err(), "{text}");
        }
    }
}
