//! A machine folder written whole or not at all.

use crate::files::check_folder;
use crate::platform::written_folder;
use anyhow::{Context, Result};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use tractive_tablegen::{FluxMap, MachineFolder};

/// The two files.
pub struct Contents {
    /// `machine.toml`.
    pub toml: String,
    /// `flux_map.csv`.
    pub map: String,
}

const FILES: [&str; 2] = ["machine.toml", "flux_map.csv"];

/// Writes a folder beside its place, lets the table generator read it and the drive check its tables, and moves it there.
///
/// # Errors
/// If the place is taken by anything but a machine folder, the generator or the drive refuses the contents, or it cannot be written.
pub fn folder(out: &Path, contents: &Contents) -> Result<()> {
    let taken = check_place(out)?;
    let fill = |folder: &Path| {
        for (name, text) in FILES.iter().zip([&contents.toml, &contents.map]) {
            std::fs::write(folder.join(name), text)?;
        }
        let read = MachineFolder::read(folder).map_err(|error| {
            // The user never sees the file: its key and what is allowed matter.
            let file = error.file.file_name().unwrap_or_default().to_string_lossy().into_owned();
            anyhow::anyhow!("the table generator refuses the {file} of these values: {}", error.problem)
        })?;
        read.tables().check().map_err(|refused| {
            let why = match (refused.name, refused.value < refused.least) {
                ("weakening.flux_knee_wb", true) => {
                    "; the link has more than a thousand times the voltage that the largest speed needs"
                }
                ("weakening.flux_knee_wb", false) => {
                    "; are inductances in H, flux linkages in Wb? The link has a hundredth of their voltage"
                }
                ("ratings.max_acceleration_rad_s2", false) => {
                    "; the rotor's inertia (`--inertia`) is too small for its torque"
                }
                _ => "",
            };
            anyhow::anyhow!("the drive refuses the tables of these values: {refused}{why}")
        })
    };
    written_folder(out, taken, fill)
}

/// Checks that the place is free, an empty folder, or, which gives `true`, a machine folder.
///
/// # Errors
/// If anything else is there, or a file is in its way.
pub fn check_place(out: &Path) -> Result<bool> {
    check_folder(out)?;
    if !out.exists() {
        return Ok(false);
    }
    let entries = std::fs::read_dir(out).and_then(|entries| {
        entries.map(|entry| Ok(PathBuf::from(entry?.file_name()))).collect::<std::io::Result<Vec<_>>>()
    });
    let entries = entries.with_context(|| format!("--out {}", out.display()))?;
    let other = entries.iter().find(|name| FILES.iter().all(|file| name.as_path() != Path::new(file)));
    if let Some(other) = other {
        anyhow::bail!(
            "--out {}: holds {}: must be a new or empty folder, or one with nothing but {}",
            out.display(),
            other.display(),
            FILES.join(" and ")
        );
    }
    Ok(!entries.is_empty())
}

/// `machine.toml` for a machine's name: a line for each key, with its value and the value's origin, below the command that made it. A value that is
/// not a number is left out.
pub fn toml(name: &str, command: &str, lines: &[(&str, f64, &str)]) -> String {
    let mut text = format!(
        "# Made by: cargo rig {command}\n# Currents and voltages of phases are peak values.\nname = {name:?}\n\n"
    );
    for (key, value, from) in lines.iter().filter(|(_, value, _)| !value.is_nan()) {
        let pair = format!("{key} = {value}");
        let _ = writeln!(text, "{pair:<40}# {from}");
    }
    text
}

/// `flux_map.csv` of a map with both signs of iq, after `#` comment lines; the file holds iq from 0 on.
pub fn csv(map: &FluxMap, comments: &str) -> String {
    let mut text = format!("{comments}id_a,iq_a,psi_d_wb,psi_q_wb\n");
    let columns = map.iq_a.len();
    for (row, id) in map.id_a.iter().enumerate() {
        for (column, iq) in map.iq_a.iter().enumerate().filter(|(_, iq)| **iq >= 0.0) {
            let node = row * columns + column;
            let _ = writeln!(text, "{id},{iq},{},{}", map.psi_d_wb[node], map.psi_q_wb[node]);
        }
    }
    text
}

/// The nearest number with nine digits, so that it prints short.
pub fn digits(value: f64) -> f64 {
    // Adding zero turns −0 into 0.
    format!("{value:.8e}").parse::<f64>().unwrap_or(value) + 0.0
}
