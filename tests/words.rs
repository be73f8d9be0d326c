//! The words of the documentation: a comment begins with the noun that it explains, as a data sheet does, not with a question.

use std::path::{Path, PathBuf};

/// Folders of the sources.
const FOLDERS: [&str; 14] = [
    "bench",
    "boards",
    "cells",
    "control",
    "fault-injector",
    "fuzz",
    "live",
    "mutants",
    "rig",
    "src",
    "tablegen",
    "tests",
    "twin",
    "xtask",
];

/// Words with which a question begins.
const QUESTIONS: [&str; 8] = ["What", "Whether", "How", "Which", "Where", "Who", "When", "Why"];

fn sources(path: &Path, out: &mut Vec<PathBuf>) {
    if path.is_dir() {
        let entries = std::fs::read_dir(path).unwrap().map(|entry| entry.unwrap().path());
        entries.for_each(|entry| sources(&entry, out));
    } else if path.extension().is_some_and(|extension| extension == "rs") {
        out.push(path.to_owned());
    }
}

/// The comments of a file that begin with a question, each with its line, from 1.
fn questions(text: &str) -> Vec<(usize, &str)> {
    let mut found = Vec::new();
    let mut before = "";
    for (number, line) in text.lines().map(str::trim_start).enumerate() {
        let comment = line.strip_prefix("/// ").or(line.strip_prefix("//! "));
        let first = comment.and_then(|comment| comment.split(|letter: char| !letter.is_alphabetic()).next());
        let begins = !before.starts_with(line.get(..3).unwrap_or(" "));
        if begins && first.is_some_and(|first| QUESTIONS.iter().any(|word| word.eq_ignore_ascii_case(first)))
        {
            found.push((number + 1, line));
        }
        before = line;
    }
    found
}

#[test]
fn a_comment_begins_with_the_noun_that_it_explains() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut complaints = Vec::new();
    for folder in FOLDERS {
        let mut files = Vec::new();
        sources(&root.join(folder), &mut files);
        assert!(!files.is_empty(), "{folder} holds no source");
        for file in files {
            let text = std::fs::read_to_string(&file).unwrap();
            let lines = questions(&text).into_iter();
            complaints.extend(lines.map(|(number, line)| format!("{}:{number}: {line}", file.display())));
        }
    }
    assert!(complaints.is_empty(), "{} comments:\n{}", complaints.len(), complaints.join("\n"));
}

#[test]
fn a_question_is_found_where_a_comment_begins() {
    let text = "/// Whether it is on.\nfn a() {}\n/// The state.\n/// What follows is its second line.\n//! WHICH.\n/// Whatever it is.";
    let found: Vec<_> = questions(text).into_iter().map(|(number, _)| number).collect();
    assert_eq!(found, [1, 5]);
}
