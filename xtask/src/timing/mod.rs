//! `cargo xtask timing`: what the interrupts execute.

mod cost;
mod drive;
mod log;
mod meter;
mod statistics;

use anyhow::Result;

use crate::cli::TimingArgs;
use crate::setup::Setup;
use crate::{build, image};
use drive::Bench;
use statistics::Statistics;

/// Drives that together reach every mode in both directions of torque and of rotation.
const DRIVES: [&[&str]; 4] =
    [&["--to=6000"], &["--to=6000", "--brake"], &["--to=-6000"], &["--to=-6000", "--brake"]];

/// The command.
pub fn run(_args: &TimingArgs) -> Result<u8> {
    let mut setup = Setup::default();
    let qemu = setup.qemu()?;
    let path = build::image(&setup.toolchain()?, None)?;
    let bench = Bench { rig: build::rig()?, qemu, image: image::read(&path)?, path };
    let mut statistics = Statistics::default();
    for options in DRIVES {
        let start = std::time::Instant::now();
        let drive = bench.drive(options)?;
        eprintln!("{options:?} {:?}", start.elapsed());
        statistics.add(&drive)?;
    }
    for ((mode, name), row) in &statistics.rows {
        println!("{mode} {name} {row:?} {}", row.instructions.mean());
    }
    println!("{} {}", statistics.hertz, statistics.stack_bytes);
    Ok(0)
}
