//! A machine folder, as the plant and as the firmware's tables.

use anyhow::{Result, bail};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use tractive::built_in;
use tractive::machine::Tables;
use tractive_tablegen::MachineFolder;

/// A machine folder and the tables made from it.
#[derive(Clone)]
pub struct Machine {
    /// The folder that was read.
    pub folder: MachineFolder,
    /// The tables that the firmware's code runs on; made once, kept for the program's lifetime.
    pub tables: &'static Tables,
}

impl Machine {
    /// Reads a machine: a path to a folder, or the name of one in `tables/`. Its tables are made once, however often it is read.
    pub fn load(name_or_path: &str) -> Result<Self> {
        let source = Source::read(find(name_or_path)?);
        let loaded = || LOADED.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, machine)) = loaded().iter().find(|(other, _)| *other == source) {
            return Ok(machine.clone());
        }
        let folder = MachineFolder::read(&source.folder)?;
        let machine = match source.built_in() {
            Some(tables) => Self { folder, tables },
            None => Self::of(folder),
        };
        loaded().push((source, machine.clone()));
        Ok(machine)
    }

    /// The machine of a folder, with tables made from it.
    pub fn of(folder: MachineFolder) -> Self {
        let tables = Box::leak(Box::new(folder.tables()));
        Self { folder, tables }
    }

    /// `true` if it is the machine of this name in `tables/`, by its contents.
    pub fn is(&self, name: &str) -> bool {
        let same = |named: &Self| {
            let (own, other) = (&self.folder, &named.folder);
            own.parameters == other.parameters && own.map == other.map
        };
        // A browser has no files; there the papers' machines are the built-in ones.
        let built_in = [&built_in::traction::BUILT_IN, &built_in::zs9::BUILT_IN];
        let papers = cfg!(not(unix)) && built_in.iter().any(|tables| std::ptr::eq(*tables, self.tables));
        self.tables.name == name && (papers || Self::load(name).is_ok_and(|named| same(&named)))
    }

    /// Largest torque at a mechanical speed in r/min, in N·m: the machine's largest, or what its largest power allows.
    pub fn envelope_nm(&self, speed_rpm: f64) -> f64 {
        let parameters = &self.folder.parameters;
        let omega = speed_rpm.abs() * core::f64::consts::TAU / 60.0;
        (parameters.max_power_w / omega.max(1e-3)).min(parameters.max_torque_nm)
    }
}

/// The source of a machine, and its contents.
#[derive(PartialEq)]
struct Source {
    folder: PathBuf,
    /// `None` for a file that cannot be read: then there is no machine.
    files: [Option<Vec<u8>>; 2],
}

impl Source {
    fn read(folder: PathBuf) -> Self {
        let files = ["machine.toml", "flux_map.csv"]
            .map(|name| tractive_tablegen::read_bounded(&folder.join(name)).ok());
        Self { folder, files }
    }

    /// The tables that `tractive` was built with, if they were made from these files: making them takes a quarter of a second.
    fn built_in(&self) -> Option<&'static Tables> {
        let tables: [&'static Tables; 2] = [&built_in::traction::BUILT_IN, &built_in::zs9::BUILT_IN];
        let same =
            |(files, _): &([&[u8]; 2], _)| self.files.each_ref().map(Option::as_deref) == files.map(Some);
        PAPERS.and_then(|papers| papers.into_iter().zip(tables).find(same).map(|(_, tables)| tables))
    }
}

/// The files of a folder in `tables/`.
macro_rules! files {
    ($name:literal) => {
        [
            include_bytes!(concat!("../../tables/", $name, "/machine.toml")),
            include_bytes!(concat!("../../tables/", $name, "/flux_map.csv")),
        ]
    };
}

/// The files of the papers' machines, which are built in unless the environment names others; none in a browser, where there are no files.
const PAPERS: Option<[[&[u8]; 2]; 2]> =
    match (cfg!(unix), option_env!("TRACTIVE_MACHINE"), option_env!("TRACTIVE_ZS9_MACHINE")) {
        (true, None, None) => Some([files!("pmasynrm-180kw"), files!("ipm-zs9")]),
        _ => None,
    };

/// The machines that this program has read.
static LOADED: Mutex<Vec<(Source, Machine)>> = Mutex::new(Vec::new());

fn find(name_or_path: &str) -> Result<PathBuf> {
    let tables = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tables");
    let candidates = [PathBuf::from(name_or_path), tables.join(name_or_path)];
    match candidates.iter().find(|path| path.is_dir()) {
        Some(path) => Ok(path.clone()),
        None => bail!("machine {name_or_path}: must be a folder, or the name of one in tables/"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_built_in_tables_are_those_that_the_folder_makes() {
        for name in ["pmasynrm-180kw", "ipm-zs9"] {
            let machine = Machine::load(name).unwrap();
            let built_in = Source::read(find(name).unwrap()).built_in();
            assert_eq!(built_in.is_some(), PAPERS.is_some());
            assert!(built_in.is_none_or(|tables| std::ptr::eq(tables, machine.tables)));
            assert_eq!(format!("{:?}", machine.tables), format!("{:?}", machine.folder.tables()));
        }
        assert!(Source::read(find("pmsm-48v-1kw").unwrap()).built_in().is_none());
    }

    #[test]
    fn a_machine_is_made_anew_when_its_folder_has_changed_and_only_then() {
        let folder = tempfile::tempdir().unwrap();
        let name = folder.path().display().to_string();
        for file in ["machine.toml", "flux_map.csv"] {
            std::fs::copy(find("pmasynrm-180kw").unwrap().join(file), folder.path().join(file)).unwrap();
        }
        let [first, again] = [(); 2].map(|()| Machine::load(&name).unwrap());
        assert!(std::ptr::eq(first.tables, again.tables));
        let toml = folder.path().join("machine.toml");
        let text = std::fs::read_to_string(&toml).unwrap();
        std::fs::write(&toml, text.replace("max_torque_nm = 1235.0", "max_torque_nm = 1000.0")).unwrap();
        let changed = Machine::load(&name).unwrap();
        assert_eq!(changed.tables.ratings.max_torque_nm, 1000.0);
        assert_eq!(changed.folder.parameters.max_torque_nm, 1000.0);
        std::fs::write(&toml, "nonsense").unwrap();
        assert!(Machine::load(&name).is_err());
    }
}
