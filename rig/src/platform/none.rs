//! No operating system: a program in a browser, which simulates and keeps what it sees.

#[path = "no_can.rs"]
pub(crate) mod can;

use anyhow::{Result, bail};
use std::io::Write;
use std::path::{Path, PathBuf};

/// No clock of the processor: 0.
pub fn processor_s() -> f64 {
    0.0
}

/// No repository: nothing.
pub(crate) fn commit() -> Option<String> {
    None
}

/// The progress of a run, which is not shown.
pub(crate) struct Progress;

impl Progress {
    pub(crate) fn new(_name: &str) -> Self {
        Self
    }

    pub(crate) fn show(&mut self, _done: f64) {}
}

/// A folder that does not exist.
pub(crate) struct NoFolder(PathBuf);

impl NoFolder {
    /// Its path.
    pub(crate) fn path(&self) -> &Path {
        &self.0
    }
}

/// No temporary folder: an error.
pub(crate) fn temporary_folder() -> Result<NoFolder> {
    bail!("there are no folders here")
}

/// No FIFO: an error.
pub(crate) fn make_fifo(path: &Path) -> Result<()> {
    bail!("{}: there are no pipes here", path.display())
}

/// No file: an error.
pub(crate) fn written(path: &Path, _fill: impl FnOnce(&mut dyn Write) -> Result<()>) -> Result<()> {
    bail!("{}: there are no files here", path.display())
}
