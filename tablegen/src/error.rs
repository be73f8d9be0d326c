//! The error of a machine folder, printed in one line.

use std::fmt;
use std::path::{Path, PathBuf};

/// A refusal: file, line, field, value, and what is allowed.
#[derive(Clone, PartialEq, thiserror::Error)]
#[error("{}{}: {problem}", file.display(), line.map_or(String::new(), |line| format!(":{line}")))]
#[non_exhaustive]
pub struct InputError {
    /// The file.
    pub file: PathBuf,
    /// The line, from 1, if there is one.
    pub line: Option<u64>,
    /// Field, value and what is allowed.
    pub problem: String,
}

impl InputError {
    /// A problem in a file, on one line whatever a parser's message looks like; and its line number, if it has one.
    pub fn new(file: &Path, line: Option<u64>, problem: impl Into<String>) -> Self {
        let problem = problem.into().split_whitespace().collect::<Vec<_>>().join(" ");
        Self { file: file.to_owned(), line, problem }
    }
}

/// Prints the same line: a build script whose `main` returns the error then shows it.
impl fmt::Debug for InputError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, formatter)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_one_line_in_a_build_scripts_words_too() {
        let told = InputError::new(Path::new("machine.toml"), Some(3), "pole_pairs: 0:\n at least 1");
        assert_eq!(format!("{told}"), "machine.toml:3: pole_pairs: 0: at least 1");
        assert_eq!(format!("{told:?}"), format!("{told}"));
    }
}
