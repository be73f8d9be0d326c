//! Runs the drive against a bench, on the host or in QEMU.

mod calls;
mod emulator;
mod host;
mod qemu;
pub mod traction;

pub(crate) use crate::platform::Progress;
pub use emulator::Emulator;
pub use host::Interrupts;
pub(crate) use host::on_host;
pub(crate) use qemu::in_qemu;

use crate::bench::Simulated;
use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use std::sync::LazyLock;
use tractive::configuration::Refused;
use tractive::protocol::Frame;
use tractive::time::{Clock, Instant};

/// The rate of the emulated board's timers, in Hz. The host runs on the same.
const TICKS_HZ: u32 = 25_000_000;

/// The emulated board's clock, control at 10 kHz.
pub const CLOCK: Clock = clock(10_000);

/// The same with control at another rate, in Hz.
pub const fn clock(control_hz: u32) -> Clock {
    Clock::new(TICKS_HZ, TICKS_HZ / control_hz)
}

/// The clock with the usual rate of control for devices with a switching frequency in Hz.
///
/// # Errors
/// Devices that switch faster than that.
pub fn usual_clock(max_switching_hz: f32) -> anyhow::Result<Clock> {
    let control_hz = Clock::control_hz(max_switching_hz);
    // A carrier lasts at least a control period.
    anyhow::ensure!(
        max_switching_hz <= control_hz as f32,
        "max_switching_hz {max_switching_hz}: must be at most {control_hz}, the rate of control of this command; run and identify take --control-hz {:.0}",
        max_switching_hz.ceil()
    );
    Ok(clock(control_hz))
}

/// A time in µs in whole ticks of these timers.
pub fn ticks(microseconds: f64) -> u32 {
    (microseconds * 1e-6 * f64::from(TICKS_HZ)).round() as u32
}

/// The error of an image that does not start.
pub(crate) fn refused(refused: Refused) -> anyhow::Error {
    let option = match refused.name.rsplit('.').next() {
        Some("dead_time_ticks") => " (--dead-time-us)",
        Some("min_pulse_ticks") => " (--min-pulse-us)",
        Some("max_acceleration_rad_s2") => {
            return anyhow::anyhow!(
                "configuration refused: {refused}, electrical, of max_torque_nm on rotor_inertia_kg_m2: control follows no lighter rotor at its rate, see --control-hz"
            );
        }
        _ => return anyhow::anyhow!("configuration refused: {refused}"),
    };
    anyhow::anyhow!("configuration refused: {refused}{option}, {} a µs", TICKS_HZ / 1_000_000)
}

/// The sender of commands over the protocol.
pub trait Supervisor {
    /// Serves the slot that began at `t_s`: says what is sent to the drive, and what happens to it. An error ends the run.
    fn slot(&mut self, t_s: f64) -> anyhow::Result<Turn>;

    /// A frame that the drive sends at `t_s`.
    fn hear(&mut self, t_s: f64, frame: &Frame);

    /// `true` if a turn may take as long as somebody needs to type.
    fn is_typed(&self) -> bool {
        false
    }
}

/// A supervisor's turn.
#[derive(Clone, Copy, Debug)]
pub struct Turn {
    /// The frame for the drive.
    pub frame: Option<Frame>,
    /// The rotors' loads from the next slot on, in N·m; with one rotor the first.
    pub loads_nm: [f64; 2],
    /// `true` if the run ends with this slot.
    pub done: bool,
}

/// A supervisor's turn in the slot that began at `at`. Its actions on the bench take effect at the beginning of the next slot, whenever the
/// slot is served.
pub(crate) fn turn(
    supervisor: &mut dyn Supervisor,
    bench: &mut impl Simulated,
    at: Instant,
) -> anyhow::Result<Option<Frame>> {
    let turn = supervisor.slot(bench.instant_s(at))?;
    let next = bench.slot_after(at);
    bench.loads_from(next, turn.loads_nm);
    if turn.done {
        bench.end_at(next);
    }
    Ok(turn.frame)
}

/// The bars on the terminal, a line each, because runs go on side by side.
static BARS: LazyLock<MultiProgress> = LazyLock::new(MultiProgress::new);

/// A bar with a number of steps on a terminal; in a pipe indicatif draws none.
pub(crate) fn bar(steps: u64, template: &str) -> ProgressBar {
    let bar = BARS.add(ProgressBar::new(steps));
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
    // The bar appears before the first step is done.
    bar.tick();
    bar
}
