//! The inputs that are kept in `fuzz/corpus`: they reach all that fuzzing has reached, and include all that it found.

/// Checks each input of a folder, given relative to the package's own.
pub fn each(folder: &str, check: impl Fn(&[u8])) {
    let entries = std::fs::read_dir(folder).unwrap_or_else(|error| panic!("{folder}: {error}"));
    let mut count = 0;
    for path in entries.map(|entry| entry.unwrap().path()) {
        let bytes = std::fs::read(&path).unwrap();
        // So that a failure names its file.
        println!("{}", path.display());
        check(&bytes);
        count += 1;
    }
    assert!(count >= 10, "{folder}: {count}");
}
