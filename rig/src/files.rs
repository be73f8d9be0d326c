//! Files that are written whole or not at all.

use anyhow::{Context, Result};
use serde::ser::{Serialize, SerializeStruct, Serializer};
use std::io::Write;
use std::path::Path;

/// A value in a row of a CSV.
#[derive(Clone, Debug)]
pub enum Cell {
    /// A time in s, to a nanosecond.
    Time(f64),
    /// A number in single precision.
    Number(f32),
    /// A number as it is written down.
    Written(String),
    /// A name.
    Name(&'static str),
    /// A count, or a flag: 0 or 1.
    Count(u32),
}

impl Cell {
    /// A number in single precision, never with an exponent.
    pub fn plain(value: f32) -> Self {
        Self::Written(value.to_string())
    }

    /// A number rounded to one of so many parts, so that it prints short.
    pub fn short(value: f64, parts: f64) -> Self {
        Self::Written(((value * parts).round() / parts).to_string())
    }
}

impl From<f64> for Cell {
    fn from(value: f64) -> Self {
        Self::Number(value as f32)
    }
}

impl From<f32> for Cell {
    fn from(value: f32) -> Self {
        Self::Number(value)
    }
}

impl From<&'static str> for Cell {
    fn from(name: &'static str) -> Self {
        Self::Name(name)
    }
}

impl From<bool> for Cell {
    fn from(flag: bool) -> Self {
        Self::Count(flag.into())
    }
}

impl Serialize for Cell {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Time(value) => serializer.serialize_f64(short_time(*value)),
            Self::Number(value) => serializer.serialize_f32(*value),
            Self::Written(text) => serializer.serialize_str(text),
            Self::Name(name) => serializer.serialize_str(name),
            Self::Count(count) => serializer.serialize_u32(*count),
        }
    }
}

/// A row of a CSV: its columns with their values.
pub struct Columns<const N: usize>(pub [(&'static str, Cell); N]);

impl<const N: usize> Serialize for Columns<N> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut row = serializer.serialize_struct("Columns", N)?;
        for (name, cell) in &self.0 {
            row.serialize_field(name, cell)?;
        }
        row.end()
    }
}

/// Writes rows under the names of their columns; of no rows nothing.
pub fn write_rows(path: &Path, rows: impl IntoIterator<Item = impl Serialize>) -> Result<()> {
    write_whole(path, |out| Ok(rows.into_iter().try_for_each(|row| out.serialize(row))?))
}

/// Writes edges.csv: when, which gate, on or off.
pub fn write_edges(path: &Path, edges: impl Iterator<Item = (Cell, &'static str, bool)>) -> Result<()> {
    let mut rows = edges
        .map(|(t_s, gate, on)| Columns([("t_s", t_s), ("gate", gate.into()), ("level", on.into())]))
        .peekable();
    match rows.peek() {
        Some(_) => write_rows(path, rows),
        None => write_text(path, "t_s,gate,level\n"),
    }
}

/// Writes what a fault has frozen in the flight recorder; else takes away what an earlier run has left.
pub fn write_recorder<R, const N: usize>(
    path: &Path,
    recorded: &[R],
    row: impl Fn(&R) -> Columns<N>,
) -> Result<()> {
    if recorded.is_empty() { forget(path) } else { write_rows(path, recorded.iter().map(row)) }
}

/// Takes away a file that an earlier run has left.
pub fn forget(path: &Path) -> Result<()> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(error).with_context(|| path.display().to_string())
        }
        _ => Ok(()),
    }
}

/// A time rounded to a nanosecond, so that it prints short; ticks are 40 ns.
pub fn short_time(t_s: f64) -> f64 {
    (t_s * 1e9).round() / 1e9
}

/// Writes a CSV beside its place and moves it there when it is complete.
pub fn write_whole(
    path: &Path,
    fill: impl FnOnce(&mut csv::Writer<std::io::BufWriter<&std::fs::File>>) -> Result<()>,
) -> Result<()> {
    let folder = path.parent().unwrap_or(Path::new("."));
    let file = tempfile::NamedTempFile::new_in(folder).with_context(|| format!("{}", folder.display()))?;
    {
        let mut out = csv::Writer::from_writer(std::io::BufWriter::with_capacity(1 << 16, file.as_file()));
        fill(&mut out)?;
        out.flush()?;
    }
    publish(file, path)
}

/// Writes a text file whole or not at all.
pub fn write_text(path: &Path, text: &str) -> Result<()> {
    let folder = path.parent().unwrap_or(Path::new("."));
    let mut file =
        tempfile::NamedTempFile::new_in(folder).with_context(|| format!("{}", folder.display()))?;
    file.write_all(text.as_bytes())?;
    publish(file, path)
}

fn publish(file: tempfile::NamedTempFile, path: &Path) -> Result<()> {
    use std::os::unix::fs::PermissionsExt;
    file.as_file().set_permissions(std::fs::Permissions::from_mode(0o644))?;
    file.persist(path).with_context(|| format!("{}", path.display()))?;
    Ok(())
}
