//! Files of a machine folder, read whole but with a size limit.

use std::io::{Error, Read, Result};
use std::path::Path;

/// Largest file that is read, in bytes: a flux map of a quarter of a million nodes.
const LARGEST_BYTES: u64 = 16 << 20;

/// Bytes of a regular file.
///
/// # Errors
/// If it cannot be read, is a device, a pipe or a folder, or is longer than 16 MiB.
pub fn read_bounded(file: &Path) -> Result<Vec<u8>> {
    // Checked before it is opened: opening a pipe waits for its writer.
    if !std::fs::metadata(file)?.is_file() {
        return Err(Error::other("must be a regular file"));
    }
    let mut bytes = Vec::new();
    std::fs::File::open(file)?.take(LARGEST_BYTES + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > LARGEST_BYTES {
        return Err(Error::other(format!("must be at most {LARGEST_BYTES} bytes long")));
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_may_be_as_long_as_the_limit() {
        let file = tempfile::NamedTempFile::new().unwrap();
        for (bytes, good) in [(LARGEST_BYTES, true), (LARGEST_BYTES + 1, false)] {
            file.as_file().set_len(bytes).unwrap();
            assert_eq!(read_bounded(file.path()).is_ok(), good, "{bytes}");
        }
    }
}
