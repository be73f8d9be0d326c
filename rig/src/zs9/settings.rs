//! The firmware's settings for a run, the same for the host's tasks and the image.

use crate::machine::Machine;
use crate::run::refused;
use anyhow::{Result, anyhow};
use tractive::drive::dual::Settings;
use tractive::machine::Tables;
use tractive::time::Clock;

/// Carrier period, in ticks.
pub fn carrier_ticks(clock: &Clock, carrier_hz: u32) -> u32 {
    (clock.ticks_per_s / carrier_hz as f32).round() as u32
}

/// The drive's settings for two machines of one kind, without a dead time.
pub fn drive(clock: Clock, carrier_hz: u32, tables: &Tables) -> Settings {
    Settings::new(clock, carrier_ticks(&clock, carrier_hz), tables)
}

/// The same with a dead time, in s.
pub fn with_dead_time(settings: Settings, dead_time_s: f64) -> Settings {
    let dead_time_ticks = (dead_time_s * f64::from(settings.clock.ticks_per_s)).round() as u32;
    Settings { dead_time_ticks, ..settings }
}

/// The check that a drive may start with these settings and this machine.
///
/// # Errors
/// Names the machine's key, and what control would need instead.
pub fn check(settings: &Settings, machine: &Machine) -> Result<()> {
    let parameters = &machine.folder.parameters;
    let Err(found) = settings.check(machine.tables) else { return Ok(()) };
    Err(match found.name {
        "ratings.dc_link_max_v" => anyhow!(
            "dc_link_max_v {}: must be at most {:.1} in the ZS9 with zs9_source_v {}: shoot-through makes no more of its source",
            parameters.dc_link_max_v,
            found.most,
            parameters.zs9_source_v
        ),
        "ratings.max_acceleration_rad_s2" => {
            let (inertia_kg_m2, most) = (parameters.rotor_inertia_kg_m2, found.most);
            anyhow!(
                "rotor_inertia_kg_m2 {inertia_kg_m2}: must be at least {:.4} with max_torque_nm {} in the ZS9: control follows no rotor that speeds up by more than {most:.0} rad/s², electrical",
                inertia_kg_m2 * f64::from(found.value / most),
                parameters.max_torque_nm
            )
        }
        _ => refused(found),
    })
}
