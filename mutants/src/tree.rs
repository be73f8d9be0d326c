//! The copy of the repository, with all mutants in it.

use crate::areas::{Area, CRATES};
use crate::modules;
use crate::schema::{self, Schema};
use crate::sites::{self, Bytes, Found, Site};
use anyhow::{Context, Result, bail};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::process::Command;

/// A mutant.
#[derive(Clone, Debug)]
pub struct Mutant {
    pub number: u32,
    pub file: String,
    pub line: usize,
    pub column: usize,
    pub function: String,
    pub what: String,
    /// The line of the source, trimmed.
    pub source: String,
    /// Compiled before it can be chosen.
    pub fixed: bool,
    /// In a `const fn`: if it runs only while compiling, no test reaches it.
    pub early: bool,
    /// For a build of its own, the bytes of its file that it replaces, and the new text; only for the two kinds above.
    pub alone: Option<(Bytes, String)>,
    /// The hash of the file.
    pub hash: u64,
}

impl Mutant {
    /// As cargo-mutants names it, nearly.
    pub fn name(&self) -> String {
        let Self { file, line, column, function, what, .. } = self;
        let within = if function.is_empty() { String::new() } else { format!(" in {function}") };
        format!("{file}:{line}:{column}: {what}{within}")
    }

    pub fn area(&self) -> Option<Area> {
        Area::of(&self.file)
    }
}

/// A file with its sites and their numbers.
pub struct Source {
    pub file: String,
    pub text: String,
    sites: Vec<Site>,
    numbers: Vec<Vec<u32>>,
}

/// All files with mutants, and the mutants in the order of their numbers, from 1.
#[derive(Default)]
pub struct Tree {
    pub sources: Vec<Source>,
    pub mutants: Vec<Mutant>,
}

/// Reads the sources of the repository.
pub fn read(root: &Path) -> Result<Tree> {
    let mut tree = Tree::default();
    for (folder, file) in CRATES {
        let mut files = Vec::new();
        modules::files(root, &Path::new(folder).join(file), &mut files)?;
        for file in files {
            tree.add(root, &file)?;
        }
    }
    Ok(tree)
}

impl Tree {
    /// A hash of the sources of all mutants.
    pub fn hash(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        for mutant in &self.mutants {
            (mutant.name(), mutant.hash).hash(&mut hasher);
        }
        hasher.finish()
    }

    fn add(&mut self, root: &Path, file: &Path) -> Result<()> {
        let name = file.to_string_lossy().into_owned();
        if Area::of(&name).is_none() {
            return Ok(());
        }
        let text = std::fs::read_to_string(root.join(file))?;
        let sites = sites::of(&text).with_context(|| name.clone())?;
        let lines: Vec<&str> = text.lines().collect();
        let mut hasher = DefaultHasher::new();
        text.hash(&mut hasher);
        let hash = hasher.finish();
        let mut numbers = Vec::new();
        for site in &sites {
            let own = site.mutants.iter().enumerate().map(|(index, found)| {
                let Found { line, column, function, what, early } = found.clone();
                let alone = if site.fixed || early { schema::alone(&text, site, index) } else { None };
                let source = lines.get(line.saturating_sub(1)).map_or("", |line| line.trim()).to_owned();
                let number = self.mutants.len() as u32 + 1;
                self.mutants.push(Mutant {
                    number,
                    file: name.clone(),
                    line,
                    column,
                    function,
                    what,
                    source,
                    fixed: site.fixed,
                    early,
                    alone,
                    hash,
                });
                number
            });
            numbers.push(own.collect());
        }
        self.sources.push(Source { file: name, text, sites, numbers });
        Ok(())
    }
}

impl Source {
    /// The file with the mutants that are wanted.
    pub fn schema(&self, wanted: impl Fn(u32) -> bool) -> Schema {
        let kept = |number: &u32| if wanted(*number) { *number } else { 0 };
        let numbers: Vec<Vec<u32>> = self.numbers.iter().map(|own| own.iter().map(kept).collect()).collect();
        schema::of(&self.text, &self.sites, &numbers)
    }
}

/// Copies what git knows, except the sources with mutants; adds the crate that says which one is active.
pub fn copy(root: &Path, to: &Path, tree: &Tree) -> Result<()> {
    let mut git = Command::new("git");
    git.args(["ls-files", "-z", "--cached", "--others", "--exclude-standard"]).current_dir(root);
    let listed = git.output().context("git ls-files")?;
    if !listed.status.success() {
        bail!("git ls-files failed");
    }
    let mutated = |file: &str| tree.sources.iter().any(|source| source.file == file);
    let text = String::from_utf8_lossy(&listed.stdout).into_owned();
    for file in text.split('\0').filter(|file| !file.is_empty() && !mutated(file)) {
        let Ok(mut bytes) = std::fs::read(root.join(file)) else { continue };
        if let Some((folder, _)) =
            CRATES.iter().find(|(folder, _)| Path::new(folder).join("Cargo.toml") == Path::new(file))
        {
            let up = "../".repeat(Path::new(folder).components().count());
            let manifest = String::from_utf8_lossy(&bytes);
            let depends = |manifest: &str, section: &str| {
                manifest.replacen(section, &format!("{section}mutant = {{ path = \"{up}mutant\" }}\n"), 1)
            };
            // A build script may share files with its package.
            bytes =
                depends(&depends(&manifest, "\n[dependencies]\n"), "\n[build-dependencies]\n").into_bytes();
        }
        put(&to.join(file), &bytes)?;
    }
    put(
        &to.join("mutant/Cargo.toml"),
        b"[package]\nname = \"mutant\"\nedition = \"2024\"\n[lib]\npath = \"lib.rs\"\n",
    )?;
    put(&to.join("mutant/lib.rs"), include_bytes!("../runtime/lib.rs"))?;
    put(&to.join("mutant/count.rs"), (tree.mutants.len() + 1).to_string().as_bytes())
}

/// Writes a file unless it exists unchanged, so that cargo does not rebuild it.
pub fn put(path: &PathBuf, bytes: &[u8]) -> Result<()> {
    if std::fs::read(path).is_ok_and(|there| there == bytes) {
        return Ok(());
    }
    std::fs::create_dir_all(path.parent().unwrap_or(path))?;
    std::fs::write(path, bytes).with_context(|| path.display().to_string())
}
