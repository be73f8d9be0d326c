//! `cargo xtask live`: the live bench, a workspace of its own in `live/`, built, served, and checked in a browser.

use crate::build::{self, System};
use crate::cli::LiveArgs;
use crate::process::{cannot_start, say, succeeds};
use crate::setup::Setup;
use crate::workspace::{WASM, cargo, root};
use anyhow::{Context, Result, bail, ensure};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The command.
pub fn run(args: &LiveArgs) -> Result<u8> {
    if args.in_qemu {
        return crate::run::run("live", &args.words);
    }
    let mut setup = Setup::default();
    if !setup.wasm() {
        bail!("{}", no_target());
    }
    let page = absolute(args.out.as_deref().unwrap_or(&root().join("target/live/page")))?;
    make(&page)?;
    if let Some(out) = &args.screenshots {
        let out = absolute(out)?;
        let browser = setup.browser().with_context(no_browser)?;
        let sweep = root().join("target/live/sweep");
        ensure!(rig(SWEEP, &sweep)? == Some(0), "the host's sweep failed");
        let mut report = tool();
        report.arg("reports").arg(sweep.join("report.html")).arg("--pictures").arg(&out);
        let mut live = tool();
        live.arg("screenshots").arg(&page).arg(out);
        let taken = succeeds(live.arg("--browser").arg(&browser))?;
        return Ok(u8::from(!(taken && succeeds(report.arg("--browser").arg(&browser))?)));
    }
    if args.build_only {
        return Ok(0);
    }
    let mut serve = tool();
    serve.arg("serve").arg(&page).args(["--port", &args.port.to_string()]);
    if args.no_open {
        serve.arg("--no-open");
    }
    Ok(u8::from(!succeeds(&mut serve)?))
}

/// The step: format and lints of what no other step checks, then the page in a browser compared with the host's sweep. The inner error is what is
/// missing.
pub fn check(setup: &mut Setup) -> Result<Result<bool, String>> {
    if !setup.wasm() {
        return Ok(Err(no_target()));
    }
    let Some(browser) = setup.browser() else { return Ok(Err(no_browser())) };
    if !is_tidy(setup)? {
        return Ok(Ok(false));
    }
    let folder = root().join("target/live");
    let (page, sweep) = (folder.join("page"), folder.join("sweep"));
    make(&page)?;
    ensure!(rig(SWEEP, &sweep)? == Some(0), "the host's sweep failed");
    let reports = reports(&folder)?;
    let mut check = tool();
    check.arg("check").arg(&page).arg("--rig").arg(build::rig()?);
    for report in [sweep.join("report.html")].iter().chain(&reports) {
        check.arg("--report").arg(report);
    }
    // The page of a drive elsewhere: the image in QEMU if there is one, as for `live --in-qemu`.
    match (setup.qemu(), setup.toolchain()) {
        (Ok(qemu), Ok(toolchain)) => {
            let image = build::image(&toolchain, System::Zs9, None)?;
            check.arg("--in-qemu").env("TRACTIVE_QEMU", qemu).env("TRACTIVE_IMAGE", image);
        }
        (Err(missing), _) | (_, Err(missing)) => {
            say(&format!("the page of QEMU's image is not looked at: {missing:#}"))
        }
    }
    match setup.axe() {
        Some(axe) => drop(check.arg("--axe").arg(axe)),
        None => say("axe-core cannot be fetched by npm or pip: the pages are looked at without it"),
    }
    let good = succeeds(check.arg("--browser").arg(&browser))?;
    Ok(Ok(good && succeeds(live().args(["test", "--quiet", "--package", "tractive-live-tool"]))?))
}

/// The rig's words for the host's sweep; `OUT` is its folder.
const SWEEP: &str = "run sweep --on host --out OUT";

/// Commands whose pages are checked besides the sweep's, with their exit codes: pictures of a paper, the other system, its longest run, a drive that
/// trips, one that is commanded over its protocol, a machine.
const REPORTS: [(&str, &str, i32); 6] = [
    ("characteristic", "run characteristic --on host --out OUT", 0),
    ("zs9-load-step", "run zs9-load-step --on host --out OUT", 0),
    ("zs9-cycle", "run zs9-cycle --on host --out OUT", 0),
    ("trip", "run sweep --to 100 --udc 2200 --on host --out OUT", 1),
    ("talk", "talk rig/scripts/round-trip.talk --on host --out OUT", 0),
    ("machine", "machine show pmasynrm-180kw --out OUT/report.html", 0),
];

/// Report pages of [`REPORTS`], made.
fn reports(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut pages = Vec::new();
    for (name, words, code) in REPORTS {
        let out = folder.join("reports").join(name);
        ensure!(rig(words, &out)? == Some(code), "{words}: not exit code {code}");
        pages.push(out.join("report.html"));
    }
    Ok(pages)
}

/// The exit code of the rig with these words; `OUT` among them is a folder.
fn rig(words: &str, out: &Path) -> Result<Option<i32>> {
    std::fs::create_dir_all(out).with_context(|| out.display().to_string())?;
    let mut rig = Command::new(build::rig()?);
    rig.current_dir(root()).args(words.split(' ').map(|word| word.replace("OUT", &out.to_string_lossy())));
    let status = rig.stdout(Stdio::null()).stderr(Stdio::null()).status();
    Ok(status.with_context(|| cannot_start(&rig))?.code())
}

/// Format and lints, of the bindings on their target and of the tool on this machine.
fn is_tidy(setup: &mut Setup) -> Result<bool> {
    if setup.component("fmt", "rustfmt") && !succeeds(live().args(["fmt", "--all", "--", "--check"]))? {
        return Ok(false);
    }
    let wasm = ["--profile", "wasm", "--target", WASM, "--package", "tractive-live"];
    let tool = ["--package", "tractive-live-tool", "--all-targets"];
    let lint = |what: &[&str]| succeeds(live().arg("clippy").args(what).args(["--", "--deny", "warnings"]));
    Ok(!setup.component("clippy", "clippy") || (lint(&wasm)? && lint(&tool)?))
}

/// Cargo in the live bench's workspace.
fn live() -> Command {
    let mut command = cargo();
    command.current_dir(root().join("live"));
    // The build script uses the machines that are built in.
    for system in System::ALL {
        command.env_remove(system.machine_variable());
    }
    command
}

/// Its tool.
fn tool() -> Command {
    let mut command = live();
    command.args(["run", "--quiet", "--package", "tractive-live-tool", "--"]);
    command
}

/// Makes the folder of static files.
fn make(page: &Path) -> Result<()> {
    say("building the live bench …");
    let mut command = live();
    command.args(["build", "--profile", "wasm", "--target", WASM, "--package", "tractive-live"]);
    ensure!(succeeds(&mut command)?, "the live bench was not built");
    let wasm = PathBuf::from("target/live").join(WASM).join("wasm/tractive_live.wasm");
    let mut command = tool();
    command.arg("make").arg(root().join(wasm)).arg(page);
    ensure!(command.status().with_context(|| cannot_start(&command))?.success(), "the page was not made");
    Ok(())
}

/// A folder as it was typed, usable from any directory.
fn absolute(folder: &Path) -> Result<PathBuf> {
    std::path::absolute(folder).with_context(|| folder.display().to_string())
}

fn no_target() -> String {
    format!("the target {WASM} is missing; add it with: rustup target add {WASM}")
}

fn no_browser() -> String {
    "there is no Chromium, and it cannot be installed (Debian: apt-get install chromium)".to_owned()
}
