//! `cargo xtask timing`: what the interrupts execute, against the budgets.
//!
//! The emulator logs every instruction outside the idle loop while the rig drives the image through every mode. The log
//! tells when an interrupt becomes pending, is entered and returns, so each instruction belongs to the innermost handler.
//! Instructions of the link to the rig are left out. The n-th interrupt of the log is the n-th that the rig served, and
//! the rig knows its mode. All of it is deterministic: two runs give the same numbers.
//!
//! [`drive`] runs the rig, [`log`] reads a line, [`meter`] assigns instructions to interrupts, [`cost`] prices them,
//! [`statistics`] and [`tally`] sum them up, [`blocks`] counts building blocks by themselves, [`profile`] says whose they are, [`budget`] judges, [`report`] tells.

mod blocks;
mod budget;
mod cost;
mod drive;
mod log;
mod meter;
mod profile;
mod report;
mod statistics;
mod tally;

use anyhow::{Context, Result};

use crate::cli::TimingArgs;
use crate::elf::Sizes;
use crate::setup::Setup;
use crate::{build, image};
use blocks::Block;
use drive::{Bench, Drive};
use profile::Profile;
use report::Report;
use statistics::{INTERRUPTS, Statistics};
use tally::Tally;

/// Both directions of torque and of rotation through every mode, up to the highest stator frequency.
const DRIVES: [&str; 2] = ["--to=6000", "--to=-6000 --brake"];
/// Then short ones: the PWM timer starts this much later against the control timer, in µs. Halves of the asynchronous
/// carrier last five control periods and five ninths, so they meet nine phases, 11 µs apart; these fall between.
/// A demand that is no number ends them.
const PHASES_US: [f64; 3] = [3.0, 6.0, 9.0];
const SHORT_S: f64 = 0.02;
/// From the run's beginning to the scenario's, in control periods.
const LEAD_PERIODS: usize = 100;
const CONTROL_S: f64 = 1e-4;
/// From the first frozen sample to the fault, in control periods.
const FROZEN_PERIODS: f64 = 19.0;

/// The command.
pub fn run(args: &TimingArgs) -> Result<u8> {
    let mut setup = Setup::default();
    let qemu = setup.qemu()?;
    let toolchain = setup.toolchain()?;
    let path = build::image(&toolchain, build::System::Traction, None)?;
    let blocks = blocks::measure(&toolchain, &qemu)?;
    let bench = Bench { rig: build::rig()?, qemu, image: image::read(&path)?, path };
    let mut sum = Sum::default();
    let mut switch_s = None;
    for options in DRIVES {
        let drive = sum.add(&bench, options)?;
        sum.profile(&drive);
        switch_s = switch_s.or(first_switch_s(&drive));
    }
    for phase_us in PHASES_US {
        sum.add(&bench, &format!("--to=6000 --pwm-delay-us={phase_us} --fault-at={SHORT_S}"))?;
    }
    // A switch of mode, a fault and full torque at the limit of the current, all in one tick. Frozen currents are found
    // after a number of periods, and of all faults they cost the most: the whole control law is executed besides.
    let switch_s = switch_s.context("the drive never switched its mode")?;
    let freeze_s = switch_s - FROZEN_PERIODS * CONTROL_S;
    sum.add(&bench, &format!("--to=6000 --freeze-at={freeze_s:.6}"))?;

    let statistics = &sum.statistics;
    let budgets = build::root().join("budgets.toml");
    let text = std::fs::read_to_string(&budgets).with_context(|| budgets.display().to_string())?;
    let judged = budget::judge(&text, &values(statistics, &blocks, &bench.image.sizes))?;
    let report = Report { statistics, blocks: &blocks, sizes: &bench.image.sizes, judged: &judged };
    if args.json {
        println!("{}", report.json());
    } else {
        print!("{}", report.table());
    }
    if let Some(count) = args.profile {
        print!("{}", sum.profile_table(&bench, count)?);
    }
    Ok(budget::exit_code(&judged))
}

/// All drives together.
#[derive(Default)]
struct Sum {
    statistics: Statistics,
    hits: Tally,
    behind: Tally,
    calls: Vec<u32>,
}

impl Sum {
    fn add(&mut self, bench: &Bench, options: &str) -> Result<Drive> {
        eprintln!("timing {options}");
        let drive = bench.drive(&options.split(' ').collect::<Vec<_>>())?;
        self.statistics.add(&drive)?;
        Ok(drive)
    }

    /// Takes it into the profile; the short drives would shift the means.
    fn profile(&mut self, drive: &Drive) {
        self.hits.merge(&drive.hits);
        self.behind.merge(&drive.behind);
        self.calls.extend(drive.calls.iter().map(|call| call.exception));
    }

    fn profile_table(&self, bench: &Bench, count: usize) -> Result<String> {
        let bytes = profile::bytes(&bench.path)?;
        let profile = Profile::new(&bytes)?;
        let mut text = String::new();
        for (name, exception) in INTERRUPTS {
            let calls = self.calls.iter().filter(|of| **of == exception).count();
            let shares = profile.shares(exception, &self.hits, &self.behind)?;
            text += &profile::table(name, &shares, calls, count);
        }
        Ok(text)
    }
}

/// When control first works for another mode with pulses than before, in the scenario's time: the middle of the period
/// before that tick.
fn first_switch_s(drive: &Drive) -> Option<f64> {
    let modes: Vec<&str> =
        drive.modes.iter().filter(|(name, ..)| name == "control").map(|(_, mode, _)| mode.as_str()).collect();
    let index = modes.windows(2).position(|pair| pair[0] != "off" && pair[1] != pair[0])? + 1;
    // The first interrupt, number 0, comes one period after the beginning.
    Some((index as f64 + 0.5 - LEAD_PERIODS as f64) * CONTROL_S)
}

/// What has a budget.
fn values(statistics: &Statistics, blocks: &[Block], sizes: &Sizes) -> Vec<(&'static str, f64)> {
    let worst = |interrupt: &str, of: fn(&statistics::Row) -> f64| {
        statistics.of(interrupt).map(of).fold(0.0, f64::max)
    };
    vec![
        ("pmasynrm.control-max", worst("control", |row| row.instructions.max.into())),
        ("pmasynrm.control-mean", worst("control", |row| row.instructions.mean())),
        ("pmasynrm.pwm-max", worst("pwm", |row| row.instructions.max.into())),
        ("pmasynrm.control-latency-max", worst("control", |row| row.latency.max.into())),
        ("pmasynrm.pwm-latency-max", worst("pwm", |row| row.latency.max.into())),
        ("pmasynrm.load-percent", statistics.worst_load()),
        ("pmasynrm.stack-bytes", statistics.stack_bytes.into()),
        ("pmasynrm.core-tick", report::core_tick(blocks).map_or(f64::NAN, f64::from)),
        ("image.code-bytes", sizes.code as f64),
        ("image.table-bytes", sizes.tables as f64),
        ("image.ram-bytes", sizes.ram as f64),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_switch_is_found_in_the_middle_of_a_period() {
        let served = |(name, mode): &(&str, &str)| ((*name).to_owned(), (*mode).to_owned(), 0.0);
        let mut modes = vec![("control", "off"); 100];
        modes.extend([("pwm", "async"), ("control", "async"), ("pwm", "sync15"), ("control", "sync15")]);
        let drive = Drive { modes: modes.iter().map(served).collect(), ..Drive::default() };
        // Interrupt number 101 comes 102 periods after the run's beginning, 2 after the scenario's.
        assert!((first_switch_s(&drive).unwrap() - 1.5e-4).abs() < 1e-12);
        assert!(first_switch_s(&Drive::default()).is_none());
    }
}
