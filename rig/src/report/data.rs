//! The numbers behind a page's plots, packed: whole multiples of a step, as differences, deflated, in base 64.
//!
//! A column's values are rounded to multiples of a step of 1, 2 or 5 times a power of ten. The differences of first or second order, whichever
//! take less room, are stored as zigzag numbers of seven bits a byte, the lowest first. All columns together are one deflated stream.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use serde::Serialize;
use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};

/// Parts into which rounding divides a curve's span, at least.
const PARTS: f64 = 8192.0;
/// The same for times that are not evenly spaced.
const TIME_PARTS: f64 = 67_108_864.0;
/// Largest number of rows in a table; if there are more, each stretch keeps its lowest and its highest value.
pub const MOST_ROWS: usize = 300_000;

/// Times of a table's rows.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
enum Times {
    /// Evenly spaced.
    Even {
        /// Time of the first row.
        first: f64,
        /// Time from one row to the next.
        every: f64,
    },
    /// A column of their own.
    Column {
        /// That column.
        at: Column,
    },
}

/// A packed column.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Column {
    /// The value that 1 stands for.
    step: f64,
    /// Order of the differences.
    order: u8,
    /// Its first byte.
    from: usize,
    /// The byte behind its last.
    to: usize,
}

/// Columns over common times.
#[derive(Debug, Serialize)]
struct Table {
    rows: usize,
    #[serde(flatten)]
    times: Times,
    columns: Vec<Column>,
    /// Rows of the recording in a stretch, which keeps their lowest and their highest; 1: every row is here.
    stretch: usize,
}

/// A column's place: its table, and its number there.
pub type Place = (usize, usize);

/// All columns of a page.
#[derive(Default)]
pub struct Data {
    tables: Vec<Table>,
    bytes: Vec<u8>,
    /// Places of the values that are already stored, by table and hash: a page shows the same curve around every change of mode.
    known: HashMap<(usize, u64), Place>,
}

impl Data {
    /// A table of rows at these times, in rising order; the same times are the same table.
    pub fn table(&mut self, times: &[f64]) -> usize {
        let stretch = times.len().div_ceil(MOST_ROWS).max(1);
        let stretch = if stretch > 1 { 2 * stretch } else { 1 };
        let rows = if stretch > 1 { 2 * times.len().div_ceil(stretch) } else { times.len() };
        let before = self.bytes.len();
        let times = match evenly(times) {
            Some((first, every)) if stretch > 1 => Times::Even { first, every: 0.5 * every * stretch as f64 },
            Some((first, every)) => Times::Even { first, every },
            None => Times::Column { at: self.column(&stretched_times(times, stretch), TIME_PARTS) },
        };
        let same = |table: &Table| {
            (table.rows, table.stretch) == (rows, stretch)
                && match (&table.times, &times) {
                    (Times::Column { at }, Times::Column { at: new }) => {
                        at.step == new.step && self.bytes[at.from..at.to] == self.bytes[new.from..new.to]
                    }
                    (old, new) => old == new,
                }
        };
        if let Some(known) = self.tables.iter().position(same) {
            self.bytes.truncate(before);
            return known;
        }
        self.tables.push(Table { rows, times, columns: Vec::new(), stretch });
        self.tables.len() - 1
    }

    /// A column of a table, with a value for each of its times; the same values are the same column.
    pub fn add(&mut self, table: usize, values: &[f64]) -> Place {
        let mut hasher = DefaultHasher::new();
        values.iter().for_each(|value| value.to_bits().hash(&mut hasher));
        let key = (table, hasher.finish());
        if let Some(place) = self.known.get(&key) {
            return *place;
        }
        let stretched = stretched(values, self.tables[table].stretch);
        let place = self.keep(table, stretched.as_deref().unwrap_or(values));
        self.known.insert(key, place);
        place
    }

    /// Instants in whole ticks of a length in s, each with the level from there on, a small whole number.
    pub fn edges(&mut self, ticks: &[i64], tick_s: f64, levels: &[i64]) -> Place {
        let at = self.pack(ticks, tick_s);
        self.tables.push(Table {
            rows: ticks.len(),
            times: Times::Column { at },
            columns: Vec::new(),
            stretch: 1,
        });
        let column = self.pack(levels, 1.0);
        let table = self.tables.len() - 1;
        self.tables[table].columns.push(column);
        (table, 0)
    }

    fn keep(&mut self, table: usize, values: &[f64]) -> Place {
        let before = self.bytes.len();
        let column = self.column(values, PARTS);
        let new = &self.bytes[column.from..column.to];
        let same = |old: &Column| {
            (old.step, old.order) == (column.step, column.order) && &self.bytes[old.from..old.to] == new
        };
        if let Some(known) = self.tables[table].columns.iter().position(same) {
            self.bytes.truncate(before);
            return (table, known);
        }
        self.tables[table].columns.push(column);
        (table, self.tables[table].columns.len() - 1)
    }

    fn column(&mut self, values: &[f64], parts: f64) -> Column {
        let step = step(values, parts);
        let numbers: Vec<i64> = values.iter().map(|value| (value / step).round() as i64).collect();
        self.pack(&numbers, step)
    }

    fn pack(&mut self, numbers: &[i64], step: f64) -> Column {
        let from = self.bytes.len();
        let (order, packed) = [1, 2]
            .map(|order| (order, packed(differences(numbers, order))))
            .into_iter()
            .min_by_key(|(_, packed)| packed.len())
            .unwrap_or_default();
        self.bytes.extend(packed);
        Column { step, order, from, to: self.bytes.len() }
    }

    /// The tables, for the page's script.
    pub fn tables(&self) -> impl Serialize + '_ {
        &self.tables
    }

    /// The stream of all columns.
    pub fn packed(&self) -> String {
        BASE64_STANDARD.encode(miniz_oxide::deflate::compress_to_vec(&self.bytes, 7))
    }

    /// The resolution of the stored rows in words; for plots over time, with their spacing.
    pub fn resolution(&self, over_time: bool) -> String {
        let longest = self.tables.iter().max_by_key(|table| table.rows * table.columns.len());
        let Some(table) = longest.filter(|table| !table.columns.is_empty()) else { return String::new() };
        let rows = match (&table.times, table.stretch) {
            (Times::Even { every, .. }, 1) if over_time => {
                format!("no row is left out, one each {} µs", (every * 1e9).round() / 1e3)
            }
            (_, 1) => "no point is left out".to_owned(),
            (_, stretch) => {
                format!("of each {stretch} rows the lowest and the highest value are left")
            }
        };
        format!(
            "Of the longest plot {rows}; values are rounded to an {PARTS}th of their span, of what hardly moves to 3e-8 of themselves, or finer; edges keep their exact time."
        )
    }
}

/// First value and spacing of times that are evenly spaced to a nanosecond, as printed times are.
fn evenly(times: &[f64]) -> Option<(f64, f64)> {
    let (first, last) = (*times.first()?, *times.last()?);
    let every = (last - first) / (times.len().max(2) - 1) as f64;
    let even = |(k, time): (usize, &f64)| (time - first - k as f64 * every).abs() <= 2e-9;
    (every > 0.0 && times.iter().enumerate().all(even)).then_some((first, every))
}

fn stretched_times(times: &[f64], stretch: usize) -> Vec<f64> {
    if stretch == 1 {
        return times.to_vec();
    }
    times.chunks(stretch).flat_map(|part| [part[0], part[part.len() / 2]]).collect()
}

/// The lowest and the highest value of each stretch, in their order; none if every row is kept.
fn stretched(values: &[f64], stretch: usize) -> Option<Vec<f64>> {
    let ends = |part: &[f64]| {
        let by_value = |a: &usize, b: &usize| part[*a].total_cmp(&part[*b]);
        let low = (0..part.len()).min_by(by_value).unwrap_or(0);
        let high = (0..part.len()).max_by(by_value).unwrap_or(0);
        [part[low.min(high)], part[low.max(high)]]
    };
    (stretch > 1).then(|| values.chunks(stretch).flat_map(ends).collect())
}

/// A step of 1, 2 or 5 times a power of ten that divides the values' span into at least a given number of parts.
fn step(values: &[f64], parts: f64) -> f64 {
    let (low, high) = values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(*value), high.max(*value)));
    // A value that is constant except for rounding has no span.
    let least = high.abs().max(low.abs()) / (4096.0 * parts);
    let wanted = ((high - low) / parts).max(least);
    if !wanted.is_finite() || wanted <= 0.0 {
        return 1.0;
    }
    let power = 10_f64.powf(wanted.log10().floor());
    let factor = [5.0, 2.0, 1.0].into_iter().find(|factor| factor * power <= wanted).unwrap_or(1.0);
    factor * power
}

/// Differences of an order, with zeros before the first number.
fn differences(numbers: &[i64], order: u8) -> Vec<i64> {
    let mut numbers = numbers.to_vec();
    for _ in 0..order {
        let mut before = 0;
        for number in &mut numbers {
            before = core::mem::replace(number, number.wrapping_sub(before));
        }
    }
    numbers
}

/// Zigzag numbers of seven bits a byte, the lowest first.
fn packed(numbers: Vec<i64>) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(numbers.len());
    for number in numbers {
        let mut rest = ((number << 1) ^ (number >> 63)) as u64;
        while rest >= 0x80 {
            bytes.push(rest as u8 | 0x80);
            rest >>= 7;
        }
        bytes.push(rest as u8);
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The values of a column, read as the page's script reads them.
    fn read(data: &Data, (table, column): Place) -> Vec<f64> {
        let Column { step, order, from, to } = data.tables[table].columns[column];
        let (mut numbers, mut number, mut shift) = (Vec::new(), 0_u64, 0);
        for byte in &data.bytes[from..to] {
            number |= u64::from(byte & 0x7f) << shift;
            shift += 7;
            if byte & 0x80 == 0 {
                numbers.push((number >> 1) as i64 ^ -((number & 1) as i64));
                (number, shift) = (0, 0);
            }
        }
        for _ in 0..order {
            let mut sum = 0;
            numbers.iter_mut().for_each(|number| {
                sum += *number;
                *number = sum;
            });
        }
        numbers.into_iter().map(|number| number as f64 * step).collect()
    }

    #[test]
    fn a_column_comes_back_within_half_a_step() {
        let times: Vec<f64> = (0..5000).map(|k| f64::from(k) * 5e-5).collect();
        let values: Vec<f64> = times.iter().map(|t_s| 247.0 * (700.0 * t_s).sin() - 31.25).collect();
        let mut data = Data::default();
        let table = data.table(&times);
        let place = data.add(table, &values);
        assert_eq!((place, data.add(table, &values), data.table(&times)), ((0, 0), (0, 0), 0));
        let step = data.tables[0].columns[0].step;
        assert_eq!(step, 0.05, "494 A in 8,192 parts at least");
        for (found, wanted) in read(&data, place).iter().zip(&values) {
            assert!((found - wanted).abs() <= 0.500_001 * step, "{found} {wanted}");
        }
    }

    #[test]
    fn of_too_many_rows_each_stretch_keeps_its_extremes() {
        let count = 2 * MOST_ROWS + 3;
        let times: Vec<f64> = (0..count).map(|k| k as f64 * 1e-6).collect();
        let mut values = vec![0.0; count];
        (values[77_777], values[77_779]) = (-5.0, 9.0);
        let mut data = Data::default();
        let table = data.table(&times);
        let place = data.add(table, &values);
        let found = read(&data, place);
        assert!(found.len() <= MOST_ROWS && found.len() == data.tables[table].rows);
        let extremes: Vec<_> = found.iter().filter(|value| **value != 0.0).collect();
        assert_eq!(extremes, [&-5.0, &9.0]);
        assert!(data.resolution(true).contains("of each 6 rows"), "{}", data.resolution(true));
    }

    #[test]
    fn times_that_are_not_even_are_kept_to_a_nanosecond() {
        let mut data = Data::default();
        assert_eq!(data.table(&[0.0, 0.1, 0.3]), 0);
        let Times::Column { at } = &data.tables[0].times else { panic!("they are not even") };
        assert!(at.step <= 1e-8, "{at:?}");
        assert_eq!(evenly(&[0.5]), None);
        assert_eq!(data.edges(&[3, 25_000_000], 4e-8, &[1, -1]), (1, 0));
    }
}
