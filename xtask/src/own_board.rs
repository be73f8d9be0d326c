//! The library as others use it: the example's firmware, outside the workspace, has its own vectors and both tasks, and nothing of the reference
//! images; and the arithmetic alone needs few dependencies.

use crate::build::{self, TARGET};
use crate::elf::Image;
use crate::graph::CallGraph;
use crate::image;
use crate::setup::Setup;
use crate::timing::Profile;
use anyhow::{Context, Result, ensure};
use std::path::{Path, PathBuf};

/// The example's interrupts: their entries in the vector table, their handlers, and the task that each must reach.
const INTERRUPTS: [(&str, &str, &str); 2] =
    [("interrupt 25", "TIM1_UP", "PwmTask"), ("interrupt 28", "TIM2", "ControlTask")];

/// Words in the names of what belongs to the reference images alone.
const FOREIGN: [&str; 7] =
    ["qemu", "semihosting", "injector", "TIMER0", "DUALTIMER", "tractive::built_in", "nucleo"];

/// Crates that `tractive-control` may come with, itself among them.
const MOST_CRATES: usize = 2;

/// Builds the example with and without link-time optimisation, and checks both; counts the dependencies of the arithmetic.
pub fn check(setup: &mut Setup) -> Result<bool> {
    for lto in ["fat", "off"] {
        let path = example(setup, lto)?;
        look_into(&path).with_context(|| format!("{} with lto = {lto:?}", path.display()))?;
        println!("lto = {lto:?}: own vectors, both tasks, nothing of the reference images");
    }
    let mut tree = build::cargo_with("tree --package tractive-control --edges normal --prefix none");
    let output = tree.output()?;
    ensure!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let tree = String::from_utf8_lossy(&output.stdout);
    let crates = tree.lines().filter(|line| !line.is_empty()).count();
    ensure!((1..=MOST_CRATES).contains(&crates), "tractive-control comes with too much:\n{tree}");
    println!("tractive-control: {crates} crates with itself");
    Ok(true)
}

/// Builds the example.
fn example(setup: &mut Setup, lto: &str) -> Result<PathBuf> {
    let folder = build::root().join("examples/own-board");
    let target = build::root().join("target/own-board");
    let manifest = folder.join("Cargo.toml").display().to_string();
    let mut command = setup.toolchain()?.cargo(&["build", "--release", "--target", TARGET]);
    command.args(["--manifest-path", &manifest, "--target-dir"]).arg(&target);
    command.env("CARGO_PROFILE_RELEASE_LTO", lto).env_remove("CARGO_BUILD_TARGET");
    ensure!(crate::process::succeeds(&mut command)?, "the example was not built");
    Ok(target.join(TARGET).join("release/own-board"))
}

fn look_into(path: &Path) -> Result<()> {
    let image = image::read(path)?;
    let bytes = std::fs::read(path)?;
    let profile = Profile::new(&bytes)?;
    let graph = CallGraph::new(&image);
    let vectors = image.vectors();
    for (entry, handler, task) in INTERRUPTS {
        let names = vectors.get(entry).with_context(|| format!("the vector table has no {entry}"))?;
        ensure!(names.iter().any(|name| name == handler), "{entry} leads to {names:?}, not to {handler}");
        let address = image.handlers.iter().find(|(name, _)| name == entry).map(|(_, address)| *address);
        let functions = graph.reach(address.context("no address")?);
        let comes = functions.keys().map(|function| comes_to(&image, &profile, *function, task));
        let comes = comes.collect::<Result<Vec<_>>>()?;
        ensure!(comes.contains(&true), "{handler} never comes to {task}::run");
    }
    let foreign: Vec<_> =
        image.symbols.iter().filter(|name| FOREIGN.iter().any(|word| name.contains(word))).collect();
    ensure!(foreign.is_empty(), "of the reference images: {foreign:?}");
    Ok(())
}

/// `true` if a function has instructions of the task's `run`, its own or inlined.
fn comes_to(image: &Image, profile: &Profile, function: u32, task: &str) -> Result<bool> {
    let size = image.functions.get(&function).map_or(0, |function| function.size);
    for (address, _) in image.instructions.range(function..function + size) {
        let places = profile.places(*address)?;
        if places.iter().any(|place| place.function.contains(task) && place.function.ends_with("::run")) {
            return Ok(true);
        }
    }
    Ok(false)
}
