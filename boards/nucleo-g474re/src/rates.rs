//! The chip's rates, and the PMaSynRM's settings that follow from them. The build script checks the power stage with these very lines.

use tractive::control::Gains;
use tractive::drive::traction::Settings;
use tractive::modulation::SwitchLimits;
use tractive::time::Clock;

/// The timers' undivided clock, in Hz.
pub const CORE_HZ: u32 = 170_000_000;

/// Most cycles of the undivided clock in a tick of both timers, so that 16 bits hold the halves of slow carriers.
const COARSEST: u16 = 8;

/// Most cycles that the control interrupt takes, by the upper bound of `docs/cost.md`.
pub const CONTROL_CYCLES: u32 = 5_230;

/// Additional cycles of the control interrupt when it damps a line filter: its 77 instructions, at slightly more than two cycles each.
pub const DAMPING_CYCLES: u32 = 170;

/// Most cycles that the PWM interrupt takes, by the same bound.
pub const PWM_CYCLES: u32 = 590;

/// Share of the processor that both interrupts may take if each took its longest time. The rest is left for the operator.
pub const LOAD: f64 = 0.92;

/// Cycles of the undivided clock in a tick of both timers at a control rate, in Hz: the most, up to 8, that divide a control period.
pub const fn prescaler(control_hz: u32) -> u16 {
    let mut prescaler = COARSEST;
    while !(CORE_HZ / control_hz).is_multiple_of(prescaler as u32) {
        prescaler -= 1;
    }
    prescaler
}

/// The timers' clock at a control rate, in Hz, of which [`CORE_HZ`] is a multiple. 21.25 MHz at 10 kHz, 34 MHz at 20 kHz.
pub const fn clock(control_hz: u32) -> Clock {
    let ticks_per_s = CORE_HZ / prescaler(control_hz) as u32;
    Clock::new(ticks_per_s, ticks_per_s / control_hz)
}

/// The longest half, in ticks: a compare of 65,535 must lie beyond the counter's last value.
pub const LONGEST_HALF_TICKS: u32 = 65_535;

/// A time in ns as cycles of [`CORE_HZ`], rounded up.
pub const fn ns_to_cycles(ns: u32) -> u32 {
    (ns as u64 * CORE_HZ as u64).div_ceil(1_000_000_000) as u32
}

/// Cycles as ticks of the prescaled timers, rounded up.
pub const fn cycles_to_ticks(cycles: u32, prescaler: u16) -> u32 {
    cycles.div_ceil(prescaler as u32)
}

/// The PMaSynRM's settings for this control rate, these times of the power stage and this highest switching frequency of its devices; if the link is
/// behind a line filter, it is damped.
pub const fn settings(
    control_hz: u32,
    min_pulse_ns: u32,
    dead_time_ns: u32,
    max_switching_hz: f32,
    behind_line_filter: bool,
) -> Settings {
    let (clock, prescaler) = (clock(control_hz), prescaler(control_hz));
    let min_pulse_ticks = cycles_to_ticks(ns_to_cycles(min_pulse_ns), prescaler);
    let dead_time_ticks = cycles_to_ticks(ns_to_cycles(dead_time_ns), prescaler);
    let devices = SwitchLimits::new(min_pulse_ticks, dead_time_ticks, max_switching_hz, &clock);
    Settings { gains: Gains::of(false, behind_line_filter), ..Settings::new(clock, devices) }
}
