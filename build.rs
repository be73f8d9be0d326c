//! Turns the chosen machine folders into the tables of `built_in`, and puts the linker's files of the reference images where it looks
//! for them: each with its feature alone.

use std::process::ExitCode;

fn main() -> ExitCode {
    println!("cargo:rerun-if-changed=build.rs");
    match generate() {
        Ok(()) => ExitCode::SUCCESS,
        Err(problem) => {
            eprintln!("{problem}");
            ExitCode::FAILURE
        }
    }
}

fn generate() -> Result<(), String> {
    #[cfg(feature = "built-in")]
    tables::write()?;
    #[cfg(any(feature = "qemu", feature = "board-nucleo-g474re"))]
    linker::write()?;
    Ok(())
}

#[cfg(feature = "built-in")]
mod tables {
    use std::{env, path::PathBuf};

    /// For each system: the variable that names its machine, the machine when it names none, the file of its tables.
    const MACHINES: [(&str, &str, &str); 2] = [
        ("TRACTIVE_MACHINE", "pmasynrm-180kw", "machine_tables.rs"),
        ("TRACTIVE_ZS9_MACHINE", "ipm-zs9", "zs9_tables.rs"),
    ];

    pub fn write() -> Result<(), String> {
        let [root, out] = ["CARGO_MANIFEST_DIR", "OUT_DIR"].map(|name| env::var_os(name).unwrap_or_default());
        for (name, default, file) in MACHINES {
            println!("cargo:rerun-if-env-changed={name}");
            let machine = env::var(name).unwrap_or_else(|_| default.to_owned());
            let named = PathBuf::from(&root).join("tables").join(&machine);
            let folder = if named.is_dir() { named } else { PathBuf::from(machine) };
            tractive_tablegen::build(folder, PathBuf::from(&out).join(file), "tractive_control::machine")
                .map_err(|error| error.to_string())?;
        }
        Ok(())
    }
}

#[cfg(any(feature = "qemu", feature = "board-nucleo-g474re"))]
mod linker {
    use std::path::{Path, PathBuf};
    use std::{env, fs};

    /// What the linker needs to know of a board.
    struct Board {
        /// The file in `memory/`, which the root's `memory.x` includes under the name `board-memory.x`: the linker takes the
        /// root's file, whatever the board.
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

    pub fn write() -> Result<(), String> {
        let variable = |name: &str| env::var(name).map_err(|error| format!("{name}: {error}"));
        if variable("CARGO_CFG_TARGET_OS")? != "none" {
            return Ok(());
        }
        let root = PathBuf::from(variable("CARGO_MANIFEST_DIR")?);
        let out = PathBuf::from(variable("OUT_DIR")?);
        let nucleo = env::var_os("CARGO_FEATURE_BOARD_NUCLEO_G474RE").is_some();
        let board = if nucleo { NUCLEO_G474RE } else { QEMU };
        let memory = root.join("memory").join(board.memory);
        println!("cargo:rerun-if-changed={}", memory.display());
        put(&out.join("board-memory.x"), &fs::read_to_string(&memory).map_err(|error| error.to_string())?)?;
        let handlers: String =
            board.handlers.iter().map(|name| format!("PROVIDE({name} = DefaultHandler);\n")).collect();
        put(&out.join("device.x"), &handlers)?;
        println!("cargo:rustc-link-search={}", out.display());
        for script in board.scripts {
            println!("cargo:rustc-link-arg-bins=-T{script}");
        }
        Ok(())
    }

    fn put(path: &Path, text: &str) -> Result<(), String> {
        fs::write(path, text).map_err(|error| format!("{}: {error}", path.display()))
    }
}
