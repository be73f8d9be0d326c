//! What every interrupt was about, in the order in which they ended: a line each.

use anyhow::{Context, Result};
use std::fmt::Write as _;
use std::path::Path;

/// The lines so far.
pub(crate) struct Calls {
    /// What the interrupts are about now.
    pub(crate) mode: String,
    lines: String,
}

impl Calls {
    /// None yet.
    pub(crate) fn new(mode: &str) -> Self {
        Self { mode: mode.to_owned(), lines: String::new() }
    }

    /// A control interrupt, and what else there is to say of it.
    pub(crate) fn control(&mut self, detail: &str) {
        let _ = writeln!(self.lines, "control,{},{detail}", self.mode);
    }

    /// A PWM interrupt.
    pub(crate) fn pwm(&mut self) {
        let _ = writeln!(self.lines, "pwm,{},", self.mode);
    }

    /// Writes them, if somebody wants them.
    pub(crate) fn write(&self, path: Option<&Path>) -> Result<()> {
        match path {
            Some(path) => std::fs::write(path, &self.lines).with_context(|| path.display().to_string()),
            None => Ok(()),
        }
    }
}
