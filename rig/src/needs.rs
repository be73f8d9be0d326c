//! The needs of a run, for the program that builds images and sets up the emulator.

use crate::commission::Commission;
use crate::identify::Identify;
use crate::options::{On, RunOptions};
use crate::scenario::System;
use crate::scenario::catalogue::{self, Chosen};
use crate::scenario::traction::{PatternsName, Traction};
use crate::scenario::zs9::Zs9;
use crate::talk::{self, DriveOptions, TalkOptions};
use anyhow::Result;
use serde::Serialize;
use std::ffi::OsString;
use std::path::PathBuf;

/// The needs of a command line.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Needs {
    /// `pmasynrm` or `zs9`.
    pub system: &'static str,
    /// The control law: `tractive`, `pi` or `identification`.
    pub law: &'static str,
    /// The pulse patterns: `paper` or `optimal`.
    pub patterns: &'static str,
    /// The place where the drive runs.
    pub on: On,
    /// The machine that was named.
    pub machine: Option<String>,
    /// `true` if the image still has to be built.
    pub image: bool,
    /// `true` if the emulator still has to be found.
    pub emulator: bool,
    /// The script of a talk that was named.
    pub script: Option<PathBuf>,
    /// The machine folder that a commissioning makes, if the drive's image with its tables then still has to be built.
    pub tables: Option<PathBuf>,
}

impl Needs {
    fn of(system: &'static str, options: &RunOptions) -> Self {
        let in_qemu = options.on == On::Qemu;
        Self {
            system,
            law: options.law.name(),
            patterns: PatternsName::Paper.name(),
            on: options.on,
            machine: options.machine.clone(),
            image: in_qemu && options.image.is_none(),
            emulator: in_qemu && options.qemu.as_os_str() == "qemu-system-arm",
            script: None,
            tables: None,
        }
    }

    /// Made from the words after `run`.
    pub fn of_run(words: Vec<OsString>) -> Result<Self> {
        Ok(match catalogue::choose(words)? {
            Chosen::Traction(choice) => {
                let patterns = PatternsName::of(&choice.options.own, &choice.machine()?).name();
                Self { patterns, ..Self::of(Traction::NAME, &choice.options) }
            }
            Chosen::Zs9(choice) => Self::of(Zs9::NAME, &choice.options),
        })
    }

    /// Made for an identification.
    pub fn of_identify(identify: &Identify) -> Self {
        Self { law: "identification", ..Self::of(Traction::NAME, &identify.options.run) }
    }

    /// Made for a commissioning.
    pub fn of_commission(commission: &Commission) -> Self {
        let options = &commission.identify.options;
        let drives = options.on == On::Qemu && commission.until.is_none() && commission.drive_image.is_none();
        Self { tables: options.out.clone().filter(|_| drives), ..Self::of_identify(&commission.identify) }
    }

    /// Made for a talk.
    pub fn of_talk(options: &TalkOptions) -> Self {
        Self { script: options.script.clone(), ..Self::of_drive(&options.drive) }
    }

    /// Made for a drive that is talked to.
    pub fn of_drive(options: &DriveOptions) -> Self {
        let system = match options.system {
            talk::System::Pmasynrm => Traction::NAME,
            talk::System::Zs9 => Zs9::NAME,
        };
        Self::of(system, &options.run)
    }
}
