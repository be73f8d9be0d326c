//! The chip's rates, and the PMaSynRM's settings that follow from them. The build script checks the power stage with these very lines.

use tractive::control::Gains;
use tractive::drive::traction::Settings;
use tractive::modulation::SwitchLimits;
use tractive::time::Clock;

/// The timers' undivided clock, in Hz.
pub const CORE_HZ: u32 = 170_000_000;

/// Cycles of the undivided clock in a tick of both timers.
pub const PRESCALER: u16 = 8;

/// Control interrupts per second, in Hz.
const CONTROL_HZ: u32 = 10_000;

/// 21.25 MHz ticks; control at 10 kHz.
pub const CLOCK: Clock = {
    let ticks_per_s = CORE_HZ / PRESCALER as u32;
    assert!(ticks_per_s * PRESCALER as u32 == CORE_HZ && ticks_per_s.is_multiple_of(CONTROL_HZ));
    Clock::new(ticks_per_s, ticks_per_s / CONTROL_HZ)
};

/// The longest half, in ticks: a compare of 65,535 must lie beyond the counter's last value.
pub const LONGEST_HALF_TICKS: u32 = 65_535;

/// Halves of the lowest carrier in one of the highest.
pub const CARRIER_RANGE: u32 = 4;

/// A time in ns as cycles of [`CORE_HZ`], rounded up.
pub const fn ns_to_cycles(ns: u32) -> u32 {
    (ns as u64 * CORE_HZ as u64).div_ceil(1_000_000_000) as u32
}

/// Cycles as ticks of the prescaled timers, rounded up.
pub const fn cycles_to_ticks(cycles: u32, prescaler: u16) -> u32 {
    cycles.div_ceil(prescaler as u32)
}

/// The PMaSynRM's settings for these times of the power stage and this highest switching frequency of its devices.
pub const fn settings(min_pulse_ns: u32, dead_time_ns: u32, max_switching_hz: f32) -> Settings {
    let min_pulse_ticks = cycles_to_ticks(ns_to_cycles(min_pulse_ns), PRESCALER);
    let dead_time_ticks = cycles_to_ticks(ns_to_cycles(dead_time_ns), PRESCALER);
    Settings {
        clock: CLOCK,
        devices: SwitchLimits::new(min_pulse_ticks, dead_time_ticks, max_switching_hz, &CLOCK),
        gains: Gains::DEFAULT,
    }
}
