//! The firmware's settings for a run, the same for the host's tasks and the image.

use crate::machine::Machine;
use crate::plant::zs9::ZNetwork;
use crate::run::refused;
use anyhow::{Result, bail, ensure};
use std::path::Path;
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

/// The check that a drive may start with these settings and this machine, which has this name or is in this folder.
///
/// # Errors
/// Names the machine's file and key, and what control, or the plant, would need instead.
pub fn check(settings: &Settings, machine: &Machine, folder: &str) -> Result<()> {
    check_network(machine, folder)?;
    let parameters = &machine.folder.parameters;
    let Err(found) = settings.check(machine.tables) else { return Ok(()) };
    let (key, allowed) = match found.name {
        "ratings.dc_link_max_v" => (
            "dc_link_max_v",
            format!(
                "{}: must be at most {:.1} in the ZS9 with zs9_source_v {}: shoot-through makes no more of its source",
                parameters.dc_link_max_v, found.most, parameters.zs9_source_v
            ),
        ),
        "ratings.max_acceleration_rad_s2" => {
            let (inertia_kg_m2, most) = (parameters.rotor_inertia_kg_m2, found.most);
            let allowed = format!(
                "{inertia_kg_m2}: must be at least {:.4} with max_torque_nm {} in the ZS9: control follows no rotor that speeds up by more than {most:.0} rad/s², electrical",
                inertia_kg_m2 * f64::from(found.value / most),
                parameters.max_torque_nm
            );
            ("rotor_inertia_kg_m2", allowed)
        }
        "limits.source_min_v" => (
            "trip_dc_under_v",
            format!(
                "{}: must be above 0 in the ZS9, whose source has a trip level",
                parameters.trip_dc_under_v
            ),
        ),
        name => match NETWORK.iter().find(|(control, _)| *control == name) {
            Some((_, key)) => {
                (*key, format!("{}: must be from {} to {} in the ZS9", found.value, found.least, found.most))
            }
            None => return Err(refused(found)),
        },
    };
    bail!("{}{key} {allowed}", place(machine, folder, key))
}

/// Control's names of the network's parts, and the machine's keys.
const NETWORK: [(&str, &str); 3] = [
    ("link.inductance_h", "zs9_inductance_h"),
    ("link.resistance_ohm", "zs9_resistance_ohm"),
    ("link.capacitance_f", "zs9_capacitance_f"),
];

/// The check that the plant's steps resolve the network: it would not come to an end.
fn check_network(machine: &Machine, folder: &str) -> Result<()> {
    let network = ZNetwork::of(&machine.folder.parameters);
    let ZNetwork { inductance_h, resistance_ohm, capacitance_f } = network;
    let (least_hf, most_ohm) = network.resolved();
    let is_named = |key: &&str| machine.folder.parameters.names(key);
    let key =
        ["zs9_inductance_h", "zs9_capacitance_f"].into_iter().find(is_named).unwrap_or("zs9_inductance_h");
    ensure!(
        inductance_h * capacitance_f >= least_hf,
        "{}zs9_inductance_h {inductance_h:e} with zs9_capacitance_f {capacitance_f:e}: their product must be at least {least_hf:.1e} H·F: the rig's plant resolves no quicker network",
        place(machine, folder, key)
    );
    ensure!(
        resistance_ohm <= most_ohm,
        "{}zs9_resistance_ohm {resistance_ohm}: must be at most {most_ohm:.3} with zs9_inductance_h {inductance_h:e}: the rig's plant resolves no quicker network",
        place(machine, folder, "zs9_resistance_ohm")
    );
    Ok(())
}

/// The machine's file with the line of a key, if it has it, as a message begins.
pub fn place(machine: &Machine, folder: &str, key: &str) -> String {
    let line = machine.folder.parameters.line_of(key).map_or(String::new(), |line| format!(":{line}"));
    format!("{}{line}: ", Path::new(folder).join("machine.toml").display())
}
