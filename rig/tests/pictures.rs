//! The gallery: its pictures against the papers, the guide's page, and the files beside it.
#![allow(missing_docs)]

use std::collections::BTreeSet;
use std::path::Path;
use tractive_rig::gallery::{PICTURES, drawn};

/// Figures of each paper.
const PAPERS: [(&str, u32); 2] = [("chai", 10), ("zs9", 36)];

fn docs() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../docs"))
}

#[test]
fn every_figure_of_both_papers_has_a_picture_and_no_number_is_made_up() {
    for (paper, count) in PAPERS {
        let mut seen = BTreeSet::new();
        for (name, first, last) in PICTURES.iter().filter_map(|picture| picture.figures()) {
            if name == paper {
                assert!(
                    1 <= first && first <= last && last <= count,
                    "{paper} has no figure {first} to {last}"
                );
                seen.extend(first..=last);
            }
        }
        assert_eq!(seen, (1..=count).collect(), "{paper}");
    }
    for picture in &PICTURES {
        let (paper, figures) = (picture.name.split('-').next().unwrap_or_default(), picture.figures());
        let is_of_a_paper = PAPERS.iter().any(|(known, _)| *known == paper);
        assert_eq!(is_of_a_paper, figures.is_some(), "{}", picture.name);
    }
    let names: BTreeSet<_> = PICTURES.iter().map(|picture| picture.name).collect();
    assert_eq!(names.len(), PICTURES.len());
}

#[test]
fn pictures_without_a_run_are_the_guides_byte_for_byte() {
    let pictures = drawn().unwrap();
    assert!(pictures.len() > 15, "{} pictures", pictures.len());
    let differs = |picture: &str, svg: &str| {
        let kept = std::fs::read_to_string(docs().join("figures").join(picture)).unwrap_or_default();
        kept != svg
    };
    let wrong: Vec<_> = pictures.iter().filter(|(picture, svg)| differs(&picture.file(), svg)).collect();
    let wrong: Vec<_> = wrong.iter().map(|(picture, _)| picture.name).collect();
    assert!(wrong.is_empty(), "{wrong:?}: `cargo rig figures --out docs/figures` writes them anew");
}

#[test]
fn the_guide_shows_every_picture_once_and_the_files_are_small() {
    let page = std::fs::read_to_string(docs().join("figures.md")).unwrap();
    let shown: Vec<_> = page.split("](figures/").skip(1).filter_map(|rest| rest.split(')').next()).collect();
    let files: Vec<_> = PICTURES.iter().map(|picture| picture.file()).collect();
    assert_eq!(shown, files, "in the papers' order");
    let entries = std::fs::read_dir(docs().join("figures")).unwrap().map(|entry| entry.unwrap());
    let mut kept = BTreeSet::new();
    for entry in entries {
        let bytes = entry.metadata().unwrap().len();
        assert!(bytes < 100_000, "{:?} has {bytes} bytes", entry.path());
        kept.insert(entry.file_name().into_string().unwrap());
    }
    assert_eq!(kept, files.into_iter().collect());
}

#[test]
fn words_lie_within_their_picture_and_are_large_enough_to_read() {
    for (picture, svg) in drawn().unwrap() {
        let attribute = |line: &str, name: &str| -> f64 {
            let value = line.split(&format!(" {name}=\"")).nth(1).and_then(|rest| rest.split('"').next());
            value.and_then(|value| value.parse().ok()).unwrap_or_else(|| panic!("{name} in {line}"))
        };
        let head = svg.lines().next().unwrap();
        let (width, height) = (attribute(head, "width"), attribute(head, "height"));
        let units: f64 =
            head.split("viewBox=\"0 0 ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
        let fine = units / width;
        for line in svg.lines().filter(|line| line.starts_with("<text")) {
            let letters = attribute(line, "font-size") / fine;
            assert!(letters >= 11.0, "{}: {letters} px in {line}", picture.name);
            let (x, y) = (attribute(line, "x") / fine, attribute(line, "y") / fine);
            assert!((0.0..=width).contains(&x) && (0.0..=height).contains(&y), "{}: {line}", picture.name);
            // The words themselves stand on the next line; a letter is half as wide as high.
            let text =
                svg[line.as_ptr() as usize - svg.as_ptr() as usize..].lines().nth(1).unwrap_or_default();
            let words: String =
                text.split('<').map(|part| part.split('>').next_back().unwrap_or(part)).collect();
            let begins = line.contains("text-anchor=\"start\"") && !line.contains("rotate");
            let room = if begins { width - x } else { width };
            let long = 0.5 * letters * words.chars().count() as f64;
            assert!(long <= room, "{}: {words} is {long} px long, {room} px are left", picture.name);
        }
    }
}

#[test]
fn a_picture_by_its_number_is_drawn_and_one_that_there_is_not_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let figures = |only: &str| {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_tractive-rig"));
        command.args(["figures", "--only", only, "--out"]).arg(&out).output().unwrap()
    };
    let refused = figures("zs9-37");
    let errors = String::from_utf8_lossy(&refused.stderr);
    assert_eq!((refused.status.code(), errors.trim().lines().count()), (Some(2), 1), "{errors}");
    assert!(errors.contains("--only zs9-37: must be one of architecture, ") && !out.exists(), "{errors}");
    // Figure 15 is one of the group of 14 to 19; it comes from a run.
    let drawn = figures("zs9-15");
    assert!(drawn.status.success(), "{}", String::from_utf8_lossy(&drawn.stderr));
    let files: Vec<_> = std::fs::read_dir(&out).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(files, ["zs9-14-19.svg"]);
}
