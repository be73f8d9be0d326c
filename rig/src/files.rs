//! Files that are written whole or not at all.

use anyhow::{Context, Result};
use std::io::Write;
use std::path::Path;

/// Takes away a file that an earlier run has left.
pub fn forget(path: &Path) -> Result<()> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(error).with_context(|| path.display().to_string())
        }
        _ => Ok(()),
    }
}

/// A time rounded to a nanosecond, so that it prints short; ticks are 40 ns.
pub fn short_time(t_s: f64) -> f64 {
    (t_s * 1e9).round() / 1e9
}

/// Writes a CSV beside its place and moves it there when it is complete.
pub fn write_whole(
    path: &Path,
    fill: impl FnOnce(&mut csv::Writer<std::io::BufWriter<&std::fs::File>>) -> Result<()>,
) -> Result<()> {
    let folder = path.parent().unwrap_or(Path::new("."));
    let file = tempfile::NamedTempFile::new_in(folder).with_context(|| format!("{}", folder.display()))?;
    {
        let mut out = csv::Writer::from_writer(std::io::BufWriter::with_capacity(1 << 16, file.as_file()));
        fill(&mut out)?;
        out.flush()?;
    }
    publish(file, path)
}

/// Writes a text file whole or not at all.
pub fn write_text(path: &Path, text: &str) -> Result<()> {
    let folder = path.parent().unwrap_or(Path::new("."));
    let mut file =
        tempfile::NamedTempFile::new_in(folder).with_context(|| format!("{}", folder.display()))?;
    file.write_all(text.as_bytes())?;
    publish(file, path)
}

fn publish(file: tempfile::NamedTempFile, path: &Path) -> Result<()> {
    use std::os::unix::fs::PermissionsExt;
    file.as_file().set_permissions(std::fs::Permissions::from_mode(0o644))?;
    file.persist(path).with_context(|| format!("{}", path.display()))?;
    Ok(())
}
