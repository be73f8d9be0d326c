//! Reasons for which the board does not start.

use tractive::protection::{FailedCheck, Fault};

/// The reason why the board did not start. All outputs are off and stay off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum StartError {
    /// The watchdog has reset the chip. The drive does not restart by itself: the next manual reset starts it.
    WatchdogReset,
    /// The flash memory did not take the wait states.
    FlashLatency,
    /// The crystal does not oscillate.
    Crystal,
    /// The PLL does not lock.
    Pll,
    /// The system clock was not switched to the PLL.
    ClockSwitch,
    /// The dead time is zero or longer than the generator can make.
    DeadTime,
    /// A carrier half may be longer than the 16-bit timers count.
    Carrier {
        /// The longest half, in ticks.
        longest_ticks: u32,
    },
    /// A converter's calibration does not end.
    ConverterCalibration,
    /// A converter does not get ready or converts nothing.
    Converter,
    /// A current sensor's zero is too far from the nominal one.
    CurrentSensor {
        /// The code that it gives at no current.
        code: u16,
    },
    /// The CAN controller does not answer.
    Can,
    /// The watchdog does not take its settings.
    Watchdog,
}

impl StartError {
    /// The fault that a drive reports if it was refused to start for this reason: [`Fault::StartRefused`], and the reason's number.
    pub const fn failed(&self) -> FailedCheck {
        let number = match self {
            Self::WatchdogReset => 1.0,
            Self::FlashLatency => 2.0,
            Self::Crystal => 3.0,
            Self::Pll => 4.0,
            Self::ClockSwitch => 5.0,
            Self::DeadTime => 6.0,
            Self::Carrier { .. } => 7.0,
            Self::ConverterCalibration => 8.0,
            Self::Converter => 9.0,
            Self::CurrentSensor { .. } => 10.0,
            Self::Can => 12.0,
            Self::Watchdog => 13.0,
        };
        (Fault::StartRefused, number, 0.0)
    }
}
