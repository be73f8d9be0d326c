//! Random cycles of the PMaSynRM drive.

use super::{Driven, corners, flaws, jumped, named, torques};
use crate::campaign::traction::{CycleResult, Drive, DriveCycle};
use anyhow::Result;
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use tractive::modulation::Mode;

/// Steepest change of speed, in r/min per s: what the machine does to its own rotor.
const STEEPEST_RPM_S: f64 = 3_000.0;
/// The line's voltages, in V, and its largest jump: what the drive has to bear under full load. With jumps of 600 V the square wave trips
/// now and then, by a hundredth over the level.
const LINE_V: (f64, f64) = (1_150.0, 1_750.0);
const LINE_JUMP_V: f64 = 200.0;

/// A random cycle: speeds between both directions' highest, torques that step or are slewed from one sign to the other, a line that
/// jumps, and, with `blocks`, gates that are blocked now and then.
pub fn cycle(drive: &Drive, duration_s: f64, seed: u64, blocks: bool) -> DriveCycle {
    let parameters = &drive.machine.folder.parameters;
    let mut random = StdRng::seed_from_u64(seed);
    let mut cycle = DriveCycle {
        speed: corners(&mut random, parameters.max_speed_rpm, STEEPEST_RPM_S, duration_s),
        torque: torques(&mut random, parameters.max_torque_nm, (0.1, duration_s)),
        duration_s,
        ..DriveCycle::default()
    };
    let (mut t_s, mut line_v) = (0.0, parameters.dc_link_nominal_v);
    while t_s < duration_s {
        line_v = jumped(&mut random, line_v, LINE_V, LINE_JUMP_V);
        cycle.line.push((t_s, line_v));
        t_s += random.random_range(0.2..2.0);
    }
    t_s = 3.0;
    while blocks && t_s < duration_s {
        let again_s = t_s + random.random_range(0.05..0.3);
        cycle.enable.extend([(t_s, false), (again_s, true)]);
        t_s = again_s + random.random_range(1.0..6.0);
    }
    cycle
}

/// Noise of the current sensors, in A rms.
const NOISE_A: f64 = 0.5;

/// Drives the cycle, which must not end in a trip.
pub fn drive(drive: &Drive, duration_s: f64, seed: u64, blocks: bool) -> Result<CycleResult> {
    let trip_current_a = drive.machine.folder.parameters.trip_current_a;
    drive.cycle(cycle(drive, duration_s, seed, blocks), flaws(trip_current_a, NOISE_A, seed))
}

impl From<CycleResult> for Driven {
    fn from(driven: CycleResult) -> Self {
        let tripped = driven.trip.map(|trip| {
            let at = driven.rows.iter().find(|row| row.trip.is_some());
            let (at_s, rpm) = at.map_or((f64::NAN, f64::NAN), |row| (row.t_s, row.speed_rpm));
            let before = driven.rows.iter().rev().find(|row| row.trip.is_none() && row.mode != Mode::Off);
            let mode = before.map_or("", |row| row.mode.name());
            format!("{} at {at_s:.3} s, {rpm:.0} r/min, {mode}", named(trip))
        });
        Self { peaks: driven.observed.until, tripped }
    }
}
