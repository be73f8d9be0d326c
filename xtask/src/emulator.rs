//! The emulator for an image that needs no partner at its other end.

use std::path::Path;
use std::process::{Command, Stdio};

/// Runs the image with one instruction per 2^`shift` nanoseconds of virtual time.
pub fn command(qemu: &Path, image: &Path, shift: u32) -> Command {
    let mut command = Command::new(qemu);
    command.args("-M mps2-an386 -cpu cortex-m4 -nographic -monitor none -serial null".split(' '));
    command.args(["-icount", &format!("shift={shift},align=off,sleep=off")]);
    command.args(["-semihosting-config", "enable=on,target=native", "-kernel"]).arg(image);
    command.stdin(Stdio::null());
    command
}
