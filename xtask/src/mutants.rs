//! `cargo xtask mutants`: mutation testing by cargo-mutants, whose settings are in `.cargo/mutants.toml`.
//!
//! A whole package takes hours; a shard of it, or a sample, what one has.

use crate::cli::MutantsArgs;
use crate::process::{output_of, succeeds};
use crate::workspace::{cargo, root};
use anyhow::{Context, Result, bail};
use std::process::Command;

/// The command. Exit code 1 where a mutant was missed.
pub fn run(args: &MutantsArgs) -> Result<u8> {
    if output_of(cargo().args(["mutants", "--version"])).is_none() {
        bail!("cargo-mutants is missing; install it with: cargo install --locked cargo-mutants");
    }
    let mut command = mutants(args);
    command.arg("--output").arg(root().join("target/tractive"));
    if let Some(shard) = &args.shard {
        command.args(["--shard", shard]);
    }
    if let Some(sample) = args.sample {
        let listed = output_of(mutants(args).arg("--list")).context("cargo mutants --list")?;
        let names: Vec<&str> = listed.lines().collect();
        for name in sampled(&names, sample) {
            command.args(["--re", &format!("^{}$", escaped(name))]);
        }
    }
    Ok(u8::from(!succeeds(&mut command)?))
}

fn mutants(args: &MutantsArgs) -> Command {
    let mut command = cargo();
    command.current_dir(root()).args(["mutants", "--package", &args.package]);
    for file in &args.file {
        command.args(["--file", file]);
    }
    command
}

/// So many of some names, evenly spread, always the same.
fn sampled<'a>(names: &[&'a str], sample: usize) -> Vec<&'a str> {
    let count = sample.min(names.len());
    (0..count).filter_map(|index| names.get(index * names.len() / count).copied()).collect()
}

/// A name as a regular expression that is it.
fn escaped(name: &str) -> String {
    let is_plain =
        |letter: char| letter.is_ascii_alphanumeric() || " _/:".contains(letter) || !letter.is_ascii();
    name.chars().flat_map(|letter| (!is_plain(letter)).then_some('\\').into_iter().chain([letter])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sample_is_spread_over_all() {
        let names = ["a", "b", "c", "d", "e", "f"];
        assert_eq!(sampled(&names, 3), ["a", "c", "e"]);
        assert_eq!(sampled(&names, 9), names);
        assert!(sampled(&names, 0).is_empty());
    }

    #[test]
    fn a_name_is_no_pattern() {
        assert_eq!(
            escaped("src/a.rs:3: replace f -> x with ()"),
            "src/a\\.rs:3: replace f \\-\\> x with \\(\\)"
        );
    }
}
