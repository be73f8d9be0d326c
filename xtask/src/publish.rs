//! The crates that a user takes, as a registry would get them: packed, unpacked, and checked from the packages alone.
//!
//! This is what `cargo publish --dry-run` does, except for asking the registry, which needs a network. Cargo's own check of several packages keeps a
//! package of the same version that it has seen before; here each package takes the others from where they were just unpacked.

use crate::build::{cargo_with, root};
use crate::process::succeeds;
use anyhow::{Context, Result, ensure};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The crates, each after those that it depends on.
const CRATES: [&str; 3] = ["tractive-control", "tractive-tablegen", "tractive"];

/// Files that every package holds.
const OF_EACH: [&str; 3] = ["README.md", "LICENSE-APACHE", "LICENSE-MIT"];

/// Additional files of `tractive`, for its feature `built-in`, which is not built here.
const OF_BUILT_IN: [&str; 3] =
    ["build.rs", "tables/pmasynrm-180kw/flux_map.csv", "tables/ipm-zs9/machine.toml"];

/// Packs and checks them.
pub fn check() -> Result<bool> {
    // Work in progress is packed as well.
    let mut pack = cargo_with("package --no-verify --offline --allow-dirty --quiet");
    pack.args(CRATES.iter().flat_map(|name| ["--package", name]));
    if !succeeds(&mut pack)? {
        return Ok(false);
    }
    let packages = root().join("target/package");
    let (mut members, mut patch) = (String::new(), String::new());
    for name in CRATES {
        let folder = unpack(&packages, name)?;
        for file in OF_EACH.iter().chain(OF_BUILT_IN.iter().filter(|_| name == "tractive")) {
            ensure!(folder.join(file).is_file(), "{name}'s package holds no {file}");
        }
        members += &format!("{folder:?}, ");
        patch += &format!("{name} = {{ path = {folder:?} }}\n");
    }
    let workspace =
        format!("[workspace]\nresolver = \"3\"\nmembers = [{members}]\n\n[patch.crates-io]\n{patch}");
    std::fs::write(packages.join("Cargo.toml"), workspace)?;
    std::fs::copy(root().join("Cargo.lock"), packages.join("Cargo.lock"))?;
    // With the macros that other steps have compiled.
    let mut check =
        cargo_with("check --release --workspace --offline --quiet --features tractive/wire --target-dir");
    check.arg(root().join("target")).current_dir(&packages);
    succeeds(&mut check)
}

/// Unpacks a crate's archive, and returns where.
fn unpack(packages: &Path, name: &str) -> Result<PathBuf> {
    let folder = packages.join(format!("{name}-{}", env!("CARGO_PKG_VERSION")));
    if folder.exists() {
        std::fs::remove_dir_all(&folder)?;
    }
    let archive = PathBuf::from(format!("{}.crate", folder.display()));
    let bytes = std::fs::metadata(&archive).with_context(|| archive.display().to_string())?.len();
    println!("{name}: {} kB packed", bytes / 1_000);
    // With the present time: all files in a package have the same time, whatever they contain, and cargo looks at it.
    let mut tar = Command::new("tar");
    tar.arg("-xmzf").arg(&archive).arg("-C").arg(packages);
    ensure!(succeeds(&mut tar)?, "{} is no archive", archive.display());
    Ok(folder)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::Value;

    fn packages() -> Vec<Value> {
        let metadata = cargo_with("metadata --format-version 1 --no-deps").output().unwrap();
        let metadata: Value = serde_json::from_slice(&metadata.stdout).unwrap();
        metadata["packages"].as_array().unwrap().clone()
    }

    #[test]
    fn what_a_user_takes_says_what_a_registry_asks() {
        let mut taken = Vec::new();
        for package in packages() {
            let name = package["name"].as_str().unwrap().to_owned();
            if package["publish"].is_array() {
                continue;
            }
            for key in ["description", "license", "readme", "documentation", "rust_version"] {
                assert!(package[key].is_string(), "{name}: {key}");
            }
            for key in ["keywords", "categories"] {
                let count = package[key].as_array().unwrap().len();
                assert!((1..=5).contains(&count), "{name}: {count} {key}");
            }
            assert!(package["metadata"]["docs"]["rs"].is_object(), "{name}: how docs.rs builds it");
            for dependency in package["dependencies"].as_array().unwrap() {
                // Tests' dependencies without a version are left out of the package.
                let unversioned = dependency["req"] == "*" && dependency["kind"] != "dev";
                assert!(!unversioned, "{name}: {} has no version", dependency["name"]);
            }
            taken.push(name);
        }
        taken.sort_unstable();
        let mut expected = CRATES;
        expected.sort_unstable();
        assert_eq!(taken, expected);
    }
}
