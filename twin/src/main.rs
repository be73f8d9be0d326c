//! `tractive-twin`: the image that is flashed, executed against a model of its chip.

use anyhow::Result;
use clap::Parser;
use std::path::PathBuf;
use std::process::ExitCode;
use tractive_rig::talk::System;
use tractive_twin::core::cpu::{Cpu, Longest};
use tractive_twin::image::Image;
use tractive_twin::instants::Instants;
use tractive_twin::machine::Access;
use tractive_twin::map::interrupt;
use tractive_twin::output::write;
use tractive_twin::replay::Replay;
use tractive_twin::replay::edges::Compared;
use tractive_twin::run::{Settings, drive_beside, instruction, prepare};
use tractive_twin::time::{SECOND, Time, seconds};
use tractive_twin::world::World;

/// Executes the image of the NUCLEO-G474RE against a model of its chip, with the simulated motor at the pins.
#[derive(Parser)]
struct Arguments {
    /// The image, an ELF file.
    image: PathBuf,
    /// The script of commands over CAN.
    script: PathBuf,
    /// The system that it is the image of.
    #[arg(long, value_enum, default_value_t)]
    system: System,
    /// The folder for trace, edges, telemetry and frames.
    #[arg(long)]
    out: Option<PathBuf>,
    /// The drivers' ready wire drops at this time for 10 ms, in s.
    #[arg(long, value_name = "SECONDS")]
    drivers_fail: Option<f64>,
    /// Compares the gates' edges with those that the drive makes on the host from the same inputs.
    #[arg(long)]
    host: bool,
    /// Counts the waits for the flash memory; takes a quarter longer.
    #[arg(long)]
    waits: bool,
    /// Lists every access to a peripheral: instant in µs, exception, access.
    #[arg(long, conflicts_with = "host")]
    record: bool,
    /// Lists the registers that the image has touched.
    #[arg(long)]
    accesses: bool,
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(1),
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(2)
        }
    }
}

fn run(arguments: &Arguments) -> Result<bool> {
    let settings = Settings::of_file(&arguments.image, arguments.system, &arguments.script)?;
    let (mut cpu, image) = prepare(&settings)?;
    if arguments.waits {
        cpu.count_waits()?;
    }
    println!("image {} SHA-256 {}", arguments.image.display(), image.sha256);
    let instant = |at_s: f64| (at_s * SECOND as f64) as Time;
    cpu.machine_mut().world.drops = arguments.drivers_fail.map(instant);
    if arguments.record {
        cpu.machine_mut().record = Some(Vec::new());
    }
    let mut replay = arguments.host.then(|| Replay::new(&settings, &image)).transpose()?;
    let start = std::time::Instant::now();
    let outcome = drive_beside(&mut cpu, replay.as_mut());
    let machine = cpu.machine();
    for finding in &machine.findings.all {
        println!("{finding} (in {})", image.function(finding.pc));
    }
    if let Some(finding) = machine.findings.all.first() {
        let (mut again, _) = prepare(&settings)?;
        again.machine_mut().world.drops = arguments.drivers_fail.map(instant);
        if let Some(pc) = instruction(&mut again, finding)? {
            println!("the first of it by the instruction at {pc:#010x} (in {})", image.function(pc));
        }
    }
    let talk = &machine.world.talk;
    for failure in &talk.failures {
        println!("not met: {failure}");
    }
    let simulated_s = seconds(machine.now());
    println!("{}", talk.state(simulated_s));
    println!(
        "{simulated_s:.3} s, {:.3} of real time; {} expectations, {} not met; {} edges",
        simulated_s / start.elapsed().as_secs_f64(),
        talk.expectations,
        talk.failures.len(),
        machine.world.edges.len(),
    );
    tell_instants(&cpu);
    let same = match &replay {
        Some(replay) => told(&replay.compare(machine), &machine.world),
        None => true,
    };
    let good = same && machine.findings.all.is_empty() && talk.failures.is_empty();
    tell_memory(&cpu, &image)?;
    if arguments.accesses {
        for (address, (reads, writes)) in &machine.chip.accesses {
            println!("{address:#010x} {reads:>9} {writes:>9}");
        }
    }
    for Access { at, exception, what } in machine.record.iter().flatten() {
        println!("{:.3} {exception} {what:x?}", 1e6 * seconds(*at));
    }
    if let Some(out) = &arguments.out {
        write(&mut cpu.machine_mut().world, &settings, out)?;
    }
    outcome?;
    Ok(good)
}

/// Says what the interrupts take, and when the converters sample.
fn tell_instants(cpu: &Cpu) {
    let machine = cpu.machine();
    for (exception, longest) in &cpu.longest {
        let late = machine.nvic.waited(*exception) / machine.cycle();
        let Longest { cycles, prefetched, waited } = longest;
        print!("{}: {cycles} cycles at most, ", interrupt(*exception));
        if machine.waits.is_some() {
            print!(
                "{prefetched} with the flash memory's prefetch alone, {waited} with all of its wait states, "
            );
        }
        println!("it waited for {late} at most");
    }
    for adc in &machine.chip.adcs {
        let instants = Instants::of(adc.name(), &adc.samplings, &machine.world.edges);
        if instants.sequences > 0 {
            println!("{instants}");
        }
    }
}

/// Says what the memory holds.
fn tell_memory(cpu: &Cpu, image: &Image) -> Result<()> {
    println!(
        "{} bytes of flash; RAM up to {:#010x} placed, {} bytes of stack used, {} left",
        image.flash_bytes,
        image.statics_end,
        cpu.stack_bytes(image.statics_end)?,
        cpu.stack_room(image.statics_end) - cpu.stack_bytes(image.statics_end)?,
    );
    Ok(())
}

/// Says how far the edges are from the host's; `true` if none is off by more than a tick.
fn told(compared: &Compared, world: &World) -> bool {
    let Compared { edges, all, worst, missed, first } = *compared;
    println!(
        "{edges} of {all} edges held against the host's of the same inputs: {:.1} ns off at most",
        1e9 * seconds(worst)
    );
    if let Some((gate, at)) = first {
        println!(
            "{missed} are off by more than a tick, or alone; the first: {} at {:.6} s",
            world.wiring().gates[gate].1,
            seconds(at)
        );
    }
    first.is_none() && edges > 0
}
