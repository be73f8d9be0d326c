//! The numbers that the repository keeps: the page of costs, and the sizes that the images must not exceed.

use super::page;
use super::report::Report;
use crate::build;
use anyhow::{Context, Result};
use std::fmt::Write as _;
use std::path::PathBuf;

/// The amount by which a number of the page may have moved: this share, or this much.
const MOVED_SHARE: f64 = 0.05;
const MOVED: f64 = 10.0;
/// Sizes are kept rounded up to a multiple of this many bytes.
const GRAIN: u64 = 256;

/// A golden file, as it should be now.
pub struct Golden {
    path: PathBuf,
    text: String,
    /// `true` if numbers may only fall (sizes); otherwise they may move a little either way.
    falls: bool,
}

/// The files, by what was measured.
pub fn files(report: &Report) -> [Golden; 2] {
    let file = |name: &str| build::root().join(name);
    [
        Golden { path: file("docs/cost.md"), text: page::text(report), falls: false },
        Golden { path: file("sizes.toml"), text: sizes(report), falls: true },
    ]
}

fn sizes(report: &Report) -> String {
    let mut text = String::from(
        "# Sizes of the images in bytes, rounded up. `cargo xtask timing` fails when one of them grows beyond this;\n\
         # `cargo xtask timing --write` takes them down anew.\n",
    );
    for measured in report.systems {
        let sizes = &measured.image.sizes;
        let stack = u64::from(measured.statistics.stack_bytes().unsigned_abs());
        let _ = writeln!(text, "\n[{}]", measured.system.name);
        for (name, bytes) in
            [("code", sizes.code), ("tables", sizes.tables), ("ram", sizes.ram), ("stack", stack)]
        {
            let _ = writeln!(text, "{name} = {}", bytes.next_multiple_of(GRAIN));
        }
    }
    text
}

/// Writes them.
pub fn write(files: &[Golden]) -> Result<()> {
    for Golden { path, text, .. } in files {
        std::fs::write(path, text).with_context(|| path.display().to_string())?;
    }
    Ok(())
}

/// The lines that do not fit.
pub fn complaints(files: &[Golden]) -> Vec<String> {
    let complaint = |file: &Golden| {
        let found = std::fs::read_to_string(&file.path).unwrap_or_default();
        let differs = difference(&found, &file.text, file.falls)?;
        Some(format!("{}: {differs}; `cargo xtask timing --write` writes it anew", file.path.display()))
    };
    files.iter().filter_map(complaint).collect()
}

/// The first line that is out of date.
fn difference(golden: &str, now: &str, falls: bool) -> Option<String> {
    let (golden_lines, now_lines): (Vec<_>, Vec<_>) = (golden.lines().collect(), now.lines().collect());
    if golden_lines.len() != now_lines.len() {
        return Some(format!("{} lines, {} now", golden_lines.len(), now_lines.len()));
    }
    let same = |(golden, now): (&str, &str)| match (golden.parse::<f64>(), now.parse::<f64>()) {
        (Ok(golden), Ok(now)) if falls => now <= golden,
        (Ok(golden), Ok(now)) => (now - golden).abs() <= (MOVED_SHARE * golden).max(MOVED),
        _ => golden == now,
    };
    let line = golden_lines.iter().zip(&now_lines).find(|(golden, now)| {
        let (golden, now): (Vec<_>, Vec<_>) = (golden.split(' ').collect(), now.split(' ').collect());
        golden.len() != now.len() || !golden.into_iter().zip(now).all(same)
    });
    line.map(|(golden, now)| format!("`{golden}` is now `{now}`"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_may_fall_and_costs_may_move_a_little() {
        assert_eq!(difference("code = 512\n", "code = 256\n", true), None);
        assert!(difference("code = 512\n", "code = 768\n", true).unwrap().contains("768"));
        assert_eq!(difference("| a | 1000 |", "| a | 1049 |", false), None);
        assert!(difference("| a | 1000 |", "| a | 1051 |", false).is_some());
        assert_eq!(difference("| a | 20 |", "| a | 29 |", false), None);
        assert!(difference("| a | 20 |", "| b | 20 |", false).is_some());
        assert!(difference("", "| b | 20 |", false).is_some());
    }
}
