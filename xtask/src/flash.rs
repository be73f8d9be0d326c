//! `cargo xtask flash`: a board's image, onto the board.

use std::path::Path;
use std::process::Command;

use anyhow::{Result, bail};

use crate::build::{self, Board, root};
use crate::cli::FlashArgs;
use crate::process::{find, succeeds};
use crate::setup::Setup;

const PROGRAM: &str = "probe-rs";
const INSTALL: &str = "cargo install probe-rs-tools --locked";

/// The command.
pub fn run(args: &FlashArgs) -> Result<u8> {
    if find(PROGRAM).is_none() {
        bail!("{PROGRAM} is missing; install it with: {INSTALL}");
    }
    let image = build::board_image(&Setup::default().toolchain()?, args.board)?;
    for mut command in commands(args.board, args.log, &image) {
        if !succeeds(&mut command)? {
            return Ok(1);
        }
    }
    Ok(0)
}

/// What probe-rs is asked for, one after the other.
fn commands(board: Board, log: bool, image: &Path) -> Vec<Command> {
    let probe = |subcommand: &str| {
        let mut command = Command::new(PROGRAM);
        command.current_dir(root()).args([subcommand, "--chip", board.chip()]);
        command
    };
    if log {
        let mut run = probe("run");
        run.arg(image);
        return vec![run];
    }
    let mut download = probe("download");
    download.args(["--verify"]).arg(image);
    vec![download, probe("reset")]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(log: bool) -> Vec<String> {
        let commands = commands(Board::NucleoG474re, log, Path::new("i.elf"));
        let line = |command: &Command| {
            let words = command.get_args().map(|word| word.to_string_lossy().into_owned());
            words.collect::<Vec<_>>().join(" ")
        };
        commands.iter().map(line).collect()
    }

    #[test]
    fn the_image_is_flashed_and_the_chip_reset_or_watched() {
        let chip = "--chip STM32G474RETx";
        assert_eq!(words(false), [format!("download {chip} --verify i.elf"), format!("reset {chip}")]);
        assert_eq!(words(true), [format!("run {chip} i.elf")]);
    }
}
