//! The firmware's settings for a run: what the host's tasks and the image are told alike.

use tractive::drive::dual::Settings;
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
