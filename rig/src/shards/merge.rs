//! The merging of the shards' files.

use super::file::{ShardFile, difference, name};
use super::{Plan, Shard};
use anyhow::{Context, Result, bail};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A whole campaign.
#[derive(Clone, Debug)]
pub struct Merged {
    /// The campaign.
    pub plan: Plan,
    /// The row of every run, in their order.
    pub rows: Vec<String>,
}

impl Merged {
    /// The rows as a CSV.
    pub fn csv(&self) -> String {
        let lines = std::iter::once(&self.plan.columns).chain(&self.rows);
        lines.flat_map(|line| [line.as_str(), "\n"]).collect()
    }

    /// The rows, parsed.
    pub fn read<R: serde::de::DeserializeOwned>(&self) -> Result<Vec<R>> {
        let text = self.csv();
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let rows = reader.deserialize().enumerate();
        rows.map(|(run, row)| row.with_context(|| format!("run {run}"))).collect()
    }
}

/// Merges the files of folders. Refuses gaps, duplicates, and files of another program, configuration or number of shards.
pub fn merge(folders: &[PathBuf]) -> Result<Merged> {
    let named = folders.iter().map(|folder| folder.display().to_string()).collect::<Vec<_>>().join(", ");
    let paths = folders.iter().map(|folder| paths(folder)).collect::<Result<Vec<_>>>()?.concat();
    let Some(first) = paths.first() else {
        bail!("{named}: no file named shard-K-of-N.csv in it");
    };
    let ShardFile { plan, shard: Shard { shards, .. }, .. } = ShardFile::read(first)?;
    let mut by_shard = BTreeMap::new();
    for path in &paths {
        let file = ShardFile::read(path)?;
        if let Some(what) = difference(&plan, &file.plan) {
            bail!("{}: is of another {what} than {}", path.display(), first.display());
        }
        if file.shard.shards != shards {
            bail!(
                "{}: is one of {} shards, {} one of {shards}",
                path.display(),
                file.shard.shards,
                first.display()
            );
        }
        if let Some((other, _)) = by_shard.insert(file.shard.shard, (path, file.rows)) {
            bail!("{}: is shard {} again, as {}", path.display(), file.shard, other.display());
        }
    }
    if let Some(shard) = (0..shards).find(|shard| !by_shard.contains_key(shard)) {
        let shard = Shard { shard, shards };
        bail!("{named}: shard {shard} is missing, {}", name(shard));
    }
    let row = |run: usize| {
        let (path, rows) = by_shard.get_mut(&(run % shards)).context("a shard that is there")?;
        let (shard, path) = (run % shards, path.display());
        rows.remove(&run)
            .with_context(|| format!("{path}: run {run} is missing; start shard {shard}/{shards} again"))
    };
    let rows = (0..plan.runs).map(row).collect::<Result<_>>()?;
    Ok(Merged { plan, rows })
}

/// The shards' files, in the order of their names.
fn paths(folder: &Path) -> Result<Vec<PathBuf>> {
    let named = || folder.display().to_string();
    let mut paths = Vec::new();
    for entry in std::fs::read_dir(folder).with_context(named)? {
        let path = entry.with_context(named)?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if name.starts_with("shard-") && name.ends_with(".csv") {
            paths.push(path);
        }
    }
    paths.sort();
    Ok(paths)
}
