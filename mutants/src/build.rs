//! The build of all test programs with all mutants, except those that do not compile this way.

use crate::schema::Schema;
use crate::tree::{Tree, put};
use anyhow::{Context, Result, bail};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The packages whose tests are run.
const PACKAGES: [&str; 6] = [
    "tractive-control",
    "tractive-tablegen",
    "tractive",
    "tractive-cells",
    "tractive-nucleo-g474re",
    "tractive-rig",
];

/// The rig's package, and those of its tests that finish soon.
const RIG: &str = "tractive-rig";
const RIG_TESTS: [&str; 12] = [
    "flying_start",
    "identify",
    "modes",
    "nine_switch",
    "optimal",
    "points",
    "scenarios",
    "start",
    "talk",
    "temperatures",
    "zs9_phases",
    "zs9_scenarios",
];

/// The features of each package's tests, so that all compile the same code: no package has the optimised patterns as a default.
const FEATURES: [(&str, &str); 4] = [
    ("tractive-control", "tractive-control/optimal"),
    ("tractive-tablegen", "tractive-tablegen/patterns"),
    ("tractive", "tractive/optimal"),
    (RIG, "tractive/authentication"),
];

/// The packages that are named, or all.
pub fn packages(named: &[String]) -> Vec<String> {
    if named.is_empty() { PACKAGES.map(str::to_owned).into() } else { named.to_vec() }
}

/// The folder of the programs with all mutants.
const TOGETHER: &str = "build";

/// The largest number of builds until everything compiles; every build leaves out what the last one complained of.
const BUILDS: usize = 60;

/// A program of tests, and the folder of its package; or the rig's own.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Program {
    pub path: PathBuf,
    pub folder: PathBuf,
    /// "tractive modulation": its package and its target.
    pub name: String,
    pub is_test: bool,
}

/// Writes the sources and builds, in `tree` and `build` of a folder; returns the programs and the mutants that were left out, with the error's code.
pub fn programs(
    work: &Path,
    tree: &Tree,
    packages: &[String],
    only: &BTreeSet<u32>,
    left_out: &mut BTreeMap<u32, String>,
) -> Result<Vec<Program>> {
    let (to, target) = (&work.join("tree"), &work.join(TOGETHER));
    for _ in 0..BUILDS {
        let mut schemata = BTreeMap::new();
        for source in &tree.sources {
            let schema = source.schema(|number| only.contains(&number) && !left_out.contains_key(&number));
            put(&to.join(&source.file), schema.text.as_bytes())?;
            schemata.insert(source.file.clone(), schema);
        }
        eprintln!("mutants: building, without {}", left_out.len());
        let messages = cargo_all(to, target, packages)?;
        if messages.success {
            return Ok(messages.programs());
        }
        let before = left_out.len();
        for line in &messages.lines {
            leave_out(to, line, &schemata, left_out);
        }
        eprintln!("mutants: {} do not compile this way, {} more", left_out.len(), left_out.len() - before);
        if left_out.len() == before {
            bail!("the build failed, and by no mutant:\n{}", messages.rendered());
        }
    }
    bail!("the build failed {BUILDS} times")
}

/// Messages of cargo.
pub struct Messages {
    pub success: bool,
    lines: Vec<Value>,
}

impl Messages {
    /// The programs that were built.
    pub fn programs(&self) -> Vec<Program> {
        self.lines.iter().filter_map(program).collect()
    }

    /// The first error's code.
    pub fn code(&self) -> String {
        let error = self.lines.iter().find(|line| line["message"]["level"] == "error");
        error.and_then(|line| line["message"]["code"]["code"].as_str()).unwrap_or("error").to_owned()
    }

    fn rendered(&self) -> String {
        let errors = self.lines.iter().filter(|line| line["message"]["level"] == "error");
        errors.filter_map(|line| line["message"]["rendered"].as_str()).take(5).collect()
    }
}

/// The rig is built by a command of its own, since its features differ from the others'.
pub fn cargo_all(to: &Path, target: &Path, packages: &[String]) -> Result<Messages> {
    let (rig, others): (Vec<_>, Vec<_>) =
        packages.iter().map(String::as_str).partition(|package| *package == RIG);
    let mut all = Messages { success: true, lines: Vec::new() };
    let tests: Vec<&str> = RIG_TESTS.iter().flat_map(|test| ["--test", test]).collect();
    for (packages, what) in [(others, vec!["--tests"]), (rig, [&["--bins"][..], &tests].concat())] {
        if all.success && !packages.is_empty() {
            let messages = cargo(to, target, &packages, &what)?;
            all.success = messages.success;
            all.lines.extend(messages.lines);
        }
    }
    Ok(all)
}

fn cargo(to: &Path, target: &Path, packages: &[&str], what: &[&str]) -> Result<Messages> {
    // A plainer shell would drop the variables that contain a program's name with a hyphen.
    let wrapper = to.join("mutant/rustc.sh");
    put(&wrapper, b"#!/usr/bin/env bash\nRUSTC_BOOTSTRAP=1 exec \"$@\"\n")?;
    Command::new("chmod").arg("+x").arg(&wrapper).status()?;
    let mut command = Command::new("cargo");
    command.current_dir(to).args(["build", "--release", "--keep-going", "--message-format=json"]).args(what);
    command.args(packages.iter().flat_map(|package| ["--package", package]));
    let features = FEATURES.iter().filter(|(package, _)| packages.contains(package));
    command.args(features.flat_map(|(_, feature)| ["--features", feature]));
    // Code that is optimised less is compiled sooner; most of it runs only for a moment.
    for package in ["tractive", "tractive-control", "tractive-tablegen", "tractive-nucleo-g474re"] {
        command.args(["--config", &format!("profile.release.package.{package}.opt-level=1")]);
    }
    command.env("CARGO_TARGET_DIR", target).env("RUSTC_WORKSPACE_WRAPPER", wrapper);
    if target.ends_with(TOGETHER) {
        // In the repository's own folder, where third-party crates are compiled already.
        command.envs(to.ancestors().nth(2).map(|folder| ("CARGO_BUILD_BUILD_DIR", folder)));
    }
    command.env("CARGO_PROFILE_RELEASE_INCREMENTAL", "true");
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::inherit());
    let output = command.output().context("cannot start cargo")?;
    let text = String::from_utf8_lossy(&output.stdout);
    let lines = text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect();
    Ok(Messages { success: output.status.success(), lines })
}

fn program(line: &Value) -> Option<Program> {
    let path = PathBuf::from(line["executable"].as_str()?);
    let is_test = line["profile"]["test"].as_bool()?;
    let manifest = Path::new(line["manifest_path"].as_str()?);
    let folder = manifest.parent()?.to_owned();
    let manifest: toml::Table = toml::from_str(&std::fs::read_to_string(manifest).ok()?).ok()?;
    let package = manifest.get("package")?.get("name")?.as_str()?;
    Some(Program { path, folder, name: format!("{package} {}", line["target"]["name"].as_str()?), is_test })
}

/// Finds the place that an error belongs to: the smallest one that contains the error's first byte.
fn leave_out(
    to: &Path,
    line: &Value,
    schemata: &BTreeMap<String, Schema>,
    left_out: &mut BTreeMap<u32, String>,
) {
    let message = &line["message"];
    if line["reason"] != "compiler-message" || message["level"] != "error" {
        return;
    }
    let code = message["code"]["code"].as_str().unwrap_or("error");
    let children = message["children"].as_array().into_iter().flatten();
    let own = [message]
        .into_iter()
        .chain(children)
        .flat_map(|message| message["spans"].as_array().into_iter().flatten());
    let mut spans: Vec<_> = own.collect();
    spans.sort_by_key(|span| span["is_primary"] != true);
    for span in spans {
        let (Some(name), Some(byte)) = (span["file_name"].as_str(), span["byte_start"].as_u64()) else {
            continue;
        };
        let name = Path::new(name);
        let name = name.strip_prefix(to).unwrap_or(name);
        let Some(schema) = schemata.get(&*name.to_string_lossy()) else { continue };
        let within = schema.written.iter().filter(|written| written.bytes.contains(&(byte as usize)));
        let fresh =
            within.filter(|written| written.numbers.iter().any(|number| !left_out.contains_key(number)));
        if let Some(written) = fresh.min_by_key(|written| written.bytes.len()) {
            for number in &written.numbers {
                left_out.entry(*number).or_insert_with(|| code.to_owned());
            }
            return;
        }
    }
}
