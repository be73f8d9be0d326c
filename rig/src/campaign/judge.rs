//! What counts as good enough.

use serde::Serialize;

/// How a case ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// A fault of a fitting name, the gates safe in time, current and voltages within what is allowed.
    Caught,
    /// No fault; the drive went on with every limit kept and the torque that is wanted.
    RiddenThrough,
    /// Anything else.
    Uncaught,
}

impl Verdict {
    /// The name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Caught => "caught",
            Self::RiddenThrough => "ridden through",
            Self::Uncaught => "uncaught",
        }
    }
}
