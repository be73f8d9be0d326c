//! The PMaSynRM drive in the page.

use crate::driven::{Column, Driven, Taken, number, pair, single};
use crate::told;
use anyhow::{Context, Result, bail};
use core::f64::consts::TAU;
use serde_json::Value;
use tractive::modulation::Mode;
use tractive_rig::bound;
use tractive_rig::campaign::traction::{Cause, Scale, faults};
use tractive_rig::machine::Machine;
use tractive_rig::scenario::live::{Command, Start, Turning, Wanted};
use tractive_rig::scenario::traction::{Live, Options};
use tractive_rig::trace::{Edge, Row};

/// The columns of a row, in their order.
pub const COLUMNS: [Column<Row>; 16] = [
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

/// Time over which the bound's operating point is taken, in s.
const LOOKED_AT_S: f64 = 0.1;
/// The share by which the speed may change in that time, and the lowest frequency in Hz.
const STEADY: (f64, f64) = (0.01, 2.0);
/// The highest frequency of the bound's lines, in Hz, and the smallest current, in A.
const LINES: (f64, f64) = (3_000.0, 0.05);
/// The largest number of samples for which a bound is worth the computing time.
const MOST_SAMPLES: usize = 20_000;

/// The PMaSynRM drive, with its last rows.
pub struct Traction {
    live: Live,
    machine: Machine,
    options: Options,
    kept: Vec<Row>,
    room: usize,
}

impl Traction {
    /// Switched on.
    pub fn new(options: Options, machine: Machine, start: Start) -> Result<Self> {
        let live = Live::new(&options, &machine, start)?;
        Ok(Self { live, machine, options, kept: Vec::new(), room: (LOOKED_AT_S / start.step_s) as usize })
    }

    fn turn_as(&mut self, turning: Turning) {
        self.live.turn_as(turning);
    }
}

/// A gate's edge as the page takes it.
pub fn edge((t_s, edge): &(f64, Edge)) -> [f64; 2] {
    [*t_s, f64::from(edge.gate + if edge.on { 16 } else { 0 })]
}

impl Driven for Traction {
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
        taken.edges.extend(edges.iter().flat_map(edge));
        self.kept.extend(rows);
        let gone = self.kept.len().saturating_sub(self.room);
        self.kept.drain(..gone);
    }

    fn state(&self) -> Value {
        let status = self.live.status();
        told::state(
            self.live.time_s(),
            self.live.trip(),
            status.as_ref(),
            status.map(|of| number(of.torque_nm)),
        )
    }

    fn faults(&self) -> Vec<String> {
        // Its operator knows no temperature sensors.
        let told =
            faults(&Scale::ONE).into_iter().skip(1).filter(|fault| !matches!(fault.cause, Cause::Sensor(..)));
        told.map(|fault| fault.name).collect()
    }

    fn want(&mut self, wanted: Wanted) {
        self.live.wanted = wanted;
    }

    fn set(&mut self, name: &str, _motor: usize, values: &[f64]) -> Result<()> {
        match name {
            "torque" => self.live.command(Command::Torque(single(name, values)?)),
            "speed" => self.live.command(Command::Speed(single(name, values)?)),
            "hold" => self.turn_as(Turning::Held(single(name, values)?)),
            "release" => {
                let (inertia_kg_m2, load_nm) = pair(name, values)?;
                self.turn_as(Turning::Free(inertia_kg_m2, load_nm));
            }
            "line" => self.live.set_source_v(single(name, values)?),
            "map" => self.live.set_flux_scale(1.0 + single(name, values)? / 100.0),
            _ => bail!("there is no setting `{name}`"),
        }
        Ok(())
    }

    fn acknowledge(&mut self) {
        self.live.acknowledge();
    }

    fn inject(&mut self, name: &str) -> Result<()> {
        let fault = faults(&Scale::ONE).into_iter().find(|fault| fault.name == name);
        match fault.with_context(|| format!("there is no fault `{name}`"))?.cause {
            Cause::Bench(kind) => self.live.inject(kind),
            Cause::Runaway => self.live.run_away(),
            Cause::Machine(flux_scale, resistance_scale) => {
                self.live.set_flux_scale(flux_scale);
                self.live.set_resistance_scale(resistance_scale);
            }
            Cause::Sensor(..) => bail!("`{name}`: no temperature sensors here"),
        }
        Ok(())
    }

    fn mend(&mut self) {
        self.live.mend();
    }

    fn bound(&self, _motor: usize) -> Vec<f64> {
        let (Some(first), Some(last)) = (self.kept.first(), self.kept.last()) else { return Vec::new() };
        let steady = self.kept.iter().all(|row| row.mode == last.mode)
            && (first.speed_rpm - last.speed_rpm).abs() <= STEADY.0 * last.speed_rpm.abs();
        if last.mode == Mode::Off || !steady || last.f1_hz.abs() < STEADY.1 {
            return Vec::new();
        }
        let f1_hz = last.f1_hz.abs();
        // Whole turns, so that means are those of the operating point.
        let turns = ((last.t_s - first.t_s) * f1_hz).floor().max(1.0);
        let rows = self.kept.iter().position(|row| last.t_s - row.t_s < turns / f1_hz).unwrap_or(0);
        let ideal = bound::ideal(&self.kept[rows..], self.options.pulse_limits(&self.machine), &self.machine);
        ideal.filter(|ideal| ideal.current_a.len() <= MOST_SAMPLES).map_or(Vec::new(), |ideal| {
            let turned =
                ideal.angle.last().zip(ideal.angle.first()).map_or(0.0, |(last, first)| last - first);
            lines(&ideal.current_a, f1_hz / (turned / TAU).round().max(1.0)).into_iter().flatten().collect()
        })
    }
}

/// The lines of an evenly sampled period's spectrum, at multiples of a frequency in Hz.
fn lines(samples: &[f64], step_hz: f64) -> Vec<[f64; 2]> {
    let count = samples.len() as f64;
    let line = |bin: u32| {
        let (turn_sin, turn_cos) = (TAU * f64::from(bin) / count).sin_cos();
        let (mut cos, mut sin) = (1.0, 0.0);
        let (mut real, mut imaginary) = (0.0, 0.0);
        for sample in samples {
            (real, imaginary) = (real + sample * cos, imaginary + sample * sin);
            (cos, sin) = (cos * turn_cos - sin * turn_sin, sin * turn_cos + cos * turn_sin);
        }
        [f64::from(bin) * step_hz, 2.0 * real.hypot(imaginary) / count]
    };
    let bins = (LINES.0 / step_hz) as u32;
    (1..=bins).map(line).filter(|[_, current_a]| *current_a > LINES.1).collect()
}
