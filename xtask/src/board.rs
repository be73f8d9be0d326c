//! The boards of real hardware: the packages in `boards/`, each with all that this program must know about it in its own `Cargo.toml`.

use crate::workspace::{folders, root};
use anyhow::{Context, Result};
use serde::Deserialize;

/// A board.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Board {
    /// Its folder's name, and its images'.
    pub name: String,
    /// The package.
    pub package: String,
    /// The contents of the package's own file.
    pub flashed: Chip,
}

/// The table `package.metadata.board`.
#[derive(Clone, Debug, Deserialize, PartialEq, Eq)]
#[serde(deny_unknown_fields)]
pub struct Chip {
    /// The chip's name in probe-rs.
    pub chip: String,
    /// The beginning of its flash memory, and with it of the images.
    pub flash_origin: u32,
}

#[derive(Deserialize)]
struct Manifest {
    package: Package,
}

#[derive(Deserialize)]
struct Package {
    name: String,
    metadata: Metadata,
}

#[derive(Deserialize)]
struct Metadata {
    board: Chip,
}

impl Board {
    /// The board in that folder of `boards/`.
    pub fn read(name: &str) -> Result<Self> {
        let file = root().join("boards").join(name).join("Cargo.toml");
        let text = std::fs::read_to_string(&file).with_context(|| file.display().to_string())?;
        let Manifest { package } = toml::from_str(&text).with_context(|| file.display().to_string())?;
        Ok(Self { name: name.to_owned(), package: package.name, flashed: package.metadata.board })
    }

    /// The same as it was typed; the error names those that there are.
    pub fn named(name: &str) -> Result<Self, String> {
        let names = names();
        if !names.iter().any(|known| known == name) {
            return Err(format!("there are: {}", names.join(", ")));
        }
        Self::read(name).map_err(|error| format!("{error:#}"))
    }

    /// All of them, by their names.
    pub fn all() -> Result<Vec<Self>> {
        names().iter().map(|name| Self::read(name)).collect()
    }
}

/// The folders of `boards/` with a package, by their names.
fn names() -> Vec<String> {
    let boards = root().join("boards");
    folders(&boards).into_iter().filter(|name| boards.join(name).join("Cargo.toml").is_file()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_board_is_what_its_folder_says() {
        let board = Board::read("nucleo-g474re").unwrap();
        assert_eq!(board.package, "tractive-nucleo-g474re");
        assert_eq!(board.flashed, Chip { chip: "STM32G474RETx".to_owned(), flash_origin: 0x0800_0000 });
        assert!(Board::all().unwrap().contains(&board));
        assert_eq!(Board::named("nucleo-g474re"), Ok(board));
        let message = Board::named("none").unwrap_err();
        assert!(message.starts_with("there are: ") && message.contains("nucleo-g474re"), "{message}");
    }
}
