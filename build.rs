//! Turns the chosen machine folder into the tables that the firmware holds in read-only memory, and, for the target,
//! puts the linker's files where it looks for them.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::{env, fs};
use tractive_tablegen::{Generated, MachineFolder};

/// For each system: the variable that names its machine, the machine when it names none, the file of its tables.
const MACHINES: [(&str, &str, &str); 2] = [
    ("TRACTIVE_MACHINE", "pmasynrm-180kw", "machine_tables.rs"),
    ("TRACTIVE_ZS9_MACHINE", "ipm-zs9", "zs9_tables.rs"),
];

/// Interrupt handlers that a firmware may define; the others end in cortex-m-rt's default handler.
const HANDLERS: [&str; 2] = ["TIMER0", "DUALTIMER"];

fn main() -> ExitCode {
    match generate() {
        Ok(()) => ExitCode::SUCCESS,
        Err(problem) => {
            eprintln!("{problem}");
            ExitCode::FAILURE
        }
    }
}

fn generate() -> Result<(), String> {
    let variable = |name: &str| env::var(name).map_err(|error| format!("{name}: {error}"));
    let root = PathBuf::from(variable("CARGO_MANIFEST_DIR")?);
    let out = PathBuf::from(variable("OUT_DIR")?);
    for (name, default, file) in MACHINES {
        let machine = env::var(name).unwrap_or_else(|_| default.to_owned());
        let named = root.join("tables").join(&machine);
        let folder = if named.is_dir() { named } else { PathBuf::from(&machine) };
        println!("cargo:rerun-if-env-changed={name}");
        println!("cargo:rerun-if-changed={}", folder.display());
        let tables = MachineFolder::read(&folder).and_then(|machine| Generated::new(&machine));
        let source = tables.map_err(|error| error.to_string())?.rust_source();
        write(&out.join(file), &source)?;
    }
    if variable("CARGO_CFG_TARGET_OS")? == "none" {
        let memory = root.join("memory.x");
        println!("cargo:rerun-if-changed={}", memory.display());
        write(&out.join("memory.x"), &fs::read_to_string(&memory).map_err(|error| error.to_string())?)?;
        let handlers: String =
            HANDLERS.iter().map(|name| format!("PROVIDE({name} = DefaultHandler);\n")).collect();
        write(&out.join("device.x"), &handlers)?;
        println!("cargo:rustc-link-search={}", out.display());
        println!("cargo:rustc-link-arg-bins=-Tlink.x");
    }
    Ok(())
}

fn write(path: &Path, text: &str) -> Result<(), String> {
    fs::write(path, text).map_err(|error| format!("{}: {error}", path.display()))
}
