//! The folder of static files: the page as it is written, the library that draws, the wasm and its bindings.

use anyhow::{Context, Result, ensure};
use std::path::Path;
use wasm_bindgen_cli_support::Bindgen;

/// The largest wasm, in bytes.
const LARGEST_BYTES: u64 = 1_500_000;

/// Makes it. Fails where the wasm has grown beyond what is allowed.
pub fn make(wasm: &Path, out: &Path) -> Result<()> {
    let sources = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    std::fs::create_dir_all(out.join("vendor")).with_context(|| format!("--out {}", out.display()))?;
    for (from, to) in [("page", out.to_owned()), ("vendor", out.join("vendor"))] {
        let folder = sources.join(from);
        for entry in std::fs::read_dir(&folder).with_context(|| folder.display().to_string())? {
            let entry = entry?;
            std::fs::copy(entry.path(), to.join(entry.file_name()))?;
        }
    }
    Bindgen::new()
        .remove_name_section(true)
        .input_path(wasm)
        .out_name("tractive_live")
        .web(true)?
        .typescript(false)
        .generate(out)?;
    let bytes = std::fs::metadata(out.join("tractive_live_bg.wasm"))?.len();
    println!("{}: {bytes} bytes of wasm", out.display());
    ensure!(bytes <= LARGEST_BYTES, "the wasm has {bytes} bytes: at most {LARGEST_BYTES} are allowed");
    Ok(())
}
