//! The generated parts of the pages for an assessor: hazards from the fault campaign's page, components and tests from the sources,
//! versions from the lock file. Each stands between two marks.
//!
//! `TRACTIVE_PAPER=write cargo test --release --test paper` writes them; without it the test says which one is out of date.

use proc_macro2::{TokenStream, TokenTree};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn read(path: impl AsRef<Path>) -> String {
    let path = root().join(path);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The pages, one test at a time.
static PAGES: Mutex<()> = Mutex::new(());

/// Holds a part of a page against what it has to be, or writes it.
fn holds(page: &str, part: &str, wanted: &str) {
    let _alone = PAGES.lock().unwrap_or_else(PoisonError::into_inner);
    let text = read(page);
    let [begin, end] = ["begin", "end"].map(|word| format!("<!-- {part}: {word} -->\n"));
    let (before, rest) = text.split_once(&begin).unwrap_or_else(|| panic!("{page} has no part {part}"));
    let (found, after) = rest.split_once(&end).unwrap_or_else(|| panic!("{page}: {part} has no end"));
    if std::env::var("TRACTIVE_PAPER").is_ok_and(|word| word == "write") {
        std::fs::write(root().join(page), format!("{before}{begin}{wanted}{end}{after}")).unwrap();
        return;
    }
    let other = found.lines().zip(wanted.lines()).find(|(found, wanted)| found != wanted);
    assert!(
        found == wanted,
        "{page}, {part}: {other:?}; TRACTIVE_PAPER=write cargo test --release --test paper writes it anew"
    );
}

/// Cells of a table's line.
fn cells(line: &str) -> Vec<&str> {
    line.trim().trim_matches('|').split('|').map(str::trim).collect()
}

/// The item that a fault of the campaign is of, by the beginning of its name.
fn item(fault: &str) -> &'static str {
    const ITEMS: [(&str, &str); 18] = [
        ("current-", "current sensor"),
        ("angle-", "angle sensor"),
        ("link-", "DC link and its line"),
        ("source-", "source of the ZS9"),
        ("network-", "sensor of the ZS9's network"),
        ("capacitors-", "capacitors of the ZS9"),
        ("overspeed", "load"),
        ("leg-", "gates' feedback"),
        ("control-", "control interrupt"),
        ("commands-", "commands between the tasks"),
        ("demand-", "demand"),
        ("flux-", "machine beside its tables"),
        ("resistance-", "machine beside its tables"),
        ("shoot-through-", "power device or its driver"),
        ("none", "nothing"),
        ("winding-sensor-", "temperature sensor"),
        ("heat-sink-sensor-", "temperature sensor"),
        ("", "power device or its driver"),
    ];
    let found = ITEMS.iter().find(|(begin, _)| fault.starts_with(begin));
    found.map_or("", |(_, item)| item)
}

#[test]
fn the_hazards_are_those_of_the_fault_campaign() {
    let campaign = read("docs/fault-campaign.md");
    let mut out = String::from(
        "| item | failure | system | seen as | reaction | gates safe within | cases: caught, ridden through, uncaught | current, of what it may be |\n|---|---|---|---|---|---|---|---|\n",
    );
    let (mut system, mut heads, mut count) = ("", Vec::new(), 0);
    for line in campaign.lines() {
        if let Some(heading) = line.strip_prefix("### ") {
            system = heading;
        }
        if !line.starts_with('|') {
            heads.clear();
            continue;
        }
        if heads.is_empty() {
            heads = cells(line);
            continue;
        }
        let row: BTreeMap<&str, &str> = heads.iter().copied().zip(cells(line)).collect();
        let Some(fault) = row.get("fault").filter(|fault| !fault.starts_with("---") && **fault != "none")
        else {
            continue;
        };
        let is_caught = row["caught"] != "0";
        let seen =
            if is_caught { format!("`{}`", row["named"].replace(", ", "`, `")) } else { "–".to_owned() };
        let reaction = match (is_caught, row["ridden"]) {
            (true, "0") => row["safe state"].to_owned(),
            (true, _) => format!("{}; or the drive goes on", row["safe state"]),
            (false, _) => "the drive goes on, torque within its tolerance".to_owned(),
        };
        let within = if is_caught { format!("{} ms", row["ms"]) } else { "–".to_owned() };
        let [caught, ridden, uncaught] = ["caught", "ridden", "uncaught"].map(|word| row[word]);
        let (item, share) = (item(fault), row["A share"]);
        writeln!(
            out,
            "| {item} | `{fault}` | {system} | {seen} | {reaction} | {within} | {caught}, {ridden}, {uncaught} | {share} |"
        )
        .unwrap();
        count += 1;
    }
    assert!(count > 70, "{count} faults");
    holds("docs/hazards.md", "hazards", &out);
}

fn sources(folder: &Path, out: &mut Vec<PathBuf>) {
    let mut entries: Vec<PathBuf> =
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            sources(&path, out);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            out.push(path);
        }
    }
}

/// The path from the root on.
fn name(path: &Path) -> String {
    path.strip_prefix(root()).unwrap().to_string_lossy().into_owned()
}

/// The first sentence of a file's comment.
fn purpose(text: &str) -> String {
    let lines = text.lines().take_while(|line| line.starts_with("//!"));
    let comment: Vec<&str> = lines.map(|line| line.trim_start_matches("//!").trim()).collect();
    let paragraph = comment.split(|line| line.is_empty()).next().unwrap_or_default().join(" ");
    let first = paragraph.split_inclusive(". ").next().unwrap_or_default();
    first.trim().trim_end_matches('.').replace("[`", "`").replace("`]", "`").replace('|', "\\|")
}

/// Uses of a deviation from the coding guidelines.
#[derive(Default)]
struct Uses {
    r#unsafe: usize,
    casts: usize,
    macros: usize,
}

impl Uses {
    fn count(&mut self, tokens: TokenStream) {
        let tokens: Vec<TokenTree> = tokens.into_iter().collect();
        let mut at = 0;
        // The names behind `use` may be renamed by `as`.
        let mut imports = false;
        while let Some(token) = tokens.get(at) {
            let next = tokens.get(at + 1).map(ToString::to_string).unwrap_or_default();
            match token {
                TokenTree::Group(group) if group.to_string().replace(' ', "") == "[cfg(test)]" => {
                    let is_block = |token: &TokenTree| matches!(token, TokenTree::Group(group) if group.to_string().starts_with('{'));
                    at += tokens[at..].iter().position(is_block).unwrap_or(0);
                }
                TokenTree::Group(group) if !imports => self.count(group.stream()),
                TokenTree::Ident(word) if *word == "use" => imports = true,
                TokenTree::Punct(punct) if punct.as_char() == ';' => imports = false,
                TokenTree::Ident(word) if *word == "unsafe" && next.starts_with('{') => self.r#unsafe += 1,
                // `<T as Trait>` and `(path as Type)::f` name no number.
                TokenTree::Ident(word) if *word == "as" && !imports => {
                    let numbers =
                        ["u8", "u16", "u32", "u64", "usize", "i8", "i16", "i32", "i64", "isize", "f32"];
                    self.casts += usize::from(numbers.contains(&next.as_str()));
                }
                TokenTree::Ident(word) if *word == "macro_rules" => self.macros += 1,
                _ => {}
            }
            at += 1;
        }
    }
}

/// The files below a folder that belong to the target.
fn on_target(folder: &str) -> Vec<PathBuf> {
    let mut files = Vec::new();
    sources(&root().join(folder), &mut files);
    files
}

/// The component of a file: the folder or file right below its sources.
fn component(file: &str) -> String {
    let (sources, rest) = file.split_once("src/").unwrap_or(("", file));
    let module = rest.split('/').next().unwrap_or_default().trim_end_matches(".rs");
    format!("{sources}src/{module}")
}

#[test]
fn the_components_are_those_of_the_sources() {
    let requirements = read("docs/requirements.md") + &read("docs/assessor.md");
    let mut all: BTreeMap<String, (String, Uses)> = BTreeMap::new();
    for path in ["control/src", "src", "boards/nucleo-g474re/src"].into_iter().flat_map(on_target) {
        let (file, text) = (name(&path), std::fs::read_to_string(&path).unwrap());
        let (about, uses) = all.entry(component(&file)).or_default();
        let own = [".rs", "/mod.rs"].map(|end| component(&file) + end);
        if about.is_empty() || own.contains(&file) {
            *about = purpose(&text);
        }
        uses.count(text.parse().unwrap());
    }
    let mut out = String::from(
        "| component | what it is | requirements that name it | `unsafe` blocks | macros |\n|---|---|--:|--:|--:|\n",
    );
    let mut sum = Uses::default();
    for (component, (about, uses)) in &all {
        let named = requirements.lines().filter(|line| line.starts_with('|') && !line.starts_with("| `"));
        let named = named.filter(|line| {
            line.contains(&format!("`{component}/")) || line.contains(&format!("`{component}.rs`"))
        });
        let Uses { r#unsafe, casts, macros } = uses;
        writeln!(out, "| `{component}` | {about} | {} | {} | {macros} |", named.count(), r#unsafe).unwrap();
        sum.r#unsafe += r#unsafe;
        sum.casts += casts;
        sum.macros += macros;
    }
    let Uses { r#unsafe, casts, macros } = sum;
    let hundreds = (casts + 50) / 100;
    writeln!(out, "| all, with some {hundreds}00 numbers by `as` | | | {} | {macros} |", r#unsafe).unwrap();
    holds("docs/assessor.md", "components", &out);
}

#[test]
fn the_tests_are_those_of_the_sources() {
    let requirements = read("docs/requirements.md") + &read("docs/assessor.md");
    let mut files = Vec::new();
    for folder in
        ["boards", "control", "rig", "src", "tablegen", "tests", "twin", "xtask", "cells", "mutants"]
    {
        sources(&root().join(folder), &mut files);
    }
    let mut out = String::from("| file | what it tests | requirements that name it |\n|---|---|--:|\n");
    for path in files {
        let (file, text) = (name(&path), std::fs::read_to_string(&path).unwrap());
        if !text.lines().any(|line| line.trim() == "#[test]") {
            continue;
        }
        let rows = requirements.lines().filter(|line| line.starts_with('|') && !line.starts_with("| `"));
        let named = rows.filter(|line| line.contains(&format!("`{file}`"))).count();
        writeln!(out, "| `{file}` | {} | {named} |", purpose(&text)).unwrap();
    }
    holds("docs/test-specification.md", "tests", &out);
}

#[test]
fn the_versions_are_those_of_the_lock_file() {
    let lock: toml::Table = read("Cargo.lock").parse().unwrap();
    let packages = lock["package"].as_array().unwrap();
    let field = |package: &toml::Value, key: &str| package[key].as_str().unwrap_or_default().to_owned();
    let mut open: Vec<String> = ROOTS.map(str::to_owned).to_vec();
    let mut there: BTreeSet<(String, String)> = BTreeSet::new();
    while let Some(wanted) = open.pop() {
        // A dependency of which there are several is named with its version.
        let (wanted, version) =
            wanted.split_once(' ').map_or((&*wanted, None), |(name, version)| (name, Some(version)));
        let named = packages.iter().filter(|package| package["name"].as_str() == Some(wanted));
        for package in
            named.filter(|package| version.is_none_or(|version| field(package, "version") == version))
        {
            if there.insert((field(package, "name"), field(package, "version"))) {
                let needs = package.get("dependencies").and_then(toml::Value::as_array);
                open.extend(needs.into_iter().flatten().filter_map(|name| name.as_str().map(str::to_owned)));
            }
        }
    }
    assert!(ROOTS.iter().all(|root| there.iter().any(|(name, _)| name == root)), "{there:?}");
    // What has no source is the workspace's own.
    let (own, others): (Vec<_>, Vec<_>) =
        packages.iter().partition(|package| package.get("source").is_none());
    let needs = own.iter().filter_map(|package| package.get("dependencies")?.as_array()).flatten();
    let needs: BTreeSet<&str> = needs.filter_map(toml::Value::as_str).collect();
    let others = others.iter().map(|package| (field(package, "name"), field(package, "version")));
    let named = others
        .filter(|(name, version)| needs.contains(&**name) || needs.contains(&*format!("{name} {version}")));
    let of_host: BTreeSet<_> = named.filter(|package| !there.contains(package)).collect();
    assert!(
        ["proptest", "loom", "unicorn-engine"]
            .iter()
            .all(|tool| of_host.iter().any(|(name, _)| name == tool))
    );
    let list = |crates: &BTreeSet<(String, String)>| {
        crates.iter().map(|(name, version)| format!("`{name}` {version}")).collect::<Vec<_>>().join(", ")
    };
    let manifest: toml::Table = read("Cargo.toml").parse().unwrap();
    let least = manifest["workspace"]["package"]["rust-version"].as_str().unwrap();
    let out = format!(
        "Rust {least} or later. Of the images, with the macros that make a part of them: {}.\n\n\
        Of what makes and tests them on the host, as far as it is named here and not by another crate: {}.\n",
        list(&there),
        list(&of_host)
    );
    holds("docs/assessor.md", "versions", &out);
}

/// The crates that the images' packages name.
const ROOTS: [&str; 8] = [
    "libm",
    "embedded-can",
    "cortex-m",
    "cortex-m-rt",
    "cortex-m-semihosting",
    "stm32-metapac",
    "defmt",
    "defmt-rtt",
];
