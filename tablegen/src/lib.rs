//! Reads a machine folder, rejects invalid input, and makes the tables that `tractive` runs on.
//!
//! A build script writes the tables out as Rust:
//!
//! ```no_run
//! # fn main() -> Result<(), tractive_tablegen::InputError> {
//! let out = std::env::var_os("OUT_DIR").unwrap_or_default();
//! tractive_tablegen::build("machine", std::path::Path::new(&out).join("machine.rs"), "tractive::machine")
//! # }
//! ```
//!
//! and the firmware includes them with `mod machine { include!(concat!(env!("OUT_DIR"), "/machine.rs")); }`. A program on a host makes them at run
//! time, with [`MachineFolder::tables`].
#![cfg_attr(not(test), deny(clippy::disallowed_methods))]
#![forbid(unsafe_code)]

mod axis;
mod demagnetisation;
mod error;
mod input;
mod iron;
mod map;
mod optimum;
mod parameters;
#[cfg(feature = "patterns")]
pub mod patterns;
mod rust_source;
mod smooth;
mod tables;
#[cfg(test)]
mod testing;
mod weakening;
mod weakening_tables;

use std::path::{Path, PathBuf};

pub use error::InputError;
pub use input::read_bounded;
pub use iron::Iron;
pub use map::{FluxMap, line_of};
pub use optimum::Optimum;
pub use parameters::{Parameters, Patterns, TWO_LEVEL_SHARE};
pub use rust_source::rust_source;
pub use smooth::{FluxPoint, SmoothMap};

/// Reads and checks the machine `folder`, writes its tables as Rust into `file`, and makes cargo rebuild them when the folder changes. For build
/// scripts; `types` is as in [`rust_source`].
///
/// # Errors
/// As [`MachineFolder::read`], or the reason why the file could not be written.
pub fn build(folder: impl AsRef<Path>, file: impl AsRef<Path>, types: &str) -> Result<(), InputError> {
    let (folder, file) = (folder.as_ref(), file.as_ref());
    println!("cargo:rerun-if-changed={}", folder.display());
    let source = rust_source(&MachineFolder::read(folder)?.tables(), types);
    std::fs::write(file, source).map_err(|error| InputError::new(file, None, error.to_string()))
}

/// A machine folder: `machine.toml` and `flux_map.csv`.
#[derive(Clone, Debug)]
pub struct MachineFolder {
    /// Ratings, limits, losses.
    pub parameters: Parameters,
    /// The flux map's nodes.
    pub map: FluxMap,
}

impl MachineFolder {
    /// Reads and checks a folder.
    ///
    /// # Errors
    /// Names file, line, field, value and what is allowed, for whatever is missing, unknown, not a number, out of
    /// range or contradictory.
    pub fn read(folder: &Path) -> Result<Self, InputError> {
        let files = [folder.join("machine.toml"), folder.join("flux_map.csv")];
        Self { parameters: Parameters::read(&files[0])?, map: FluxMap::read(&files[1])? }.checked(&files)
    }

    /// The same from the text of the two files: for a program that has no file system.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn parse(machine_toml: &str, flux_map_csv: &str) -> Result<Self, InputError> {
        let files = ["machine.toml", "flux_map.csv"].map(PathBuf::from);
        let parameters = Parameters::parse(machine_toml, &files[0])?;
        let map = FluxMap::parse(flux_map_csv.as_bytes(), &files[1])?;
        Self { parameters, map }.checked(&files)
    }

    /// Checks that parameters and map fit each other.
    fn checked(self, [machine_toml, flux_map_csv]: &[PathBuf; 2]) -> Result<Self, InputError> {
        self.map.check_range(self.parameters.max_current_a, flux_map_csv)?;
        demagnetisation::check(&self, machine_toml)?;
        self.check_torque(machine_toml)?;
        Ok(self)
    }

    /// Checks that the largest torque is within reach of the largest current, and that its best point is on the map.
    fn check_torque(&self, file: &Path) -> Result<(), InputError> {
        let parameters = &self.parameters;
        let smooth = SmoothMap::new(&self.map);
        let optimum = Optimum::new(&smooth, parameters);
        let reach = optimum.most_torque_nm();
        let refuse = |allowed: String| {
            let problem = format!("max_torque_nm: {}: must be {allowed}", parameters.max_torque_nm);
            Err(InputError::new(file, parameters.line_of("max_torque_nm"), problem))
        };
        if parameters.max_torque_nm > reach {
            return refuse(format!(
                "at most {reach:.1}, what the flux map gives at max_current_a {}",
                parameters.max_current_a
            ));
        }
        let (id, iq) = optimum.least_current(parameters.max_torque_nm);
        let last = self.map.id_a[self.map.id_a.len() - 1];
        if id > last {
            return refuse(format!(
                "reachable with least current at id up to {last}, not at id {id:.1}, iq {iq:.1}: d must lie along the magnets, or along the higher reluctance"
            ));
        }
        Ok(())
    }
}
