//! Machine folders of nameplates.

use std::process::Command;
use tempfile::TempDir;

/// A folder of these values, as `machine new` makes it.
pub fn made(values: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path().to_str().unwrap();
    let words = ["machine", "new", "--out", place].into_iter().chain(values.split(' '));
    let made = Command::new(env!("CARGO_BIN_EXE_tractive-rig")).args(words).output().unwrap();
    assert!(made.status.success(), "{made:?}");
    folder
}
