//! `cargo xtask test`: every check in order, then a table and a count.

use crate::board::Board;
use crate::build::{self, System, TARGET, cargo, cargo_with};
use crate::cli::{TestArgs, TimingArgs};
use crate::image;
use crate::process::{processor_s, succeeds};
use crate::setup::Setup;
use crate::step::Step;
use crate::twin;
use anyhow::Result;
use clap::ValueEnum;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

/// Parts in which packages are tested: arguments of `cargo test`.
type Parts = &'static [&'static str];

/// The packages by the commands that test them. Cargo unites the features of all packages in one command: with all of them at once the rig and this
/// program would be recompiled, since `cargo rig` and `cargo xtask` ask for one package. The boards go with the first command.
const TOGETHER: [(&str, Parts); 4] = [
    (
        "tractive tractive-control tractive-tablegen tractive-bench tractive-cells tractive-fault-injector tractive-mutants",
        // With the optimised patterns too, for which these tests are meant: otherwise only the rig's dependencies have these features.
        &[
            "",
            "--features tractive/optimal,tractive-tablegen/patterns --test pinned --test pulses --test patterns --test values",
            "--features tractive/optimal,tractive-tablegen/patterns --test proofs compare_values",
        ],
    ),
    // The unit tests of the same features, which only these two packages have.
    (
        ONCE_MORE,
        &["--features tractive-control/optimal,tractive-tablegen/patterns --lib -- modulation patterns"],
    ),
    // The rig's own unit tests take a second, but need all of it compiled once more; that is done without optimisation. The others use the library that
    // `cargo rig` runs.
    (
        "tractive-rig",
        &["--lib --config profile.release.package.tractive-rig.opt-level=0", "--bins --test *", "--doc"],
    ),
    ("xtask", &[""]),
];
const ONCE_MORE: &str = "tractive-control tractive-tablegen";

/// Settings of the C library (glibc; others ignore them) that keep freed memory for the program's next use. A recording has many megabytes, and the
/// system would otherwise have to provide every page anew for each.
const MEMORY_KEPT: [(&str, &str); 4] = [
    ("MALLOC_ARENA_MAX", "1"),
    ("MALLOC_MMAP_THRESHOLD_", "4294967296"),
    ("MALLOC_TRIM_THRESHOLD_", "4294967296"),
    ("MALLOC_TOP_PAD_", "67108864"),
];

/// The end of a step.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Outcome {
    Passed,
    Failed,
    /// The reason why it could not be done.
    Skipped(String),
}

/// The outcome of a step.
struct Done {
    step: Step,
    outcome: Outcome,
    took: Duration,
    processor_s: f64,
}

impl From<bool> for Outcome {
    fn from(good: bool) -> Self {
        if good { Self::Passed } else { Self::Failed }
    }
}

/// The command.
pub fn run(args: &TestArgs) -> Result<u8> {
    let chosen = |step: &&Step| args.only.is_empty() || args.only.contains(step);
    let steps: Vec<Step> = Step::value_variants().iter().filter(chosen).copied().collect();
    if args.list {
        for step in steps {
            println!("{:<14} {}", name(step), about(step));
        }
        return Ok(0);
    }
    let mut setup = Setup::default();
    let mut done = Vec::new();
    for step in steps {
        println!("\n== {}: {}", name(step), about(step));
        let (start, start_s) = (Instant::now(), processor_s());
        let outcome = perform(step, &mut setup).unwrap_or_else(|error| {
            eprintln!("error: {error:#}");
            Outcome::Failed
        });
        if let Outcome::Skipped(reason) = &outcome {
            println!("skipped: {reason}");
        }
        done.push(Done { step, outcome, took: start.elapsed(), processor_s: processor_s() - start_s });
    }
    print!("{}", summary(&done));
    Ok(u8::from(done.iter().any(|done| done.outcome == Outcome::Failed)))
}

fn perform(step: Step, setup: &mut Setup) -> Result<Outcome> {
    let good = match step {
        Step::Fmt if !setup.component("fmt", "rustfmt") => return Ok(no_component("rustfmt")),
        Step::Fmt => succeeds(&mut cargo_with("fmt --all -- --check"))?,
        Step::ClippyHost if !setup.component("clippy", "clippy") => return Ok(no_component("clippy")),
        // As released, like everything built for this machine: macros and build scripts are then compiled once.
        Step::ClippyHost => {
            lint(&mut cargo(), &["--release", "--workspace", "--exclude", twin::PACKAGE, "--all-targets"])?
        }
        Step::ClippyTarget if !setup.component("clippy", "clippy") => return Ok(no_component("clippy")),
        Step::ClippyTarget if !setup.toolchain()?.has_clippy => {
            return Ok(Outcome::Skipped(format!("clippy needs rustup's target {TARGET}")));
        }
        Step::ClippyTarget => all(on_target()?, |(package, what)| {
            let command = ["--release", "--target", TARGET, "--package", &package];
            lint(&mut cargo(), &[&command[..], what].concat())
        })?,
        Step::Doc => {
            let mut command = cargo_with("doc --release --no-deps --workspace --exclude");
            succeeds(command.arg(twin::PACKAGE).env("RUSTDOCFLAGS", "-D warnings"))?
        }
        Step::Host => all(together()?, |(packages, parts)| host(&packages, parts))?,
        Step::Loom => {
            let mut command = cargo_with("test --profile loom --package tractive-cells --test interleavings");
            succeeds(command.env("RUSTFLAGS", "--cfg loom"))?
        }
        Step::Miri => return miri(setup),
        Step::Fuzz => return Ok(where_possible(crate::fuzz::check()?)),
        Step::Mutants => crate::mutants::check()?,
        Step::Cells => crate::cells::check(setup)?,
        Step::Preemption => crate::preemption::check(setup)?,
        Step::Overruns => crate::overruns::check(setup)?,
        Step::Image => {
            build::reference_images(&setup.toolchain()?)?
                && images(setup, |path| {
                    println!("{}", path.display());
                    Ok(true)
                })?
        }
        Step::ImageCheck => images(setup, image::check)?,
        Step::NucleoImage => board_images(setup)?,
        Step::Twin => return Ok(where_possible(twin::check(setup)?)),
        Step::OwnBoard => crate::own_board::check(setup)?,
        Step::Publish => crate::publish::check()?,
        Step::Guide => crate::guide::run(build::root())?,
        Step::Book => return book(setup),
        Step::Live => return Ok(where_possible(crate::live::check(setup)?)),
        Step::Slurm => return Ok(where_possible(crate::slurm::check(setup)?)),
        Step::Python => return Ok(where_possible(crate::python::check()?)),
        Step::Qemu => qemu(setup)?,
        Step::Timing => {
            let identify = TimingArgs { identify: true, ..TimingArgs::default() };
            crate::timing::run(&TimingArgs::default())? == 0 && crate::timing::run(&identify)? == 0
        }
        Step::Machines => machines(setup)?,
    };
    Ok(good.into())
}

/// The tests of packages on this machine, part by part.
fn host(packages: &str, parts: Parts) -> Result<bool> {
    let named = packages.split(' ').flat_map(|package| ["--package", package]);
    all(parts, |part| {
        let mut command = cargo_with("test --release");
        command.args(named.clone()).args(part.split_whitespace());
        succeeds(command.envs(MEMORY_KEPT))
    })
}

/// The outcome of a check that may lack a tool; the inner error names the tool.
fn where_possible(checked: Result<bool, String>) -> Outcome {
    checked.map_or_else(Outcome::Skipped, Outcome::from)
}

fn miri(setup: &mut Setup) -> Result<Outcome> {
    let Some(mut command) = setup.miri() else {
        return Ok(Outcome::Skipped("cargo miri is not installed and cannot be added".to_owned()));
    };
    let words = "miri test --package tractive-cells --test threads --target-dir target/miri";
    Ok(succeeds(command.args(words.split(' ')))?.into())
}

/// Checks the reference image of each system.
fn images(setup: &mut Setup, check: impl Fn(&Path) -> Result<bool>) -> Result<bool> {
    all(System::ALL, |system| {
        println!("{}:", system.image());
        check(&build::image(&setup.toolchain()?, system, None)?)
    })
}

/// Power stages with other position sensors than an encoder that counts.
const SENSORS: [&str; 3] =
    ["power_stage_absolute.toml", "power_stage_biss.toml", "power_stage_resolver.toml"];

/// Checks the images of every board: both drives, with each position sensor, and the one that identifies.
fn board_images(setup: &mut Setup) -> Result<bool> {
    let boards = Board::all()?;
    let stages = boards.iter().flat_map(|board| SENSORS.map(|stage| (board, stage)));
    let sensors = all(stages, |(board, stage)| {
        println!("{}, {stage}:", board.name);
        image::check_board(&build::image_of_stage(&setup.toolchain()?, board, stage)?, board)
    })?;
    let built = all(&boards, |board| build::images_of(&setup.toolchain()?, board))?;
    let images = boards.iter().flat_map(|board| System::ALL.map(|system| (board, system)));
    let drives = all(images, |(board, system)| {
        println!("{}:", system.image_on(board));
        let path = build::board_image(&setup.toolchain()?, board, system, None)?;
        image::check_board(&path, board)
    })?;
    let identifying = all(&boards, |board| {
        println!("{}, identifying:", board.name);
        image::check_board(&build::identify_on(&setup.toolchain()?, board, None)?, board)
    })?;
    Ok(sensors && built && drives && identifying)
}

fn book(setup: &mut Setup) -> Result<Outcome> {
    let Some(mdbook) = setup.mdbook() else {
        return Ok(Outcome::Skipped("mdbook is not installed (cargo install mdbook)".to_owned()));
    };
    Ok(succeeds(Command::new(mdbook).arg("build").arg(build::root().join("docs")))?.into())
}

/// The images in QEMU against the host.
fn qemu(setup: &mut Setup) -> Result<bool> {
    let (qemu, toolchain) = (setup.qemu()?, setup.toolchain()?);
    let mut command = cargo_with("test --release --package tractive-rig --test qemu -- --ignored");
    command.env("TRACTIVE_QEMU", qemu);
    command.env("TRACTIVE_IMAGE", build::image(&toolchain, System::Traction, None)?);
    command.env("TRACTIVE_OPTIMAL_IMAGE", build::optimal_image(&toolchain, None)?);
    command.env("TRACTIVE_PI_IMAGE", build::pi_image(&toolchain, System::Traction, None)?);
    command.env("TRACTIVE_ZS9_IMAGE", build::image(&toolchain, System::Zs9, None)?);
    command.env("TRACTIVE_ZS9_PI_IMAGE", build::pi_image(&toolchain, System::Zs9, None)?);
    command.env("TRACTIVE_IDENTIFY_IMAGE", build::identify_image(&toolchain, None)?);
    succeeds(&mut command)
}

/// The image with each machine. It comes after everything that takes the built-in machine, since each change of machine rebuilds the image.
fn machines(setup: &mut Setup) -> Result<bool> {
    let toolchain = setup.toolchain()?;
    for machine in crate::run::machine_names(build::root()) {
        let named = Some(machine.clone().into()).filter(|_| machine != System::Traction.machine());
        build::image(&toolchain, System::Traction, named.as_ref())?;
        println!("{machine}");
    }
    Ok(true)
}

/// The lints on the target: packages, and their parts.
fn on_target() -> Result<Vec<(String, &'static [&'static str])>> {
    const IMAGES: &[&str] = &["--lib", "--bins"];
    let own: [(&str, &[&str]); 4] = [
        ("tractive", &["--lib", "--features", "defmt,authentication"]),
        ("tractive", &["--lib", "--bins", "--features", build::QEMU]),
        ("tractive", &["--bin", "optimal", "--features", "qemu,optimal"]),
        ("tractive-fault-injector", IMAGES),
    ];
    let own = own.map(|(package, what)| (package.to_owned(), what));
    let boards = Board::all()?.into_iter().map(|board| (board.package, IMAGES));
    Ok(own.into_iter().chain(boards).collect())
}

/// [`TOGETHER`], with the boards.
fn together() -> Result<[(String, Parts); 4]> {
    let mut groups = TOGETHER.map(|(packages, parts)| (packages.to_owned(), parts));
    Board::all()?.iter().for_each(|board| groups[0].0 += &format!(" {}", board.package));
    Ok(groups)
}

fn lint(command: &mut Command, what: &[&str]) -> Result<bool> {
    succeeds(command.arg("clippy").args(what).args(["--", "--deny", "warnings"]))
}

/// Checks every one, also after one that is not good.
fn all<T>(of: impl IntoIterator<Item = T>, mut check: impl FnMut(T) -> Result<bool>) -> Result<bool> {
    of.into_iter().try_fold(true, |good, one| Ok(check(one)? && good))
}

fn no_component(component: &str) -> Outcome {
    Outcome::Skipped(format!("{component} is not installed and cannot be added"))
}

fn name(step: Step) -> String {
    step.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
}

fn about(step: Step) -> String {
    step.to_possible_value().and_then(|value| Some(value.get_help()?.to_string())).unwrap_or_default()
}

fn summary(done: &[Done]) -> String {
    let mut text = format!("\n{:<14} {:<8} {:>8} {:>10}\n", "step", "result", "seconds", "processor");
    for Done { step, outcome, took, processor_s } in done {
        let (result, note) = match outcome {
            Outcome::Passed => ("passed", String::new()),
            Outcome::Failed => ("FAILED", String::new()),
            Outcome::Skipped(reason) => ("skipped", format!("  {reason}")),
        };
        let seconds = took.as_secs_f64();
        text += &format!("{:<14} {result:<8} {seconds:>8.1} {processor_s:>10.1}{note}\n", name(*step));
    }
    let minutes = done.iter().map(|done| done.processor_s).sum::<f64>() / 60.0;
    let count = |wanted: Outcome| done.iter().filter(|done| done.outcome == wanted).count();
    text += &format!("\n{minutes:.1} min of processor time\n");
    text + &format!("{} passed, {} failed\n", count(Outcome::Passed), count(Outcome::Failed))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn the_summary_ends_with_the_count_alone_on_its_line() {
        let done = [
            (Step::Fmt, Outcome::Passed),
            (Step::ClippyTarget, Outcome::Skipped("no clippy".to_owned())),
            (Step::ImageCheck, Outcome::Failed),
            (Step::Qemu, Outcome::Passed),
        ];
        let took = Duration::from_millis(1_250);
        let done = done.map(|(step, outcome)| Done { step, outcome, took, processor_s: 30.0 });
        let text = summary(&done);
        let lines: Vec<_> = text.lines().collect();
        assert_eq!(lines.last(), Some(&"2 passed, 1 failed"));
        assert_eq!(lines[1], "step           result    seconds  processor");
        assert_eq!(lines[3], "clippy-target  skipped       1.2       30.0  no clippy");
        assert_eq!(lines[4], "image-check    FAILED        1.2       30.0");
        assert_eq!(lines[lines.len() - 2], "2.0 min of processor time");
    }

    #[test]
    fn every_package_is_tested_once() {
        let mut command = cargo();
        let metadata = command.args(["metadata", "--format-version", "1", "--no-deps"]).output().unwrap();
        let metadata: serde_json::Value = serde_json::from_slice(&metadata.stdout).unwrap();
        let packages = metadata["packages"].as_array().unwrap();
        let mut there: Vec<_> = packages.iter().map(|package| package["name"].as_str().unwrap()).collect();
        let groups = together().unwrap().map(|(packages, _)| packages);
        let once = groups.iter().filter(|packages| *packages != ONCE_MORE);
        let mut tested: Vec<_> = once.flat_map(|packages| packages.split(' ')).collect();
        // Step `twin` tests it, if its emulator is available.
        tested.push(twin::PACKAGE);
        there.sort_unstable();
        tested.sort_unstable();
        assert_eq!(tested, there);
    }

    /// The units of what cargo would compile: package, target, what for, profile and features.
    fn units(words: &str) -> BTreeSet<String> {
        let mut command = cargo_with(words);
        // The list of units is the part that stable cargos keep behind this.
        command.args(["--unit-graph", "-Zunstable-options"]).env("RUSTC_BOOTSTRAP", "1");
        let graph: serde_json::Value = serde_json::from_slice(&command.output().unwrap().stdout).unwrap();
        let unit = |unit: &serde_json::Value| {
            let parts = ["pkg_id", "mode", "platform", "features"].map(|part| unit[part].to_string());
            format!("{} {} {}", parts.join(" "), unit["target"]["name"], unit["profile"]["opt_level"])
        };
        graph["units"].as_array().unwrap().iter().map(unit).collect()
    }

    /// The rig's program, which the twin's tests do not need.
    const PROGRAM: &str = "\"tractive-rig\"";

    /// A feature that only a package of the tests asks for would make the library and all that needs it compile twice.
    #[test]
    fn the_rigs_tests_and_the_twin_take_the_rig_that_runs() {
        let rig = units("build --release --package tractive-rig --bin tractive-rig");
        assert!(rig.len() > 50, "{rig:?}");
        for words in ["test --release --package tractive-rig", "test --release --package tractive-twin"] {
            let units = units(words);
            let lacking: Vec<_> = rig.difference(&units).filter(|unit| !unit.contains(PROGRAM)).collect();
            assert!(lacking.is_empty(), "{words}: with other features {lacking:#?}");
        }
    }

    #[test]
    fn every_step_has_a_name_and_says_what_it_is() {
        for step in Step::value_variants() {
            assert!(!name(*step).is_empty() && !about(*step).is_empty());
        }
    }
}
