//! `cargo rig machine`: machine folders made, and shown.

mod given;
mod nameplate;
mod ratings;
mod write;

pub use given::Given;
pub use nameplate::Nameplate;

use anyhow::Result;
use clap::Subcommand;

/// The commands about machine folders.
#[derive(Clone, Debug, Subcommand)]
pub enum MachineCommand {
    /// A machine folder from nameplate values.
    ///
    /// Currents, voltages and flux linkages of phases are peak values. The d axis lies along the magnets' flux: L_d is the inductance
    /// along the magnets and L_q the one across them, so L_q is at least L_d, and in a machine of reluctance alone L_d is the smaller
    /// one. Data of a SynRM or PMaSynRM whose d axis lies along the least reluctance (L_d above L_q, magnets along −q) has L_d and L_q
    /// the other way round: give its L_q as --ld and its L_d as --lq; ψ_f stays positive.
    New(Nameplate),
}

/// Does what the command says.
///
/// # Errors
/// One line that names option or file, value and what is allowed; then nothing was written.
pub fn run(command: &MachineCommand) -> Result<()> {
    match command {
        MachineCommand::New(nameplate) => nameplate.make(),
    }
}
