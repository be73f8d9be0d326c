//! Who knows whom, as the map of the modules in `src/lib.rs` says.

use std::path::{Path, PathBuf};

/// Each room, and the others that no line of it may name.
const NEVER: [(&str, &[&str]); 5] = [
    ("frames", &["time", "machine", "control", "modulation", "nine_switch", "cell", "drive"]),
    ("machine", &["control", "modulation", "nine_switch", "cell", "drive", "board", "protection"]),
    ("control", &["modulation", "nine_switch", "cell", "drive", "board", "protection", "recorder"]),
    ("modulation", &["control", "nine_switch", "cell", "drive", "board", "protection", "recorder"]),
    ("nine_switch", &["control", "modulation", "cell", "drive", "board", "protection", "recorder"]),
];

/// The sources of a room: a file, or all of a folder.
fn sources(path: &Path) -> Vec<PathBuf> {
    if path.is_file() {
        return vec![path.to_owned()];
    }
    let entries = std::fs::read_dir(path).unwrap().map(|entry| entry.unwrap().path());
    entries.flat_map(|entry| sources(&entry)).collect()
}

#[test]
fn control_and_modulation_know_neither_each_other_nor_who_uses_them() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for (room, never) in NEVER {
        let files = sources(&root.join(room));
        assert!(!files.is_empty(), "{room}");
        for file in files {
            let text = std::fs::read_to_string(&file).unwrap();
            // What stands in a document's link is no dependency.
            for (number, line) in
                text.lines().enumerate().filter(|(_, line)| !line.trim_start().starts_with("//"))
            {
                for other in never {
                    let named = line.contains(&format!("crate::{other}::"))
                        || line.contains(&format!("crate::{other};"));
                    assert!(!named, "{}:{}: {line}", file.display(), number + 1);
                }
            }
        }
    }
}
