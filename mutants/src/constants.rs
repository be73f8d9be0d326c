//! Mutants in constants and lengths, and in code that runs only while compiling: a build each, since no program could choose among them.

use crate::Places;
use crate::areas::CRATES;
use crate::build::{self, Program};
use crate::results::{Line, Outcome, Results};
use crate::run::Search;
use crate::tree::{Mutant, Tree, put};
use anyhow::{Context, Result};

/// Tries them one after another: the package's own tests first, then those of the others.
pub fn run(
    places: &Places,
    tree: &Tree,
    search: &Search,
    packages: &[String],
    mutants: &[&Mutant],
    results: &Results,
) -> Result<()> {
    let copy = places.work.join("tree");
    for source in &tree.sources {
        put(&copy.join(&source.file), source.text.as_bytes())?;
    }
    for (count, mutant) in mutants.iter().enumerate() {
        let source = tree.sources.iter().find(|source| source.file == mutant.file);
        let text = &source.with_context(|| mutant.name())?.text;
        put(&copy.join(&mutant.file), mutated(text, mutant).as_bytes())?;
        let tried = one(places, tree, search, &groups(&mutant.file, packages), mutant);
        put(&copy.join(&mutant.file), text.as_bytes())?;
        let (outcome, by) = tried?;
        eprintln!("mutants: constant {} of {}: {}: {outcome:?}", count + 1, mutants.len(), mutant.name());
        results.add(&Line { name: mutant.name(), source: mutant.hash, outcome, by })?;
    }
    Ok(())
}

/// The packages in the order in which they are built: that of the file, then all others.
fn groups(file: &str, packages: &[String]) -> Vec<Vec<String>> {
    let folder = |package: &str| match package {
        "tractive-control" => "control",
        "tractive-tablegen" => "tablegen",
        "tractive-nucleo-g474re" => "boards/nucleo-g474re",
        _ => "",
    };
    let of = CRATES.iter().map(|(of, _)| *of).find(|of| !of.is_empty() && file.starts_with(of)).unwrap_or("");
    let own = |package: &&String| folder(package) == of && (!of.is_empty() || *package == "tractive");
    let (own, others): (Vec<String>, Vec<String>) =
        packages.iter().cloned().partition(|package| own(&package));
    [own, others].into_iter().filter(|group| !group.is_empty()).collect()
}

fn mutated(text: &str, mutant: &Mutant) -> String {
    let mut text = text.to_owned();
    if let Some((bytes, other)) = &mutant.alone {
        text.replace_range(bytes.clone(), other);
    }
    text
}

/// Tries one that is written.
fn one(
    places: &Places,
    tree: &Tree,
    search: &Search,
    groups: &[Vec<String>],
    mutant: &Mutant,
) -> Result<(Outcome, String)> {
    let (copy, target) = (places.work.join("tree"), places.work.join("alone"));
    let all = search.of_file(&tree.mutants, &mutant.file);
    let mut last = (Outcome::Unreached, String::new());
    for group in groups {
        let built = build::cargo_all(&copy, &target, group)?;
        if !built.success {
            return Ok((Outcome::NoProgram, built.code()));
        }
        let programs = built.programs();
        let program = |index: usize| -> Option<&Program> {
            let name = &search.trial(index)?.program.name;
            programs.iter().find(|program| program.name == *name)
        };
        let own = all.iter().copied().filter(|index| program(*index).is_some()).collect();
        let scratch = places.work.join("scratch");
        let found = search.tried(mutant, own, |trial| {
            let program = programs.iter().find(|program| program.name == trial.program.name);
            trial.run_in(program.context("no program")?, &scratch)
        })?;
        match found.0 {
            Outcome::Unreached => {}
            Outcome::Killed | Outcome::Late => return Ok(found),
            _ => last = found,
        }
    }
    Ok(last)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tree;
    use std::path::Path;

    /// The text that a mutant of a constant is compiled as.
    #[test]
    fn a_constant_is_written_with_its_mutant() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
        let tree = tree::read(root).unwrap();
        let of = |file: &str, what: &str| {
            let own = |mutant: &&Mutant| mutant.file == file && mutant.fixed && mutant.what == what;
            let mutant = tree.mutants.iter().find(own).unwrap();
            let text = &tree.sources.iter().find(|source| source.file == file).unwrap().text;
            mutated(text, mutant).lines().nth(mutant.line - 1).unwrap().trim().to_owned()
        };
        assert_eq!(of("src/protocol/crc.rs", "replace < with =="), "while value == 16 {");
        assert_eq!(of("src/protocol/scales.rs", "delete -"), "const EXPONENTS: [i32; 2] = [4, 4];");
    }

    #[test]
    fn a_files_own_package_is_built_first() {
        let packages = ["tractive-control", "tractive", "tractive-cells"].map(str::to_owned);
        assert_eq!(groups("control/src/frames/angle.rs", &packages)[0], ["tractive-control"]);
        assert_eq!(groups("src/cell/ring.rs", &packages)[0], ["tractive"]);
        assert_eq!(groups("src/cell/ring.rs", &packages)[1], ["tractive-control", "tractive-cells"]);
        assert_eq!(groups("tablegen/src/axis.rs", &packages), [packages.to_vec()]);
    }
}
