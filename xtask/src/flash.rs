//! `cargo xtask flash`: a board's image, onto the board.

use crate::board::Board;
use crate::build::{self, root};
use crate::cli::FlashArgs;
use crate::process::{find, succeeds};
use crate::run::machine_for_build;
use crate::setup::Setup;
use anyhow::{Result, bail};
use std::path::Path;
use std::process::Command;

const PROGRAM: &str = "probe-rs";
const INSTALL: &str = "cargo install probe-rs-tools --locked";

/// The command.
pub fn run(args: &FlashArgs) -> Result<u8> {
    if !args.dry_run && find(PROGRAM).is_none() {
        bail!("{PROGRAM} is missing; install it with: {INSTALL}");
    }
    let machine = args.machine.as_deref().map(|machine| machine_for_build(machine, root())).transpose()?;
    let toolchain = Setup::default().toolchain()?;
    let image = if args.identify {
        build::identify_on(&toolchain, &args.board, machine.as_ref())?
    } else {
        build::board_image(&toolchain, &args.board, args.system, machine.as_ref())?
    };
    for mut command in commands(&args.board, args.log, &image) {
        if args.dry_run {
            println!("{}", spelled(&command));
        } else if !succeeds(&mut command)? {
            return Ok(1);
        }
    }
    Ok(0)
}

fn spelled(command: &Command) -> String {
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    words.map(|word| word.to_string_lossy().into_owned()).collect::<Vec<_>>().join(" ")
}

/// The calls of probe-rs, one after the other.
fn commands(board: &Board, log: bool, image: &Path) -> Vec<Command> {
    let probe = |subcommand: &str| {
        let mut command = Command::new(PROGRAM);
        command.current_dir(root()).args([subcommand, "--chip", &board.flashed.chip]);
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
        let commands = commands(&Board::read("nucleo-g474re").unwrap(), log, Path::new("i.elf"));
        commands.iter().map(spelled).collect()
    }

    #[test]
    fn the_image_is_flashed_and_the_chip_reset_or_watched() {
        let chip = "--chip STM32G474RETx";
        let download = format!("probe-rs download {chip} --verify i.elf");
        assert_eq!(words(false), [download, format!("probe-rs reset {chip}")]);
        assert_eq!(words(true), [format!("probe-rs run {chip} i.elf")]);
    }
}
