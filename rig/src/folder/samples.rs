//! The rows of another tool's flux map.

use super::header::{Column, QUANTITIES, column};
use anyhow::{Context, Result, anyhow, bail, ensure};
use std::path::Path;
use tractive_tablegen::{line_of, read_bounded};

/// A row: its line, and current and flux linkage in A and Wb, peak, in the order of [`QUANTITIES`].
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Line, from 1.
    pub line: u64,
    /// Values.
    pub values: [f64; 4],
}

/// Largest current in A, and flux linkage in Wb.
const LARGEST: [f64; 4] = [1e5, 1e5, 1e3, 1e3];

/// Reads a map.
///
/// # Errors
/// File, line and column, what stands there and what is allowed.
pub fn read(path: &Path, rms: bool) -> Result<Vec<Sample>> {
    let file = path.display();
    let text = read_bounded(path).with_context(|| format!("{file}: cannot be read"))?;
    let text = text.strip_prefix("\u{feff}".as_bytes()).unwrap_or(&text);
    let delimiter = delimiter(text);
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .delimiter(delimiter)
        .flexible(true)
        .from_reader(text);
    let broken = |error: csv::Error| {
        let line = error.position().map_or(0, |position| line_of(text, position));
        match error.kind() {
            csv::ErrorKind::Utf8 { .. } => anyhow!("{file}:{line}: must be text in UTF-8, as ASCII is"),
            _ => anyhow!("{file}:{line}: must be text in columns: {error}"),
        }
    };
    let headers = reader.headers().map_err(broken)?.clone();
    ensure!(!headers.is_empty(), "{file}: is empty: must hold a head and a line for each node");
    let line = headers.position().map_or(1, |position| line_of(text, position));
    let columns = columns(&headers, rms).with_context(|| format!("{file}:{line}"))?;
    let mut samples = Vec::new();
    for record in reader.records() {
        let record = record.map_err(broken)?;
        let line = record.position().map_or(0, |position| line_of(text, position));
        if record.iter().all(str::is_empty) {
            continue;
        }
        // An empty one at the end is a delimiter too many.
        let cells = (1..=record.len()).rev().find(|n| !record[n - 1].is_empty()).unwrap_or(0);
        ensure!(
            cells <= headers.len(),
            "{file}:{line}: {cells} cells: must be {} as in the head; with decimal commas, semicolons part the columns",
            headers.len()
        );
        let mut values = [0.0; 4];
        for (place, column) in &columns {
            let field = record.get(*place).unwrap_or("");
            // Where a semicolon parts the columns, a comma may part the decimals.
            let plain = if delimiter == b';' { field.replace(',', ".") } else { field.to_owned() };
            let value = plain.parse::<f64>().map_or(f64::NAN, |value| value * column.factor);
            let (name, largest) = (&column.name, LARGEST[column.quantity]);
            ensure!(
                value.abs() <= largest,
                "{file}:{line}: {name}: {}: must be a number, in A or Wb at most {largest}",
                field.escape_debug()
            );
            values[column.quantity] = value;
        }
        samples.push(Sample { line, values });
    }
    ensure!(!samples.is_empty(), "{file}: holds no node below its head");
    Ok(samples)
}

/// The delimiter of the first line that is no comment.
fn delimiter(text: &[u8]) -> u8 {
    let head = text.split(|byte| *byte == b'\n').find(|line| !line.starts_with(b"#") && line.len() > 1);
    let head = head.unwrap_or_default();
    [b';', b'\t'].into_iter().find(|byte| head.contains(byte)).unwrap_or(b',')
}

/// Places and meanings of the four columns.
fn columns(headers: &csv::StringRecord, rms: bool) -> Result<Vec<(usize, Column)>> {
    let mut found: Vec<(usize, Column)> = Vec::new();
    for (place, name) in headers.iter().enumerate() {
        let Some(column) = column(name, rms).map_err(|problem| anyhow!("{name}: {problem}"))? else {
            continue;
        };
        if let Some((_, twin)) = found.iter().find(|(_, other)| other.quantity == column.quantity) {
            bail!("{name}: must be there once: {} is {} too", twin.name, QUANTITIES[column.quantity]);
        }
        found.push((place, column));
    }
    let missing =
        (0..QUANTITIES.len()).find(|quantity| found.iter().all(|(_, one)| one.quantity != *quantity));
    if let Some(missing) = missing {
        let names = headers.iter().collect::<Vec<_>>().join(", ");
        bail!(
            "no column for {}: must be there, such as id_a, iq_a, psi_d_wb, psi_q_wb; the head is {}",
            QUANTITIES[missing],
            names.escape_debug()
        );
    }
    Ok(found)
}
