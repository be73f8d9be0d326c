//! The steps of `cargo xtask test`.

use clap::ValueEnum;

/// The steps, in their order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Step {
    /// The format of the sources
    Fmt,
    /// Lints on the host
    ClippyHost,
    /// Lints on the target
    ClippyTarget,
    /// The documentation builds without a warning
    Doc,
    /// Tests on the host, of every crate
    Host,
    /// The lock-free cells under every interleaving
    Loom,
    /// The lock-free cells in the interpreter that detects undefined behaviour
    Miri,
    /// Every target of fuzz/ for a minute or two million inputs, guided by what it reaches
    Fuzz,
    /// A sample of mutants of the code: tests notice enough of them
    Mutants,
    /// The lock-free cells in QEMU, interrupted on every instruction
    Cells,
    /// Interrupts that are slow, late and lost, in QEMU
    Overruns,
    /// The PWM interrupt on every instruction of the control interrupt, in QEMU
    Preemption,
    /// The image builds
    Image,
    /// No panic within an interrupt's reach, no double precision
    ImageCheck,
    /// The images of the boards in `boards/` build, with no panic within an interrupt's reach and no double precision
    NucleoImage,
    /// The image that is flashed, executed against a model of its chip, with the simulated motor at the pins
    Twin,
    /// The example's firmware, outside the workspace, holds what is its own and nothing else
    OwnBoard,
    /// The crates that a user takes, packed and checked from their packages alone
    Publish,
    /// Every command of the engineer's guide
    Guide,
    /// The engineer's guide as a book
    Book,
    /// The live bench in a browser: the host's bytes, its controls, its faults, its sizes; and report pages
    Live,
    /// A campaign as a Slurm array on this machine, a shard of it killed: the bytes of one run
    Slurm,
    /// The Python package, installed and against the rig
    Python,
    /// The image in QEMU
    Qemu,
    /// The interrupts within their budgets
    Timing,
    /// The image builds for every folder of tables/
    Machines,
}
