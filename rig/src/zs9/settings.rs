//! The firmware's settings for a run: what the host's tasks and the image are told alike.

use tractive::drive::dual::Settings;
use tractive::time::Clock;

/// Carrier period, in ticks.
pub fn carrier_ticks(clock: &Clock, carrier_hz: u32) -> u32 {
    (clock.ticks_per_s / carrier_hz as f32).round() as u32
}

/// The drive's settings.
pub fn drive(clock: Clock, carrier_hz: u32) -> Settings {
    Settings::new(clock, carrier_ticks(&clock, carrier_hz))
}
