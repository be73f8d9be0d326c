//! `rig live`: the live page of a drive that is elsewhere, in QEMU, on the host, or on a CAN bus. The page displays; commands must be permitted
//! by an option and switched on in the page.

mod relay;
mod server;
mod shared;

pub use relay::Relay;
pub use shared::Shared;

use crate::can;
use crate::curves;
use crate::machine::Machine;
use crate::talk::{self, DriveOptions, System};
use anyhow::Result;
use serde_json::json;
use std::ffi::OsString;
use std::process::Command;
use std::sync::Arc;

/// The options of the page's own.
#[derive(Clone, Debug, clap::Args)]
struct Page {
    /// A CAN interface of this machine, as can0: the drive is on its bus, and nothing is simulated.
    #[arg(long, value_name = "INTERFACE")]
    can: Option<String>,
    /// Permit commands; they are sent only once they are also switched on in the page.
    #[arg(long)]
    commands: bool,
    /// Port of the server on this machine; 0: any.
    #[arg(long, default_value_t = 0)]
    port: u16,
    /// Serve, and open no browser.
    #[arg(long)]
    no_open: bool,
    /// Time after which a simulated drive ends, in s.
    #[arg(long, default_value_t = 3600.0, value_parser = crate::options::positive)]
    seconds: f64,
}

/// The options of `rig live`.
#[derive(Clone, Debug)]
pub struct LiveOptions {
    page: Page,
    /// The drive that is shown.
    pub drive: DriveOptions,
}

/// Step of a simulated drive's recording, in s, which nobody asks for.
const UNSEEN_STEP_S: f64 = 0.1;

impl LiveOptions {
    /// Reads the words behind `live`.
    pub fn read(words: &[OsString]) -> Result<Self> {
        let about =
            "Serves the live page of a drive that is elsewhere: the image in QEMU, or a drive on a CAN bus";
        let (page, mut drive) = talk::read("live", words, |command, _| command.about(about))?;
        drive.run.dt.get_or_insert(UNSEEN_STEP_S);
        Ok(Self { page, drive })
    }
}

/// Serves until the drive ends or the program is interrupted.
pub fn run(options: &LiveOptions) -> Result<()> {
    let LiveOptions { page, drive } = options;
    let machine = Machine::load(drive.machine_name())?;
    let source = match &page.can {
        Some(interface) => format!("on {interface}"),
        None => format!("the code on {}, its plant simulated", drive.run.on.name()),
    };
    let about = json!({
        "system": drive.system.name(),
        "machine": machine.tables.name,
        "source": source,
        "commands": page.commands,
        "columns": relay::columns(drive.system),
        "step": shared::STEP_S,
        "properties": curves::properties(&machine),
    });
    let shared = Arc::new(Shared::new(page.commands));
    let address = server::serve(page.port, about, Arc::clone(&shared))?;
    crate::say!("{address}   (Ctrl-C ends it)");
    if !page.no_open {
        open(&address);
    }
    let mut relay = Relay::new(drive.system, drive.inertia(), &machine.tables.ratings, shared);
    match (&page.can, drive.system) {
        (Some(interface), _) => can::command(interface, &mut relay),
        (None, System::Pmasynrm) => {
            let own = talk::traction_options(drive);
            talk::with_traction(&own, drive.inertia(), page.seconds, &machine, &mut relay).map(|_| ())
        }
        (None, System::Zs9) => talk::with_zs9(drive, page.seconds, &machine, &mut relay).map(|_| ()),
    }
}

fn open(address: &str) {
    let opener = if cfg!(target_os = "macos") { "open" } else { "xdg-open" };
    if Command::new(opener).arg(address).spawn().is_err() {
        crate::say!("open it in a browser: {opener} is not here");
    }
}
