//! An operating system with files, pipes and a clock of the processor.

#[cfg_attr(target_os = "linux", path = "linux_can.rs")]
#[cfg_attr(not(target_os = "linux"), path = "no_can.rs")]
pub(crate) mod can;

use crate::run::bar;
use anyhow::{Context, Result, ensure};
use indicatif::ProgressBar;
use rustix::fs::{CWD, FileType, Mode, RenameFlags, renameat_with};
use std::io::Write;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::Command;
use tempfile::{NamedTempFile, TempDir};

/// The processor time of this thread, in s: other programs do not count.
pub fn processor_s() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

/// The commit that the repository of this program's sources stands at, followed by `-dirty` if a file differs; nothing without a repository.
pub(crate) fn commit() -> Option<String> {
    const WORDS: [&str; 6] = ["describe", "--always", "--dirty", "--abbrev=12", "--exclude", "*"];
    let told = Command::new("git").args(["-C", env!("CARGO_MANIFEST_DIR")]).args(WORDS).output().ok()?;
    let commit = String::from_utf8(told.stdout).ok()?.trim().to_owned();
    (told.status.success() && !commit.is_empty()).then_some(commit)
}

/// The progress of a run, as a bar on the terminal.
pub(crate) struct Progress {
    bar: ProgressBar,
    calls: u32,
}

impl Progress {
    const STEPS: u64 = 1000;

    pub(crate) fn new(name: &str) -> Self {
        let template = "{msg:16} [{bar:40}] {percent:>3} % {elapsed} (left {eta})";
        // A talk lasts as long as its lines say, and shows its state instead.
        let bar = if name == "talk" { ProgressBar::hidden() } else { bar(Self::STEPS, template) };
        Self { bar: bar.with_message(name.to_owned()), calls: 0 }
    }

    pub(crate) fn show(&mut self, done: f64) {
        self.calls = self.calls.wrapping_add(1);
        if self.calls.is_multiple_of(256) {
            self.bar.set_position((done * Self::STEPS as f64) as u64);
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// A folder that is removed with its value.
pub(crate) fn temporary_folder() -> Result<TempDir> {
    tempfile::tempdir().context("no temporary folder for the link")
}

/// Makes a FIFO.
pub(crate) fn make_fifo(path: &Path) -> Result<()> {
    rustix::fs::mknodat(CWD, path, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0)
        .with_context(|| format!("cannot make the FIFO {}", path.display()))
}

/// Writes a file whole or not at all.
pub(crate) fn written(path: &Path, fill: impl FnOnce(&mut dyn Write) -> Result<()>) -> Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    ensure!(folder.is_dir(), "{}: there is no folder {}", path.display(), folder.display());
    ensure!(!path.is_dir(), "{}: is a folder: must be a file, or nothing yet", path.display());
    let mut file = NamedTempFile::new_in(folder).with_context(|| folder.display().to_string())?;
    fill(&mut file)?;
    file.as_file().set_permissions(std::fs::Permissions::from_mode(0o644))?;
    file.persist(path).with_context(|| path.display().to_string())?;
    Ok(())
}

/// Writes a folder whole or not at all; an existing one that has `taken` its place is exchanged for it.
pub(crate) fn written_folder(out: &Path, taken: bool, fill: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
    let parent = out.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let failed = || format!("--out {}", out.display());
    std::fs::create_dir_all(parent).with_context(failed)?;
    let beside = tempfile::Builder::new().prefix(".machine").tempdir_in(parent).with_context(failed)?;
    fill(beside.path())?;
    std::fs::set_permissions(beside.path(), std::fs::Permissions::from_mode(0o755)).with_context(failed)?;
    if taken {
        // The old folder is removed with the temporary one.
        renameat_with(CWD, beside.path(), CWD, out, RenameFlags::EXCHANGE).with_context(failed)
    } else {
        std::fs::rename(beside.path(), out).with_context(failed)
    }
}
