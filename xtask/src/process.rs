//! Running other programs.

use anyhow::{Context, Result, bail};
use std::process::Command;

/// Runs a program that must succeed.
pub fn must(command: &mut Command) -> Result<()> {
    match exit_code(command)? {
        0 => Ok(()),
        code => bail!("{} ended with {code}", shown(command)),
    }
}

/// Runs a program; its exit code (1 when a signal ended it).
pub fn exit_code(command: &mut Command) -> Result<u8> {
    let status = command.status().with_context(|| format!("cannot start {}", shown(command)))?;
    Ok(status.code().and_then(|code| u8::try_from(code).ok()).unwrap_or(1))
}

/// Whether a program can be started and succeeds, in silence.
pub fn succeeds(command: &mut Command) -> bool {
    command.output().is_ok_and(|output| output.status.success())
}

/// What a program prints, if it succeeds.
pub fn output(command: &mut Command) -> Option<String> {
    let output = command.output().ok().filter(|output| output.status.success())?;
    String::from_utf8(output.stdout).ok()
}

/// The command as one would type it.
pub fn shown(command: &Command) -> String {
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    words.map(|word| word.to_string_lossy().into_owned()).collect::<Vec<_>>().join(" ")
}
