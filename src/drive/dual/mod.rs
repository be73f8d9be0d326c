//! The ZS9's drive: one control task and one PWM task for both motors and the link between them and the source.
//!
//! ```text
//!  valley       peak         valley       peak         valley
//!    │ control ──► command     │            │            │
//!    │            │ PWM ─► loads the next period         │
//!    │            │            │ which is played here ───│
//! ```
//!
//! Logical execution time: control samples at a valley of the carrier, and its command may be used from the last peak before the next sample on. At
//! that peak the PWM interrupt loads the carrier period that begins at the next valley. So a voltage acts one period after its sample, and lasts one
//! period. Both interrupts select each other's words by their instants. At 20 kHz a control period holds two carrier periods: each command is played
//! twice, with the vectors turned further the second time.
//!
//! The modulator divides by the link voltage that the PWM interrupt measures, so a change of the link voltage hardly reaches the motors; the link's
//! own control sees the motors' power before it is drawn.
//!
//! A single fault stops both motors: they share the bridge, and one leg holds a switch of each.

mod axis;
mod control;
mod messages;
mod pwm;

use super::mailbox::DualOperatorMailboxes;
use crate::cell::{Mailbox, Seqlock};
use crate::control::{Gains, SpeedDesign, ZSourceDesign, ZSourceGains};
use crate::machine::{Ratings, Tables};
use crate::protection::LinkLimits;
use crate::recorder::DualRecorder;
use crate::time::Clock;
use core::sync::atomic::AtomicU32;

pub use axis::TRACKING_RAD_S;
pub use control::ControlTask;
pub(crate) use control::TWO_LEVEL_SHARE;
pub use messages::{DualApplied, DualCommand, MotorCommand, MotorShare};
pub use pwm::PwmTask;

/// Steps of the compare registers per tick of the timers' clock: 1.25 ns at 25 MHz, as high-resolution timers have them. With whole ticks the
/// rounding alone would shake each motor's torque by some hundredths of a N·m.
pub const COMPARE_STEPS: u32 = 32;

/// Share of the nominal source's voltage from which on the capacitors count as charged: at rest they have the source's voltage, which may be that
/// low.
pub const LOWEST_SHARE: f32 = 0.9;

/// Longest dead time that the gates' hardware may insert, in s.
const DEAD_TIME_S: f32 = 5e-6;

/// Control periods from one operating point of a motor to its next one: the motors take turns.
pub(crate) const TURNS: u32 = 2;

/// The settings of both tasks.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Settings {
    /// The timers' clock and the control period.
    pub clock: Clock,
    /// Carrier period, in ticks: the control period or an integer fraction of it, even, at most 4,000.
    pub carrier_ticks: u32,
    /// Dead time between two gates of a leg, in ticks, which the pulses compensate; 0: none.
    pub dead_time_ticks: u32,
    /// The current loops' gains.
    pub gains: Gains,
    /// The speed loops.
    pub speed: SpeedDesign,
    /// The link's control.
    pub link: ZSourceDesign,
    /// Its gains.
    pub link_gains: ZSourceGains,
    /// The link's limits.
    pub limits: LinkLimits,
}

impl Settings {
    /// The ZS9's settings for two machines of one kind, with a carrier period in ticks.
    pub const fn new(clock: Clock, carrier_ticks: u32, tables: &Tables) -> Self {
        let Tables { ratings, z_source, .. } = tables;
        let period_s = clock.control_ticks as f32 * clock.tick_s;
        let link = ZSourceDesign::of(z_source, ratings, period_s);
        Self {
            clock,
            carrier_ticks,
            dead_time_ticks: 0,
            // Learning takes place in every other period, from both motors.
            gains: Gains {
                carrier: 0.6,
                observer: TURNS as f32 * 0.02,
                sixth_turn_rad: TURNS as f32 * Gains::DEFAULT.sixth_turn_rad,
                ..Gains::DEFAULT
            },
            speed: SpeedDesign::of(ratings, 280.0, TURNS as f32 * period_s),
            link,
            link_gains: link.gains(),
            limits: LinkLimits {
                source_min_v: ratings.trip_dc_under_v / TWO_LEVEL_SHARE,
                capacitor_max_v: ratings.trip_dc_over_v / TWO_LEVEL_SHARE,
                duty_max: link.duty_max,
            },
        }
    }

    /// The same for a source that is behind a line filter, whose swing the capacitors then damp, or that is not.
    pub const fn behind_line_filter(mut self, behind: bool, tables: &Tables) -> Self {
        let Tables { ratings, z_source, .. } = tables;
        self.link.damping_s = if behind { ZSourceDesign::line_damping_s(z_source, ratings) } else { 0.0 };
        self
    }

    /// The ratings as the operator uses them: link voltages are those of the capacitors, with the drive's own trip levels.
    pub const fn operator_ratings(ratings: &Ratings) -> Ratings {
        Ratings {
            dc_link_min_v: LOWEST_SHARE * ratings.dc_link_min_v / TWO_LEVEL_SHARE,
            dc_link_nominal_v: ratings.dc_link_nominal_v / TWO_LEVEL_SHARE,
            dc_link_max_v: ratings.dc_link_max_v / TWO_LEVEL_SHARE,
            trip_dc_over_v: ratings.trip_dc_over_v / TWO_LEVEL_SHARE,
            // Once the gates go off, the part above the source's voltage swings as far below it; a lost source has a limit of its own.
            trip_dc_under_v: 0.5 * ratings.trip_dc_under_v / TWO_LEVEL_SHARE,
            ..*ratings
        }
    }

    /// The lowest and the highest link voltage outside shoot-through that an operator may ask for, and the one that holds until then, in V, for such
    /// ratings.
    pub const fn link_range_v(ratings: &Ratings) -> [f32; 3] {
        let source_v = ratings.dc_link_min_v / LOWEST_SHARE;
        [source_v, 2.0 * ratings.dc_link_max_v - source_v, 2.0 * ratings.dc_link_nominal_v - source_v]
    }

    /// The least shoot-through that the pulses of a duty have: in each carrier period two dead times of those that are told are missing, and as much as
    /// the longest one for those that are not.
    #[inline]
    pub const fn least_duty(&self, duty: f32) -> f32 {
        let missing_ticks = DEAD_TIME_S * self.clock.ticks_per_s + 2.0 * self.dead_time_ticks as f32;
        let least = duty - missing_ticks / self.carrier_ticks as f32;
        if least > 0.0 { least } else { 0.0 }
    }

    /// Instant of the first PWM interrupt, in ticks: the first peak.
    pub const fn first_peak_ticks(&self) -> u32 {
        self.carrier_ticks / 2
    }

    /// Time from a control sample until its command may be used, in ticks: until the last peak before the next sample.
    pub const fn deadline_ticks(&self) -> u32 {
        self.clock.control_ticks.saturating_sub(self.carrier_ticks / 2)
    }

    /// Compare steps of a carrier half.
    pub const fn half_steps(&self) -> u32 {
        self.carrier_ticks / 2 * COMPARE_STEPS
    }

    /// Compare steps for which a gate may pause in a carrier half and yet must be seen on: the part of the half that the longest and the configured
    /// dead time leave. M is on before its pause and after it, and a dead time may take either.
    pub const fn longest_pause_steps(&self) -> u32 {
        let dead_ticks = (DEAD_TIME_S * self.clock.ticks_per_s) as u32 + self.dead_time_ticks;
        self.half_steps().saturating_sub(dead_ticks * COMPARE_STEPS)
    }
}

/// The cells between the two interrupts, the operator's mailboxes, and the flight recorder, if there is one.
pub struct Shared<'a> {
    command: Mailbox<DualCommand, 10>,
    applied: Seqlock<DualApplied, 10>,
    /// Instant of the newest control interrupt, from the beginning of that interrupt on.
    began: AtomicU32,
    /// Between the operator in the idle loop and control.
    pub operator: DualOperatorMailboxes,
    recorder: Option<&'a DualRecorder>,
}

impl<'a> Shared<'a> {
    /// Empty cells.
    #[cfg(not(loom))]
    pub const fn new() -> Self {
        Self {
            operator: DualOperatorMailboxes::new(),
            command: Mailbox::new(),
            applied: Seqlock::new(),
            began: AtomicU32::new(0),
            recorder: None,
        }
    }

    /// The same with a flight recorder, which the control interrupt fills.
    #[cfg(not(loom))]
    pub const fn recorded_by(recorder: &'a DualRecorder) -> Self {
        Self { recorder: Some(recorder), ..Self::new() }
    }
}
