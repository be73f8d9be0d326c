//! `cargo xtask test`: every test, one step after another, and a table of how they ended.

use crate::build::{self, cargo, target_folder};
use crate::process::must;
use crate::setup::{self, TARGET};
use crate::{image, root};
use anyhow::{Result, bail};
use std::time::Instant;

type Step = (&'static str, fn() -> Result<()>);

const STEPS: [Step; 9] = [
    ("format", format),
    ("clippy", clippy),
    ("clippy-target", clippy_target),
    ("docs", docs),
    ("host", host),
    ("loom", loom),
    ("image", check_image),
    ("machines", machines),
    ("qemu", qemu),
];

/// Prints the names of the steps.
pub fn list() {
    for (name, _) in STEPS {
        println!("{name}");
    }
}

/// Runs the steps, all or those named.
pub fn run(only: &[String]) -> Result<u8> {
    if let Some(unknown) = only.iter().find(|name| STEPS.iter().all(|(known, _)| known != name)) {
        bail!("--only {unknown}: must be one of {}", STEPS.map(|(name, _)| name).join(", "));
    }
    let mut results = Vec::new();
    for (name, step) in
        STEPS.iter().filter(|(name, _)| only.is_empty() || only.iter().any(|wanted| wanted == name))
    {
        println!("== {name}");
        let began = Instant::now();
        let outcome = step();
        if let Err(error) = &outcome {
            println!("{name}: {error:#}");
        }
        results.push((name, outcome.is_ok(), began.elapsed().as_secs_f64()));
    }
    println!();
    for (name, passed, seconds) in &results {
        println!("{name:16} {:6} {seconds:7.1} s", if *passed { "passed" } else { "FAILED" });
    }
    let passed = results.iter().filter(|(_, passed, _)| *passed).count();
    let failed = results.len() - passed;
    println!("{passed} passed, {failed} failed");
    Ok(u8::from(failed > 0))
}

fn format() -> Result<()> {
    if !setup::component("rustfmt") {
        println!("rustfmt cannot be had here: not checked");
        return Ok(());
    }
    must(cargo().args(["fmt", "--all", "--check"]))
}

fn clippy() -> Result<()> {
    if !setup::component("clippy") {
        println!("clippy cannot be had here: not checked");
        return Ok(());
    }
    must(cargo().args([
        "clippy",
        "--quiet",
        "--release",
        "--workspace",
        "--all-targets",
        "--",
        "-D",
        "warnings",
    ]))
}

fn clippy_target() -> Result<()> {
    let toolchain = setup::toolchain()?;
    if !setup::component("clippy") || toolchain != setup::Toolchain::Own {
        println!("clippy for {TARGET} cannot be had here: not checked");
        return Ok(());
    }
    let mut command = toolchain.cargo("clippy");
    command.current_dir(root()).args([
        "--quiet",
        "--package",
        "tractive",
        "--lib",
        "--bins",
        "--",
        "-D",
        "warnings",
    ]);
    must(&mut command)
}

fn docs() -> Result<()> {
    must(cargo().args(["doc", "--quiet", "--workspace", "--no-deps"]).env("RUSTDOCFLAGS", "-D warnings"))
}

fn host() -> Result<()> {
    must(cargo().args(["test", "--quiet", "--release", "--workspace"]))
}

fn loom() -> Result<()> {
    must(
        cargo()
            .args(["test", "--quiet", "--release", "--package", "tractive", "--test", "loom_cells"])
            .env("RUSTFLAGS", "--cfg loom")
            .env("CARGO_TARGET_DIR", target_folder().join("loom")),
    )
}

fn check_image() -> Result<()> {
    image::check(&build::image(None)?)
}

/// The image builds for another machine's folder too.
fn machines() -> Result<()> {
    let folder = root().join("tables/ipm-linear-5kw");
    build::image(Some(&folder.to_string_lossy()))?;
    // The default machine's image is the one that the next steps take.
    build::image(None).map(|_| ())
}

fn qemu() -> Result<()> {
    let (qemu, image) = (setup::qemu()?, build::image(None)?);
    must(
        cargo()
            .args([
                "test",
                "--quiet",
                "--release",
                "--package",
                "tractive-rig",
                "--test",
                "qemu",
                "--",
                "--ignored",
            ])
            .env("TRACTIVE_QEMU", qemu)
            .env("TRACTIVE_IMAGE", image),
    )
}
