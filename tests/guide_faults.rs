//! The guide's table of faults against the code: names and order, and of each its unit, its values and its limits.

use std::path::Path;
use tractive::protection::Fault;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn read(path: &str) -> String {
    std::fs::read_to_string(root().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// A fault's row.
struct Row<'a> {
    name: &'a str,
    value: &'a str,
    /// Its limits, one a part.
    limits: Vec<&'a str>,
    causes: &'a str,
}

fn table(page: &str) -> Vec<Row<'_>> {
    let cells = page.lines().filter_map(|line| line.strip_prefix("| `")).map(|line| line.split(" | "));
    let mut rows = Vec::new();
    for [name, value, limits, causes] in
        cells.map(|cells| <[&str; 4]>::try_from(cells.collect::<Vec<_>>()).unwrap())
    {
        rows.push(Row {
            name: name.trim_end_matches('`'),
            value,
            limits: limits.split("; ").collect(),
            causes,
        });
    }
    rows
}

/// All sources below a folder, as one text.
fn sources(folder: &Path, out: &mut String) {
    for entry in std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
        if entry.is_dir() {
            sources(&entry, out);
        } else if entry.extension().is_some_and(|extension| extension == "rs") {
            *out += &std::fs::read_to_string(entry).unwrap();
        }
    }
}

/// The drive's code and its board's, in one line.
fn code() -> String {
    let mut code = String::new();
    for folder in ["src", "boards/nucleo-g474re/src"] {
        sources(&root().join(folder), &mut code);
    }
    code.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The parts between commas, up to the bracket that closes more than was opened.
fn parts(text: &str) -> Vec<&str> {
    let (mut modulation_index, mut from, mut parts) = (0, 0, Vec::new());
    for (at, letter) in text.char_indices() {
        match letter {
            '(' | '[' | '{' => modulation_index += 1,
            ')' | ']' | '}' | ';' if modulation_index == 0 => {
                parts.push(text[from..at].trim());
                break;
            }
            ')' | ']' | '}' => modulation_index -= 1,
            ',' if modulation_index == 0 => {
                parts.push(text[from..at].trim());
                from = at + 1;
            }
            _ => {}
        }
    }
    parts
}

/// The trips of a fault that a code writes out: value and limit, as they stand there. Where both are 0 a record is made that is filled
/// later.
fn trips<'a>(code: &'a str, fault: &str) -> Vec<(&'a str, &'a str)> {
    let plain = |part: &'a str, name| part.strip_prefix(name).unwrap_or(part);
    let at = format!("Fault::{fault}, ");
    let found = code.split(at.as_str()).skip(1).map(parts).filter(|parts| parts.len() >= 2);
    let found = found.map(|parts| (plain(parts[0], "value: "), plain(parts[1], "limit: ")));
    found.filter(|trip| *trip != ("0.0", "0.0")).collect()
}

/// The page's word for a limit of the code.
fn told(limit: &str) -> &'static str {
    match limit {
        "0.0" => "0",
        "1.0" | "wanted" => "1",
        "f32::MAX" => "largest number",
        _ => "level",
    }
}

/// A whole number that a value is, or `None` where it is worked out.
fn number(value: &str) -> Option<&str> {
    value.strip_suffix(".0").filter(|number| number.parse::<u32>().is_ok())
}

fn words(text: &str) -> Vec<&str> {
    text.split(|letter: char| !letter.is_alphanumeric()).collect()
}

#[test]
fn every_fault_is_explained_once_and_in_the_order_of_its_code() {
    let page = read("docs/faults.md");
    let table = table(&page);
    assert!(table.iter().all(|row| row.causes.len() > 10));
    assert_eq!(table.iter().map(|row| row.name).collect::<Vec<_>>(), Fault::ALL.map(Fault::name));
}

#[test]
fn values_and_limits_are_those_of_the_code() {
    let (page, code) = (read("docs/faults.md"), code());
    let (mut wrong, mut known) = (Vec::new(), 0);
    for (fault, row) in Fault::ALL.into_iter().zip(table(&page)) {
        let trips = trips(&code, &format!("{fault:?}"));
        known += usize::from(!trips.is_empty());
        for (value, limit) in &trips {
            if !row.limits.iter().any(|part| part.starts_with(told(limit))) {
                wrong.push(format!("{}: limit {limit}", row.name));
            }
            if number(value).is_some_and(|number| !words(row.value).contains(&number)) {
                wrong.push(format!("{}: value {value}", row.name));
            }
        }
        // And the other way round, where its trips are written out.
        let missing = |part: &&&str| !trips.iter().any(|(_, limit)| part.starts_with(told(limit)));
        let missing = row.limits.iter().filter(missing).filter(|_| !trips.is_empty());
        wrong.extend(missing.map(|part| format!("{}: no limit {part}", row.name)));
    }
    assert!(known >= 24 && wrong.is_empty(), "{known} known, {wrong:#?}");
}

/// Units as the code's doc comments have them, and as the page has them.
const UNITS: [(&str, &str); 6] = [
    (" in A", ", A"),
    (" in V", ", V"),
    (" in s", ", s"),
    (" in mechanical rad/s", "mechanical speed, rad/s"),
    (" in electrical rad", ", electrical rad"),
    (" in control periods", "control periods"),
];

/// The doc comment at the end of a source, in one line.
fn doc_comment(source: &str) -> String {
    let lines: Vec<_> = source.lines().rev().map_while(|line| line.trim().strip_prefix("/// ")).collect();
    lines.into_iter().rev().collect::<Vec<_>>().join(" ")
}

/// A unit stands in a text, not as the beginning of another word.
fn has(text: &str, unit: &str) -> bool {
    text.match_indices(unit).any(|(at, _)| !text[at + unit.len()..].starts_with(char::is_alphanumeric))
}

#[test]
fn units_are_those_of_the_code() {
    let (page, declared) = (read("docs/faults.md"), read("src/protection/fault.rs"));
    let mut wrong = Vec::new();
    for (fault, row) in Fault::ALL.into_iter().zip(table(&page)) {
        let variant = declared.find(&format!("        {fault:?}")).unwrap();
        // Of the lower motor the code says that it is the same.
        let comment = doc_comment(&declared[..variant]).replace("the same of", "in electrical rad, of");
        let differ =
            UNITS.iter().filter(|(declares, tells)| has(&comment, declares) != has(row.value, tells));
        wrong.extend(differ.map(|(unit, _)| format!("{}:{unit}", row.name)));
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
