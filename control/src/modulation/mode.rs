//! The modes: how the pulses are made.

/// How the pulses are made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Mode {
    /// All gates off.
    #[default]
    Off,
    /// Asynchronous SPWM with zero sequence at the highest switching frequency.
    Async,
    /// Synchronous, 15 carriers per turn.
    Sync15,
    /// Synchronous, 12 carriers per turn.
    Sync12,
    /// Middle 60°, 7 pulses: 18 carriers per turn with one notch each.
    Mid7,
    /// Middle 60°, 3 pulses: 6 carriers per turn with one notch each.
    Mid3,
    /// Square wave: 6 carriers per turn without a notch.
    Square,
}

impl Mode {
    /// Every mode, in the order of its discriminant.
    pub const ALL: [Self; 7] =
        [Self::Off, Self::Async, Self::Sync15, Self::Sync12, Self::Mid7, Self::Mid3, Self::Square];

    /// The mode with this discriminant; `Off` for any other number.
    pub fn from_code(code: u32) -> Self {
        match code {
            1 => Self::Async,
            2 => Self::Sync15,
            3 => Self::Sync12,
            4 => Self::Mid7,
            5 => Self::Mid3,
            6 => Self::Square,
            _ => Self::Off,
        }
    }

    /// The name in traces and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::Async => "async",
            Self::Sync15 => "sync15",
            Self::Sync12 => "sync12",
            Self::Mid7 => "mid7",
            Self::Mid3 => "mid3",
            Self::Square => "square",
        }
    }

    /// Carriers per turn of the pulse angle; 0 where the carrier is not locked to it.
    pub const fn carriers(self) -> u32 {
        match self {
            Self::Off | Self::Async => 0,
            Self::Sync15 => 15,
            Self::Sync12 => 12,
            Self::Mid7 => 18,
            Self::Mid3 | Self::Square => 6,
        }
    }

    /// Whether it is a pattern of whole edges of a flux hexagon: middle 60° or square wave.
    pub const fn is_pattern(self) -> bool {
        matches!(self, Self::Mid7 | Self::Mid3 | Self::Square)
    }

    /// Halves in a sector of 60° of a pattern.
    pub const fn sector_halves(self) -> u32 {
        self.carriers() / 3
    }

    /// Carriers in a sector of 60° of a pattern, each with a notch or with room for one.
    pub(super) const fn notches(self) -> u32 {
        self.carriers() / 6
    }

    /// Whether the mean voltage of each carrier half follows the command: the modes with a triangular carrier.
    pub const fn is_carrier(self) -> bool {
        matches!(self, Self::Async | Self::Sync15 | Self::Sync12)
    }
}
