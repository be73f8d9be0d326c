//! `cargo rig identify`: an unknown machine identified by its own drive.
//!
//! The drive's own tasks run [`tractive::identification`] against a simulated machine; [`Fit`] makes a flux map, a resistance and a dead time from
//! their observations. Known beforehand is only what a nameplate says: the keys of `machine.toml` except resistance and inertia.

mod boundary;
mod check;
mod commander;
mod corrected;
mod equations;
mod experiment;
mod fit;
mod half;
mod outcome;
mod response;
mod signs;
mod toml;
mod turn;

pub use commander::{Commander, Ended};
pub use fit::Fit;
pub use outcome::{Outcome, Truth};
pub use signs::{Signs, saliency_deg};
pub use turn::Rotor;

use crate::can;
use crate::files::write_text;
use crate::folder::{Contents, check_place, csv, usual_page, write_folder};
use crate::machine::Machine;
use crate::options::{not_negative, positive};
use crate::report::{self, Page};
use crate::scenario::System;
use crate::scenario::traction::identification::{self, Stand};
use crate::scenario::traction::{Traction, TractionOptions};
use crate::trace::Recorded;
use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use serde_json::Map;
use std::path::PathBuf;
use std::process::ExitCode;
use tractive::identification::{Observation, PROBED_NOISE_SHARE, Stage};

/// The options of an identification.
#[derive(Clone, Debug, Args)]
#[command(mut_arg("out", |arg| arg.help("The machine folder to make")))]
pub struct Identify {
    /// The drive and its bench; of `--machine` only its nameplate is known, `--out` is the machine folder that is made.
    #[command(flatten)]
    pub options: crate::options::Options<TractionOptions>,
    /// Inertia of the free rotor, in kg·m²; default the folder's.
    #[arg(long, value_name = "KG_M2", value_parser = positive, allow_negative_numbers = true)]
    pub inertia: Option<f64>,
    /// Time from which on a current sensor reads too much, in s: the fault ends the experiment.
    #[arg(long, value_name = "SECONDS", value_parser = not_negative, allow_negative_numbers = true)]
    pub fault_at: Option<f64>,
    /// Command the drive over the protocol, like a board: charge, enable, stop, and collect its observations, frame by frame.
    #[arg(long)]
    pub over_protocol: bool,
    /// With --over-protocol: a file for the frames, in candump's log format.
    #[arg(long, value_name = "FILE", requires = "over_protocol")]
    pub frames: Option<PathBuf>,
    /// Identify the machine of a board on this CAN interface, for instance can0; on Linux.
    #[arg(long, value_name = "INTERFACE", conflicts_with_all = ["over_protocol", "on", "fault_at", "inertia"])]
    pub can: Option<String>,
    /// The page to write; default target/tractive/identify-NAME.html.
    #[arg(long, value_name = "FILE.html")]
    pub page: Option<PathBuf>,
}

/// Executes the command. Exit code 1 if a fault has ended the experiment; then nothing is written.
///
/// # Errors
/// Options that make no sense, observations that do not determine the machine, or a folder that the table generator refuses.
pub fn command(identify: &Identify) -> Result<ExitCode> {
    let Some(out) = &identify.options.out else {
        bail!("--out: must name the machine folder to make");
    };
    check_place(out)?;
    let machine = Machine::load(identify.options.machine.as_deref().unwrap_or(Traction::MACHINE))?;
    let outcome = match identified(identify, &machine)? {
        Ok(outcome) => outcome,
        Err(Ended { fault, value, limit, .. }) => {
            eprintln!("fault {fault}: {value} (limit {limit}): nothing is written{}", remedy(&fault));
            return Ok(ExitCode::from(1));
        }
    };
    write_folder(out, &contents(&outcome, &machine))?;
    let page = identify.page.clone().unwrap_or_else(|| usual_page("identify", machine.tables.name));
    write_page(&outcome, &machine, &page)?;
    if identify.options.json {
        crate::say!("{}", serde_json::to_string(outcome.figures().values())?);
    } else {
        crate::say!("{}\n", report::text(&outcome.figures()));
        if let Some(advice) = outcome.threshold_advice() {
            crate::say!("{advice}\n");
        }
        crate::say!("machine folder: {}\nreport: {}", out.display(), page.display());
    }
    Ok(ExitCode::SUCCESS)
}

/// Remedy for an experiment that has ended with a fault, as words that follow others.
fn remedy(fault: &str) -> &'static str {
    match fault {
        ROTOR_TURNED => {
            "; a light rotor swings under the pulses: couple it to what it drives (of a simulated one --inertia); else a load turns it, or its angle is wrong, of which commission tells more"
        }
        CURRENT_NOISE => {
            "; the readings of the current sensors at rest scatter too much: screen their leads, or filter or average what they read"
        }
        _ => "",
    }
}

/// Least share of the largest current that must be allowed for pulses against the magnets' flux: with less a rotor turns away.
const LEAST_ID_SHARE: f64 = 0.1;

/// The outcome of an experiment, or the fault that has ended it.
///
/// # Errors
/// As [`command`].
pub fn identified(identify: &Identify, machine: &Machine) -> Result<std::result::Result<Outcome, Ended>> {
    let (least_a, bound_a) = (machine.folder.parameters.min_id_a, machine.folder.parameters.max_current_a);
    ensure!(
        least_a <= -LEAST_ID_SHARE * bound_a,
        "min_id_a {least_a}: must be at or below {}: the experiment's pulses along d take {LEAST_ID_SHARE} of max_current_a",
        -LEAST_ID_SHARE * bound_a
    );
    if let Some(interface) = &identify.can {
        return on_bus(interface, machine);
    }
    Traction::check(&identify.options, &Map::new(), machine)?;
    let options = &Traction::filled(&identify.options, machine);
    let parameters = &machine.folder.parameters;
    let inertia_kg_m2 = identify.inertia.unwrap_or(parameters.rotor_inertia_kg_m2);
    let stand = Stand { inertia_kg_m2, fault_at_s: identify.fault_at };
    let (recording, observed) = if identify.over_protocol {
        let mut commander = Commander::new(&machine.tables.ratings);
        let recording = identification::drive_commanded(options, machine, &stand, &mut commander)?;
        if let Some(log) = &identify.frames {
            write_text(log, &commander.frames)?;
        }
        (recording, commander.finish())
    } else {
        let mut recording = identification::drive(options, machine, &stand)?;
        let observed = match recording.trip() {
            Some(trip) => Err(Ended {
                fault: trip.fault.name().to_owned(),
                value: trip.value.to_string(),
                limit: trip.limit.to_string(),
                ..Ended::default()
            }),
            None => Ok(std::mem::take(&mut recording.observations)),
        };
        (recording, observed)
    };
    let observations = match observed.and_then(|observations| complete(observations, bound_a)) {
        Ok(observations) => observations,
        Err(ended) => return Ok(Err(ended)),
    };
    let peak_a = recording.rows.iter().map(|row| row.id_a.hypot(row.iq_a)).fold(0.0, f64::max);
    let truth = Truth::of(options, machine, inertia_kg_m2)?;
    Outcome::of(&observations, peak_a, machine, Some(&truth)).map(Ok)
}

/// The fault of an experiment whose rotor has turned away.
pub const ROTOR_TURNED: &str = "rotor_turned";
/// The fault of an experiment whose currents do not follow the voltage.
pub const CURRENT_SENSORS: &str = "current_sensors";

/// The fault of an experiment that does not begin, because the currents are mostly noise.
pub const CURRENT_NOISE: &str = "current_noise";

/// Observations of an experiment that has run to its end. If its rotor is in the wrong place, because its angle is wrong or a load turns it, it ends
/// before the rotor is to turn; if its currents respond as no machine's do, it ends after its first pulses; if they are noise, before these.
fn complete(observations: Vec<Observation>, bound_a: f64) -> std::result::Result<Vec<Observation>, Ended> {
    let reached = |stage: Stage| observations.iter().any(|observation| observation.stage == stage);
    if reached(Stage::Turn) {
        return Ok(observations);
    }
    Err(if reached(Stage::Staircase) {
        let zero_deg = saliency_deg(&observations, bound_a);
        let (value, limit) = ("more".to_owned(), "5° before it is to turn".to_owned());
        Ended { fault: ROTOR_TURNED.to_owned(), value, limit, zero_deg, wiring: None }
    } else if !observations.iter().any(response::has_pulse) {
        let value = format!("{:.3} A", response::noise_a(&observations, bound_a));
        let limit = format!(
            "{:.3} A, root mean square of each phase: {:.2} % of max_current_a",
            f64::from(PROBED_NOISE_SHARE) * bound_a,
            100.0 * PROBED_NOISE_SHARE
        );
        Ended { fault: CURRENT_NOISE.to_owned(), value, limit, zero_deg: None, wiring: None }
    } else {
        let wiring = response::wiring(&observations);
        let value = wiring.map_or_else(|| "as no machine's".to_owned(), |wiring| wiring.to_string());
        let limit = "u,v,w, as the currents answer the first pulses".to_owned();
        Ended { fault: CURRENT_SENSORS.to_owned(), value, limit, zero_deg: None, wiring }
    })
}

/// The same for a drive on a CAN bus, whose true parameters nobody knows.
fn on_bus(interface: &str, machine: &Machine) -> Result<std::result::Result<Outcome, Ended>> {
    let mut commander = Commander::new(&machine.tables.ratings);
    can::command(interface, &mut commander)?;
    let bound_a = machine.folder.parameters.max_current_a;
    let observed = commander.finish().and_then(|observations| complete(observations, bound_a));
    let observations = match observed {
        Ok(observations) => observations,
        Err(ended) => return Ok(Err(ended)),
    };
    let currents = observations.iter().map(|observation| observation.current.length());
    let peak_a = currents.fold(0.0, f32::max);
    Outcome::of(&observations, peak_a.into(), machine, None).map(Ok)
}

/// The machine folder of an outcome.
pub fn contents(outcome: &Outcome, machine: &Machine) -> Contents {
    let parameters = &machine.folder.parameters;
    let map = outcome.fit.map(parameters.max_current_a);
    let [_, dead_time_s, threshold_v] = outcome.fit.errors();
    let about = format!(
        "# Identified by the drive: the gradient of one co-energy polynomial, fitted by least squares.\n\
         # The inverter's error is no part of it: dead time {:.2} us (standard error {:.2}), threshold {:.3} V ({:.3}).\n",
        1e6 * outcome.fit.dead_time_s,
        1e6 * dead_time_s,
        outcome.fit.threshold_v,
        threshold_v
    );
    Contents { toml: toml::of(outcome, &map, parameters), map: csv(&map, &about) }
}

/// The page: map, residuals, and the errors against the truth, which only a simulation knows.
fn write_page(outcome: &Outcome, machine: &Machine, path: &std::path::Path) -> Result<()> {
    if let Some(parent) = path.parent() {
        std::fs::create_dir_all(parent).with_context(|| format!("--page {}", path.display()))?;
    }
    let mut page = Page::new(machine.tables.name, "no figure: identified by its own drive");
    outcome.draw(machine, &mut page);
    let subtitle = format!("tractive {}", env!("CARGO_PKG_VERSION"));
    write_text(path, &page.finish(&subtitle, &outcome.figures())?)
}
