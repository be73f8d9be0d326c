//! The building blocks in the bench's image: instructions from the emulator, errors from the host.

use super::log::{Event, Log};
use crate::build::{self, cargo};
use crate::elf::Image;
use crate::setup::Toolchain;
use crate::thumb::cost::REFILL;
use crate::{emulator, image, process};
use anyhow::{Context, Result, bail};
use std::collections::BTreeMap;
use std::path::Path;

/// A building block.
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// Its work and its maker, as `sqrt/libm`.
    pub name: String,
    /// Instructions for the most expensive input.
    pub max: u32,
    pub mean: f64,
    /// Cycles that they take at most.
    pub cycles: u32,
    /// Largest absolute error; `None` if there is nothing to compare with.
    pub max_error: Option<f64>,
}

/// Its largest error as in the tables.
pub fn error(block: &Block) -> String {
    block.max_error.map_or_else(String::new, |error| format!("{error:.1e}"))
}

/// Builds the bench for the board and for the host, runs both.
pub fn measure(toolchain: &Toolchain, qemu: &Path) -> Result<Vec<Block>> {
    let path = build::bench(toolchain, "tractive-bench")?;
    let image = image::read(&path)?;
    let counts = counts(&image, &executed(&image, &run(qemu, &path)?)?);
    let mut host = cargo();
    host.args(["run", "--quiet", "--release", "--package", "tractive-bench", "--bin", "tractive-bench"]);
    let errors = process::output_of(&mut host).context("the bench does not run on this machine")?;
    errors.lines().map(|line| block(line, &counts)).collect()
}

/// Runs the image with its instructions logged; the log.
fn run(qemu: &Path, path: &Path) -> Result<Vec<u8>> {
    let mut command = emulator::command(qemu, path, 3);
    // Without -D the log goes to the standard error.
    command.args(super::log::ARGUMENTS);
    let output = command.output().with_context(|| process::cannot_start(&command))?;
    if !output.status.success() {
        bail!("the bench failed in the emulator ({})", output.status);
    }
    Ok(output.stderr)
}

/// Instructions of each call of each function `tractive_bench::blocks::…`, from its first instruction to its return.
fn counts(image: &Image, executed: &[u32]) -> BTreeMap<String, Vec<Count>> {
    let named = image.functions.iter().filter_map(|(start, function)| {
        let name = function.names.iter().find_map(|name| name.strip_prefix("tractive_bench::blocks::"))?;
        Some((*start, name.to_owned()))
    });
    let blocks: BTreeMap<u32, String> = named.collect();
    let mut counts = BTreeMap::<String, Vec<Count>>::new();
    // The running block's return address, and its progress.
    let mut running: Option<(&String, u32, Count)> = None;
    let mut last = 0;
    for &address in executed {
        running = match running {
            Some((name, back, count)) if address == back => {
                counts.entry(name.clone()).or_default().push(count.after(0, REFILL));
                None
            }
            Some((name, back, count)) => {
                let refill = if address == behind(image, last) { 0 } else { REFILL };
                Some((name, back, count.after(1, cycles(image, address) + refill)))
            }
            None => blocks
                .get(&address)
                .map(|name| (name, behind(image, last), Count::default().after(1, cycles(image, address)))),
        };
        last = address;
    }
    counts
}

/// The addresses of the instructions that were executed.
fn executed(image: &Image, log: &[u8]) -> Result<Vec<u32>> {
    let (mut reader, mut addresses) = (Log::new(image), Vec::new());
    for line in log.split(|byte| *byte == b'\n') {
        reader.take(line, |event| {
            if let Event::Step(address) = event {
                addresses.push(address);
            }
            Ok(())
        })?;
    }
    Ok(addresses)
}

/// The instructions of a call.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Count {
    instructions: u32,
    cycles: u32,
}

impl Count {
    fn after(self, instructions: u32, cycles: u32) -> Self {
        Self { instructions: self.instructions + instructions, cycles: self.cycles + cycles }
    }
}

fn cycles(image: &Image, address: u32) -> u32 {
    image.instructions.get(&address).map_or(0, |instruction| instruction.cycles)
}

/// The address behind the instruction at this one.
fn behind(image: &Image, address: u32) -> u32 {
    address + image.instructions.get(&address).map_or(0, |instruction| instruction.length)
}

/// One of the host's lines, `name,error`, with its counts.
fn block(line: &str, counts: &BTreeMap<String, Vec<Count>>) -> Result<Block> {
    let (name, error) = line.split_once(',').with_context(|| format!("the bench says `{line}`"))?;
    let of = counts.get(&name.replace('/', "_")).with_context(|| format!("{name} was never called"))?;
    let max = of.iter().map(|count| count.instructions).max().unwrap_or(0);
    let cycles = of.iter().map(|count| count.cycles).max().unwrap_or(0);
    let mean = of.iter().map(|count| f64::from(count.instructions)).sum::<f64>() / of.len() as f64;
    Ok(Block { name: name.to_owned(), max, mean, cycles, max_error: error.parse().ok() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elf::tests::small_elf;

    #[test]
    fn a_blocks_calls_are_counted_apart() {
        // main: blx r0, blx r0; the block: bl helper or not, bx lr.
        let image = small_elf(
            0x100,
            &[
                ("main", 0x100, &[0x4780, 0x4780]),
                ("tractive_bench::blocks::sqrt_libm", 0x110, &[0xF000, 0xF806, 0x4770]),
                ("helper", 0x120, &[0x4770]),
            ],
        );
        let image = Image::parse(&image).unwrap();
        let steps = [0x100, 0x110, 0x120, 0x114, 0x102, 0x110, 0x114, 0x104];
        let counts = counts(&image, &steps);
        // Two branches and the return; the return alone.
        let count = |instructions, cycles| Count { instructions, cycles };
        assert_eq!(counts["sqrt_libm"], [count(3, 3 + 3 * REFILL), count(2, 2 + REFILL)]);
        let expected = Block {
            name: "sqrt/libm".to_owned(),
            max: 3,
            mean: 2.5,
            cycles: 3 + 3 * REFILL,
            max_error: Some(1e-7),
        };
        assert_eq!(block("sqrt/libm,1e-7", &counts).unwrap(), expected);
        assert_eq!(block("sqrt/libm,", &counts).unwrap().max_error, None);
        assert!(block("sqrt/other,", &counts).is_err());
    }
}
