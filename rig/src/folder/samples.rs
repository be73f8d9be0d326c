//! The rows of another tool's flux map.

use super::header::{ANGLE, Column, MAGNITUDE, QUANTITIES, column};
use super::torque;
use anyhow::{Context, Result, anyhow, bail, ensure};
use core::f64::consts::TAU;
use std::path::Path;
use tractive_tablegen::{line_of, read_bounded};

/// A row: its line, and current and flux linkage in A and Wb, peak, in the order of [`QUANTITIES`].
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Line, from 1.
    pub line: u64,
    /// Values.
    pub values: [f64; 4],
    /// Torque in N·m, as given by the map; not a number if it gives none.
    pub torque_nm: f64,
}

/// The rows of a map.
pub struct Samples {
    /// In the file's order.
    pub rows: Vec<Sample>,
    /// `true` if currents were given as magnitude and angle: then the angle counts from q towards −d.
    pub is_polar: bool,
    /// Values in A of the units that the head states for id and iq, or for their magnitude; `None` if it states none.
    pub units_a: [Option<f64>; 2],
}

/// Largest current in A, flux linkage in Wb, and angle in rad; by quantity.
const LARGEST: [f64; 6] = [1e5, 1e5, 1e3, 1e3, 1e5, 100.0];

/// Reads a map.
///
/// # Errors
/// File, line and column, what is there and what is allowed.
pub fn read(path: &Path, rms: bool) -> Result<Samples> {
    let file = path.display();
    let text = read_bounded(path).with_context(|| format!("{file}: cannot be read"))?;
    let text = text.strip_prefix("\u{feff}".as_bytes()).unwrap_or(&text);
    let delimiter = delimiter(text);
    let text = &if delimiter == b' ' { single_blanks(text) } else { text.to_owned() };
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .delimiter(delimiter)
        .flexible(true)
        .from_reader(text.as_slice());
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
    let mut head = Head::of(headers, rms).with_context(|| format!("{file}:{line}"))?;
    let mut rows = Vec::new();
    for (k, record) in reader.records().enumerate() {
        let record = record.map_err(broken)?;
        let line = record.position().map_or(0, |position| line_of(text, position));
        if record.iter().all(str::is_empty) {
            continue;
        }
        if let Some(with_units) = (k == 0).then(|| head.with_units(&record, rms)).flatten() {
            head = with_units;
            continue;
        }
        rows.push(head.row(&record, line, delimiter).with_context(|| format!("{file}:{line}"))?);
    }
    ensure!(!rows.is_empty(), "{file}: holds no node below its head");
    let is_polar = head.is_polar();
    if is_polar {
        head.check_angles(&rows).with_context(|| file.to_string())?;
    }
    let sample = |(line, values, torque_nm): Row| {
        let [id, iq, psi_d, psi_q, magnitude, angle] = values;
        let (sin, cos) = angle.sin_cos();
        let [id, iq] = if is_polar { [-magnitude * sin, magnitude * cos] } else { [id, iq] };
        Sample { line, values: [id, iq, psi_d, psi_q], torque_nm }
    };
    let units_a = head.current_units_a();
    Ok(Samples { rows: rows.into_iter().map(sample).collect(), is_polar, units_a })
}

/// The delimiter in the first line that is not a comment.
fn delimiter(text: &[u8]) -> u8 {
    let head = text.split(|byte| *byte == b'\n').find(|line| !line.starts_with(b"#") && line.len() > 1);
    let head = head.unwrap_or_default();
    [b';', b'\t', b',', b' '].into_iter().find(|byte| head.contains(byte)).unwrap_or(b',')
}

/// The text with single blanks, none around a line, with the same line numbers.
fn single_blanks(text: &[u8]) -> Vec<u8> {
    let single = |line: &[u8]| {
        let words = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        words.collect::<Vec<_>>().join(&b' ')
    };
    text.split(|byte| *byte == b'\n').map(single).collect::<Vec<_>>().join(&b'\n')
}

/// A line's number, its values by quantity, and its torque in N·m.
type Row = (u64, [f64; 6], f64);

/// The head of a map: its cells, and the positions and meanings of the columns that count.
struct Head {
    cells: csv::StringRecord,
    columns: Vec<(usize, Column)>,
    /// Position and factor of a torque.
    torque: Option<(usize, f64)>,
}

impl Head {
    fn of(cells: csv::StringRecord, rms: bool) -> Result<Self> {
        let mut columns: Vec<(usize, Column)> = Vec::new();
        for (place, name) in cells.iter().enumerate() {
            let Some(column) = column(name, rms).map_err(|problem| anyhow!("{name}: {problem}"))? else {
                continue;
            };
            if let Some((_, twin)) = columns.iter().find(|(_, other)| other.quantity == column.quantity) {
                let quantity = QUANTITIES.get(column.quantity).unwrap_or(&"part of a polar current");
                bail!("{name}: must be there once: {} is {quantity} too", twin.name);
            }
            columns.push((place, column));
        }
        let has = |quantity: usize| columns.iter().any(|(_, one)| one.quantity == quantity);
        let is_polar = !has(0) && !has(1) && has(MAGNITUDE) && has(ANGLE);
        columns.retain(|(_, one)| if one.quantity < 2 { !is_polar } else { one.quantity < 4 || is_polar });
        let has = |quantity: usize| columns.iter().any(|(_, one)| one.quantity == quantity);
        let known = |quantity: usize| has(quantity) || (is_polar && quantity < 2);
        let missing = (0..QUANTITIES.len()).find(|quantity| !known(*quantity));
        if let Some(missing) = missing {
            let names = cells.iter().collect::<Vec<_>>().join(", ");
            let inductance = |name: &str| {
                let letters: String = name.chars().filter(|letter| letter.is_alphanumeric()).collect();
                letters.to_lowercase().starts_with("ld")
            };
            let hint = if cells.iter().any(inductance) {
                "; inductances are no flux linkages: they leave out the magnets'"
            } else {
                ""
            };
            bail!(
                "no column for {}: must be there, such as id_a, iq_a, psi_d_wb, psi_q_wb with a node a line, or in place of both currents Is and gamma; the head is {}{hint}",
                QUANTITIES[missing],
                names.escape_debug()
            );
        }
        let torque = cells.iter().enumerate().find_map(|(place, name)| Some((place, torque::factor(name)?)));
        Ok(Self { cells, columns, torque })
    }

    /// The head with the units in the line below it; `None` if that line holds anything else.
    fn with_units(&self, units: &csv::StringRecord, rms: bool) -> Option<Self> {
        let silent = self.columns.iter().all(|(place, column)| {
            !column.has_unit() && units.get(*place).is_some_and(|unit| unit.parse::<f64>().is_err())
        });
        let named = self.cells.iter().enumerate().map(|(place, name)| match units.get(place) {
            Some(unit) if !unit.is_empty() => format!("{name} [{}]", unit.trim_matches(['(', ')', '[', ']'])),
            _ => name.to_owned(),
        });
        let head = silent.then(|| Self::of(named.collect(), rms))?.ok()?;
        head.columns.iter().all(|(_, column)| column.has_unit()).then_some(head)
    }

    fn is_polar(&self) -> bool {
        self.columns.iter().any(|(_, column)| column.quantity == ANGLE)
    }

    /// Values in A of the units of id and iq.
    fn current_units_a(&self) -> [Option<f64>; 2] {
        let quantities = if self.is_polar() { [MAGNITUDE; 2] } else { [0, 1] };
        quantities.map(|quantity| self.columns.iter().find(|(_, one)| one.quantity == quantity)?.1.unit)
    }

    /// A line's number, values and torque.
    fn row(&self, record: &csv::StringRecord, line: u64, delimiter: u8) -> Result<Row> {
        // An empty one at the end comes from a superfluous delimiter.
        let cells = (1..=record.len()).rev().find(|n| !record[n - 1].is_empty()).unwrap_or(0);
        ensure!(
            cells <= self.cells.len(),
            "{cells} cells: must be {} as in the head; with decimal commas, semicolons part the columns",
            self.cells.len()
        );
        let number = |place: usize, factor: f64| {
            let field = record.get(place).unwrap_or("");
            // If a semicolon separates the columns, a comma may be the decimal separator.
            let plain = if delimiter == b';' { field.replace(',', ".") } else { field.to_owned() };
            (field, plain.parse::<f64>().map_or(f64::NAN, |value| value * factor))
        };
        let mut values = [0.0; 6];
        for (place, column) in &self.columns {
            let (field, value) = number(*place, column.factor);
            let (name, largest) = (&column.name, LARGEST[column.quantity]);
            let hint = match column.quantity {
                2 | 3 if !column.has_unit() => format!(" (is the unit another, {name} [mWb]?)"),
                ANGLE => String::new(),
                _ if !column.has_unit() => format!(" (is the unit another, {name} [mA]?)"),
                _ => String::new(),
            };
            ensure!(
                value.abs() <= largest,
                "{name}: {}: must be a number, in {} at most {largest}{}",
                field.escape_debug(),
                if column.quantity == ANGLE { "rad" } else { "A or Wb" },
                if value.is_finite() { &hint } else { "" }
            );
            values[column.quantity] = value;
        }
        Ok((line, values, self.torque.map_or(f64::NAN, |(place, factor)| number(place, factor).1)))
    }

    /// Checks that angles whose column gives no unit are degrees.
    fn check_angles(&self, rows: &[Row]) -> Result<()> {
        let Some((_, column)) = self.columns.iter().find(|(_, column)| column.quantity == ANGLE) else {
            return Ok(());
        };
        let most = rows.iter().map(|(_, values, _)| values[ANGLE].abs() / column.factor).fold(0.0, f64::max);
        let name = &column.name;
        ensure!(
            column.has_unit() || most > TAU,
            "{name}: at most {most}: must have its unit, as {name} [deg] or {name} [rad]"
        );
        Ok(())
    }
}
