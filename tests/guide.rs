//! The guide against the code: what its pages on papers and requirements name, and its links.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use tractive::control::Gains;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn read(path: impl AsRef<Path>) -> String {
    let path = root().join(path);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// A row of a table: its cells by the names of their columns.
type Row<'a> = Vec<(&'a str, &'a str)>;

/// The rows of all tables under the headings that begin so.
fn rows<'a>(text: &'a str, heading: &str) -> Vec<Row<'a>> {
    let sections = text.split("\n## ").filter(|section| section.starts_with(heading));
    let cells = |line: &'a str| -> Vec<&'a str> {
        line.trim_matches('|').split(" |").map(|cell| cell.trim_start_matches('|').trim()).collect()
    };
    let mut rows = Vec::new();
    for lines in
        sections.map(|section| section.lines().filter(|line| line.starts_with('|')).collect::<Vec<_>>())
    {
        let [head, _, body @ ..] = lines.as_slice() else { continue };
        let heads = cells(head);
        for line in body {
            let row: Row = heads.iter().copied().zip(cells(line)).collect();
            assert_eq!(row.len(), heads.len(), "a row with too few cells: {line}");
            rows.push(row);
        }
    }
    rows
}

fn cell<'a>(row: &Row<'a>, column: &str) -> &'a str {
    row.iter().find(|(name, _)| *name == column).map_or("", |(_, cell)| cell)
}

/// The words in code type of a cell.
fn spans(cell: &str) -> impl Iterator<Item = &str> {
    cell.split('`').skip(1).step_by(2)
}

/// A word stands in a text, not as a part of another.
fn has_word(text: &str, word: &str) -> bool {
    let is_part = |letter: char| letter.is_alphanumeric() || letter == '_';
    text.match_indices(word)
        .any(|(at, _)| !text[..at].ends_with(is_part) && !text[at + word.len()..].starts_with(is_part))
}

/// Names of a cell that the tree does not have: a path is a file, the words after it stand in that file, as functions where they are
/// `tests`, and a word before any path is a scenario.
fn missing(cell: &str, tests: bool, scenarios: &str) -> Vec<String> {
    let (mut found, mut file) = (Vec::new(), None);
    for span in spans(cell) {
        if span.contains('/') {
            match std::fs::read_to_string(root().join(span)) {
                Ok(text) => file = Some((span, text)),
                Err(_) => found.push(format!("no file {span}")),
            }
            continue;
        }
        match &file {
            Some((path, text)) if tests && !text.contains(&format!("fn {span}(")) => {
                found.push(format!("no test {span} in {path}"));
            }
            Some((path, text)) if !has_word(text, span) => found.push(format!("no {span} in {path}")),
            None if !scenarios.contains(&format!("\"{span}\"")) => found.push(format!("no scenario {span}")),
            _ => {}
        }
    }
    found
}

/// Complaints about the columns that name code and tests.
fn complaints(rows: &[Row]) -> Vec<String> {
    let scenarios = read("rig/src/scenario/catalogue.rs");
    let of = |row: &Row| {
        let mut found = missing(cell(row, "code"), false, &scenarios);
        for column in ["seen", "test"] {
            for part in cell(row, column).split(';') {
                found.extend(missing(part, true, &scenarios));
            }
        }
        let reason = cell(row, "here");
        if spans(cell(row, "code")).next().is_none() && reason.len() < 20 {
            found.push(format!("{:?} has neither a place nor a reason", row[0].1));
        }
        if spans(cell(row, "code")).next().is_some()
            && ["seen", "test"].iter().all(|column| cell(row, column).len() < 4)
        {
            found.push(format!("{:?} is nowhere to be seen", row[0].1));
        }
        found
    };
    rows.iter().flat_map(of).collect()
}

/// The numbers of a row's first cell: `(3)`, `figure 3`, `figures 3, 4`, `figures 3 to 5`.
fn numbers(cell: &str) -> Vec<u32> {
    let mut all: Vec<u32> = Vec::new();
    let mut through = false;
    for word in cell.split([' ', ',', '(', ')']) {
        if let Ok(number) = word.parse() {
            let from = if through { all.last().map_or(number, |last| last + 1) } else { number };
            all.extend(from..=number);
        }
        through = word == "to";
    }
    all
}

#[test]
fn the_page_on_the_papers_has_every_equation_table_and_figure() {
    let text = read("docs/papers.md");
    for (heading, sign, count) in [
        ("The first paper: equations", "(", 17),
        ("The first paper: figures", "figure", 10),
        ("The second paper: equations", "(", 19),
        ("The second paper: table and figures", "table", 1),
        ("The second paper: table and figures", "figure", 36),
    ] {
        let rows = rows(&text, heading);
        let named = rows.iter().map(|row| row[0].1).filter(|name| name.starts_with(sign));
        let mut found: Vec<_> = named.flat_map(numbers).collect();
        found.sort_unstable();
        assert_eq!(found, (1..=count).collect::<Vec<_>>(), "{heading}: {sign}");
        let complaints = complaints(&rows);
        assert!(complaints.is_empty(), "{complaints:#?}");
    }
    let gains = Gains::DEFAULT;
    let told = [
        format!("g = {} (`carrier`)", gains.carrier),
        format!("k = {} (`observer`)", gains.observer),
        format!("1/k = {} halves", (1.0 / gains.observer).round()),
        format!("{} rad/s with devices of 900 Hz", 900.0 * gains.pattern_rad),
        format!(
            "{} the stator's frequency (`square_damping`)",
            if gains.square_damping == 0.5 { "half" } else { "not" }
        ),
    ];
    let text = text.replace('\n', " ");
    assert!(told.iter().all(|part| text.contains(part)), "{told:?}");
}

#[test]
fn every_requirement_names_code_and_a_test_that_there_are() {
    let text = read("docs/requirements.md");
    let rows = rows(&text, "Specification");
    assert!(rows.len() > 80, "{} requirements", rows.len());
    let mut complaints = complaints(&rows);
    for row in &rows {
        if spans(cell(row, "test")).next().is_none() && cell(row, "test").len() < 20 {
            complaints.push(format!("{:?} has neither a test nor a reason", row[0].1));
        }
    }
    assert!(complaints.is_empty(), "{complaints:#?}");
    let named: BTreeSet<_> = rows.iter().map(|row| row[0].1).collect();
    assert_eq!(named.len(), rows.len(), "a requirement stands there twice");
}

#[test]
fn every_software_requirement_names_code_and_a_test_that_there_are() {
    let text = read("docs/assessor.md");
    let rows = rows(&text, "Software requirements");
    let numbered = rows.iter().enumerate().filter(|(k, row)| row[0].1.starts_with(&format!("SR{}: ", k + 1)));
    assert!(rows.len() > 20 && numbered.count() == rows.len(), "{} requirements, in their order", rows.len());
    let complaints = complaints(&rows);
    assert!(complaints.is_empty(), "{complaints:#?}");
}

#[test]
fn every_mutation_and_proof_names_a_test_that_there_is() {
    let text = read("docs/proof.md");
    let rows = rows(&text, "Mutations");
    assert!(rows.len() >= 13, "{} mutations", rows.len());
    let missing: Vec<_> =
        rows.iter().flat_map(|row| missing(cell(row, "test that fails"), true, "")).collect();
    assert!(missing.is_empty(), "{missing:#?}");
    let proofs = [
        "tests/proofs.rs",
        "tests/protocol/e2e.rs",
        "src/cell.rs",
        "control/src/modulation/carrier.rs",
        "control/src/modulation/middle60.rs",
        "control/src/modulation/modulator/proofs.rs",
        "control/src/modulation/schedule/proofs.rs",
        "control/src/nine_switch/proofs.rs",
    ];
    let proofs = proofs.map(read).concat();
    for (section, least) in [("Every value", 8), ("What single-precision numbers decide", 16)] {
        let rows = self::rows(&text, section);
        let named =
            rows.iter().flat_map(|row| spans(cell(row, "by"))).filter(|name| !name.contains(['/', ' ']));
        let missing: Vec<_> = named.filter(|name| !proofs.contains(&format!("fn {name}("))).collect();
        assert!(rows.len() >= least && missing.is_empty(), "{missing:?}");
        assert!(rows.iter().all(|row| cell(row, "fails with").len() > 5));
    }
}

#[test]
fn what_is_not_in_the_tree_is_found() {
    let wrong = |cell: &str, tests| missing(cell, tests, "\"sweep\"").len();
    assert_eq!(wrong("`src/lib.rs` `control`, `frames`", false), 0);
    assert_eq!(wrong("`src/lib.rs` `contro`", false), 1);
    assert_eq!(wrong("`src/no.rs`", false), 1);
    assert_eq!(wrong("`sweep`", true) + wrong("`tests/guide.rs` `missing`", true), 0);
    assert_eq!(wrong("`sweeps`", true) + wrong("`tests/guide.rs` `Row`", true), 2);
    assert_eq!(numbers("figures 3, 5 to 7"), [3, 5, 6, 7]);
}

/// All sources and scripts below a folder, as one text.
fn sources(folder: &Path, out: &mut String) {
    for entry in std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
        if entry.is_dir() {
            sources(&entry, out);
        } else if entry.extension().is_some_and(|extension| extension == "rs") {
            *out += &std::fs::read_to_string(entry).unwrap();
        }
    }
}

#[test]
fn every_message_of_troubleshooting_is_one_that_the_code_prints() {
    // What the compiler's linker says is not ours.
    const FOREIGN: [&str; 3] = ["error: linker", "cc", "not found"];
    let mut code = String::new();
    for folder in ["rig/src", "xtask/src", "tablegen/src", "src", "boards"] {
        sources(&root().join(folder), &mut code);
    }
    // A message's words may go on in the next line of a source.
    let code: String = code.replace("\\\n", "").split_whitespace().collect::<Vec<_>>().join(" ");
    let text = read("docs/troubleshooting.md");
    let seen: Vec<_> = rows(&text, "").into_iter().map(|row| row[0].1.to_owned()).collect();
    let quoted = seen.iter().flat_map(|cell| spans(cell)).filter(|span| !FOREIGN.contains(span));
    let parts: Vec<_> =
        quoted.flat_map(|span| span.split('…')).map(str::trim).filter(|part| !part.is_empty()).collect();
    let wrong: Vec<_> = parts.iter().filter(|part| !code.contains(**part)).collect();
    assert!(seen.len() > 40 && parts.len() > 50 && wrong.is_empty(), "{} rows, {wrong:#?}", seen.len());
}

/// The numbers that follow a word, or its plural, in a text: `figures 14–16, 18 and 19`, `figure 9a`, `equations (7) to (13)`.
fn numbers_after(text: &str, word: &str) -> Vec<u32> {
    let text = text.to_lowercase();
    let after = text.split(word).skip(1).map(|rest| rest.strip_prefix('s').unwrap_or(rest));
    let number = |word: &&str| word.trim_end_matches(['a', 'b', 'c', 'd']).parse::<u32>().ok();
    let list = |rest: &str| {
        let between = |letter: char| " ,\":.()–*`".contains(letter);
        let words: Vec<_> = rest.split(between).filter(|word| !word.is_empty()).collect();
        let list = words.iter().take_while(|word| number(word).is_some() || ["to", "and"].contains(word));
        list.filter_map(number).collect::<Vec<_>>()
    };
    after.filter(|rest| rest.starts_with(' ')).flat_map(list).collect()
}

/// The texts that people read, by their paths: sources, pages of the guide, of reports and of the live bench, pictures.
fn read_by_people(folder: &Path, out: &mut Vec<(String, String)>) {
    const ENDS: [&str; 9] = ["rs", "md", "js", "html", "css", "py", "ipynb", "svg", "toml"];
    const OTHERS: [&str; 3] = ["target", "vendor", "node_modules"];
    for entry in std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap()) {
        let (name, path) = (entry.file_name().into_string().unwrap(), entry.path());
        if name.starts_with('.') || OTHERS.contains(&name.as_str()) {
            continue;
        }
        if path.is_dir() {
            read_by_people(&path, out);
        } else if ENDS.iter().any(|end| path.extension().is_some_and(|extension| extension == *end)) {
            let place = path.strip_prefix(root()).unwrap().display().to_string();
            out.push((place, std::fs::read_to_string(&path).unwrap()));
        }
    }
}

#[test]
fn figures_and_equations_that_are_named_are_ones_of_the_papers() {
    // Of the first paper and of the second one.
    const MOST: [(&str, [u32; 2]); 2] = [("figure", [10, 36]), ("equation", [17, 19])];
    const FIRST: [&str; 3] =
        ["rig/src/scenario/traction/", "rig/src/pictures/chai/", "control/src/modulation/"];
    let mut texts = Vec::new();
    read_by_people(root(), &mut texts);
    let (mut wrong, mut named) = (Vec::new(), 0);
    for (place, text) in &texts {
        let lower = text.to_lowercase();
        let of_second = place.contains("zs9") || lower.contains("zs9") || lower.contains("second paper");
        let of_second = of_second && !FIRST.iter().any(|folder| place.starts_with(folder));
        for (word, most) in MOST {
            let numbers = numbers_after(text, word);
            named += numbers.len();
            let beyond = |number: &&u32| **number == 0 || **number > most[usize::from(of_second)];
            wrong.extend(numbers.iter().filter(beyond).map(|number| format!("{place}: {word} {number}")));
        }
    }
    assert!(
        texts.len() > 300 && named > 200 && wrong.is_empty(),
        "{} texts, {named}: {wrong:#?}",
        texts.len()
    );
    assert_eq!(numbers_after("Figures 14–16, 18 and 19: x; figure 9a.", "figure"), [14, 16, 18, 19, 9]);
    assert_eq!(numbers_after("Equations (7)–(13), equation (3)", "equation"), [7, 13, 3]);
}

/// The calls of a trait in a source, as a page has them: name and parameters without `self`, types and the mark of what is not used.
fn calls(source: &str, port: &str) -> BTreeSet<String> {
    let (_, body) = source.split_once(&format!("pub trait {port}<")).unwrap();
    let body = body.split("\n}").next().unwrap();
    let call = |declared: &str| {
        let (name, rest) = declared.split_once('(').unwrap();
        let parameters = rest.split(", ").filter_map(|one| one.split_once(": ").map(|(name, _)| name));
        let parameters: Vec<_> = parameters.map(|name| name.trim_start_matches('_')).collect();
        format!("{name}({})", parameters.join(", "))
    };
    body.lines().filter_map(|line| line.trim().strip_prefix("fn ")).map(call).collect()
}

#[test]
fn the_page_on_boards_has_every_call_of_the_ports() {
    let (text, ports, slot) =
        (read("docs/own-board.md"), read("src/ports/mod.rs"), read("src/operator/slot.rs"));
    for (port, source) in [("ControlPort", &ports), ("PwmPort", &ports), ("OperatorPort", &slot)] {
        let (_, table) = text.split_once(&format!("| `{port}` |")).unwrap();
        let rows = table.lines().skip(2).take_while(|line| line.starts_with('|'));
        let told: BTreeSet<_> = rows.map(|row| spans(row).next().unwrap().to_owned()).collect();
        assert_eq!(told, calls(source, port), "{port}");
    }
}

#[test]
fn the_page_on_machines_has_every_key_of_machine_toml() {
    let (text, source) = (read("docs/own-machine.md"), read("tablegen/src/parameters.rs"));
    let (_, body) = source.split_once("\nparameters! {").unwrap();
    let body = body.split("\n}").next().unwrap();
    let declared = body.lines().filter_map(|line| line.trim().strip_suffix(';')?.split_once(": "));
    let declared: Vec<_> = declared.collect();
    let rows = rows(&text, "The files");
    let told: BTreeSet<_> = rows.iter().flat_map(|row| spans(row[0].1)).collect();
    let keys: BTreeSet<_> =
        declared.iter().map(|(key, _)| *key).chain(["name", "pole_pairs", "patterns"]).collect();
    assert_eq!(told, keys);
    for (key, rest) in declared.iter().filter(|(key, _)| key.starts_with("trip_")) {
        let (factor, of) = rest.rsplit(", ").next().unwrap().split_once(" * ").unwrap();
        let row = rows.iter().find(|row| row[0].1.contains(key)).unwrap();
        let default = format!("{factor} × `{of}`");
        assert!(cell(row, "what").ends_with(&default), "{key}: {default}");
    }
}

/// The anchors of a page's headings.
fn anchors(text: &str) -> BTreeSet<String> {
    let headings = text.lines().filter(|line| line.starts_with('#'));
    let anchor = |heading: &str| {
        let kept = heading.trim_start_matches('#').trim().to_lowercase();
        let kept = kept.chars().filter(|letter| letter.is_alphanumeric() || [' ', '-', '_'].contains(letter));
        kept.collect::<String>().replace(' ', "-")
    };
    headings.map(anchor).collect()
}

#[test]
fn every_link_of_guide_and_readme_leads_somewhere() {
    let mut pages = vec![PathBuf::from("README.md")];
    let entries = std::fs::read_dir(root().join("docs")).unwrap().map(|entry| entry.unwrap().path());
    pages.extend(entries.filter(|path| path.extension().is_some_and(|extension| extension == "md")));
    let docs = root().join("docs").canonicalize().unwrap();
    let mut wrong = Vec::new();
    for page in &pages {
        let text = read(page);
        let links = text.split("](").skip(1).filter_map(|rest| rest.split(')').next());
        for link in links.filter(|link| !link.contains("://")) {
            let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
            let target = root().join(page).parent().unwrap().join(file);
            let target = if file.is_empty() { root().join(page) } else { target };
            let known = anchor.is_empty()
                || std::fs::read_to_string(&target).is_ok_and(|text| anchors(&text).contains(anchor));
            // A chapter's links stay in the book: what is beside it is not there where the book is read.
            let leaves =
                page.is_absolute() && !target.canonicalize().is_ok_and(|target| target.starts_with(&docs));
            if !target.exists() || !known || leaves {
                wrong.push(format!("{}: {link}", page.display()));
            }
        }
    }
    assert!(pages.len() > 15 && wrong.is_empty(), "{wrong:#?}");
}
