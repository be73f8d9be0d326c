//! Makes the tables of the chosen machines, checks the power stages against them, and gives the linker this board's memories and interrupts.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::{env, fs};
use tractive::modulation::FREE_CARRIER_SHARE;
use tractive_tablegen::{InputError, MachineFolder, Patterns, rust_source};

#[allow(dead_code, reason = "the image's")]
#[path = "src/dead_time.rs"]
mod dead_time;
#[path = "build/power_stage/mod.rs"]
mod power_stage;
#[path = "src/rates.rs"]
mod rates;
#[allow(dead_code, reason = "the image's")]
#[path = "src/zs9/rates.rs"]
mod zs9_rates;

/// A check of a power stage's file and text against a machine; it gives the constant as Rust.
type Check = fn(&Path, &str, &power_stage::Machine) -> Result<String, InputError>;

/// An image: the variables that name its machine and its power stage, each with what holds when it names none, the name of its tables, and the
/// power stage's check.
struct Image {
    machine: (&'static str, &'static str),
    stage: (&'static str, &'static str),
    tables: &'static str,
    check: Check,
}

const IMAGES: [Image; 2] = [
    Image {
        machine: ("TRACTIVE_MACHINE", "pmasynrm-180kw"),
        stage: ("TRACTIVE_POWER_STAGE", "power_stage"),
        tables: "traction",
        check: power_stage::traction,
    },
    Image {
        machine: ("TRACTIVE_ZS9_MACHINE", "ipm-zs9"),
        stage: ("TRACTIVE_ZS9_POWER_STAGE", "power_stage_zs9"),
        tables: "zs9",
        check: power_stage::zs9,
    },
];

/// Interrupt handlers that an image may define; the others end in cortex-m-rt's default handler.
const HANDLERS: [&str; 3] = ["TIM1_UP_TIM16", "TIM2", "TIM3"];

fn main() -> ExitCode {
    println!("cargo:rerun-if-changed=build.rs");
    let out = PathBuf::from(env::var_os("OUT_DIR").unwrap_or_default());
    match images(&out).and_then(|()| linker(&out)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(problem) => {
            eprintln!("{problem}");
            ExitCode::FAILURE
        }
    }
}

/// The tables of each image's machine and the constant of its power stage.
fn images(out: &Path) -> Result<(), String> {
    let chosen = |variable: &str, default: String| {
        println!("cargo:rerun-if-env-changed={variable}");
        env::var(variable).unwrap_or(default)
    };
    for Image { machine: (machine, usual), stage: (file, stage), tables, check } in IMAGES {
        let machine = chosen(machine, usual.to_owned());
        // A folder of tables/, or a path as seen from the repository's root.
        let mut places = ["../../tables", "../.."].into_iter().map(|place| Path::new(place).join(&machine));
        let folder = places.find(|folder| folder.is_dir()).unwrap_or_else(|| PathBuf::from(&machine));
        // A file beside the package, or a path as seen from the repository's root.
        let name = chosen(file, format!("{stage}.toml"));
        let beside = PathBuf::from(&name);
        let file = if beside.is_file() { beside } else { Path::new("../..").join(&name) };
        for read in [&folder, &file] {
            println!("cargo:rerun-if-changed={}", read.display());
        }
        let told = |error: InputError| error.to_string();
        let read = MachineFolder::read(&folder).map_err(told)?;
        let carrier_share = if tables == "traction" { carrier_share(read.parameters.patterns)? } else { 1.0 };
        let made = read.tables();
        let text = fs::read_to_string(&file).map_err(|error| format!("{}: {error}", file.display()))?;
        let machine = power_stage::Machine { folder: &folder, tables: &made, carrier_share };
        let constant = check(&file, &text, &machine).map_err(told)?;
        put(&out.join(format!("{tables}.rs")), &rust_source(&made, "tractive::machine"))?;
        put(&out.join(format!("{stage}.rs")), &constant)?;
        if tables == "traction" {
            put(&out.join("position.rs"), &power_stage::sensor(&file, &text, &machine).map_err(told)?)?;
        }
    }
    Ok(())
}

/// Highest frequency of the free carrier, as a share of the switches'.
///
/// # Errors
/// The image has the patterns that its feature says, and the machine does not ask for these.
fn carrier_share(asked: Patterns) -> Result<f32, String> {
    match (asked, env::var_os("CARGO_FEATURE_OPTIMAL").is_some()) {
        (Patterns::Paper, false) => Ok(1.0),
        (Patterns::Optimal, true) => Ok(FREE_CARRIER_SHARE),
        (Patterns::Optimal, false) => {
            Err("machine.toml: patterns: \"optimal\": the image needs the feature `optimal`".to_owned())
        }
        (Patterns::Paper, true) => {
            Err("feature `optimal`: the machine.toml has no patterns = \"optimal\"".to_owned())
        }
    }
}

/// The linker looks into the workspace's root before it looks here, and there `memory.x` includes `board-memory.x`.
fn linker(out: &Path) -> Result<(), String> {
    println!("cargo:rerun-if-changed=memory.x");
    println!("cargo:rerun-if-changed=ccm.x");
    if env::var("CARGO_CFG_TARGET_OS").as_deref() != Ok("none") {
        return Ok(());
    }
    let handlers = HANDLERS.map(|name| format!("PROVIDE({name} = DefaultHandler);\n")).concat();
    let here = env::var("CARGO_MANIFEST_DIR").map_err(|error| format!("CARGO_MANIFEST_DIR: {error}"))?;
    let memory = fs::read_to_string("memory.x").map_err(|error| format!("memory.x: {error}"))?;
    for (file, text) in [("board-memory.x", memory), ("device.x", handlers)] {
        put(&out.join(file), &text)?;
    }
    println!("cargo:rustc-link-search={}", out.display());
    println!("cargo:rustc-link-arg-bin=nucleo-g474re-zs9=-T{}", Path::new(&here).join("ccm.x").display());
    for script in ["link.x", "defmt.x"] {
        println!("cargo:rustc-link-arg-bins=-T{script}");
    }
    Ok(())
}

fn put(path: &Path, text: &str) -> Result<(), String> {
    fs::write(path, text).map_err(|error| format!("{}: {error}", path.display()))
}
