//! What the devices ask of every pulse.

use crate::time::Clock;

/// What the inverter's devices ask of every pulse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Devices {
    /// Shortest pulse or pause of a device, in ticks, dead time included.
    pub min_pulse_ticks: u32,
    /// Dead time between the two devices of a leg, in ticks; the hardware inserts it.
    pub dead_time_ticks: u32,
    /// Length of the shortest carrier half, in ticks: half a period of the highest switching frequency.
    pub shortest_half_ticks: u32,
}

impl Devices {
    /// From times in ticks and the highest switching frequency in Hz. A half lasts two control periods at least, so
    /// that each has a command of its own: beyond a quarter of the control rate the devices switch less than they could.
    pub const fn new(
        min_pulse_ticks: u32,
        dead_time_ticks: u32,
        max_switching_hz: f32,
        clock: &Clock,
    ) -> Self {
        // One tick more than the quotient's whole part: never above the highest frequency.
        let half = (clock.ticks_per_s / (2.0 * max_switching_hz)) as u32 + 1;
        let commanded = 2 * clock.control_ticks;
        Self {
            min_pulse_ticks,
            dead_time_ticks,
            shortest_half_ticks: if half > commanded { half } else { commanded },
        }
    }
}
