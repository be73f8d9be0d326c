//! `cargo rig machine`: machine folders made, and shown.

mod axes;
mod fitted;
mod given;
mod header;
mod import;
mod nameplate;
mod ratings;
mod reach;
mod reading;
mod rectangle;
mod ripple;
mod samples;
mod show;
mod torque;
mod write;

pub use given::Given;
pub use import::Import;
pub use nameplate::Nameplate;
pub use reading::{AngleFrom, DAxis, Reading};
pub use show::{Show, page, usual_page};
pub use write::{Contents, check_place, csv, digits, folder as write_folder, toml};

use anyhow::Result;
use clap::Subcommand;

/// The commands about machine folders.
#[derive(Clone, Debug, Subcommand)]
pub enum MachineCommand {
    /// A machine folder from nameplate values.
    ///
    /// Currents, voltages and flux linkages of phases are peak values. The d axis lies along the magnets' flux: L_d is the inductance along the
    /// magnets and L_q the one across them, so L_q is at least L_d; in a pure reluctance machine L_d is the smaller one. For a SynRM or PMaSynRM
    /// whose d axis lies along the least reluctance (L_d above L_q, magnets along −q) L_d and L_q are swapped: give its L_q as --ld and its L_d as
    /// --lq; ψ_f stays positive.
    New(Nameplate),
    /// A machine folder from a flux map of another tool.
    ///
    /// The map's nodes lie on a rectangular grid, even or not, in any order. An even one is used as it is; between uneven nodes the map is
    /// interpolated. Nodes anywhere else, and those that are too rough for a machine's, are fitted as the gradient of one co-energy, and the fit's
    /// residual is printed. For a map with one sign of iq the other is its mirror image. Nothing is written unless the table generator accepts the
    /// folder: flux linkage that rises with its own current, the same cross inductance both ways, one current for one flux linkage.
    Import(Import),
    /// A page about a machine: its flux linkages, its currents, torque and power over speed, and the cost of each limit.
    Show(Show),
}

/// Executes the command.
///
/// # Errors
/// One line that names option or file, value and what is allowed; then nothing was written.
pub fn run(command: &MachineCommand) -> Result<()> {
    match command {
        MachineCommand::New(nameplate) => nameplate.make(),
        MachineCommand::Import(import) => import.make(),
        MachineCommand::Show(show) => show.write(),
    }
}
