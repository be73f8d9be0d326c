//! The ZS9's rates, and the settings that follow from them. The build script checks the power stage with these very lines.

use crate::rates::CORE_HZ;
use tractive::drive::dual::Settings;
use tractive::machine::Tables;
use tractive::time::Clock;

/// Cycles of the timers' clock in a tick of the drive's.
pub const CYCLES_PER_TICK: u32 = 5;

/// Control interrupts per second, in Hz.
pub const CONTROL_HZ: u32 = 10_000;

/// Carrier periods in a control period: 1 (10 kHz) or 2 (20 kHz).
pub const CARRIERS_PER_CONTROL: u32 = 1;

/// 34 MHz ticks; control at 10 kHz.
pub const CLOCK: Clock = {
    let ticks_per_s = CORE_HZ / CYCLES_PER_TICK;
    assert!(ticks_per_s * CYCLES_PER_TICK == CORE_HZ && ticks_per_s.is_multiple_of(CONTROL_HZ));
    Clock::new(ticks_per_s, ticks_per_s / CONTROL_HZ)
};

/// The carrier's period, in ticks.
pub const CARRIER_TICKS: u32 = {
    let ticks = CLOCK.control_ticks / CARRIERS_PER_CONTROL;
    assert!(ticks * CARRIERS_PER_CONTROL == CLOCK.control_ticks && ticks.is_multiple_of(2) && ticks <= 4_000);
    ticks
};

/// Cycles of the timers' clock from a valley to a peak.
pub const HALF_CYCLES: u16 = {
    let cycles = CARRIER_TICKS / 2 * CYCLES_PER_TICK;
    assert!(cycles < u16::MAX as u32);
    cycles as u16
};

/// The settings of the drive's tasks for two identical machines, with a source behind a line filter or not.
pub const fn settings(tables: &Tables, behind_line_filter: bool) -> Settings {
    Settings::new(CLOCK, CARRIER_TICKS, tables).behind_line_filter(behind_line_filter, tables)
}
