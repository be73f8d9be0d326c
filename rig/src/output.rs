//! The output of the commands.

use std::fmt::Arguments;
use std::io::{ErrorKind, Write as _, stdout};

/// Prints a line, formatted as by `println!`, to whoever still reads: if `head` has ended, that is no reason to stop before all files are written.
#[macro_export]
macro_rules! say {
    ($($text:tt)*) => { $crate::output::line(format_args!($($text)*)) };
}

/// A line on the standard output. If it cannot be written for any reason other than that nobody reads any more, the program ends with exit code 2.
pub fn line(text: Arguments) {
    match writeln!(stdout(), "{text}") {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            eprintln!("error: cannot print: {error}");
            std::process::exit(2);
        }
        _ => {}
    }
}
