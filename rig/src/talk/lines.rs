//! The source of the lines: a script, read whole before anything runs, or standard input, read a line at a time when it is needed.

use super::script::{self, Line};
use super::system::System;
use anyhow::{Context, Result};
use std::collections::VecDeque;
use std::io::{BufRead, IsTerminal, Write};
use std::path::Path;

/// A source of lines.
pub enum Lines {
    /// The rest of a script.
    Script(VecDeque<Line>),
    /// Standard input, and the number of lines that were read.
    Typed(usize),
    /// No source here: the lines come by [`super::Talk::say`].
    Said,
}

impl Lines {
    /// The lines of a script. The error names the file, the line and the word.
    pub fn of_script(path: &Path, system: System) -> Result<Self> {
        let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
        let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
        let lines = script::script(text, system).with_context(|| path.display().to_string())?;
        Ok(Self::Script(lines.into()))
    }

    /// The lines of a text. The error names the line and the word.
    pub fn of_text(text: &str, system: System) -> Result<Self> {
        Ok(Self::Script(script::script(text, system)?.into()))
    }

    /// `true` if the lines are typed.
    pub fn are_typed(&self) -> bool {
        matches!(self, Self::Typed(_))
    }

    /// `true` if the lines have no end.
    pub fn are_said(&self) -> bool {
        matches!(self, Self::Said)
    }

    /// The next line; `None` at the end. A line that cannot be understood is an error; on a terminal it is reported and the next line
    /// is read.
    pub fn take(&mut self, system: System) -> Result<Option<Line>> {
        let count = match self {
            Self::Script(lines) => return Ok(lines.pop_front()),
            Self::Typed(count) => count,
            Self::Said => return Ok(None),
        };
        let input = std::io::stdin();
        loop {
            if input.is_terminal() {
                eprint!("> ");
                std::io::stderr().flush()?;
            }
            let mut text = String::new();
            if input.lock().read_line(&mut text)? == 0 {
                return Ok(None);
            }
            *count += 1;
            match script::line(&text, *count, system) {
                Ok(Some(line)) => return Ok(Some(line)),
                Ok(None) => {}
                Err(error) if input.is_terminal() => eprintln!("{error:#}"),
                Err(error) => return Err(error),
            }
        }
    }
}
