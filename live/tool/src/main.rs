//! The live bench's page: made of the drive's wasm, served, looked at in a browser.
//!
//! `cargo xtask live` calls this; what it does is in [`page`] (the folder of static files), [`server`], [`browser`], [`check`] and
//! [`pictures`]. [`reports`] looks at the report pages of runs, [`axe`] at all of them.
#![forbid(unsafe_code)]

mod axe;
mod browser;
mod check;
mod page;
mod pictures;
mod reports;
mod server;

use anyhow::Result;
use axe::Axe;
use browser::Browser;
use clap::Parser;
use std::path::PathBuf;

/// The live bench's page.
#[derive(Parser)]
enum Command {
    /// Makes the folder of static files
    Make {
        /// The wasm that cargo has made
        wasm: PathBuf,
        /// Folder for the page
        out: PathBuf,
    },
    /// Serves it until interrupted
    Serve {
        /// The page's folder
        page: PathBuf,
        /// Port; 0: any
        #[arg(long, default_value_t = 0)]
        port: u16,
        /// Do not open a browser
        #[arg(long)]
        no_open: bool,
    },
    /// Looks at it in a headless Chromium
    Check {
        /// The page's folder
        page: PathBuf,
        /// The rig, whose traces are the page's and whose page of a drive elsewhere is looked at, too
        #[arg(long)]
        rig: PathBuf,
        /// Report pages that are looked at, too
        #[arg(long)]
        report: Vec<PathBuf>,
        /// That drive runs in QEMU, by the environment's image; else on the host
        #[arg(long)]
        in_qemu: bool,
        /// The file axe.min.js of axe-core
        #[arg(long)]
        axe: Option<PathBuf>,
        /// Chromium
        #[arg(long, default_value = "chromium")]
        browser: PathBuf,
    },
    /// Looks at report pages in a headless Chromium
    Reports {
        /// The pages
        #[arg(required = true)]
        pages: Vec<PathBuf>,
        /// Folder for pictures of them
        #[arg(long)]
        pictures: Option<PathBuf>,
        /// Chromium
        #[arg(long, default_value = "chromium")]
        browser: PathBuf,
    },
    /// Takes its pictures
    Screenshots {
        /// The page's folder
        page: PathBuf,
        /// Folder for the pictures
        out: PathBuf,
        /// Chromium
        #[arg(long, default_value = "chromium")]
        browser: PathBuf,
    },
}

fn main() -> Result<()> {
    match Command::parse() {
        Command::Make { wasm, out } => page::make(&wasm, &out),
        Command::Serve { page, port, no_open } => server::serve(&page, port, !no_open),
        Command::Check { page, rig, report, in_qemu, axe, browser } => {
            let (axe, mut browser) = (Axe::read(axe.as_deref())?, Browser::start(&browser)?);
            check::check(&page, &rig, &mut browser, &axe)?;
            check::check_remote(&rig, if in_qemu { "qemu" } else { "host" }, &mut browser, &axe)?;
            reports::check(&report, None, &mut browser, &axe)
        }
        Command::Reports { pages, pictures, browser } => {
            reports::check(&pages, pictures.as_deref(), &mut Browser::start(&browser)?, &Axe::default())
        }
        Command::Screenshots { page, out, browser } => pictures::take(&page, &out, &browser),
    }
}
