//! The files of a crate, by its `mod` declarations, as they are compiled for tests on the host.

use anyhow::{Context, Result};
use std::path::{Path, PathBuf};
use syn::{Attribute, Item};

/// The file and those of its modules, in their order; paths from `root` on.
pub fn files(root: &Path, file: &Path, out: &mut Vec<PathBuf>) -> Result<()> {
    let text = std::fs::read_to_string(root.join(file)).with_context(|| file.display().to_string())?;
    out.push(file.to_owned());
    let parsed = syn::parse_file(&text).with_context(|| file.display().to_string())?;
    let folder = match file.file_stem().and_then(|stem| stem.to_str()) {
        Some("lib" | "mod" | "main") | None => file.parent().unwrap_or(file).to_owned(),
        Some(_) => file.with_extension(""),
    };
    for item in parsed.items {
        let Item::Mod(module) = item else { continue };
        if module.content.is_some() || is_off(&module.attrs) {
            continue;
        }
        let name = module.ident.to_string();
        let (flat, nested) = (folder.join(format!("{name}.rs")), folder.join(&name).join("mod.rs"));
        files(root, if root.join(&flat).exists() { &flat } else { &nested }, out)?;
    }
    Ok(())
}

/// Conditions that no test on the host meets, without their spaces; and those that mark the tests themselves.
const OFF: [&str; 9] = [
    "(test)",
    "(all(test",
    "(loom)",
    "(target_os=\"none\")",
    "(all(target_os=\"none\"",
    "(target_arch=\"arm\")",
    "(all(not(loom),target_os=\"none\")",
    "(not(feature=\"optimal\"))",
    "(feature=\"defmt\")",
];

/// Code that is not compiled, or is a test's.
pub fn is_off(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        let text = quote::ToTokens::to_token_stream(&attribute.meta).to_string().replace(' ', "");
        text == "test"
            || text.strip_prefix("cfg").is_some_and(|cfg| OFF.iter().any(|off| cfg.starts_with(off)))
    })
}
