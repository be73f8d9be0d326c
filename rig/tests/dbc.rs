//! The DBC files: the published ones, and those of other machines.

use can_dbc::Dbc;
use std::path::{Path, PathBuf};
use tractive::protocol::{Kind, Scales};
use tractive_rig::dbc::{messages, signals, text};
use tractive_rig::machine::Machine;

fn published() -> [PathBuf; 2] {
    ["docs/tractive.dbc", "python/tractive/tractive.dbc"]
        .map(|file| Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(file))
}

fn scales(machine: &str) -> Scales {
    Scales::of(&Machine::load(machine).unwrap().tables.ratings)
}

#[test]
fn the_published_files_are_what_the_code_says_of_the_papers_machines() {
    let wanted = text(Scales::USUAL);
    for path in published() {
        if std::env::var_os("TRACTIVE_RENEW_DBC").is_some() {
            std::fs::write(&path, &wanted).unwrap();
        }
        assert!(
            std::fs::read_to_string(&path).unwrap() == wanted,
            "{} is not what the code says; TRACTIVE_RENEW_DBC=1 cargo test -p tractive-rig --test dbc writes it anew",
            path.display()
        );
    }
    for machine in ["pmasynrm-180kw", "ipm-zs9"] {
        assert!(text(scales(machine)) == wanted, "{machine}");
    }
}

/// A DBC library reads of the file of 48 V what the code encodes.
#[test]
fn the_file_of_48_v_describes_its_frames() {
    let scales = scales("pmsm-48v-1kw");
    let file = text(scales);
    let dbc = Dbc::try_from(file.as_str()).unwrap();
    assert!(file.contains("SG_ torque_nm : 16|16@1- (0.001,0) [-30|30] \"N.m\" DRIVE"), "{file}");
    assert!(file.contains("SG_ scale : 36|4@1+ (1,0) [14|14] \"\" DRIVE"), "{file}");
    assert!(file.contains("SG_ link_v : 48|16@1+ (0.01,0) [0|650] \"V\" SUPERVISOR"), "{file}");
    for (message, _) in messages() {
        let described = dbc.messages.iter().find(|found| found.name == message.name).unwrap();
        let own = if message.name.starts_with("ZS9_") { Scales::USUAL } else { scales };
        let signals = signals(message, own);
        assert_eq!(described.signals.len(), signals.len(), "{}", message.name);
        for signal in signals.iter().filter(|signal| signal.kind != Kind::Float) {
            let found = described.signals.iter().find(|found| found.name == signal.name).unwrap();
            let step = f64::from(signal.scale) * f64::from(own.worth(signal.quantity));
            assert!((found.factor - step).abs() <= 1e-6 * step, "{}.{}", message.name, signal.name);
        }
    }
}
