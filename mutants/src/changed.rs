//! Files that were changed recently: a sample looks there first.

use crate::tree::Mutant;
use std::collections::HashSet;
use std::process::Command;

/// The files that the last commits changed, or that differ from the last one. None if there is no history: a sample is then drawn from all.
pub fn files(commits: u32) -> HashSet<String> {
    let mut git = Command::new("git");
    git.current_dir(env!("CARGO_MANIFEST_DIR")).args(["diff", "--name-only", &format!("HEAD~{commits}")]);
    let names = git.output().map(|output| output.stdout).unwrap_or_default();
    String::from_utf8_lossy(&names).lines().map(str::to_owned).collect()
}

/// So many mutants of these files before all of the others, in the order in which they come.
pub fn first<'a>(mutants: Vec<&'a Mutant>, files: &HashSet<String>, count: usize) -> Vec<&'a Mutant> {
    let (mut changed, others): (Vec<_>, Vec<_>) =
        mutants.into_iter().partition(|mutant| files.contains(&mutant.file));
    let rest = changed.split_off(count.min(changed.len()));
    changed.into_iter().chain(others).chain(rest).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tree;
    use std::path::Path;

    #[test]
    fn a_sample_begins_with_some_of_the_files_that_changed() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
        let all = tree::read(root).unwrap().mutants;
        let file = |mutant: &Mutant| mutant.file.clone();
        let changed = HashSet::from([file(all.last().unwrap())]);
        let chosen = first(all.iter().collect(), &changed, 3);
        let names: Vec<_> = chosen.iter().map(|mutant| changed.contains(&mutant.file)).collect();
        assert_eq!(chosen.len(), all.len());
        assert_eq!(names.iter().take(4).copied().collect::<Vec<_>>(), [true, true, true, false]);
        assert_eq!(
            names.iter().filter(|of| **of).count(),
            all.iter().filter(|of| changed.contains(&of.file)).count()
        );
        let numbers: HashSet<u32> = chosen.iter().map(|mutant| mutant.number).collect();
        assert_eq!(numbers.len(), all.len());
        // Anyone with few changes gets a sample of everything.
        assert_eq!(
            first(all.iter().collect(), &HashSet::new(), 3).first().map(|of| of.number),
            all.first().map(|of| of.number)
        );
    }
}
