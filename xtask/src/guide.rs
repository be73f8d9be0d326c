//! The commands of the engineer's guide, run as they stand there, so that a renamed option fails here.
//!
//! They are the lines of the `sh` blocks in the chapters of `docs/SUMMARY.md`. A line that ends in `# exits with N` must exit with N; all others must
//! succeed. Commands that would touch a board get `--dry-run`: the image is built but not flashed. A command that stands in several places is run at
//! the first of them; its output is checked in each. Tests are only built, steps of `cargo xtask test` are only looked up, and what would run in QEMU
//! runs on the host: the rest is the business of those steps.
//!
//! A block ```` ```text prints ```` after a command holds lines that the command must print, in this order; `…` stands for omitted text.

use crate::process::cannot_start;
use anyhow::{Context, Result, bail};
use std::collections::HashMap;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

/// A command, the exit code that it must have, and lines that it must print.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Line {
    chapter: String,
    command: String,
    code: i32,
    prints: Vec<String>,
}

/// The first line of a block of what is printed.
const PRINTS: &str = "```text prints";

/// The folder of the guide's files: files left there by an earlier build are not used.
const FILES: &str = "target/guide";

/// Runs them all; `true` is good.
pub fn run(root: &Path) -> Result<bool> {
    let files = root.join(FILES);
    if files.is_dir() {
        std::fs::remove_dir_all(&files).with_context(|| files.display().to_string())?;
    }
    let (mut good, mut outputs) = (true, HashMap::new());
    for Line { chapter, command, code, prints } in lines(root)? {
        let began = Instant::now();
        if !outputs.contains_key(&command) {
            let mut shell = Command::new("sh");
            shell.current_dir(root).args(["-c", &command]).stdin(Stdio::null());
            outputs.insert(command.clone(), shell.output().with_context(|| cannot_start(&shell))?);
        }
        let output = &outputs[&command];
        let said = [&output.stdout, &output.stderr].map(|said| String::from_utf8_lossy(said)).concat();
        let missing = missing(&said, &prints);
        let passed = output.status.code() == Some(code) && missing.is_none();
        let verdict = if passed { "passed" } else { "FAILED" };
        println!("{verdict} {:>5.1} s  {chapter}: {command}", began.elapsed().as_secs_f64());
        if let Some(missing) = missing {
            println!("it does not print, or not in this place: {missing}\n{}", said.trim_end());
        } else if !passed {
            println!("{}, expected {code}", output.status);
            println!("{}", String::from_utf8_lossy(&output.stderr).trim_end());
        }
        good &= passed;
    }
    Ok(good)
}

fn lines(root: &Path) -> Result<Vec<Line>> {
    let read = |name: &str| {
        let path = root.join("docs").join(name);
        std::fs::read_to_string(&path).with_context(|| path.display().to_string())
    };
    let mut lines = Vec::new();
    for chapter in chapters(&read("SUMMARY.md")?) {
        lines.extend(commands(&chapter, &read(&chapter)?));
    }
    if lines.is_empty() {
        bail!("the guide holds no command");
    }
    Ok(lines)
}

/// The files that the summary links to.
fn chapters(summary: &str) -> Vec<String> {
    let links = summary.lines().filter_map(|line| line.split_once("](")?.1.split_once(')'));
    links.map(|(file, _)| file.to_owned()).collect()
}

fn commands(chapter: &str, text: &str) -> Vec<Line> {
    let mut lines: Vec<Line> = Vec::new();
    let mut block = "";
    for line in text.lines() {
        if line.starts_with("```") {
            block = line;
        } else if block == "```sh" && !line.trim().is_empty() {
            lines.push(command(chapter, line));
        } else if block == PRINTS
            && let Some(last) = lines.last_mut()
        {
            last.prints.push(line.to_owned());
        }
    }
    lines
}

/// The first of the lines that does not occur in a text after the line before it.
fn missing<'a>(text: &str, lines: &'a [String]) -> Option<&'a String> {
    let mut left = text.lines();
    let has = |line: &str, wanted: &str| {
        let mut rest = line;
        let mut parts = wanted.split('…').map(str::trim).filter(|part| !part.is_empty());
        parts.all(|part| match rest.split_once(part) {
            Some((_, behind)) => {
                rest = behind;
                true
            }
            None => false,
        })
    };
    let wanted = |line: &&String| !line.replace('…', "").trim().is_empty();
    lines.iter().filter(wanted).find(|wanted| !left.any(|line| has(line, wanted)))
}

fn command(chapter: &str, line: &str) -> Line {
    let (command, comment) = line.split_once(" # ").unwrap_or((line, ""));
    let code = comment.trim().strip_prefix("exits with ").and_then(|code| code.parse().ok()).unwrap_or(0);
    let mut command = command.trim_end().to_owned();
    if command.starts_with("cargo xtask flash")
        && !["--dry-run", "--help"].iter().any(|word| command.contains(word))
    {
        command += " --dry-run";
    }
    if command.starts_with("cargo xtask live") {
        command = "cargo xtask test --only live --list".to_owned();
    }
    // A page is served until its reader has seen enough.
    if command.starts_with("cargo rig live") {
        command += " --help";
    }
    // Step `qemu` runs the images, and shows that the host does the same.
    if in_qemu(&command) {
        command += " --on host";
    }
    // A setting of the environment may stand before it.
    if command.contains("cargo test ") {
        let (cargos, tests) = command.split_once(" -- ").unwrap_or((&command, ""));
        command = format!("{cargos} --no-run -- {tests}").trim_end_matches(" -- ").to_owned();
    }
    if command.starts_with("cargo xtask test") && !command.ends_with(" --list") {
        command += " --list";
    }
    Line { chapter: chapter.to_owned(), command, code, prints: Vec::new() }
}

/// `true` for a run or a talk whose drive is an image in QEMU.
fn in_qemu(command: &str) -> bool {
    let runs = ["cargo xtask run ", "cargo xtask talk"].iter().any(|start| command.starts_with(start));
    runs && !["--on ", "--help"].iter().any(|word| command.contains(word))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_summary_names_the_chapters() {
        assert_eq!(chapters("# Summary\n\n- [One](one.md)\n  - [Two](two.md)\n"), ["one.md", "two.md"]);
    }

    #[test]
    fn commands_stand_in_sh_blocks_alone() {
        let text = "ls\n```sh\ncargo rig run sweep # exits with 1\n\ncargo xtask flash --log   # prints\n```\n```text\nno\n```\n";
        let line = |command: &str, code| Line {
            chapter: "c".to_owned(),
            command: command.to_owned(),
            code,
            prints: Vec::new(),
        };
        let wanted = [line("cargo rig run sweep", 1), line("cargo xtask flash --log --dry-run", 0)];
        assert_eq!(commands("c", text), wanted);
    }

    #[test]
    fn what_is_to_be_printed_belongs_to_the_command_before_it() {
        let text =
            "```sh\na\nb\n```\nIt prints:\n```text prints\none … three\n…\nfour\n```\n```text\nfive\n```\n";
        let [a, b] = &commands("c", text)[..] else { panic!("two commands") };
        assert_eq!((a.prints.len(), b.prints.join("|").as_str()), (0, "one … three|…|four"));
        assert_eq!(missing("zero\none two three\n\nfour five\n", &b.prints), None);
        for text in ["one two\nfour", "four\none two three", "three one\nfour"] {
            assert!(missing(text, &b.prints).is_some(), "{text}");
        }
    }

    #[test]
    fn what_other_steps_run_is_not_run_again() {
        assert_eq!(command("c", "cargo test -p x --test y").command, "cargo test -p x --test y --no-run");
        assert_eq!(command("c", "cargo test -- --nocapture").command, "cargo test --no-run -- --nocapture");
        assert_eq!(command("c", "ALL=1 cargo test -p x").command, "ALL=1 cargo test -p x --no-run");
        assert_eq!(command("c", "cargo xtask run chopper").command, "cargo xtask run chopper --on host");
        assert_eq!(command("c", "cargo xtask run --help").command, "cargo xtask run --help");
        assert_eq!(
            command("c", "cargo xtask test --only qemu").command,
            "cargo xtask test --only qemu --list"
        );
        assert_eq!(command("c", "cargo rig live --can can0").command, "cargo rig live --can can0 --help");
        assert_eq!(command("c", "cargo xtask live --out x").command, "cargo xtask test --only live --list");
    }

    #[test]
    fn every_chapter_is_there() {
        assert!(lines(crate::build::root()).unwrap().len() > 10);
    }
}
