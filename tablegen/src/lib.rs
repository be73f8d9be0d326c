//! Reads a machine folder, refuses what is wrong, and makes the tables that `tractive` runs on.
//!
//! Used by `build.rs`, which writes the tables out as Rust, and by the rig, which makes them at run time.
#![forbid(unsafe_code)]

mod error;
mod generated;
mod map;
mod optimum;
mod parameters;
mod rust_source;
mod smooth;
mod weakening;

use std::path::Path;

pub use error::InputError;
pub use generated::{Axis, Generated, RatingsF32};
pub use map::FluxMap;
pub use optimum::Optimum;
pub use parameters::Parameters;
pub use smooth::{FluxPoint, SmoothMap};

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
        let parameters = Parameters::read(&folder.join("machine.toml"))?;
        let map = FluxMap::read(&folder.join("flux_map.csv"))?;
        map.check_range(parameters.max_current_a, &folder.join("flux_map.csv"))?;
        let machine = Self { parameters, map };
        machine.check_torque(&folder.join("machine.toml"))?;
        Ok(machine)
    }

    /// The largest torque must be within reach of the largest current.
    fn check_torque(&self, file: &Path) -> Result<(), InputError> {
        let parameters = &self.parameters;
        let smooth = SmoothMap::new(&self.map);
        let reach = Optimum::new(&smooth, parameters).most_torque_nm();
        if parameters.max_torque_nm > reach {
            return Err(InputError::new(
                file,
                parameters.line_of("max_torque_nm"),
                format!(
                    "max_torque_nm: {}: must be at most {reach:.1}, what the flux map gives at max_current_a {}",
                    parameters.max_torque_nm, parameters.max_current_a
                ),
            ));
        }
        Ok(())
    }
}
