//! `cargo xtask fuzz`: coverage-guided fuzzing of the targets in `fuzz/`, a workspace of its own, by libFuzzer.
//!
//! A pass of LLVM that every toolchain has inserts the counters of what is reached: neither a nightly toolchain nor cargo-fuzz is needed, only a C++
//! compiler for libFuzzer itself.

use crate::cli::FuzzArgs;
use crate::process::{cannot_start, find, output_of, succeeds};
use crate::workspace::{cargo, root};
use anyhow::{Context, Result, bail};
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The flags with which the fuzzed code counts what it reaches and reports what it compares.
const FLAGS: [&str; 6] = [
    "-Cpasses=sancov-module",
    "-Cllvm-args=-sanitizer-coverage-level=4",
    "-Cllvm-args=-sanitizer-coverage-inline-8bit-counters",
    "-Cllvm-args=-sanitizer-coverage-pc-table",
    "-Cllvm-args=-sanitizer-coverage-trace-compares",
    "--cfg=fuzzing",
];

/// Longest input, in bytes: for most targets, and for a machine folder's files.
const LONGEST: usize = 512;
const LONGEST_FILE: usize = 4_096;

/// Time of each target in the tests, in s, and its seed: a change is tested with the same inputs everywhere.
const MINUTE_S: u32 = 60;
const SEED: u32 = 1;
/// Inputs after which a target ends before its minute. `wire` decodes words and keeps nothing from one input to the next: the last input that reached
/// anything new came before number 80,000 of the seed's in two builds, and none of the millions after it did. No other target gets so far in a minute.
const ENOUGH: u64 = 2_000_000;

/// Origin of the inputs: the kept ones and the seed's alone; or also all that have accumulated on this machine, and any others.
#[derive(Clone, Copy)]
enum Origin {
    Seed(u32),
    Any,
}

/// The end of a target's run: after a time in s, or earlier after that many inputs.
#[derive(Clone, Copy)]
struct Length {
    seconds: u32,
    inputs: Option<u64>,
}

/// The command. Exit code 1 where something was found.
pub fn run(args: &FuzzArgs) -> Result<u8> {
    let all = targets()?;
    if let Some(unknown) = args.target.iter().find(|target| !all.contains(target)) {
        bail!("{unknown}: must be one of {}", all.join(", "));
    }
    let chosen = if args.target.is_empty() { &all } else { &args.target };
    let folder = match build()? {
        Ok(folder) => folder,
        Err(missing) => bail!(missing),
    };
    let origin = args.seed.map_or(Origin::Any, Origin::Seed);
    let is_good = fuzz(&folder, chosen, Length { seconds: args.seconds, inputs: None }, origin)?;
    if args.keep {
        chosen.iter().try_for_each(|target| keep(&folder, target))?;
    }
    Ok(u8::from(!is_good))
}

/// Every target for a minute, or until it has had enough, with the same inputs each time. The inner error is what is missing.
pub fn check() -> Result<Result<bool, String>> {
    match build()? {
        Ok(folder) => {
            let length = Length { seconds: MINUTE_S, inputs: Some(ENOUGH) };
            fuzz(&folder, &targets()?, length, Origin::Seed(SEED)).map(Ok)
        }
        Err(missing) => Ok(Err(missing)),
    }
}

/// The targets, by their names.
fn targets() -> Result<Vec<String>> {
    let entries = std::fs::read_dir(root().join("fuzz/targets")).context("fuzz/targets")?.flatten();
    let mut names: Vec<_> =
        entries.filter_map(|entry| Some(entry.path().file_stem()?.to_string_lossy().into_owned())).collect();
    names.sort_unstable();
    Ok(names)
}

/// Builds the targets; returns the folder that they are in. The inner error is what is missing.
fn build() -> Result<Result<PathBuf, String>> {
    if std::env::var_os("CXX").is_none() && find("c++").is_none() {
        return Ok(Err("there is no C++ compiler for libFuzzer (Debian: apt-get install g++)".to_owned()));
    }
    let mut fetch = cargo();
    fetch.args(["fetch", "--quiet", "--locked", "--manifest-path", "fuzz/Cargo.toml"]);
    if !succeeds(&mut fetch)? {
        return Ok(Err("its packages cannot be had".to_owned()));
    }
    let version = output_of(Command::new("rustc").current_dir(root()).arg("-vV")).context("rustc -vV")?;
    let host = version.lines().find_map(|line| line.strip_prefix("host: ")).context("rustc names no host")?;
    let out = root().join("target/fuzz");
    let mut command = cargo();
    // With a target named, build scripts do not get the flags; they and their macros are already compiled in the workspace's own folder.
    command.env("CARGO_BUILD_BUILD_DIR", root().join("target"));
    command.args(["build", "--release", "--locked", "--manifest-path", "fuzz/Cargo.toml", "--target", host]);
    command.arg("--target-dir").arg(&out).env("CARGO_ENCODED_RUSTFLAGS", FLAGS.join("\x1f"));
    if !succeeds(&mut command)? {
        bail!("fuzz/ does not build");
    }
    Ok(Ok(out.join(host).join("release")))
}

/// The corpora: the kept ones, and those that accumulate on this machine.
fn corpora(target: &str) -> Result<[PathBuf; 2]> {
    let corpora = ["fuzz/corpus", "target/fuzz/corpus"].map(|folder| root().join(folder).join(target));
    corpora.iter().try_for_each(std::fs::create_dir_all)?;
    Ok(corpora)
}

/// Runs these targets, one at a time on each core; returns whether nothing was found.
fn fuzz(folder: &Path, targets: &[String], length: Length, origin: Origin) -> Result<bool> {
    let good = targets.par_iter().map(|target| run_target(folder, target, length, origin));
    Ok(good.collect::<Result<Vec<_>>>()?.into_iter().all(|good| good))
}

fn run_target(folder: &Path, target: &str, length: Length, origin: Origin) -> Result<bool> {
    let [kept, own] = corpora(target)?;
    let fresh = tempfile::tempdir().context("no temporary folder")?;
    let (own, seed) = match origin {
        Origin::Seed(seed) => (fresh.path().to_owned(), seed),
        // libFuzzer takes one of its own.
        Origin::Any => (own, 0),
    };
    let found = root().join("target/fuzz/found").join(target);
    std::fs::create_dir_all(&found)?;
    let longest = if target == "folder" { LONGEST_FILE } else { LONGEST };
    let mut command = Command::new(folder.join(target));
    command
        .arg(own)
        .arg(kept)
        .arg(format!("-max_total_time={}", length.seconds))
        .arg(format!("-max_len={longest}"));
    command
        .arg(format!("-seed={seed}"))
        .arg("-timeout=20")
        .arg(format!("-artifact_prefix={}/", found.display()));
    command.args(length.inputs.map(|inputs| format!("-runs={inputs}")));
    let dictionary = root().join("fuzz/dictionaries").join(target);
    if dictionary.is_file() {
        command.arg(format!("-dict={}", dictionary.display()));
    }
    let output = command.output().with_context(|| cannot_start(&command))?;
    let log = String::from_utf8_lossy(&output.stderr);
    std::fs::write(found.with_extension("log"), log.as_bytes())?;
    if output.status.success() {
        println!("{target}: {}", log.lines().rfind(|line| line.contains("DONE")).unwrap_or_default());
        return Ok(true);
    }
    // The place of the panic and its message, and where the input is.
    let panic = log.lines().skip_while(|line| !line.contains("panicked at")).take(2);
    let written =
        log.lines().filter(|line| line.contains("ERROR: ") || line.contains("Test unit written to"));
    panic.chain(written).for_each(|line| println!("{target}: {line}"));
    println!(
        "{target}: mend it, and keep that file in fuzz/corpus/{target}/, where the ordinary tests try it"
    );
    Ok(false)
}

/// Adds to a kept corpus the inputs that reach code that it does not.
fn keep(folder: &Path, target: &str) -> Result<()> {
    let [kept, own] = corpora(target)?;
    if !succeeds(
        Command::new(folder.join(target)).args(["-set_cover_merge=1", "-use_counters=0"]).args([kept, own]),
    )? {
        bail!("{target}: the corpora cannot be merged");
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_target_has_inputs_that_are_kept() {
        let targets = targets().unwrap();
        assert!(targets.len() >= 5, "{targets:?}");
        for target in targets {
            let kept = std::fs::read_dir(root().join("fuzz/corpus").join(&target)).unwrap().count();
            assert!((1..100).contains(&kept), "{target}: {kept}");
        }
    }
}
