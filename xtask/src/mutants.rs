//! `cargo xtask mutants`: the program of mutants/, with the words that it was given.

use crate::workspace::cargo_with;
use anyhow::Result;
use std::ffi::OsStr;

/// The sample of the tests' step: mutants of `tractive-control`, against its own tests.
const SAMPLE: [&str; 6] = ["--sample", "150", "--seed", "1", "--tests", "tractive-control"];

/// The command; its exit code.
pub fn run(words: &[impl AsRef<OsStr>]) -> Result<u8> {
    let mut command = cargo_with("run --release --quiet --package tractive-mutants --");
    let status = command.args(words).status()?;
    Ok(status.code().and_then(|code| code.try_into().ok()).unwrap_or(1))
}

/// Whether every mutant of the sample is noticed, or known.
pub fn check() -> Result<bool> {
    Ok(run(&SAMPLE)? == 0)
}
