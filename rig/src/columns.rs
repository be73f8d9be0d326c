//! A CSV from the user: named columns, in any order, `#` comments; an error is reported in one line with file, line, column, value and what is
//! allowed.

use anyhow::{Context, Result, anyhow};
use csv::StringRecord;
use std::path::Path;

/// The wanted columns of a file, row by row.
pub struct Columns<const N: usize> {
    file: String,
    names: [&'static str; N],
    places: [usize; N],
    head: StringRecord,
    rows: Vec<(u64, StringRecord)>,
}

/// One field, and its position.
pub struct Field<'a> {
    file: &'a str,
    line: u64,
    column: &'static str,
    text: &'a str,
}

impl<const N: usize> Columns<N> {
    /// Reads these columns. Fails if the file cannot be read, a column is missing, or a row has too many or too few fields.
    pub fn read(path: &Path, names: [&'static str; N]) -> Result<Self> {
        let file = path.display().to_string();
        let mut reader = csv::ReaderBuilder::new()
            .comment(Some(b'#'))
            .trim(csv::Trim::All)
            .from_path(path)
            .with_context(|| format!("{file}: cannot be read"))?;
        let headers = reader.headers().map_err(|error| broken(&file, &error))?.clone();
        let mut places = [0; N];
        for (place, name) in places.iter_mut().zip(names) {
            *place = headers.iter().position(|header| header == name).with_context(|| {
                let found = headers.iter().collect::<Vec<_>>().join(",");
                format!("{file}:1: {found:?}: the column {name} is missing; must be {}", names.join(","))
            })?;
        }
        let mut rows = Vec::new();
        for record in reader.records() {
            let record = record.map_err(|error| broken(&file, &error))?;
            let line = record.position().map_or(0, csv::Position::line);
            rows.push((line, record));
        }
        Ok(Self { file, names, places, head: headers, rows })
    }

    /// The head, with all of the file's columns.
    pub const fn head(&self) -> &StringRecord {
        &self.head
    }

    /// Each row with all of the file's columns.
    pub fn records(&self) -> impl Iterator<Item = &StringRecord> {
        self.rows.iter().map(|(_, record)| record)
    }

    /// Each row's fields in the order of the names given to [`Columns::read`].
    pub fn rows(&self) -> impl Iterator<Item = [Field<'_>; N]> {
        self.rows.iter().map(|(line, record)| {
            core::array::from_fn(|k| Field {
                file: &self.file,
                line: *line,
                column: self.names[k],
                text: record.get(self.places[k]).unwrap_or(""),
            })
        })
    }
}

impl Field<'_> {
    /// The field as it appears in the file.
    pub const fn text(&self) -> &str {
        self.text
    }

    /// The field as a finite number that `good` accepts; otherwise an error that ends with what is allowed.
    pub fn number(&self, allowed: &str, good: impl Fn(f64) -> bool) -> Result<f64> {
        match self.text.parse::<f64>() {
            Ok(value) if value.is_finite() && good(value) => Ok(value),
            _ => Err(self.wrong(allowed)),
        }
    }

    /// The error for this field.
    pub fn wrong(&self, allowed: &str) -> anyhow::Error {
        let Self { file, line, column, text } = self;
        // Escaped: whatever the field holds, the error stays one line.
        let text = text.escape_debug();
        anyhow!("{file}:{line}: {column}: {text}: must be {allowed}")
    }
}

fn broken(file: &str, error: &csv::Error) -> anyhow::Error {
    let line = error.position().map_or(0, csv::Position::line);
    match error.kind() {
        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
            anyhow!("{file}:{line}: {len} fields: must be {expected_len}, as in the first line")
        }
        _ => anyhow!("{file}:{line}: must be text with commas: {error}"),
    }
}
