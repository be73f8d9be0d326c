//! The run: builds, learns which test reaches which mutant, and tries mutants with the tests that do, the cheapest first.

use crate::build::{self, Program};
use crate::changed;
use crate::constants;
use crate::results::{KnownList, Line, Outcome, Results};
use crate::shards::{self, Head};
use crate::tree::{self, Mutant, Tree};
use crate::trials::{self, End, Trial};
use crate::{Options, Places};
use anyhow::{Context, Result};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// The mutants that the options ask for.
pub fn chosen<'a>(mutants: &'a [Mutant], options: &Options) -> Vec<&'a Mutant> {
    let area = |mutant: &Mutant| {
        options.area.is_empty() || mutant.area().is_some_and(|area| options.area.contains(&area))
    };
    let file = |mutant: &Mutant| {
        options.file.is_empty() || options.file.iter().any(|file| mutant.file.starts_with(file.as_str()))
    };
    let kind = |mutant: &Mutant| !options.constants || mutant.fixed;
    let mut chosen: Vec<&Mutant> =
        mutants.iter().filter(|mutant| area(mutant) && file(mutant) && kind(mutant)).collect();
    if let Some((k, n)) = options.shard {
        chosen = chosen.into_iter().skip(k).step_by(n).collect();
    }
    let Some(sample) = options.sample else { return chosen };
    let count = sample.min(chosen.len());
    if let Some(seed) = options.seed {
        chosen.sort_by_cached_key(|mutant| drawn(seed, mutant));
        if let Some(commits) = options.changed {
            chosen = changed::first(chosen, &changed::files(commits), count.div_ceil(2));
        }
        chosen.truncate(count);
    }
    let all = chosen.len();
    (0..count).filter_map(|index| chosen.get(index * all / count).copied()).collect()
}

fn drawn(seed: u64, mutant: &Mutant) -> u64 {
    let mut hasher = DefaultHasher::new();
    (seed, mutant.name()).hash(&mut hasher);
    hasher.finish()
}

/// The file of the mutants that do not compile this way: names, each with the error's code.
pub fn left_out(places: &Places, tree: &Tree) -> BTreeMap<u32, String> {
    let text = std::fs::read_to_string(places.work.join("left-out.json")).unwrap_or_default();
    let named: HashMap<String, String> = serde_json::from_str(&text).unwrap_or_default();
    let code = |mutant: &Mutant| named.get(&mutant.name()).map(|code| (mutant.number, code.clone()));
    tree.mutants.iter().filter_map(code).collect()
}

/// The names of those that are left out.
pub fn named(tree: &Tree, left_out: &BTreeMap<u32, String>) -> BTreeMap<String, String> {
    tree.mutants
        .iter()
        .filter_map(|mutant| Some((mutant.name(), left_out.get(&mutant.number)?.clone())))
        .collect()
}

/// Writes the file of those that are left out.
pub fn keep_named(places: &Places, named: &BTreeMap<String, String>) -> Result<()> {
    Ok(std::fs::write(places.work.join("left-out.json"), serde_json::to_string_pretty(named)?)?)
}

/// Tries them all.
pub fn run(places: &Places, tree: &Tree, options: &Options) -> Result<()> {
    let known = KnownList::read(&places.root.join("mutants/known.toml"), &tree.mutants)?;
    let copy = places.work.join("tree");
    tree::copy(&places.root, &copy, tree)?;
    let mut left_out = left_out(places, tree);
    let packages = build::packages(&options.tests);
    // A sample alone compiles sooner.
    let numbers = |mutants: Vec<&Mutant>| mutants.iter().map(|mutant| mutant.number).collect();
    let only = numbers(match options.sample {
        Some(_) => chosen(&tree.mutants, options),
        None => tree.mutants.iter().collect(),
    });
    let built = build::programs(&places.work, tree, &packages, &only, &mut left_out);
    keep_named(places, &named(tree, &left_out))?;
    let programs = built?;
    rayon::ThreadPoolBuilder::new().num_threads(options.jobs).build_global()?;
    let trials = learnt(places, &programs, options)?;
    let results = Results::open(&shards::file(places, options), Head::new(places, tree, options).as_ref())?;
    let (fixed, mut open): (Vec<&Mutant>, Vec<&Mutant>) = chosen(&tree.mutants, options)
        .into_iter()
        .filter(|mutant| !left_out.contains_key(&mutant.number))
        .filter(|mutant| match results.of(mutant).map(|line| line.outcome) {
            None => true,
            Some(outcome) => options.again && !outcome.is_settled() && !known.has(mutant),
        })
        .partition(|mutant| mutant.fixed);
    // In no particular order: a run that is stopped is then a sample of all.
    open.sort_by_cached_key(|mutant| drawn(0, mutant));
    let search = Search::new(&trials, options.budget, &places.work);
    let (done, alone) = (AtomicUsize::new(0), Mutex::new(fixed));
    open.par_iter().with_max_len(1).try_for_each(|mutant| {
        let (outcome, by) = search.of(mutant)?;
        let count = done.fetch_add(1, Ordering::Relaxed) + 1;
        if count.is_multiple_of(100) {
            eprintln!("mutants: {count} of {} tried", open.len());
        }
        if outcome == Outcome::Unreached && mutant.early {
            if let Ok(mut alone) = alone.lock() {
                alone.push(mutant);
            }
            return Ok(());
        }
        results.add(&Line { name: mutant.name(), source: mutant.hash, outcome, by })
    })?;
    let mut alone = alone.into_inner().unwrap_or_default();
    alone.sort_by_key(|mutant| mutant.number);
    // A build each: a sample takes none of these.
    if options.sample.is_none() && !alone.is_empty() {
        constants::run(places, tree, &search, &packages, &alone, &results)?;
    }
    Ok(())
}

/// Limits up to which earlier results of learning are looked for, in s.
const LONGEST_KEPT_S: u64 = 30;

/// The trials of all programs; those of an unchanged program are read from file.
fn learnt(places: &Places, programs: &[Program], options: &Options) -> Result<Vec<Trial>> {
    let longest_s = options.longest;
    let folder = places.work.join("reached");
    std::fs::create_dir_all(&folder)?;
    let mut all = Vec::new();
    for program in programs {
        let bytes = std::fs::read(&program.path).with_context(|| program.path.display().to_string())?;
        let mut of_bytes = DefaultHasher::new();
        bytes.hash(&mut of_bytes);
        let file = |longest_s: u64| {
            let mut hasher = of_bytes.clone();
            (longest_s, include_str!("../goldens.txt")).hash(&mut hasher);
            folder.join(format!("{}-{:016x}.json", program.name.replace(' ', "-"), hasher.finish()))
        };
        // What was learnt with longer limits serves as well.
        let read = |longest_s| std::fs::read_to_string(file(longest_s)).ok();
        let known = (longest_s..=LONGEST_KEPT_S).find_map(read);
        if let Some(trials) = known.and_then(|text| serde_json::from_str::<Vec<Trial>>(&text).ok()) {
            all.extend(trials.into_iter().filter(|trial| trial.seconds <= longest_s as f64));
            continue;
        }
        let found = match (program.is_test, program.name.ends_with(" tractive-rig")) {
            (true, _) => trials::of(program)?,
            (false, true) if options.bytes => trials::goldens(program),
            (false, _) => continue,
        };
        let count = found.len();
        let learnt: Vec<Trial> = found
            .into_par_iter()
            .with_max_len(1)
            .filter_map(|trial| trial.learn(&places.work.join("scratch"), longest_s))
            .collect();
        eprintln!("mutants: {}: {} of {count} tests come by a mutant", program.name, learnt.len());
        std::fs::write(file(longest_s), serde_json::to_string(&learnt)?)?;
        all.extend(learnt);
    }
    Ok(all)
}

/// The trials, and what is known of them.
pub struct Search<'a> {
    trials: &'a [Trial],
    /// For each mutant, the trials that reach it.
    by: HashMap<u32, Vec<usize>>,
    /// Runs and kills of each trial, for each file.
    scores: Mutex<HashMap<(String, usize), (f64, f64)>>,
    budget: f64,
    work: &'a Path,
}

impl<'a> Search<'a> {
    pub fn new(trials: &'a [Trial], budget: f64, work: &'a Path) -> Self {
        let mut by: HashMap<u32, Vec<usize>> = HashMap::new();
        for (index, trial) in trials.iter().enumerate() {
            for number in &trial.reached {
                by.entry(*number).or_default().push(index);
            }
        }
        Self { trials, by, scores: Mutex::default(), budget, work }
    }

    /// The trials that reach any of a file's mutants; all of them, if none does.
    pub fn of_file(&self, mutants: &[Mutant], file: &str) -> Vec<usize> {
        let own = mutants.iter().filter(|mutant| mutant.file == file);
        let found: BTreeSet<usize> =
            own.filter_map(|mutant| self.by.get(&mutant.number)).flatten().copied().collect();
        if found.is_empty() { (0..self.trials.len()).collect() } else { found.into_iter().collect() }
    }

    /// A trial by its place.
    pub fn trial(&self, index: usize) -> Option<&Trial> {
        self.trials.get(index)
    }

    /// Trials in the order of the expected cost of killing a mutant, lowest first; tests before the rig's bytes.
    fn ordered(&self, mutant: &Mutant, mut order: Vec<usize>) -> Vec<usize> {
        let scores = self.scores.lock();
        let cost = |index: &usize| {
            let Some(trial) = self.trials.get(*index) else { return (true, f64::MAX) };
            let key = (mutant.file.clone(), *index);
            let (runs, kills) =
                scores.as_ref().ok().and_then(|scores| scores.get(&key).copied()).unwrap_or((0.0, 0.0));
            (trial.golden.is_some(), (trial.seconds + 0.01) * (runs + 2.0) / (kills + 0.5))
        };
        let mut keyed: Vec<_> = order.drain(..).map(|index| (cost(&index), index)).collect();
        keyed.sort_by(|(a, _), (b, _)| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        keyed.into_iter().map(|(_, index)| index).collect()
    }

    fn of(&self, mutant: &Mutant) -> Result<(Outcome, String)> {
        let by = self.by.get(&mutant.number).cloned().unwrap_or_default();
        self.tried(mutant, by, |trial| trial.run(mutant.number, &self.work.join("scratch")))
    }

    /// Runs trials until one notices or the budget is spent.
    pub fn tried(
        &self,
        mutant: &Mutant,
        by: Vec<usize>,
        run: impl Fn(&Trial) -> Result<End>,
    ) -> Result<(Outcome, String)> {
        let order = self.ordered(mutant, by);
        if order.is_empty() {
            return Ok((Outcome::Unreached, String::new()));
        }
        // The rig's bytes have a budget of their own.
        let mut left = [self.budget; 2];
        let mut passed = 0;
        for index in &order {
            let Some(trial) = self.trials.get(*index) else { continue };
            let Some(left) = left.get_mut(usize::from(trial.golden.is_some())) else { continue };
            if *left < trial.seconds {
                continue;
            }
            *left -= trial.seconds;
            let end = run(trial)?;
            if let Ok(mut scores) = self.scores.lock() {
                let (runs, kills) = scores.entry((mutant.file.clone(), *index)).or_default();
                *runs += 1.0;
                *kills += f64::from(u8::from(end != End::Same));
            }
            match (end, trial.golden) {
                (End::Same, _) => passed += 1,
                (_, Some(_)) => return Ok((Outcome::Golden, trial.label())),
                (End::Late, None) => return Ok((Outcome::Late, trial.label())),
                (End::Other, None) => return Ok((Outcome::Killed, trial.label())),
            }
        }
        Ok((Outcome::Missed, format!("{passed} of {}", order.len())))
    }
}
