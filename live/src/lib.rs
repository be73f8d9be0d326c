//! The live bench: the drive's own code on its plant, in a browser.
//!
//! [`Bench`] is what the page's worker holds; it speaks in numbers, names and JSON. All that is simulated is the rig's
//! ([`tractive_rig::scenario::traction::Live`]); nothing here is.
#![forbid(unsafe_code)]

mod machine;

use anyhow::{Context, Result, bail};
use clap::{Args, FromArgMatches};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use tractive_rig::campaign::traction::{Cause, faults};
use tractive_rig::machine::Machine;
use tractive_rig::scenario::traction::{Command, Live, Options, Start, Sweep, Traction, Turning};
use tractive_rig::scenario::{Scenario, System};
use tractive_rig::trace::{Edge, Row};
use wasm_bindgen::prelude::*;

/// The value of a row in a column.
type Of = fn(&Row) -> f64;

/// The columns of [`Bench::rows`], in their order.
const COLUMNS: [(&str, Of); 16] = [
    ("ia", |row| row.ia_a),
    ("ib", |row| row.ib_a),
    ("ic", |row| row.ic_a),
    ("te", |row| row.te_nm),
    ("teRef", |row| row.te_ref_nm),
    ("speed", |row| row.speed_rpm),
    ("udc", |row| row.udc_v),
    ("id", |row| row.id_a),
    ("iq", |row| row.iq_a),
    ("idRef", |row| row.id_ref_a),
    ("iqRef", |row| row.iq_ref_a),
    ("u", |row| row.u_v),
    ("f1", |row| row.f1_hz),
    ("mapError", |row| row.map_error),
    ("mode", |row| f64::from(row.mode as u8)),
    ("line", |row| row.line_a.unwrap_or(0.0)),
];

/// The names of the columns.
#[wasm_bindgen]
pub fn columns() -> Vec<String> {
    COLUMNS.iter().map(|(name, _)| (*name).to_owned()).collect()
}

/// A drive on its bench.
#[wasm_bindgen]
pub struct Bench {
    machine: Machine,
    live: Live,
    step_s: f64,
    rows: Vec<Row>,
    edges: Vec<(f64, Edge)>,
}

#[wasm_bindgen]
impl Bench {
    /// Switched on at a speed in r/min, with words as on the rig's command line and rows of a step in s.
    #[wasm_bindgen(constructor)]
    pub fn new(words: Vec<String>, speed_rpm: f64, step_s: f64) -> Result<Bench, JsError> {
        let bench = || {
            let machine = machine::pmasynrm()?;
            let live = Live::new(&options(&words)?, &machine, Start { speed_rpm, step_s })?;
            Ok(Self { machine, live, step_s, rows: Vec::new(), edges: Vec::new() })
        };
        bench().map_err(told)
    }

    /// The machine's limits and curves, and the faults that can be injected, as JSON.
    pub fn properties(&self) -> String {
        let mut properties = machine::properties(&self.machine);
        properties["faults"] = faults().into_iter().skip(1).map(|fault| fault.name).collect();
        properties["step"] = self.step_s.into();
        properties.to_string()
    }

    /// Lets so much time pass, in s; returns the time since it was switched on, in s.
    pub fn run(&mut self, seconds: f64) -> Result<f64, JsError> {
        self.live.run(seconds).map_err(told)?;
        let (rows, edges) = self.live.take();
        self.rows.extend(rows);
        self.edges.extend(edges);
        Ok(self.live.time_s())
    }

    /// Time of the first row that [`Self::rows`] will hand over, in s; NaN where there is none.
    pub fn rows_from_s(&self) -> f64 {
        self.rows.first().map_or(f64::NAN, |row| row.t_s)
    }

    /// The rows since the last time, one behind the other.
    pub fn rows(&mut self) -> Vec<f32> {
        self.rows.drain(..).flat_map(|row| COLUMNS.map(|(_, of)| of(&row) as f32)).collect()
    }

    /// The gates' edges since the last time: time in s; gate, and 8 more where it goes on.
    pub fn edges(&mut self) -> Vec<f64> {
        let code = |edge: Edge| f64::from(edge.gate + if edge.on { 8 } else { 0 });
        self.edges.drain(..).flat_map(|(t_s, edge)| [t_s, code(edge)]).collect()
    }

    /// The operator's and the drive's word, as JSON.
    pub fn state(&self) -> String {
        let trip = self.live.trip().map(|trip| {
            json!({
                "fault": trip.fault.name(),
                "value": number(trip.value),
                "limit": number(trip.limit),
                "safe": format!("{:?}", trip.safe),
            })
        });
        let status = self.live.status().map(|status| {
            json!({
                "state": status.state.name(),
                "refusal": status.refusal.map(|refusal| refusal.name()),
                "torque": number(status.torque_nm),
                "precharge": status.switches.precharge,
                "main": status.switches.main,
                "discharge": status.switches.discharge,
                "chopper": number(status.switches.chopper),
            })
        });
        json!({ "t": self.live.time_s(), "trip": trip, "status": status }).to_string()
    }

    /// The link charged and the drive enabled (`on`), the gates off meanwhile (`coast`), the link emptied (`discharge`).
    pub fn want(&mut self, on: bool, coast: bool, discharge: bool) {
        self.live.wanted.on = on;
        self.live.wanted.coast = coast;
        self.live.wanted.discharge = discharge;
    }

    /// The torque that is commanded, in N·m.
    pub fn torque(&mut self, torque_nm: f64) {
        self.live.command(Command::Torque(torque_nm));
    }

    /// The speed that is commanded, in r/min.
    pub fn speed(&mut self, speed_rpm: f64) {
        self.live.command(Command::Speed(speed_rpm));
    }

    /// The rotor is held at a speed, in r/min.
    pub fn hold(&mut self, speed_rpm: f64) {
        self.live.turn_as(Turning::Held(speed_rpm));
    }

    /// The rotor is let go of, with an inertia in kg·m² and a load in N·m.
    pub fn release(&mut self, inertia_kg_m2: f64, load_nm: f64) {
        self.live.turn_as(Turning::Free(inertia_kg_m2, load_nm));
    }

    /// Voltage of the line, in V.
    pub fn line(&mut self, voltage_v: f64) {
        self.live.set_source_v(voltage_v);
    }

    /// By how much the true flux exceeds the map, in percent.
    pub fn map_error(&mut self, percent: f64) {
        self.live.set_flux_scale(1.0 + percent / 100.0);
    }

    /// The fault is acknowledged.
    pub fn acknowledge(&mut self) {
        self.live.acknowledge();
    }

    /// Something goes wrong, by its name in the fault campaign.
    pub fn inject(&mut self, name: &str) -> Result<(), JsError> {
        self.go_wrong(name).map_err(told)
    }

    /// Mends all that was injected.
    pub fn mend(&mut self) {
        self.live.mend();
    }

    /// Speed of the rotor, in r/min.
    pub fn speed_rpm(&self) -> f64 {
        self.live.speed_rpm()
    }
}

impl Bench {
    fn go_wrong(&mut self, name: &str) -> Result<()> {
        let fault = faults().into_iter().find(|fault| fault.name == name);
        match fault.with_context(|| format!("there is no fault `{name}`"))?.cause {
            Cause::Bench(kind) => self.live.inject(kind),
            Cause::Runaway => self.live.run_away(),
            Cause::Machine(flux_scale, resistance_scale) => {
                self.live.set_flux_scale(flux_scale);
                if resistance_scale != 1.0 {
                    bail!("`{name}`: the resistance is an option of the start");
                }
            }
        }
        Ok(())
    }
}

/// Figure 9's sweep on its ordinary bench: SHA-256 and length of its trace.csv, and what came of it, as JSON.
#[wasm_bindgen]
pub fn sweep() -> Result<String, JsError> {
    let run = || -> Result<Value> {
        let machine = machine::pmasynrm()?;
        let mut options = options(&[])?;
        let scenario = Sweep::default();
        options.run.dt = Some(scenario.trace_step_s(&options.own));
        let plan = scenario.plan(&options, &machine);
        let recording = Traction::run("sweep", plan, &options, &machine, None)?;
        let bytes = recording.trace_bytes()?;
        let sha256: String = Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect();
        Ok(json!({ "sha256": sha256, "bytes": bytes.len(), "rows": recording.rows.len() }))
    };
    run().map(|value| value.to_string()).map_err(told)
}

/// Options as on the rig's command line.
fn options(words: &[String]) -> Result<Options> {
    let command = Options::augment_args(clap::Command::new("live").no_binary_name(true));
    Ok(Options::from_arg_matches(&command.try_get_matches_from(words)?)?)
}

/// A number for JSON; text where it is not finite.
fn number(value: f32) -> Value {
    if value.is_finite() { f64::from(value).into() } else { value.to_string().into() }
}

/// An error in the page's words.
fn told(error: anyhow::Error) -> JsError {
    JsError::new(&format!("{error:#}"))
}
