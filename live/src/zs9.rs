//! The ZS9 in the page.

use crate::driven::{Column, Driven, Taken, pair, single};
use crate::told;
use anyhow::{Context, Result, bail};
use serde_json::{Value, json};
use tractive::nine_switch::Scheme;
use tractive::ports::MotorDemand;
use tractive_rig::campaign::dual::{Cause, faults};
use tractive_rig::machine::Machine;
use tractive_rig::scenario::live::{Command, Start, Turning, Wanted};
use tractive_rig::scenario::zs9::{Live, Options, link_v};
use tractive_rig::zs9::bound::{Stretch, currents};
use tractive_rig::zs9::trace::{Edge, Row};

/// The columns of a row, in their order.
pub const COLUMNS: [Column<Row>; 29] = [
    ("ia1", |row| row.motors[0].phases_a[0]),
    ("ib1", |row| row.motors[0].phases_a[1]),
    ("ic1", |row| row.motors[0].phases_a[2]),
    ("ia2", |row| row.motors[1].phases_a[0]),
    ("ib2", |row| row.motors[1].phases_a[1]),
    ("ic2", |row| row.motors[1].phases_a[2]),
    ("te1", |row| row.motors[0].torque_nm),
    ("te2", |row| row.motors[1].torque_nm),
    ("teRef1", |row| row.motors[0].torque_ref_nm),
    ("teRef2", |row| row.motors[1].torque_ref_nm),
    ("speed1", |row| row.motors[0].speed_rpm),
    ("speed2", |row| row.motors[1].speed_rpm),
    ("id1", |row| row.motors[0].id_a),
    ("iq1", |row| row.motors[0].iq_a),
    ("id2", |row| row.motors[1].id_a),
    ("iq2", |row| row.motors[1].iq_a),
    ("u1", |row| row.motors[0].voltage_v),
    ("u2", |row| row.motors[1].voltage_v),
    ("weak1", |row| row.motors[0].weakening.into()),
    ("weak2", |row| row.motors[1].weakening.into()),
    ("load1", |row| row.motors[0].load_nm),
    ("load2", |row| row.motors[1].load_nm),
    ("udc", |row| row.link_v),
    ("capacitor", |row| row.capacitor_v),
    ("inductor", |row| row.inductor_a),
    ("source", |row| row.source_v),
    ("duty", |row| 100.0 * row.duty),
    ("mode", |row| f64::from(scheme_code(row))),
    ("trip", |row| row.trip.is_some().into()),
];

/// 0 while no voltage is made, otherwise the scheme's place, from 1 on.
fn scheme_code(row: &Row) -> u8 {
    let made = row.motors.iter().any(|motor| motor.voltage_v > 0.0) && row.trip.is_none();
    let place = Scheme::ALL.iter().position(|scheme| *scheme == row.scheme).unwrap_or(0);
    if made { place as u8 + 1 } else { 0 }
}

/// Time for which edges are kept, in s: with so many gates, more would only be drawn as a band.
const EDGES_S: f64 = 0.1;

/// Time over which the bound's operating point is taken, in s.
const LOOKED_AT_S: f64 = 0.1;
/// The change of a speed and of a torque demand allowed in that time, as a share of the largest, and the speed below which no bound is asked, in r/min.
const STEADY: (f64, f64) = (0.005, 30.0);
/// Rows of the bound's current: those of the page's spectrum.
const BOUND_ROWS: usize = 4096;

/// The ZS9, with its last rows.
pub struct Zs9 {
    live: Live,
    machine: Machine,
    carrier_hz: f64,
    step_s: f64,
    kept: Vec<Row>,
    link_ref_v: f64,
    scheme: Scheme,
    gates: [bool; 9],
}

impl Zs9 {
    /// Switched on.
    pub fn new(options: &Options, machine: &Machine, start: Start) -> Result<Self> {
        Ok(Self {
            live: Live::new(options, machine, start)?,
            machine: machine.clone(),
            carrier_hz: options.own.carrier_hz.into(),
            step_s: start.step_s,
            kept: Vec::new(),
            link_ref_v: link_v(options, machine),
            scheme: options.own.scheme,
            gates: [false; 9],
        })
    }

    /// Both motors turn and make the torque that they made a while ago.
    fn is_steady(&self) -> bool {
        let (Some(first), Some(last)) = (self.kept.first(), self.kept.last()) else { return false };
        let largest_nm = self.machine.folder.parameters.max_torque_nm;
        last.trip.is_none()
            && last.t_s - first.t_s > 0.9 * LOOKED_AT_S
            && first.motors.iter().zip(&last.motors).all(|(first, last)| {
                last.voltage_v > 0.0
                    && last.speed_rpm.abs() >= STEADY.1
                    && (last.speed_rpm - first.speed_rpm).abs() <= STEADY.0 * last.speed_rpm.abs()
                    && (last.torque_ref_nm - first.torque_ref_nm).abs() <= STEADY.0 * largest_nm
            })
    }

    /// The newest edges, after the states that those before them have left.
    fn newest(&mut self, edges: &[Edge]) -> Vec<f64> {
        let from_s = self.live.time_s() - EDGES_S;
        let old = edges.partition_point(|edge| edge.t_s < from_s);
        for edge in &edges[..old] {
            self.gates[usize::from(edge.gate)] = edge.on;
        }
        let left = (0_u8..).zip(self.gates).map(|(gate, on)| Edge { t_s: from_s, gate, on });
        let left = left.take(if old > 0 { 9 } else { 0 });
        let codes = left.chain(edges[old..].iter().copied()).flat_map(|edge| code(&edge)).collect();
        for edge in &edges[old..] {
            self.gates[usize::from(edge.gate)] = edge.on;
        }
        codes
    }
}

/// A gate's edge as the page takes it.
pub fn code(edge: &Edge) -> [f64; 2] {
    [edge.t_s, f64::from(edge.gate + if edge.on { 16 } else { 0 })]
}

impl Driven for Zs9 {
    fn columns(&self) -> Vec<String> {
        COLUMNS.iter().map(|(name, _)| (*name).to_owned()).collect()
    }

    fn run(&mut self, seconds: f64) -> Result<()> {
        self.live.run(seconds)
    }

    fn time_s(&self) -> f64 {
        self.live.time_s()
    }

    fn take(&mut self, taken: &mut Taken) {
        let (rows, edges) = self.live.take();
        taken.from_s = taken.from_s.or(rows.first().map(|row| row.t_s));
        taken.rows.extend(rows.iter().flat_map(|row| COLUMNS.map(|(_, of)| of(row) as f32)));
        let edges = self.newest(&edges);
        taken.edges.extend(edges);
        self.kept.extend(rows);
        let gone = self.kept.len().saturating_sub((LOOKED_AT_S / self.step_s) as usize);
        self.kept.drain(..gone);
    }

    fn state(&self) -> Value {
        let status = self.live.status();
        let demands = status.map(|status| {
            json!(status.torque_nm.map(|demand| match demand {
                MotorDemand::Torque(demand) => demand.torque_nm,
                MotorDemand::Speed(speed) => speed,
            }))
        });
        told::state(self.live.time_s(), self.live.trip(), status.as_ref(), demands)
    }

    fn faults(&self) -> Vec<String> {
        faults().into_iter().skip(1).map(|fault| fault.name).collect()
    }

    fn want(&mut self, wanted: Wanted) {
        self.live.wanted = wanted;
    }

    fn set(&mut self, name: &str, motor: usize, values: &[f64]) -> Result<()> {
        match name {
            "torque" => self.live.command(motor, Command::Torque(single(name, values)?)),
            "speed" => self.live.command(motor, Command::Speed(single(name, values)?)),
            "hold" => self.live.turn_as(motor, Turning::Held(single(name, values)?)),
            "release" => {
                let (inertia_kg_m2, load_nm) = pair(name, values)?;
                self.live.turn_as(motor, Turning::Free(inertia_kg_m2, load_nm));
            }
            "line" => self.live.set_source_v(single(name, values)?),
            "map" => self.live.set_flux_scale(1.0 + single(name, values)? / 100.0),
            "link" => {
                self.link_ref_v = single(name, values)?;
                self.live.set_link(self.link_ref_v, self.scheme);
            }
            "scheme" => {
                let place = single(name, values)? as usize;
                self.scheme = *Scheme::ALL.get(place).context("there is no such scheme")?;
                self.live.set_link(self.link_ref_v, self.scheme);
            }
            _ => bail!("there is no setting `{name}`"),
        }
        Ok(())
    }

    fn acknowledge(&mut self) {
        self.live.acknowledge();
    }

    fn inject(&mut self, name: &str) -> Result<()> {
        let fault = faults().into_iter().find(|fault| fault.name == name);
        match fault.with_context(|| format!("there is no fault `{name}`"))?.cause {
            Cause::Bench(kind) => self.live.inject(kind),
            Cause::Runaway(motor) => self.live.run_away(motor),
            Cause::Flux(flux_scale) => self.live.set_flux_scale(flux_scale),
        }
        Ok(())
    }

    fn mend(&mut self) {
        self.live.mend();
    }

    fn bound(&self, motor: usize) -> Vec<f64> {
        let stretch = Stretch { carrier_hz: self.carrier_hz, step_s: self.step_s, count: BOUND_ROWS };
        let both = self.is_steady().then(|| currents(&self.kept, stretch, &self.machine)).flatten();
        both.and_then(|both| both.into_iter().nth(motor)).unwrap_or_default()
    }
}
