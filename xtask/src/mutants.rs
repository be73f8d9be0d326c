//! `cargo xtask mutants`: mutation testing by cargo-mutants, whose settings are in `.cargo/mutants.toml`.
//!
//! A whole package takes hours; a shard of it, or a sample, what one has.

use crate::cli::{Area, MutantsArgs};
use crate::process::{output_of, succeeds};
use crate::workspace::{cargo, root};
use anyhow::{Context, Result, bail};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::process::Command;

/// The command. Exit code 1 where a mutant was missed.
pub fn run(args: &MutantsArgs) -> Result<u8> {
    if output_of(cargo().args(["mutants", "--version"])).is_none() {
        bail!("cargo-mutants is missing; install it with: cargo install --locked cargo-mutants");
    }
    let (package, files) = args.area.map_or((args.package.as_str(), &[][..]), |area| area.place());
    let mut files: Vec<&str> = files.iter().copied().chain(args.file.iter().map(String::as_str)).collect();
    let listed = match args.sample {
        None => String::new(),
        Some(_) => output_of(mutants(package, &files).arg("--list")).context("cargo mutants --list")?,
    };
    let names: Vec<&str> = listed.lines().collect();
    let sample = sampled(&names, args.sample.unwrap_or(0), args.seed);
    if args.sample.is_some() {
        if sample.is_empty() {
            bail!("no mutant is in the sample");
        }
        // No pattern keeps cargo-mutants from deleting fields: those of other files it leaves alone.
        files = sample.iter().filter_map(|name| name.split(':').next()).collect();
        files.dedup();
    }
    let mut command = mutants(package, &files);
    command.arg("--output").arg(root().join("target/tractive"));
    if let Some(shard) = &args.shard {
        command.args(["--shard", shard]);
    }
    for name in sample {
        command.args(["--re", &format!("^{}$", escaped(name))]);
    }
    Ok(u8::from(!succeeds(&mut command)?))
}

fn mutants(package: &str, files: &[&str]) -> Command {
    let mut command = cargo();
    command.current_dir(root()).args(["mutants", "--package", package]);
    for file in files {
        command.args(["--file", file]);
    }
    command
}

impl Area {
    /// Its package, and its files; none: all of the package.
    fn place(self) -> (&'static str, &'static [&'static str]) {
        match self {
            Self::Control => ("tractive-control", &["control/src/control/**"]),
            Self::Modulation => ("tractive-control", &["control/src/modulation/**"]),
            Self::NineSwitch => ("tractive-control", &["control/src/nine_switch/**"]),
            Self::Drive => ("tractive", &["src/drive/**"]),
            Self::Protection => ("tractive", &["src/protection/**"]),
            Self::Cell => ("tractive", &["src/cell.rs", "src/cell/**"]),
            Self::Operator => ("tractive", &["src/operator/**"]),
            Self::Protocol => ("tractive", &["src/protocol/**"]),
            Self::Boards => ("tractive-nucleo-g474re", &[]),
            Self::Tablegen => ("tractive-tablegen", &[]),
        }
    }
}

/// So many of some names, in their order: evenly spread, or drawn by a seed; always the same.
fn sampled<'a>(names: &[&'a str], sample: usize, seed: Option<u64>) -> Vec<&'a str> {
    let count = sample.min(names.len());
    let Some(seed) = seed else {
        return (0..count).filter_map(|index| names.get(index * names.len() / count).copied()).collect();
    };
    let mut drawn: Vec<_> = names.iter().copied().enumerate().collect();
    drawn.sort_by_cached_key(|(_, name)| {
        let mut hasher = DefaultHasher::new();
        (seed, name).hash(&mut hasher);
        hasher.finish()
    });
    drawn.truncate(count);
    drawn.sort_unstable();
    drawn.into_iter().map(|(_, name)| name).collect()
}

/// A name as a regular expression that is it. What means nothing by itself must stay as it is: `\<` is a word's beginning.
fn escaped(name: &str) -> String {
    let means_something = |letter: char| r"\.+*?()|[]{}^$#&-~".contains(letter);
    name.chars()
        .flat_map(|letter| means_something(letter).then_some('\\').into_iter().chain([letter]))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::ValueEnum;

    #[test]
    fn a_sample_is_spread_over_all() {
        let names = ["a", "b", "c", "d", "e", "f"];
        assert_eq!(sampled(&names, 3, None), ["a", "c", "e"]);
        assert_eq!(sampled(&names, 9, None), names);
        assert!(sampled(&names, 0, None).is_empty());
    }

    #[test]
    fn a_seed_draws_another_sample_each_time_the_same() {
        let names: Vec<String> = (0..100).map(|number| number.to_string()).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let [one, again, other] = [1, 1, 2].map(|seed| sampled(&names, 10, Some(seed)));
        assert_eq!((one.len(), &one), (10, &again));
        assert_ne!(one, other);
        assert_eq!(sampled(&names, 200, Some(3)), names);
    }

    #[test]
    fn every_area_has_its_files() {
        for area in Area::value_variants() {
            let (_, files) = area.place();
            for file in files {
                assert!(root().join(file.trim_end_matches("/**")).exists(), "{file}");
            }
        }
    }

    #[test]
    fn a_name_is_no_pattern() {
        assert_eq!(
            escaped("src/a.rs:3: replace A<T>::f -> x with ()"),
            r"src/a\.rs:3: replace A<T>::f \-> x with \(\)"
        );
    }
}
