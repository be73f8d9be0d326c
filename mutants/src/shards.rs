//! Shards of a run: each writes a file of its own, and the files merge into the results of the whole.

use crate::Options;
use crate::areas::Area;
use crate::results::{Line, Results};
use crate::run::{chosen, left_out};
use crate::tree::Tree;
use crate::{Places, run};
use anyhow::{Context, Result, bail, ensure};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

/// A run, described by all that determines its results.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    area: Vec<Area>,
    file: Vec<String>,
    tests: Vec<String>,
    budget: f64,
    longest: u64,
    bytes: bool,
    constants: bool,
    /// A hash of the sources of all mutants.
    sources: u64,
    /// The mutants that do not compile this way: names, each with the error's code.
    left_out: BTreeMap<String, String>,
}

/// The first line of a shard's file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Head {
    shard: usize,
    shards: usize,
    plan: Plan,
}

impl Head {
    /// The head of a shard of this run, whose mutants without a program are known; `None` for a run in one piece.
    pub fn new(places: &Places, tree: &Tree, options: &Options) -> Option<Self> {
        let (shard, shards) = options.shard?;
        let left_out = run::named(tree, &left_out(places, tree));
        let Options { area, file, tests, budget, longest, bytes, constants, .. } = options;
        let (area, file, tests) = (area.clone(), file.clone(), tests.clone());
        let (budget, longest, bytes, constants) = (*budget, *longest, *bytes, *constants);
        let plan =
            Plan { area, file, tests, budget, longest, bytes, constants, sources: tree.hash(), left_out };
        Some(Self { shard, shards, plan })
    }
}

/// The file of a run's results: a shard's own, or that of the whole.
pub fn file(places: &Places, options: &Options) -> PathBuf {
    let name = match options.shard {
        Some((shard, shards)) => format!("shard-{shard}-of-{shards}.jsonl"),
        None => "results.jsonl".to_owned(),
    };
    places.work.join(name)
}

/// A shard's file as it exists.
struct Shard {
    path: String,
    head: Head,
    lines: Vec<Line>,
}

impl Shard {
    fn read(path: &Path) -> Result<Self> {
        let name = path.display().to_string();
        let text = std::fs::read_to_string(path).with_context(|| name.clone())?;
        let mut lines = text.lines();
        let head = lines.next().and_then(|head| serde_json::from_str(head).ok());
        let head = head.with_context(|| format!("{name}: no shard's file"))?;
        Ok(Self {
            path: name,
            head,
            lines: lines.filter_map(|line| serde_json::from_str(line).ok()).collect(),
        })
    }
}

/// Merges shards' files into the results of the whole, in the order of the mutants, and the options into those of their run.
///
/// # Errors
/// A shard that is missing or exists twice, is of another run or of other sources; a mutant that was not tried, or is in two shards.
pub fn merge(paths: &[PathBuf], places: &Places, tree: &Tree, options: &mut Options) -> Result<()> {
    let mut shards = paths.iter().map(|path| Shard::read(path)).collect::<Result<Vec<_>>>()?;
    shards.sort_by_key(|shard| shard.head.shard);
    let Some(Shard { head: Head { shards: count, plan, .. }, .. }) = shards.first() else { return Ok(()) };
    let (count, plan) = (*count, plan.clone());
    for (number, Shard { path, head, .. }) in shards.iter().enumerate() {
        ensure!(head.plan == plan && head.shards == count, "{path}: of another run");
        ensure!(head.shard <= number, "shard {number} of {count} is missing");
        ensure!(head.shard == number, "{path}: shard {} is there twice", head.shard);
    }
    ensure!(shards.len() == count, "shard {} of {count} is missing", shards.len());
    ensure!(plan.sources == tree.hash(), "the shards are of other sources than this commit's");
    let Plan { area, file, tests, budget, longest, bytes, constants, left_out, .. } = plan;
    (options.area, options.file, options.tests) = (area, file, tests);
    (options.budget, options.longest, options.bytes) = (budget, longest, bytes);
    (options.constants, options.shard) = (constants, None);
    let mut tried: HashMap<String, Line> = HashMap::new();
    for line in shards.into_iter().flat_map(|shard| shard.lines) {
        if let Some(line) = tried.insert(line.name.clone(), line) {
            bail!("{}: is there twice", line.name);
        }
    }
    let wanted = chosen(&tree.mutants, options).into_iter();
    let wanted = wanted.filter(|mutant| !left_out.contains_key(&mutant.name()));
    let lines = wanted.map(|mutant| {
        let name = mutant.name();
        tried.remove(&name).with_context(|| format!("{name}: was not tried"))
    });
    let lines = lines.collect::<Result<Vec<_>>>()?;
    run::keep_named(places, &left_out)?;
    Results::replace(&self::file(places, options), &lines)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::Outcome;
    use crate::tree::{self, Mutant};
    use clap::Parser;

    /// A tree of two files' mutants, and the shards' files of a run in a folder.
    struct Run {
        folder: tempfile::TempDir,
        places: Places,
        tree: Tree,
    }

    impl Run {
        fn new() -> Self {
            let folder = tempfile::tempdir().unwrap();
            let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_owned();
            let mut tree = tree::read(&root).unwrap();
            tree.mutants
                .retain(|mutant| mutant.file == "src/protocol/crc.rs" || mutant.file == "src/cell.rs");
            let places = Places { root, work: folder.path().to_owned() };
            Self { folder, places, tree }
        }

        fn options(&self, words: &str) -> Options {
            Options::parse_from(["mutants"].into_iter().chain(words.split_whitespace()))
        }

        /// Runs a shard, leaving so many mutants at the end untried.
        fn shard(&self, shard: &str, more: &str, left: usize) -> PathBuf {
            let options = self.options(&format!("--shard {shard} {more}"));
            let head = Head::new(&self.places, &self.tree, &options);
            let path = file(&self.places, &options);
            let results = Results::open(&path, head.as_ref()).unwrap();
            let mutants: Vec<&Mutant> = chosen(&self.tree.mutants, &options);
            for mutant in mutants.iter().take(mutants.len() - left) {
                let (outcome, by) = (Outcome::Killed, String::new());
                results.add(&Line { name: mutant.name(), source: mutant.hash, outcome, by }).unwrap();
            }
            path
        }

        fn merge(&self, paths: &[PathBuf]) -> Result<String, String> {
            let mut options = self.options("--report");
            merge(paths, &self.places, &self.tree, &mut options).map_err(|error| error.to_string())?;
            Ok(std::fs::read_to_string(self.folder.path().join("results.jsonl")).unwrap())
        }
    }

    #[test]
    fn shards_merge_alike_into_the_whole() {
        let run = Run::new();
        let merged = [1, 3, 7].map(|count| {
            let shards: Vec<_> =
                (0..count).rev().map(|shard| run.shard(&format!("{shard}/{count}"), "", 0)).collect();
            run.merge(&shards).unwrap()
        });
        assert!(merged[0].lines().count() > 60 && merged[1] == merged[0] && merged[2] == merged[0]);
    }

    #[test]
    fn a_merge_refuses_gaps_duplicates_and_other_runs() {
        let run = Run::new();
        let shards = [0, 1, 2].map(|shard| run.shard(&format!("{shard}/3"), "", 0));
        let of = |numbers: &[usize]| numbers.iter().map(|number| shards[*number].clone()).collect::<Vec<_>>();
        assert_eq!(run.merge(&of(&[0, 1])).unwrap_err(), "shard 2 of 3 is missing");
        assert_eq!(run.merge(&of(&[2, 0])).unwrap_err(), "shard 1 of 3 is missing");
        assert!(run.merge(&of(&[0, 1, 1, 2])).unwrap_err().ends_with("shard 1 is there twice"));
        run.merge(&of(&[0, 1, 2])).unwrap();
        std::fs::remove_file(&shards[1]).unwrap();
        run.shard("1/3", "--budget 3", 0);
        assert!(run.merge(&of(&[0, 1, 2])).unwrap_err().ends_with("of another run"));
        std::fs::remove_file(&shards[1]).unwrap();
        run.shard("1/3", "", 1);
        assert!(run.merge(&of(&[0, 1, 2])).unwrap_err().ends_with("was not tried"));
    }

    /// A shard that was cut off in the middle of a line continues, but not with other options.
    #[test]
    fn a_shard_goes_on_where_it_was_cut_off() {
        let run = Run::new();
        let path = run.shard("0/1", "", 1);
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(&path, &text[..text.len() - 9]).unwrap();
        let options = run.options("--shard 0/1");
        let head = Head::new(&run.places, &run.tree, &options);
        let results = Results::open(&path, head.as_ref()).unwrap();
        let open: Vec<_> = run.tree.mutants.iter().filter(|mutant| results.of(mutant).is_none()).collect();
        assert_eq!(open.len(), 2);
        for mutant in open {
            let (outcome, by) = (Outcome::Killed, String::new());
            results.add(&Line { name: mutant.name(), source: mutant.hash, outcome, by }).unwrap();
        }
        run.merge(std::slice::from_ref(&path)).unwrap();
        let other = Head::new(&run.places, &run.tree, &run.options("--shard 0/1 --longest 3"));
        let error = Results::open(&path, other.as_ref()).err().unwrap().to_string();
        assert!(error.contains("of another run"), "{error}");
    }
}
