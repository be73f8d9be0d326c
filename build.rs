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
    #[cfg(feature = "qemu")]
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

#[cfg(feature = "qemu")]
mod linker {
    use std::path::{Path, PathBuf};
    use std::{env, fs};

    /// QEMU's memories. The root's `memory.x` includes them as `board-memory.x`: the linker takes the root's file, whatever the board.
    const MEMORY: &str = "src/board/qemu/memory.x";
    /// Interrupt handlers that a firmware may define; the others end in cortex-m-rt's default handler.
    const HANDLERS: [&str; 2] = ["TIMER0", "DUALTIMER"];

    pub fn write() -> Result<(), String> {
        let variable = |name: &str| env::var(name).map_err(|error| format!("{name}: {error}"));
        if variable("CARGO_CFG_TARGET_OS")? != "none" {
            return Ok(());
        }
        let out = PathBuf::from(variable("OUT_DIR")?);
        println!("cargo:rerun-if-changed={MEMORY}");
        let memory = fs::read_to_string(MEMORY).map_err(|error| format!("{MEMORY}: {error}"))?;
        put(&out.join("board-memory.x"), &memory)?;
        put(
            &out.join("device.x"),
            &HANDLERS.map(|name| format!("PROVIDE({name} = DefaultHandler);\n")).concat(),
        )?;
        println!("cargo:rustc-link-search={}", out.display());
        println!("cargo:rustc-link-arg-bins=-Tlink.x");
        Ok(())
    }

    fn put(path: &Path, text: &str) -> Result<(), String> {
        fs::write(path, text).map_err(|error| format!("{}: {error}", path.display()))
    }
}
