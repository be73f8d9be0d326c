//! What must be there before anything is built: each step only when it is missing, and said in one line.

use crate::process::{must, output, shown, succeeds};
use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The target of the images.
pub const TARGET: &str = "thumbv7em-none-eabihf";
const QEMU: &str = "qemu-system-arm";
const MACHINE: &str = "mps2-an386";

/// How to build for the target.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Toolchain {
    /// The toolchain that runs this, with the target's standard library.
    Own,
    /// Debian's `rustc-web`, `cargo-web` and `rust-web-src`, which build the core library themselves and link with
    /// this linker.
    Debian {
        /// Path of `rust-lld`.
        linker: PathBuf,
    },
}

impl Toolchain {
    /// `cargo VERB` for the target.
    pub fn cargo(&self, verb: &str) -> Command {
        match self {
            Self::Own => {
                let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
                command.args([verb, "--target", TARGET]);
                command
            }
            Self::Debian { linker } => {
                let mut command = Command::new("/usr/bin/cargo");
                command.args([verb, "--target", TARGET, "-Zbuild-std=core"]);
                command.env("RUSTC_BOOTSTRAP", "1").env("RUSTC", "/usr/bin/rustc");
                command.env("CARGO_TARGET_THUMBV7EM_NONE_EABIHF_LINKER", linker);
                command.env_remove("RUSTUP_TOOLCHAIN").env_remove("CARGO");
                command
            }
        }
    }
}

/// A toolchain for the target.
pub fn toolchain() -> Result<Toolchain> {
    let installed = output(Command::new("rustup").args(["target", "list", "--installed"]));
    if installed.is_some_and(|list| list.lines().any(|line| line == TARGET)) || own_core_library() {
        return Ok(Toolchain::Own);
    }
    let mut add = Command::new("rustup");
    add.args(["target", "add", TARGET]);
    println!("set-up: the target {TARGET} is missing: {}", shown(&add));
    if must(&mut add).is_ok() {
        return Ok(Toolchain::Own);
    }
    println!("set-up: that failed; Debian's toolchain builds for it as well");
    let linker = own_linker().context("rust-lld is not in this toolchain's folders")?;
    if !Path::new("/usr/bin/cargo").exists() || !Path::new("/usr/bin/rustc").exists() {
        install(&["rustc-web", "cargo-web", "rust-web-src"])?;
    }
    Ok(Toolchain::Debian { linker })
}

/// The folder of this toolchain.
fn sysroot() -> Option<PathBuf> {
    output(Command::new("rustc").args(["--print", "sysroot"])).map(|path| PathBuf::from(path.trim()))
}

/// Whether the toolchain has the target's library, whoever installed it.
fn own_core_library() -> bool {
    sysroot().is_some_and(|root| root.join("lib/rustlib").join(TARGET).join("lib").is_dir())
}

fn own_linker() -> Option<PathBuf> {
    let libraries = sysroot()?.join("lib/rustlib");
    let hosts = std::fs::read_dir(libraries).ok()?;
    hosts.flatten().map(|host| host.path().join("bin/rust-lld")).find(|path| path.exists())
}

/// QEMU, installed where that is allowed.
pub fn qemu() -> Result<PathBuf> {
    if !usable(QEMU) {
        println!("set-up: {QEMU} is missing");
        install(&["qemu-system-arm"])?;
        if !usable(QEMU) {
            bail!("{QEMU} is there but does not know the machine {MACHINE}: must be QEMU 7 or later");
        }
    }
    Ok(PathBuf::from(QEMU))
}

fn usable(program: &str) -> bool {
    output(Command::new(program).args(["-M", "help"])).is_some_and(|list| list.contains(MACHINE))
}

/// Installs packages with apt where this user may; otherwise says what to type.
fn install(packages: &[&str]) -> Result<()> {
    let typed = hint(packages);
    if !succeeds(Command::new("apt-get").arg("--version")) {
        bail!("please install it and try again: {typed}");
    }
    let root = output(Command::new("id").arg("-u")).is_some_and(|id| id.trim() == "0");
    let prefix: &[&str] = if root {
        &["apt-get"]
    } else if succeeds(Command::new("sudo").args(["-n", "true"])) {
        &["sudo", "-n", "apt-get"]
    } else {
        bail!("please install it and try again: {typed}");
    };
    let apt = |arguments: &[&str]| {
        let mut command = Command::new(prefix[0]);
        command.args(&prefix[1..]).args(arguments).env("DEBIAN_FRONTEND", "noninteractive");
        println!("set-up: {}", shown(&command));
        must(command.stdout(std::process::Stdio::null()))
    };
    let install = [&["install", "-y", "--no-install-recommends"], packages].concat();
    let installed = apt(&["update"]).and_then(|()| apt(&install));
    installed.with_context(|| format!("please install it and try again: {typed}"))
}

/// The command for the package manager that is present.
fn hint(packages: &[&str]) -> String {
    let managers =
        [("apt-get", "sudo apt-get install"), ("dnf", "sudo dnf install"), ("pacman", "sudo pacman -S")];
    for (program, typed) in managers {
        if succeeds(Command::new(program).arg("--version")) {
            return format!("{typed} {}", packages.join(" "));
        }
    }
    if succeeds(Command::new("brew").arg("--version")) {
        return "brew install qemu".to_owned();
    }
    format!("the packages {}", packages.join(" "))
}

/// rustfmt or clippy; whether it can be had.
pub fn component(name: &str) -> bool {
    let program = if name == "rustfmt" { "fmt" } else { name };
    if succeeds(Command::new("cargo").args([program, "--version"])) {
        return true;
    }
    println!("set-up: rustup component add {name}");
    must(Command::new("rustup").args(["component", "add", name])).is_ok()
}
