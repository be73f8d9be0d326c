//! The DBC files: the published ones, and those of other machines.

use can_dbc::Dbc;
use std::path::{Path, PathBuf};
use tractive::machine::Ratings;
use tractive::protocol::Kind;
use tractive_rig::dbc::{messages, scales, signals, text};
use tractive_rig::machine::Machine;

fn published() -> [PathBuf; 2] {
    ["docs/tractive.dbc", "python/tractive/tractive.dbc"]
        .map(|file| Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(file))
}

fn ratings(machine: &str) -> &'static Ratings {
    &Machine::load(machine).unwrap().tables.ratings
}

#[test]
fn the_published_files_are_what_the_code_says_of_the_papers_machines() {
    let wanted = text(ratings("pmasynrm-180kw"));
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
    assert!(text(ratings("ipm-zs9")) == wanted);
}

/// A DBC library reads of the file of 48 V what the code encodes.
#[test]
fn the_file_of_48_v_describes_its_frames() {
    let ratings = ratings("pmsm-48v-1kw");
    let file = text(ratings);
    let dbc = Dbc::try_from(file.as_str()).unwrap();
    assert!(file.contains("SG_ torque_nm : 16|16@1- (0.001,0) [-30|30] \"N.m\" DRIVE"), "{file}");
    assert!(file.contains("SG_ scale : 36|4@1+ (1,0) [14|14] \"\" DRIVE"), "{file}");
    assert!(file.contains("SG_ link_v : 48|16@1+ (0.01,0) [0|650] \"V\" SUPERVISOR"), "{file}");
    // Of two such motors on a ZS9: 106 V of its capacitor in the usual steps.
    assert!(file.contains("SG_ torque1_nm m0 : 16|16@1- (0.001,0) [-30|30] \"N.m\" ZS9"), "{file}");
    assert!(file.contains("SG_ current_a : 48|16@1+ (0.01,0) [0|300] \"A\" SUPERVISOR"), "{file}");
    assert!(file.contains("SG_ capacitor_v : 32|16@1+ (0.1,0) [0|6500] \"V\" SUPERVISOR"), "{file}");
    for (message, _) in messages() {
        let described = dbc.messages.iter().find(|found| found.name == message.name).unwrap();
        let own = scales(message, ratings);
        let signals = signals(message, own);
        assert_eq!(described.signals.len(), signals.len(), "{}", message.name);
        for signal in signals.iter().filter(|signal| signal.kind != Kind::Float) {
            let found = described.signals.iter().find(|found| found.name == signal.name).unwrap();
            let step = f64::from(signal.scale) * f64::from(own.worth(signal.quantity));
            assert!((found.factor - step).abs() <= 1e-6 * step, "{}.{}", message.name, signal.name);
        }
    }
}
