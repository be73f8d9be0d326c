//! Outputs that are pinned: files of hashes, one a line.

use std::path::Path;

/// The hash of nothing.
pub const BASIS: u64 = 0xcbf2_9ce4_8422_2325;

/// The hash with these bytes behind it: FNV-1a.
pub fn hash(sum: u64, bytes: &[u8]) -> u64 {
    bytes.iter().fold(sum, |sum, byte| (sum ^ u64::from(*byte)).wrapping_mul(0x100_0000_01b3))
}

/// Asserts that a text is the one of `tests/pinned/NAME.txt`; with `TRACTIVE_PINNED=write` it becomes that.
pub fn holds(name: &str, text: &str) {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/pinned").join(name).with_extension("txt");
    if std::env::var_os("TRACTIVE_PINNED").is_some_and(|word| word == "write") {
        std::fs::write(&file, text).unwrap();
    }
    let pinned = std::fs::read_to_string(&file).unwrap();
    for (now, pinned) in text.lines().zip(pinned.lines()) {
        assert_eq!(now, pinned, "{}: an output changed since the line before", file.display());
    }
    assert_eq!(text.lines().count(), pinned.lines().count(), "{}", file.display());
}
