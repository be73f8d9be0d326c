//! Files that are written whole or not at all.

use crate::platform::written;
use anyhow::{Context, Result, bail};
use serde::Serialize;
use serde::ser::{SerializeStruct, Serializer};
use std::io::{BufWriter, Write};
use std::path::Path;

/// A value in a row of a CSV.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
pub enum Cell {
    /// A number in single precision.
    Number(f32),
    /// A number in double precision.
    Exact(f64),
    /// A number in its written form.
    Written(String),
    /// A name.
    Name(&'static str),
    /// A count, or a flag: 0 or 1.
    Count(u32),
    /// Nothing: the table has no such column.
    Missing,
}

impl Cell {
    /// A time in s, to a nanosecond, so that it prints short; ticks are 40 ns.
    pub fn time(t_s: f64) -> Self {
        Self::Exact((t_s * 1e9).round() / 1e9)
    }

    /// A number in single precision, never with an exponent.
    pub fn plain(value: f32) -> Self {
        Self::Written(value.to_string())
    }

    /// A number rounded to a multiple of one over `parts`, so that it prints short.
    pub fn short(value: f64, parts: f64) -> Self {
        Self::Written(((value * parts).round() / parts).to_string())
    }
}

/// Cells of plain values.
macro_rules! cells {
    ($($from:ty: $value:ident => $cell:expr;)*) => {$(
        impl From<$from> for Cell {
            fn from($value: $from) -> Self {
                $cell
            }
        }
    )*};
}

cells! {
    f64: value => Self::Number(value as f32);
    f32: value => Self::Number(value);
    &'static str: name => Self::Name(name);
    bool: flag => Self::Count(flag.into());
    Option<f64>: value => value.map_or(Self::Missing, Self::from);
}

/// Columns by their names, with their contents.
#[macro_export]
macro_rules! columns {
    ($($name:ident: $value:expr),* $(,)?) => {
        $crate::files::Columns([$((stringify!($name), $crate::files::Cell::from($value))),*])
    };
}

/// A row of a CSV: its columns with their values.
pub struct Columns<const N: usize>(pub [(&'static str, Cell); N]);

impl<const N: usize> Serialize for Columns<N> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut row = serializer.serialize_struct("Columns", N)?;
        for (name, cell) in self.0.iter().filter(|(_, cell)| !matches!(cell, Cell::Missing)) {
            row.serialize_field(name, cell)?;
        }
        row.end()
    }
}

/// Writes rows under the names of their columns; for no rows nothing.
pub fn write_rows(path: &Path, rows: impl IntoIterator<Item = impl Serialize>) -> Result<()> {
    write_whole(path, |out| Ok(rows.into_iter().try_for_each(|row| out.serialize(row))?))
}

/// The bytes that [`write_rows`] writes.
pub fn bytes_of_rows(rows: impl IntoIterator<Item = impl Serialize>) -> Result<Vec<u8>> {
    let mut out = csv::Writer::from_writer(Vec::new());
    rows.into_iter().try_for_each(|row| out.serialize(row))?;
    Ok(out.into_inner().map_err(csv::IntoInnerError::into_error)?)
}

/// Writes edges.csv: time, gate, on or off.
pub fn write_edges(path: &Path, edges: impl Iterator<Item = (Cell, &'static str, bool)>) -> Result<()> {
    let mut rows = edges
        .map(|(t_s, gate, on)| Columns([("t_s", t_s), ("gate", gate.into()), ("level", on.into())]))
        .peekable();
    match rows.peek() {
        Some(_) => write_rows(path, rows),
        None => write_text(path, "t_s,gate,level\n"),
    }
}

/// Writes what a fault has frozen in the flight recorder; otherwise removes what an earlier run has left.
pub fn write_recorder<R, const N: usize>(
    path: &Path,
    recorded: &[R],
    row: impl Fn(&R) -> Columns<N>,
) -> Result<()> {
    if recorded.is_empty() { forget(path) } else { write_rows(path, recorded.iter().map(row)) }
}

/// Removes a file that an earlier run has left.
pub fn forget(path: &Path) -> Result<()> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(error).with_context(|| path.display().to_string())
        }
        _ => Ok(()),
    }
}

/// Writes a CSV beside its place and moves it there when it is complete.
pub fn write_whole(
    path: &Path,
    fill: impl FnOnce(&mut csv::Writer<BufWriter<&mut dyn Write>>) -> Result<()>,
) -> Result<()> {
    written(path, |file| {
        let mut out = csv::Writer::from_writer(BufWriter::with_capacity(1 << 16, file));
        fill(&mut out)?;
        Ok(out.flush()?)
    })
}

/// Refuses an `--out` if a file is in the way of a folder.
pub fn check_folder(out: &Path) -> Result<()> {
    let in_the_way = out.ancestors().find(|path| path.exists() && !path.is_dir());
    in_the_way.map_or(Ok(()), |file| {
        bail!("--out {}: {} is a file: must be a folder, or nothing yet", out.display(), file.display())
    })
}

/// Creates the folder of `--out` if it does not exist yet.
pub fn make_folder(out: &Path) -> Result<()> {
    check_folder(out)?;
    std::fs::create_dir_all(out).with_context(|| format!("--out {}", out.display()))
}

/// Writes a text file whole or not at all.
pub fn write_text(path: &Path, text: &str) -> Result<()> {
    written(path, |file| Ok(file.write_all(text.as_bytes())?))
}
