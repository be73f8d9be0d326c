//! The power stage that is wired to the board: every scale and time of it, from `power_stage.toml`.

use super::dead_time::DeadTime;
use super::patterns;
use super::rates;
pub use super::rates::{CORE_HZ, cycles_to_ticks, ns_to_cycles};
use super::start::StartError;
use tractive::drive::traction::{Drops, Settings};
use tractive::frames::Angle;
use tractive::machine::Ratings;
use tractive::operator::LineTimes;
#[allow(unused_imports, reason = "a stage without temperature sensors has none of them")]
use tractive::thermal::Element::{Ntc, Pt1000};
#[allow(unused_imports, reason = "the same")]
use tractive::thermal::{Derating, DeviceLosses, Magnets, Rise, Sensor, Thermal};
use tractive::time::Clock;

/// The power stage and its sensors.
#[derive(Clone, Copy, Debug)]
pub struct PowerStage {
    /// Control interrupts per second, in Hz.
    pub control_hz: u32,
    /// Least time between the turn-off of one device of a leg and the turn-on of the other, in ns.
    pub dead_time_ns: u32,
    /// Shortest pulse or pause of a device, dead time included, in ns.
    pub min_pulse_ns: u32,
    /// Current sensors: A per code of the 12-bit converter; positive into the machine.
    pub current_a_per_code: f32,
    /// Code at no current, nominally; the code measured at the start is used, and may differ by [`Self::zero_tolerance`].
    pub zero_code: u16,
    /// Farthest that a measured zero may lie from the nominal one, in codes.
    pub zero_tolerance: u16,
    /// Link voltage divider: V per code; code 0 is 0 V.
    pub udc_v_per_code: f32,
    /// Phase current, of either sign, at which the comparators turn the gates off, in A. It lies above the drive's own trip level, so that a fault
    /// which software can still catch gets its name.
    pub break_current_a: f32,
    /// Counts of the position sensor per mechanical turn: for an encoder four times its lines, 4 ..= 65,536.
    pub encoder_counts: u32,
    /// Levels of an encoder's tracks A and B while its index counts, as two bits, 0b00 ..= 0b11.
    pub encoder_index_ab: u8,
    /// Electrical angle of the d axis at the encoder's index, or where the sensor says 0.
    pub encoder_zero: Angle,
    /// The line side's time constants.
    pub line: LineTimes,
    /// `true` if a choke lies between the line and the link: the drive then damps the link.
    pub behind_line_filter: bool,
    /// Age of the angle when it is read, in s, for which the drive compensates.
    pub angle_late_s: f32,
    /// Time constant of the current sensors' filter, in s, for which the drive compensates.
    pub current_filter_s: f32,
    /// Drops of the devices, for which the drive compensates, too.
    pub drops: Drops,
    /// Temperature sensors, and the thermal behaviour of what they are mounted on; `None`: there are none.
    pub thermal: Option<Thermal>,
}

/// The PMaSynRM's, `power_stage.toml`, which the build script has checked against the machine.
pub const POWER_STAGE: PowerStage = include!(concat!(env!("OUT_DIR"), "/power_stage.rs"));

/// Its temperature sensors.
pub static THERMAL: Option<Thermal> = POWER_STAGE.thermal;

/// The PMaSynRM's clock, for both timers.
pub const CLOCK: Clock = rates::clock(POWER_STAGE.control_hz);

/// Cycles of the undivided clock in one of its ticks.
pub const PRESCALER: u16 = rates::prescaler(POWER_STAGE.control_hz);

impl PowerStage {
    /// The PMaSynRM's settings with this stage and this machine.
    pub const fn settings(&self, ratings: &Ratings) -> Settings {
        let Self {
            control_hz,
            min_pulse_ns,
            dead_time_ns,
            behind_line_filter,
            angle_late_s,
            current_filter_s,
            drops,
            encoder_counts,
            ..
        } = *self;
        let carrier_hz = patterns::FREE_CARRIER_SHARE * ratings.max_switching_hz;
        let settings =
            rates::settings(control_hz, min_pulse_ns, dead_time_ns, carrier_hz, behind_line_filter);
        let angle_step_rad = Settings::step_rad(encoder_counts, ratings.pole_pairs);
        let current_filter_ticks = (current_filter_s * settings.clock.ticks_per_s + 0.5) as u32;
        let iron_share = ratings.iron_share;
        Settings { angle_late_s, angle_step_rad, current_filter_ticks, drops, iron_share, ..settings }
    }

    /// The dead time for the generator, never shorter than requested; `None` if the generator cannot make it.
    pub const fn dead_time(&self) -> Option<DeadTime> {
        DeadTime::at_least(ns_to_cycles(self.dead_time_ns))
    }

    /// A current sensor's measured zero, unless it is too far from the nominal one.
    pub fn check_zero(&self, zero: AdcCode) -> Result<AdcCode, StartError> {
        let near = zero.0.abs_diff(self.zero_code) <= self.zero_tolerance;
        if near { Ok(zero) } else { Err(StartError::CurrentSensor { code: zero.0 }) }
    }

    /// Codes between which the phase currents stay as long as the comparators do not trip.
    pub fn break_codes(&self) -> (u16, u16) {
        let away = (self.break_current_a / self.current_a_per_code) as u16;
        (self.zero_code.saturating_sub(away), self.zero_code.saturating_add(away).min(4_095))
    }
}

/// A code of the 12-bit converters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AdcCode(pub u16);

impl AdcCode {
    /// As a phase current in A; `zero` is the code at no current.
    #[inline]
    pub fn current_a(self, zero: AdcCode) -> f32 {
        self.above(zero) * POWER_STAGE.current_a_per_code
    }

    /// Number of codes above another one.
    #[inline]
    pub fn above(self, zero: AdcCode) -> f32 {
        (i32::from(self.0) - i32::from(zero.0)) as f32
    }

    /// As the link voltage in V.
    #[inline]
    pub fn udc_v(self) -> f32 {
        f32::from(self.0) * POWER_STAGE.udc_v_per_code
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_never_shorter_than_asked_for() {
        assert_eq!(ns_to_cycles(5_000), 850);
        assert_eq!(ns_to_cycles(1), 1);
        assert_eq!(cycles_to_ticks(850, 8), 107);
        let cycles = POWER_STAGE.dead_time().unwrap().cycles();
        assert!((850..=858).contains(&cycles), "{cycles}");
    }

    #[test]
    fn the_comparators_watch_both_signs_inside_the_sensors_range() {
        let (low, high) = POWER_STAGE.break_codes();
        let zero = AdcCode(POWER_STAGE.zero_code);
        for (code, current_a) in [(low, -450.0), (high, 450.0)] {
            assert!((AdcCode(code).current_a(zero) - current_a).abs() < 0.5);
            assert!((20..=4_075).contains(&code));
        }
    }
}
