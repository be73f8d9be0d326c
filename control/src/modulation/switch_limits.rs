//! Limits of the switches, which every pulse keeps.

use crate::time::Clock;

/// Highest frequency of the free carrier, as a share of the switches', if an optimised pattern follows it: the pattern's first edges may come
/// half a carrier early.
pub const FREE_CARRIER_SHARE: f32 = 0.99;

/// Limits of the inverter's switches, which every pulse keeps.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SwitchLimits {
    /// Shortest pulse or pause of a device, in ticks, dead time included.
    pub min_pulse_ticks: u32,
    /// Dead time between the two devices of a leg, in ticks; the hardware inserts it.
    pub dead_time_ticks: u32,
    /// Length of the shortest carrier half, in ticks: half a period of the highest switching frequency. A half that is locked to the angle may be shorter
    /// while it makes up for an angle.
    pub shortest_half_ticks: u32,
}

impl SwitchLimits {
    /// Limits from times in ticks and the highest switching frequency in Hz, which is at most the control rate.
    pub const fn new(
        min_pulse_ticks: u32,
        dead_time_ticks: u32,
        max_switching_hz: f32,
        clock: &Clock,
    ) -> Self {
        // One tick more than the quotient's whole part: never above the highest frequency.
        let half = ((clock.ticks_per_s / (2.0 * max_switching_hz)) as u32).saturating_add(1);
        Self { min_pulse_ticks, dead_time_ticks, shortest_half_ticks: half }
    }

    /// The least value of [`SwitchLimits::longest_half_ticks`], in shortest halves.
    pub const LEAST_RANGE: u32 = 4;

    /// Length of the longest carrier half, in ticks: that of a stopped carrier that is locked to the angle. Modes are locked from 1/23.7 of the highest
    /// switching frequency up; there the longest half that leads the flux linkage to a pattern, over 135°, lasts 17.8 of the shortest. The limit is 20 of them
    /// as far as timers of 16 bits count, but 4 at least.
    pub const fn longest_half_ticks(&self) -> u32 {
        const COUNTED: u32 = 65_000;
        let half = self.shortest_half_ticks;
        let (most, least) = (half.saturating_mul(20), half.saturating_mul(Self::LEAST_RANGE));
        if most < COUNTED {
            most
        } else if least < COUNTED {
            COUNTED
        } else {
            least
        }
    }
}
