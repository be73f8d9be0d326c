//! `cargo xtask timing`: the instructions that the interrupts execute, against the budgets.
//!
//! The emulator logs every instruction outside the idle loop while the rig drives the image through every mode. The log
//! tells when an interrupt becomes pending, is entered and returns, so each instruction belongs to the innermost handler.
//! Instructions of the link to the rig are left out. The n-th interrupt of the log is the n-th that the rig served, and
//! the rig knows its mode. All of it is deterministic: two runs give the same numbers.
//!
//! [`system`] defines what is driven, [`drive`] runs the rig, [`log`] reads a line, [`meter`] assigns instructions to interrupts,
//! [`cost`](crate::thumb::cost) prices them, [`statistics`] and [`tally`] sum them up, [`parts`] and [`profile`] say whose they are, [`blocks`] counts
//! building blocks by themselves, [`entry`] finds what could delay an entry, [`budget`] judges, [`report`], [`tables`] and [`page`] present the
//! results, and [`golden`] compares them with what the repository holds.

mod blocks;
mod budget;
pub mod drive;
mod entry;
mod golden;
mod log;
pub mod meter;
mod page;
mod parts;
mod profile;
mod report;
pub mod statistics;
mod system;
mod tables;
mod tally;

pub use profile::Profile;

use crate::build;
use crate::cli::TimingArgs;
use crate::setup::Setup;
use anyhow::{Context, Result};
use report::Report;
use system::{Measured, System};

/// The command.
pub fn run(args: &TimingArgs) -> Result<u8> {
    let mut setup = Setup::default();
    let qemu = setup.qemu()?;
    let toolchain = setup.toolchain()?;
    let rig = build::rig()?;
    if args.identify {
        return identify(&system::identification(&toolchain, &rig, &qemu)?);
    }
    let blocks = blocks::measure(&toolchain, &qemu)?;
    let (mut systems, mut pi) = (Vec::new(), Vec::new());
    for system in System::ALL {
        systems.push(system.measure(&toolchain, &rig, &qemu)?);
        pi.push(system.under_pi(&toolchain, &rig, &qemu)?);
    }
    parts::all_found(&systems.iter().flat_map(|measured| &measured.sources).copied().collect())?;
    let text = budgets(|group| group != IDENTIFICATION)?;
    let values: Vec<_> = systems.iter().flat_map(values).chain(report::blocks(&blocks)).collect();
    let judged = budget::judge(&text, &values)?;
    let report = Report { systems: &systems, pi: &pi, blocks: &blocks, judged: &judged };
    if args.json {
        println!("{}", report.json());
    } else {
        print!("{}", page::plain(&report));
    }
    if let Some(count) = args.profile {
        for measured in &systems {
            print!("{}", measured.profile_table(count)?);
        }
    }
    let files = golden::files(&report);
    if args.write {
        golden::write(&files)?;
        return Ok(budget::exit_code(&judged));
    }
    let complaints = golden::complaints(&files);
    for complaint in &complaints {
        eprintln!("{complaint}");
    }
    Ok(budget::exit_code(&judged).max(u8::from(!complaints.is_empty())))
}

/// The group of budgets of the image that identifies its machine.
const IDENTIFICATION: &str = "identification";

/// The interrupts of the image that identifies its machine, against its budgets.
fn identify(statistics: &statistics::Statistics) -> Result<u8> {
    let of = |interrupt: &str, value: fn(&statistics::Row) -> f64| {
        statistics.of(interrupt).map(value).fold(0.0, f64::max)
    };
    let values = [
        ("identification.control-max", of("control", |row| row.instructions.max.into())),
        ("identification.control-mean", of("control", |row| row.instructions.mean())),
        ("identification.pwm-max", of("pwm", |row| row.instructions.max.into())),
    ];
    let judged = budget::judge(&budgets(|group| group == IDENTIFICATION)?, &values)?;
    for judged in &judged {
        let budget::Judged { name, value, budget } = judged;
        let verdict = if judged.kept() { "ok" } else { "OVER" };
        let value = value.ceil();
        println!("{name:<28} {value:>6} of {budget:>6}: {verdict}");
    }
    Ok(budget::exit_code(&judged))
}

/// The groups of budgets.toml whose names pass.
fn budgets(passes: impl Fn(&str) -> bool) -> Result<String> {
    let path = build::root().join("budgets.toml");
    let text = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
    let mut all: toml::Table = text.parse().context("budgets.toml")?;
    all.retain(|group, _| passes(group));
    Ok(toml::to_string(&all)?)
}

/// The values of a system that have a budget.
fn values(measured: &Measured) -> Vec<(String, f64)> {
    let statistics = &measured.statistics;
    let worst = |interrupt: &str, of: fn(&statistics::Row) -> f64| {
        statistics.of(interrupt).map(of).fold(0.0, f64::max)
    };
    let sizes = &measured.image.sizes;
    let values = [
        ("control-max", worst("control", |row| row.instructions.max.into())),
        ("control-mean", worst("control", |row| row.instructions.mean())),
        ("pwm-max", worst("pwm", |row| row.instructions.max.into())),
        ("control-latency-max", worst("control", |row| row.latency.max.into())),
        ("pwm-latency-max", worst("pwm", |row| row.latency.max.into())),
        ("pwm-entry-spread", statistics.entry_spread("pwm").into()),
        ("masking-functions", measured.masking.len() as f64),
        ("load-percent", statistics.worst_load()),
        ("stack-bytes", statistics.stack_bytes().into()),
        ("code-bytes", sizes.code as f64),
        ("table-bytes", sizes.tables as f64),
        ("ram-bytes", sizes.ram as f64),
    ];
    values.into_iter().map(|(name, value)| (format!("{}.{name}", measured.system.name), value)).collect()
}
