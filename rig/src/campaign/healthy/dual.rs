//! Random cycles of the ZS9.

use super::{Driven, corners, flaws, jumped, named, torques};
use crate::campaign::dual::{CycleResult, Drive, DriveCycle, Script};
use crate::zs9::bench::Course;
use anyhow::Result;
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use tractive::nine_switch::Scheme;

/// Highest speed, in r/min: the cycle's cruise.
const MOST_RPM: f64 = 1_300.0;
/// Steepest change of speed if the torque is demanded, in r/min per s.
const STEEPEST_RPM_S: f64 = 3_000.0;
/// Steepest change of a demanded speed, in r/min per s: half of what full torque does to the rotor.
const WANTED_RPM_S: f64 = 5_000.0;
/// Largest load, in N·m: half of what is available at the highest speed.
const LOAD_NM: f64 = 45.0;
/// Range of the source, in V: a tenth to either side; and its largest jump.
const SOURCE_V: (f64, f64) = (320.0, 460.0);
const SOURCE_JUMP_V: f64 = 80.0;
/// Noise of the current sensors, in A rms.
const NOISE_A: f64 = 0.2;

/// A random cycle: each motor follows torques that jump or are slewed from one sign to the other at a speed that goes up and down, or
/// follows a speed with a load that jumps; the source jumps and the scheme changes.
pub fn cycle(drive: &Drive, duration_s: f64, seed: u64) -> DriveCycle {
    let parameters = &drive.machine.folder.parameters;
    let mut random = StdRng::seed_from_u64(seed);
    let motors = [0, 1].map(|_| {
        if random.random_bool(0.5) {
            Script::Torque {
                speed_rpm: corners(&mut random, MOST_RPM, STEEPEST_RPM_S, duration_s),
                torque_nm: torques(&mut random, parameters.max_torque_nm, (0.0, duration_s)),
            }
        } else {
            by_speed(&mut random, duration_s)
        }
    });
    let mut course = Course::default();
    let (mut t_s, mut source_v) = (0.0, 400.0);
    while t_s < duration_s {
        t_s += random.random_range(0.1..1.5);
        source_v = jumped(&mut random, source_v, SOURCE_V, SOURCE_JUMP_V);
        course.source_v.push((t_s, source_v));
    }
    t_s = 0.0;
    while t_s < duration_s {
        t_s += random.random_range(0.3..3.0);
        course.schemes.push((t_s, Scheme::ALL[random.random_range(0..Scheme::ALL.len())]));
    }
    DriveCycle { motors, course, duration_s }
}

fn by_speed(random: &mut StdRng, duration_s: f64) -> Script {
    let wanted_rpm = corners(random, MOST_RPM, WANTED_RPM_S, duration_s);
    let mut load_nm = Vec::new();
    let mut t_s = 0.0;
    while t_s < duration_s {
        load_nm.push((t_s, random.random_range(-LOAD_NM..LOAD_NM)));
        t_s += random.random_range(0.05..1.0);
    }
    Script::Speed { wanted_rpm, load_nm }
}

/// Step of the trace, in s.
const STEP_S: f64 = 1e-3;

/// Drives the cycle, which must not end in a trip.
pub fn drive(drive: &Drive, duration_s: f64, seed: u64) -> Result<CycleResult> {
    let trip_current_a = drive.machine.folder.parameters.trip_current_a;
    drive.cycle(cycle(drive, duration_s, seed), flaws(trip_current_a, NOISE_A, seed), STEP_S, 0)
}

impl From<CycleResult> for Driven {
    fn from(driven: CycleResult) -> Self {
        let tripped = driven.trip.map(|trip| {
            let last = driven.rows.last();
            let [upper, lower] =
                last.map_or([f64::NAN; 2], |row| row.motors.each_ref().map(|motor| motor.speed_rpm));
            let scheme = last.map_or("", |row| row.scheme.name());
            format!("{} at {:.3} s, {upper:.0} and {lower:.0} r/min, {scheme}", named(trip), driven.ended_s)
        });
        Self { peaks: driven.observed.until, tripped }
    }
}
