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

/// What the linker needs to know of a board.
struct Board {
    /// The file in `memory/`, which the root's `memory.x` includes under the name `board-memory.x`: the linker takes the root's
    /// file, whatever the board.
    memory: &'static str,
    /// Interrupt handlers that a firmware may define; the others end in cortex-m-rt's default handler.
    handlers: &'static [&'static str],
    scripts: &'static [&'static str],
}

/// QEMU's, unless a feature names another.
const QEMU: Board =
    Board { memory: "mps2-an386.x", handlers: &["TIMER0", "DUALTIMER"], scripts: &["link.x"] };
const NUCLEO_G474RE: Board = Board {
    memory: "nucleo-g474re.x",
    handlers: &["TIM1_UP_TIM16", "TIM2", "TIM3"],
    scripts: &["link.x", "defmt.x"],
};

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
        let nucleo = env::var_os("CARGO_FEATURE_BOARD_NUCLEO_G474RE").is_some();
        let board = if nucleo { NUCLEO_G474RE } else { QEMU };
        let memory = root.join("memory").join(board.memory);
        println!("cargo:rerun-if-changed={}", memory.display());
        write(&out.join("board-memory.x"), &fs::read_to_string(&memory).map_err(|error| error.to_string())?)?;
        let handlers: String =
            board.handlers.iter().map(|name| format!("PROVIDE({name} = DefaultHandler);\n")).collect();
        write(&out.join("device.x"), &handlers)?;
        println!("cargo:rustc-link-search={}", out.display());
        for script in board.scripts {
            println!("cargo:rustc-link-arg-bins=-T{script}");
        }
    }
    Ok(())
}

fn write(path: &Path, text: &str) -> Result<(), String> {
    fs::write(path, text).map_err(|error| format!("{}: {error}", path.display()))
}
