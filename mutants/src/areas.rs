//! The areas whose tests are tested, and the minimum shares that are required of them.

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

/// A part of the code.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, ValueEnum)]
pub enum Area {
    Control,
    Modulation,
    Protection,
    Cell,
    Protocol,
    Operator,
    NineSwitch,
    Drive,
    Boards,
    Tablegen,
}

/// Each crate's root, the folder of its manifest first.
pub const CRATES: [(&str, &str); 4] = [
    ("control", "src/lib.rs"),
    ("tablegen", "src/lib.rs"),
    ("", "src/lib.rs"),
    ("boards/nucleo-g474re", "src/lib.rs"),
];

impl Area {
    /// The area of a file; `None` if it belongs to no area.
    pub fn of(file: &str) -> Option<Self> {
        let place =
            |area: &Self| file.strip_prefix(area.folder()).is_some_and(|rest| rest.starts_with(['/', '.']));
        Self::value_variants().iter().copied().find(place)
    }

    fn folder(self) -> &'static str {
        match self {
            Self::Control => "control/src/control",
            Self::Modulation => "control/src/modulation",
            Self::Protection => "src/protection",
            Self::Cell => "src/cell",
            Self::Protocol => "src/protocol",
            Self::Operator => "src/operator",
            Self::NineSwitch => "control/src/nine_switch",
            Self::Drive => "src/drive",
            Self::Boards => "boards",
            Self::Tablegen => "tablegen/src",
        }
    }

    /// The share of its viable mutants that tests must notice, in percent.
    pub fn bound(self) -> f64 {
        match self {
            Self::NineSwitch | Self::Drive | Self::Boards | Self::Tablegen => 90.0,
            _ => 95.0,
        }
    }

    /// Its name on the command line.
    pub fn name(self) -> String {
        self.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_has_its_area() {
        assert_eq!(Area::of("control/src/control/pi/mod.rs"), Some(Area::Control));
        assert_eq!(Area::of("src/cell.rs"), Some(Area::Cell));
        assert_eq!(Area::of("control/src/start_up.rs"), None);
    }
}
