//! The firmware's settings for a run: what the host's tasks and the image are told alike.

use crate::machine::Machine;
use crate::run::refused;
use anyhow::{Result, anyhow};
use tractive::drive::dual::{MOST_ACCELERATION_RAD_S2, Settings};
use tractive::time::Clock;

/// Carrier period, in ticks.
pub fn carrier_ticks(clock: &Clock, carrier_hz: u32) -> u32 {
    (clock.ticks_per_s / carrier_hz as f32).round() as u32
}

/// The drive's settings; without a dead time.
pub fn drive(clock: Clock, carrier_hz: u32) -> Settings {
    Settings::new(clock, carrier_ticks(&clock, carrier_hz))
}

/// The same with a dead time, in s.
pub fn with_dead_time(settings: Settings, dead_time_s: f64) -> Settings {
    let dead_time_ticks = (dead_time_s * f64::from(settings.clock.ticks_per_s)).round() as u32;
    Settings { dead_time_ticks, ..settings }
}

/// The check that a drive may start with these settings and this machine.
///
/// # Errors
/// Names the machine's key, and what control would need.
pub fn check(settings: &Settings, machine: &Machine) -> Result<()> {
    let parameters = &machine.folder.parameters;
    let torque_nm = parameters.max_torque_nm;
    let Err(found) = settings.check(machine.tables) else { return Ok(()) };
    Err(match found.name {
        "speed.inertia_kg_m2" => {
            let least_nm = torque_nm * f64::from(found.value / found.most);
            anyhow!(
                "max_torque_nm {torque_nm}: must be at least {least_nm:.2} in the ZS9: its speed loops are made for {} kg·m² and would ask for more",
                settings.speed.inertia_kg_m2
            )
        }
        "ratings.max_acceleration_rad_s2" => {
            let inertia_kg_m2 = parameters.rotor_inertia_kg_m2;
            let least_kg_m2 = inertia_kg_m2 * f64::from(found.value / found.most);
            anyhow!(
                "rotor_inertia_kg_m2 {inertia_kg_m2}: must be at least {least_kg_m2:.4} with max_torque_nm {torque_nm} in the ZS9: a rotor that speeds up by more than {MOST_ACCELERATION_RAD_S2:.0} rad/s², electrical, is taken for an angle sensor that fails"
            )
        }
        _ => refused(found),
    })
}
