//! The machines of the page.

use anyhow::{Result, bail};
use tractive::built_in::{traction, zs9};
use tractive_rig::machine::Machine;
use tractive_tablegen::MachineFolder;

/// The machine of this name in `tables/`, with the built-in tables if they belong to it.
pub fn named(name: &str) -> Result<Machine> {
    macro_rules! folder {
        ($name:literal) => {
            MachineFolder::parse(
                include_str!(concat!("../../tables/", $name, "/machine.toml")),
                include_str!(concat!("../../tables/", $name, "/flux_map.csv")),
            )
        };
    }
    let (folder, tables) = match name {
        "pmasynrm-180kw" => (folder!("pmasynrm-180kw")?, Some(&traction::BUILT_IN)),
        "ipm-zs9" => (folder!("ipm-zs9")?, Some(&zs9::BUILT_IN)),
        "pmsm-48v-1kw" => (folder!("pmsm-48v-1kw")?, None),
        _ => bail!("there is no machine `{name}` in the page"),
    };
    // Made anew at each start of a machine that is not built in, a few kilobytes.
    let tables = tables.unwrap_or_else(|| Box::leak(Box::new(folder.tables())));
    Ok(Machine { folder, tables })
}
