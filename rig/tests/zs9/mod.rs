//! The tools that the ZS9's tests share: a plain pattern, not the product's, and a plain current control.
#![allow(dead_code)]

use std::f64::consts::{PI, TAU};
use std::path::Path;
use tractive_rig::plant::SpeedSource;
use tractive_rig::plant::zs9::{IllegalState, LegGates, Zs9Plant, Zs9Settings};
use tractive_tablegen::MachineFolder;

/// Carrier period.
pub const PERIOD_S: f64 = 100e-6;
pub const SOURCE_V: f64 = 400.0;

pub fn machine() -> MachineFolder {
    MachineFolder::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../tables/ipm-zs9")).unwrap()
}

pub fn turning(rpm: f64) -> SpeedSource {
    SpeedSource::profile(vec![(0.0, rpm)])
}

/// Motors at prescribed speeds.
pub fn plant_at(rpm: [f64; 2], settings: &Zs9Settings) -> Zs9Plant {
    let machine = machine();
    Zs9Plant::new([&machine, &machine], rpm.map(turning), settings)
}

const L: [LegGates; 3] = [LegGates::ZERO, LegGates::ONE, LegGates::MINUS_ONE];

/// Leg states 0, 1, and 2 for −1.
fn legs(states: [usize; 3]) -> [LegGates; 3] {
    states.map(|state| L[state])
}

const UPPER: [[usize; 3]; 6] = [[1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1], [1, 0, 1]];
const LOWER: [[usize; 3]; 6] = [[2, 1, 1], [2, 2, 1], [1, 2, 1], [1, 2, 2], [1, 1, 2], [2, 1, 2]];

/// The two vectors next to an angle, with their shares of the period for a modulation index m.
fn active(table: &[[usize; 3]; 6], m: f64, angle: f64) -> [([LegGates; 3], f64); 2] {
    let angle = angle.rem_euclid(TAU);
    let sector = ((angle / (PI / 3.0)) as usize).min(5);
    let a = angle - sector as f64 * PI / 3.0;
    let share = 0.75_f64.sqrt() * m;
    [(legs(table[sector]), share * (PI / 3.0 - a).sin()), (legs(table[(sector + 1) % 6]), share * a.sin())]
}

/// A period of gates with their shares of it: (modulation index, angle in rad) of both motors, shoot-through duty.
pub fn pattern(upper: (f64, f64), lower: (f64, f64), duty: f64) -> Vec<([LegGates; 3], f64)> {
    let (mut first, mut second) = (active(&UPPER, upper.0, upper.1), active(&LOWER, lower.0, lower.1));
    let used: f64 = first.iter().chain(&second).map(|(_, share)| share).sum();
    // What asks for more than the period is shortened.
    let fitting = (1.0 - duty).min(used);
    for (_, share) in first.iter_mut().chain(&mut second) {
        *share *= fitting / used.max(1e-9);
    }
    let zero = 1.0 - duty - fitting;
    let short = [LegGates::SHOOT_THROUGH, LegGates::ZERO, LegGates::ZERO];
    let [a, b] = first;
    let [c, d] = second;
    let (v14, v15) = (legs([0; 3]), legs([2; 3]));
    vec![(short, 0.5 * duty), a, b, (v14, 0.5 * zero), (short, 0.5 * duty), c, d, (v15, 0.5 * zero)]
}

/// A period of the plant with voltages that keep to the rotor frames: (d, q) indices of both motors.
pub fn period(plant: &mut Zs9Plant, indices: [(f64, f64); 2], duty: f64) -> Result<(), IllegalState> {
    let [upper, lower] = [0, 1].map(|k| {
        let motor = &plant.motors[k];
        let omega = motor.speed_rpm() * TAU / 60.0 * 4.0;
        let (d, q) = indices[k];
        // Seen from the middle of the motor's own half.
        let ahead = omega * PERIOD_S * [0.2, 0.7][k];
        (d.hypot(q), q.atan2(d) + motor.angle_turns() * TAU + ahead)
    });
    for (gates, share) in pattern(upper, lower, duty) {
        if share > 0.0 {
            plant.advance(gates, share * PERIOD_S)?;
        }
    }
    Ok(())
}

/// Depths that hold a current at a speed, with a link voltage: `m = 2 u / U_in`.
pub fn depth_for(current: (f64, f64), rpm: f64, link_v: f64) -> (f64, f64) {
    let (id, iq) = current;
    let omega = rpm * TAU / 60.0 * 4.0;
    let ud = 0.12 * id - omega * 5e-3 * iq;
    let uq = 0.12 * iq + omega * (0.33 + 2.5e-3 * id);
    (2.0 * ud / link_v, 2.0 * uq / link_v)
}

/// The indices that lead the currents to a reference: feed-forward and a proportional part, by the measured link.
pub fn regulated(plant: &Zs9Plant, references: [(f64, f64); 2]) -> [(f64, f64); 2] {
    const BANDWIDTH: f64 = 1500.0;
    let link_v = plant.link_v();
    [0, 1].map(|k| {
        let motor = &plant.motors[k];
        let ((id, iq), (rd, rq)) = (motor.currents_dq(), references[k]);
        let (d, q) = depth_for(references[k], motor.speed_rpm(), link_v);
        let (pd, pq) = (BANDWIDTH * 2.5e-3 * (rd - id), BANDWIDTH * 5e-3 * (rq - iq));
        (d + 2.0 * pd / link_v, q + 2.0 * pq / link_v)
    })
}
