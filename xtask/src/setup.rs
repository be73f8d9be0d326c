//! The set-up: the target, QEMU, the lints. Each step acts only when something is missing, and says so.

use crate::process::{find, output_of, quietly, say};
use crate::workspace::{TARGET, WASM, cargo, root};
use anyhow::{Result, bail};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The emulated board.
const QEMU_MACHINE: &str = "mps2-an386";
/// Debian's own Rust, new enough if rustup's target is not available.
const DEBIAN_PACKAGES: [&str; 3] = ["rustc-web", "cargo-web", "rust-web-src"];
const DEBIAN_CARGO: &str = "/usr/bin/cargo";
const DEBIAN_RUSTC: &str = "/usr/bin/rustc";

/// Names of Chromium, the first one Debian's package too.
const BROWSERS: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];

/// The release of Unicorn that the twin names.
const UNICORN: &str = "2.1.3";

/// The toolchain that Miri belongs to.
const NIGHTLY: &str = "nightly";

/// The cargo for the board's target.
#[derive(Debug, PartialEq, Eq)]
pub struct Toolchain {
    cargo: OsString,
    /// Behind the subcommand.
    extra_args: Vec<OsString>,
    env: Vec<(&'static str, OsString)>,
    /// Clippy knows the target.
    pub has_clippy: bool,
}

impl Toolchain {
    /// The toolchain in use, with the target's precompiled library.
    fn installed() -> Self {
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        Self { cargo, extra_args: Vec::new(), env: Vec::new(), has_clippy: true }
    }

    /// Debian's toolchain, which builds the library for the target from its source.
    fn debian(linker: &Path) -> Self {
        Self {
            cargo: DEBIAN_CARGO.into(),
            extra_args: vec![
                "-Zbuild-std=core".into(),
                "--target-dir".into(),
                root().join("target/debian").into(),
            ],
            env: vec![
                ("RUSTC_BOOTSTRAP", "1".into()),
                ("RUSTC", DEBIAN_RUSTC.into()),
                ("CARGO_TARGET_THUMBV7EM_NONE_EABIHF_LINKER", linker.into()),
            ],
            has_clippy: false,
        }
    }

    /// A cargo command for the target, in the repository's root.
    pub fn cargo(&self, args: &[&str]) -> Command {
        let mut command = Command::new(&self.cargo);
        command.current_dir(root()).args(args).args(&self.extra_args);
        command.envs(self.env.iter().map(|(name, value)| (name, value)));
        command
    }
}

/// The set-up, which remembers what it has already done.
#[derive(Debug, Default)]
pub struct Setup {
    apt_updated: bool,
}

impl Setup {
    /// A toolchain that builds the image.
    pub fn toolchain(&mut self) -> Result<Toolchain> {
        if target_is_there(TARGET) {
            return Ok(Toolchain::installed());
        }
        if find("rustup").is_some() {
            say(&format!("{TARGET}: Debian's toolchain is tried instead"));
        }
        if !debian_is_usable() {
            self.apt_install(&DEBIAN_PACKAGES);
        }
        if !debian_is_usable() {
            bail!("no Rust toolchain for {TARGET}; install it with: rustup target add {TARGET}");
        }
        if find_linker().is_none() {
            self.apt_install(&["lld"]);
        }
        match find_linker() {
            Some(linker) => Ok(Toolchain::debian(&linker)),
            None => bail!("no linker for {TARGET}; {}", how_to_install("lld", "lld")),
        }
    }

    /// The browsers' target; `false` if rustup does not provide it.
    pub fn wasm(&mut self) -> bool {
        target_is_there(WASM)
    }

    /// A browser that runs without a screen.
    pub fn browser(&mut self) -> Option<PathBuf> {
        let found = || BROWSERS.iter().find_map(|name| find(name));
        if found().is_none() {
            self.apt_install(&BROWSERS[..1]);
        }
        found()
    }

    /// The file of axe-core, which finds accessibility problems in a page: from npm, else from a Python package that contains it.
    pub fn axe(&mut self) -> Option<PathBuf> {
        const BY_NPM: &str = "axe-core@4.11.0";
        const BY_PIP: &str = "axe-playwright-python==0.1.8";
        let tools = root().join("target/tools/axe");
        let files = ["node_modules/axe-core/axe.min.js", "axe_playwright_python/axe.min.js"]
            .map(|file| tools.join(file));
        let found = || files.iter().find(|file| file.is_file()).cloned();
        if found().is_none() && find("npm").is_some() {
            say("fetching axe-core (npm install)");
            let install =
                ["install", "--no-save", "--no-audit", "--no-fund", "--ignore-scripts", BY_NPM, "--prefix"];
            quietly(Command::new("npm").args(install).arg(&tools));
        }
        if found().is_none() && find("python3").is_some() {
            say("fetching axe-core (pip install)");
            let install = ["-m", "pip", "install", "--no-deps", BY_PIP, "--target"];
            quietly(Command::new("python3").args(install).arg(&tools));
        }
        found()
    }

    /// The twin's emulator: compiled, from the Python package that contains the library; else what is needed to compile it.
    pub fn emulator(&mut self) -> bool {
        self.unicorn() || self.cmake()
    }

    /// Unicorn's library of exactly the release that the twin names, placed where `.cargo/config.toml` makes pkg-config look for it.
    fn unicorn(&mut self) -> bool {
        let tools = root().join("target/tools/unicorn");
        let (library, told) = (tools.join("unicorn/lib/libunicorn.a"), tools.join("unicorn.pc"));
        if !library.is_file() && find("python3").is_some() {
            say("fetching Unicorn (pip install)");
            let package = format!("unicorn=={UNICORN}");
            let install =
                ["-m", "pip", "install", "--no-deps", "--only-binary", ":all:", &package, "--target"];
            quietly(Command::new("python3").args(install).arg(&tools));
        }
        if !library.is_file() {
            return false;
        }
        if find("pkg-config").is_none() {
            self.apt_install(&["pkg-config"]);
        }
        let libs = "Libs: -L${pcfiledir}/unicorn/lib -lunicorn";
        let told_now = format!("Name: unicorn\nDescription: emulator\nVersion: {UNICORN}\n{libs}\n");
        let is_told = || std::fs::read_to_string(&told).is_ok_and(|text| text == told_now);
        find("pkg-config").is_some() && (is_told() || std::fs::write(&told, &told_now).is_ok())
    }

    /// CMake, with which the emulator is built.
    fn cmake(&mut self) -> bool {
        const PROGRAM: &str = "cmake";
        if find(PROGRAM).is_none() {
            self.apt_install(&[PROGRAM]);
        }
        find(PROGRAM).is_some()
    }

    /// mdBook, which builds the guide: the installed one, else one built for this project alone.
    pub fn mdbook(&mut self) -> Option<PathBuf> {
        const PROGRAM: &str = "mdbook";
        let tools = root().join("target/tools");
        let own = tools.join("bin").join(PROGRAM);
        if find(PROGRAM).is_none() && !own.is_file() {
            say(&format!("building {PROGRAM} (cargo install)"));
            // One small book: not worth the time of an optimised build.
            let install =
                ["install", "--debug", "--locked", "--no-default-features", "--quiet", PROGRAM, "--root"];
            quietly(cargo().args(install).arg(&tools));
        }
        find(PROGRAM).or_else(|| Some(own).filter(|own| own.is_file()))
    }

    /// Slurm with its daemons, and munge.
    pub fn slurm(&mut self) -> bool {
        const PROGRAMS: [&str; 3] = ["slurmctld", "slurmd", "munged"];
        // The daemons' folder is not on every user's path.
        let is_there = || {
            PROGRAMS.iter().all(|name| find(name).is_some() || Path::new("/usr/sbin").join(name).is_file())
        };
        if !is_there() {
            self.apt_install(&["slurm-wlm", "munge"]);
        }
        is_there()
    }

    /// QEMU with the emulated board.
    pub fn qemu(&mut self) -> Result<PathBuf> {
        const PROGRAM: &str = "qemu-system-arm";
        if find(PROGRAM).is_none() {
            self.apt_install(&[PROGRAM]);
        }
        let Some(qemu) = find(PROGRAM) else {
            bail!("{PROGRAM} is missing; {}", how_to_install(PROGRAM, "qemu"));
        };
        let machines = output_of(Command::new(&qemu).args(["-M", "help"])).unwrap_or_default();
        if !lists_machine(&machines) {
            bail!("{} has no machine {QEMU_MACHINE}; a newer QEMU is needed", qemu.display());
        }
        Ok(qemu)
    }

    /// A component of the toolchain that cargo calls as a subcommand (`fmt`, `clippy`).
    pub fn component(&mut self, subcommand: &str, component: &str) -> bool {
        let usable = || quietly(cargo().args([subcommand, "--version"]));
        if usable() {
            return true;
        }
        if find("rustup").is_none() {
            return false;
        }
        say(&format!("adding {component} with rustup"));
        quietly(Command::new("rustup").args(["component", "add", component])) && usable()
    }

    /// `cargo miri` of the toolchain in use, else of nightly, to which it is added.
    pub fn miri(&mut self) -> Option<Command> {
        let nightly = || {
            let mut command = Command::new("rustup");
            command.current_dir(root()).args(["run", NIGHTLY, "cargo"]);
            command
        };
        let usable = |candidate: &mut Command| quietly(candidate.args(["miri", "--version"]));
        if usable(&mut cargo()) {
            return Some(cargo());
        }
        if !usable(&mut nightly()) && quietly(nightly().arg("--version")) {
            say("adding miri to nightly with rustup");
            let components = ["component", "add", "miri", "rust-src", "--toolchain", NIGHTLY];
            quietly(Command::new("rustup").args(components));
        }
        usable(&mut nightly()).then(nightly)
    }

    /// Installs packages with apt-get if that is available and allowed; the caller checks whether it helped.
    fn apt_install(&mut self, packages: &[&str]) {
        if find("apt-get").is_none() || !may_install() {
            return;
        }
        if !self.apt_updated {
            say("updating the list of packages (apt-get update)");
            quietly(&mut privileged(&["apt-get", "update"]));
            self.apt_updated = true;
        }
        say(&format!("installing {} (apt-get install)", packages.join(" ")));
        let install = "env DEBIAN_FRONTEND=noninteractive apt-get install --yes --no-install-recommends";
        let args: Vec<_> = install.split(' ').chain(packages.iter().copied()).collect();
        if !quietly(&mut privileged(&args)) {
            say(&format!("apt-get could not install {}", packages.join(" ")));
        }
    }
}

fn is_root() -> bool {
    output_of(Command::new("id").arg("-u")).as_deref() == Some("0")
}

fn may_install() -> bool {
    is_root() || (find("sudo").is_some() && quietly(Command::new("sudo").args(["-n", "true"])))
}

fn privileged(args: &[&str]) -> Command {
    let prefix: &[&str] = if is_root() { &[] } else { &["sudo", "-n"] };
    let mut words = prefix.iter().chain(args);
    let mut command = Command::new(words.next().unwrap_or(&"true"));
    command.args(words);
    command
}

/// `true` if a target's library is there, after rustup was asked for it if it was not.
fn target_is_there(target: &str) -> bool {
    if has_target(target) || find("rustup").is_none() {
        return has_target(target);
    }
    say(&format!("adding the target {target} with rustup"));
    let added = quietly(Command::new("rustup").args(["target", "add", target])) && has_target(target);
    if !added {
        say(&format!("rustup cannot add {target}"));
    }
    added
}

/// `true` if a target's library is there, whoever installed it.
fn has_target(target: &str) -> bool {
    let mut rustc = Command::new("rustc");
    let folder = output_of(rustc.current_dir(root()).args(["--print", "target-libdir", "--target", target]));
    let entries = folder.and_then(|folder| std::fs::read_dir(folder).ok()).into_iter().flatten().flatten();
    entries.into_iter().any(|entry| entry.file_name().to_string_lossy().starts_with("libcore-"))
}

fn debian_is_usable() -> bool {
    let version = output_of(Command::new(DEBIAN_RUSTC).arg("--version")).unwrap_or_default();
    let sysroot = output_of(Command::new(DEBIAN_RUSTC).args(["--print", "sysroot"])).unwrap_or_default();
    let source = Path::new(&sysroot).join("lib/rustlib/src/rust/library/core");
    let cargo = output_of(Command::new(DEBIAN_CARGO).arg("--version")).unwrap_or_default();
    let minor = minor_version(env!("CARGO_PKG_RUST_VERSION"));
    source.is_dir() && [version, cargo].iter().all(|found| minor_version(found) >= minor)
}

/// 96 of `rustc 1.96.0 (…)` and of `1.96`; `None` is less than all.
fn minor_version(text: &str) -> Option<u32> {
    let number = text.split_whitespace().find_map(|word| word.strip_prefix("1."))?;
    number.split(|c: char| !c.is_ascii_digit()).next()?.parse().ok()
}

/// A linker for the target: rustup's own, or LLVM's.
fn find_linker() -> Option<PathBuf> {
    let sysroot = output_of(Command::new("rustc").current_dir(root()).args(["--print", "sysroot"]));
    let hosts = sysroot.and_then(|sysroot| std::fs::read_dir(Path::new(&sysroot).join("lib/rustlib")).ok());
    let bundled = hosts.into_iter().flatten().flatten().map(|host| host.path().join("bin/rust-lld"));
    bundled.into_iter().find(|file| file.is_file()).or_else(|| find("rust-lld")).or_else(|| find("ld.lld"))
}

/// The command to type, for the package manager that is there.
fn how_to_install(debian: &str, elsewhere: &str) -> String {
    let known = [
        ("apt-get", format!("sudo apt-get update && sudo apt-get install --yes {debian}")),
        ("dnf", format!("sudo dnf install --assumeyes {debian}")),
        ("pacman", format!("sudo pacman -S --needed {debian}")),
        ("brew", format!("brew install {elsewhere}")),
    ];
    let found = known.into_iter().find(|(manager, _)| find(manager).is_some());
    match found {
        Some((_, command)) => format!("install it with: {command}"),
        None => format!("install {debian} and put it on the PATH"),
    }
}

fn lists_machine(help: &str) -> bool {
    help.lines().any(|line| line.split_whitespace().next() == Some(QEMU_MACHINE))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_compare_by_their_minor_number() {
        assert_eq!(minor_version("rustc 1.96.0 (ac68faa20 2026-01-01)"), Some(96));
        assert_eq!(minor_version("cargo 1.85.1-nightly"), Some(85));
        assert_eq!(minor_version("1.88"), Some(88));
        assert!(minor_version("") < minor_version("1.88"));
    }

    #[test]
    fn the_board_must_be_listed_by_its_own_name() {
        let help =
            "Supported machines are:\nmps2-an385  ARM MPS2\nmps2-an386           ARM MPS2 with AN386\n";
        assert!(lists_machine(help));
        assert!(!lists_machine("mps2-an3860  another"));
        assert!(!lists_machine(""));
    }

    #[test]
    fn the_compiled_emulator_is_of_the_twins_release() {
        let manifest = std::fs::read_to_string(root().join("twin/Cargo.toml")).unwrap();
        assert!(manifest.contains(&format!("unicorn-engine = {{ version = \"={UNICORN}\"")));
        let config = std::fs::read_to_string(root().join(".cargo/config.toml")).unwrap();
        assert!(config.contains("\"target/tools/unicorn\""));
    }

    #[test]
    fn debians_toolchain_brings_its_linker_and_builds_the_library() {
        let toolchain = Toolchain::debian(Path::new("/x/rust-lld"));
        let command = toolchain.cargo(&["build", "--target", TARGET]);
        let args: Vec<_> = command.get_args().collect();
        assert_eq!(args[..4], ["build", "--target", TARGET, "-Zbuild-std=core"]);
        let env: Vec<_> =
            command.get_envs().filter_map(|(name, value)| Some((name.to_str()?, value?))).collect();
        assert!(env.contains(&("CARGO_TARGET_THUMBV7EM_NONE_EABIHF_LINKER", "/x/rust-lld".as_ref())));
        assert!(env.contains(&("RUSTC_BOOTSTRAP", "1".as_ref())));
        assert!(!toolchain.has_clippy);
    }

    #[test]
    fn the_linker_variable_names_the_target() {
        let variable = format!("CARGO_TARGET_{}_LINKER", TARGET.to_uppercase().replace('-', "_"));
        assert_eq!(Toolchain::debian(Path::new("l")).env[2].0, variable);
    }
}
