//! Runs the drive against a bench, on the host or in QEMU.

mod emulator;
mod host;
mod qemu;

pub use emulator::Emulator;
pub(crate) use emulator::emulate;
pub use host::{Tasks, run_on_host};
pub use qemu::run_in_qemu;

use indicatif::{ProgressBar, ProgressStyle};
use tractive::time::Clock;

/// The clock of the emulated board: 25 MHz ticks, control at 10 kHz. The host runs on the same.
pub const CLOCK: Clock = Clock::new(25_000_000, 2_500);

/// A bar on a terminal; in a pipe indicatif draws none.
pub(crate) struct Progress {
    bar: ProgressBar,
    calls: u32,
}

impl Progress {
    const STEPS: u64 = 1000;

    pub(crate) fn new(name: &str) -> Self {
        let bar = ProgressBar::new(Self::STEPS).with_message(name.to_owned());
        if let Ok(style) =
            ProgressStyle::with_template("{msg:16} [{bar:40}] {percent:>3} % {elapsed} (left {eta})")
        {
            bar.set_style(style);
        }
        Self { bar, calls: 0 }
    }

    pub(crate) fn show(&mut self, done: f64) {
        self.calls = self.calls.wrapping_add(1);
        if self.calls.is_multiple_of(256) {
            self.bar.set_position((done * Self::STEPS as f64) as u64);
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
