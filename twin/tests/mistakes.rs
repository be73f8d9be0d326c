//! Mistakes that the twin must show, and the drive without one, which must show nothing. The image is that which
//! `TRACTIVE_NUCLEO_IMAGE` names.

use std::path::PathBuf;
use tractive_twin::mistakes::{MISTAKES, outcome};

fn image() -> PathBuf {
    std::env::var_os("TRACTIVE_NUCLEO_IMAGE").expect("TRACTIVE_NUCLEO_IMAGE").into()
}

#[test]
#[ignore = "needs the image; `cargo xtask test --only twin` builds it"]
fn the_image_as_it_is_shows_nothing() {
    assert_eq!(outcome(&image(), None).unwrap(), None);
}

#[test]
#[ignore = "needs the image; `cargo xtask test --only twin` builds it"]
fn a_mistake_is_shown() {
    let image = image();
    let mut missed = Vec::new();
    // One alone, by a part of its name.
    let only = std::env::var("TRACTIVE_MISTAKE").unwrap_or_default();
    for mistake in MISTAKES.iter().filter(|mistake| mistake.name.contains(&only)) {
        let shown = outcome(&image, Some(mistake)).unwrap();
        println!("| {} | {} |", mistake.name, shown.as_deref().unwrap_or("not shown"));
        if shown.is_none() {
            missed.push(mistake.name);
        }
    }
    assert!(missed.is_empty(), "{missed:?}");
}
