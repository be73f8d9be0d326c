//! `cargo xtask mutants`: the program of mutants/, with the arguments that it was given.

use crate::workspace::cargo_with;
use anyhow::Result;
use std::ffi::OsStr;

/// The sample of the tests' step, tried against the quick tests of the packages that it comes from. The least share is a little below the last measured
/// one, all of 182: a guard that only rises.
const SAMPLE: &str = "--tests tractive-control --tests tractive --tests tractive-tablegen --tests tractive-nucleo-g474re --longest 1 --budget 4 --sample 200 --seed 1 --changed 20 --least 99";

/// The command; its exit code.
pub fn run(words: &[impl AsRef<OsStr>]) -> Result<u8> {
    let mut command = cargo_with("run --release --quiet --package tractive-mutants --");
    let status = command.args(words).status()?;
    Ok(status.code().and_then(|code| code.try_into().ok()).unwrap_or(1))
}

/// `true` if enough of the sample is noticed.
pub fn check() -> Result<bool> {
    Ok(run(&SAMPLE.split(' ').collect::<Vec<_>>())? == 0)
}
