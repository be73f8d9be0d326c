//! The bound set by the nine-switch modulator's own pulses: the phase currents of both motors in steady state, without any control.
//!
//! The pulses' volt-seconds, less those of the fundamental, are the ripple of the flux linkage. Added to the mean flux linkage of the
//! operating point and converted into current by the inductances there, they give the least that any control could reach with these pulses. The
//! motors turn at their own speeds, so nothing repeats, and the result is a stretch of time.

use super::trace::{MotorRow, Row};
use crate::machine::Machine;
use core::f64::consts::TAU;
use tractive::frames::Angle;
use tractive::nine_switch::{GatePattern, MotorVoltage, Period, Request, step};
use tractive_tablegen::SmoothMap;

/// Instants in a row's step at which the current is taken; a row holds their mean.
const WITHIN_ROW: usize = 4;

/// The stretch of time that is requested.
#[derive(Clone, Copy, Debug)]
pub struct Stretch {
    /// Carrier frequency, in Hz.
    pub carrier_hz: f64,
    /// Step of the rows, in s.
    pub step_s: f64,
    /// Number of rows, the last of which is that of the operating point.
    pub count: usize,
}

/// Current of phase u of either motor in A, row by row, at the operating point that some rows in steady state hold; `None` if a motor
/// stands still or does not get the voltage that it needs.
pub fn currents(rows: &[Row], stretch: Stretch, machine: &Machine) -> Option<[Vec<f64>; 2]> {
    let (last, count) = (rows.last()?, rows.len() as f64);
    let link_v = rows.iter().map(|row| row.link_v).sum::<f64>() / count;
    let duty = rows.iter().map(|row| row.duty).sum::<f64>() / count;
    let end_s = last.t_s + stretch.step_s;
    let begin_s = end_s - stretch.count as f64 * stretch.step_s;
    let motors = [0, 1].map(|k| Motor::of(rows, k, stretch, machine));
    let [Some(upper), Some(lower)] = motors else { return None };
    let motors = [upper, lower];
    let mut flux = [0, 1].map(|_| Vec::with_capacity(stretch.count * WITHIN_ROW));
    let mut pulses =
        Pulses { carrier_hz: stretch.carrier_hz, link_v, duty, row: last, alpha_beta: [(0.0, 0.0); 2] };
    let within_s = stretch.step_s / WITHIN_ROW as f64;
    let mut next = 0;
    let instant = |sample: usize| begin_s + (sample as f64 + 0.5) * within_s;
    let first = (begin_s * stretch.carrier_hz).floor() as i64;
    let end = (end_s * stretch.carrier_hz).ceil() as i64;
    for period in first..end {
        let (from_s, middle_s) = (pulses.at_s(period, 0.0), pulses.at_s(period, 0.5));
        let edges =
            pulses.edges(&pulses.gates(
                [0, 1].map(|k| motors[k].voltage_angle(middle_s)),
                [0, 1].map(|k| motors[k].voltage_v),
            )?);
        let mut since = 0.0;
        for (until, levels) in edges {
            let until_s = pulses.at_s(period, until);
            while next < stretch.count * WITHIN_ROW && instant(next) < until_s {
                let share = ((instant(next) - from_s) * stretch.carrier_hz).max(since);
                pulses.pass(share - since, levels);
                since = share;
                (0..2).for_each(|k| flux[k].push(motors[k].ripple(pulses.alpha_beta[k], instant(next))));
                next += 1;
            }
            pulses.pass(until - since, levels);
            since = until;
        }
    }
    let [upper, lower] = flux;
    Some([motors[0].phase_u(&upper, instant), motors[1].phase_u(&lower, instant)])
}

/// The pulses, with the volt-seconds that they have applied to the motors so far.
struct Pulses<'a> {
    carrier_hz: f64,
    link_v: f64,
    duty: f64,
    row: &'a Row,
    /// Volt-seconds of both motors, (α, β) in Wb.
    alpha_beta: [(f64, f64); 2],
}

/// The levels of the three nodes of both motors, as shares of the link.
type Levels = [[f64; 3]; 2];

impl Pulses<'_> {
    /// The instant in a carrier period, in s.
    fn at_s(&self, period: i64, share: f64) -> f64 {
        (period as f64 + share) / self.carrier_hz
    }

    /// The gates of a period with these voltages; `None` if they do not fit.
    fn gates(&self, angles: [f64; 2], voltages_v: [f64; 2]) -> Option<Period> {
        let [upper, lower] = [0, 1].map(|k| MotorVoltage {
            angle: Angle::from_turns((angles[k] / TAU).rem_euclid(1.0) as f32),
            modulation_index: (2.0 * voltages_v[k] / self.link_v) as f32,
        });
        let request = Request { scheme: self.row.scheme, upper, lower, shoot_through: self.duty as f32 };
        step(&request).ok().filter(|period| period.applied.feasible())
    }

    /// Stretches of a period, each given by its end as a share of the period, with the levels until then.
    fn edges(&self, period: &Period) -> Vec<(f64, Levels)> {
        let toggles = period.gates.iter().flat_map(GatePattern::toggles).map(f64::from);
        let mut ends: Vec<f64> = toggles.chain([1.0]).collect();
        ends.sort_by(f64::total_cmp);
        ends.dedup();
        let mut from = 0.0;
        let stretch = |end: f64| {
            let levels = levels(&period.gates, 0.5 * (from + end));
            from = end;
            (end, levels)
        };
        ends.into_iter().map(stretch).collect()
    }

    /// Lets a share of a period pass.
    fn pass(&mut self, share: f64, levels: Levels) {
        let volt_seconds = share / self.carrier_hz * self.link_v;
        for ((alpha, beta), [a, b, c]) in self.alpha_beta.iter_mut().zip(levels) {
            *alpha += volt_seconds * (2.0 * a - b - c) / 3.0;
            *beta += volt_seconds * (b - c) / 3.0_f64.sqrt();
        }
    }
}

/// The nodes at an instant of a period: the upper motor's are high while H is on, the lower one's are low while L is; while a leg shorts the
/// link, there is no voltage.
fn levels(gates: &[GatePattern; 9], at: f64) -> Levels {
    let on = gates.map(|gate| {
        // A pause that meets its mirror image covers the middle, too.
        let mirrored = at.min(1.0 - at) as f32;
        !(gate.off_from < mirrored && mirrored <= gate.off_to)
    });
    if (0..3).any(|leg| on[leg] && on[leg + 3] && on[leg + 6]) {
        return [[0.0; 3]; 2];
    }
    let level = |high: bool| if high { 1.0 } else { 0.0 };
    [[0, 1, 2].map(|leg| level(on[leg])), [0, 1, 2].map(|leg| level(!on[leg + 6]))]
}

/// A motor in steady state.
struct Motor {
    /// Angle of its rotor in rad at an instant in s, and its electrical speed in rad/s.
    rotor: (f64, f64, f64),
    /// Mean currents (d, q), in A.
    current_a: (f64, f64),
    /// Change of current per change of flux linkage, in A/Wb: d of d, d of q, q of d, q of q.
    softness: [f64; 4],
    /// The voltage that these currents need, in V, and its angle ahead of the rotor's, in rad.
    voltage_v: f64,
    ahead: f64,
}

/// The least electrical speed, in rad/s: slower motors hardly turn in the time considered.
const LEAST_RAD_S: f64 = 12.0;

impl Motor {
    /// Motor 0 or 1 of rows in steady state.
    fn of(rows: &[Row], k: usize, stretch: Stretch, machine: &Machine) -> Option<Self> {
        let parameters = &machine.folder.parameters;
        let last = &rows.last()?.motors[k];
        let omega = TAU * last.speed_rpm * f64::from(parameters.pole_pairs) / 60.0;
        let mean = |value: fn(&MotorRow) -> f64| {
            rows.iter().map(|row| value(&row.motors[k])).sum::<f64>() / rows.len() as f64
        };
        let (id, iq) = (mean(|row| row.id_a), mean(|row| row.iq_a));
        let at = SmoothMap::new(&machine.folder.map).at(id, iq);
        let determinant = at.ldd_h * at.lqq_h - at.ldq_h * at.lqd_h;
        let r = parameters.stator_resistance_ohm;
        let (ud, uq) = (r * id - omega * at.psi_q_wb, r * iq + omega * at.psi_d_wb);
        let [a, b, c] = last.phases_a;
        let turned = ((b - c) / 3.0_f64.sqrt()).atan2(a) - last.iq_a.atan2(last.id_a);
        let middle_s = rows.last()?.t_s + 0.5 * stretch.step_s;
        (omega.abs() >= LEAST_RAD_S).then_some(Self {
            rotor: (turned, middle_s, omega),
            current_a: (id, iq),
            softness: [at.lqq_h, -at.ldq_h, -at.lqd_h, at.ldd_h].map(|part| part / determinant),
            voltage_v: ud.hypot(uq),
            ahead: uq.atan2(ud),
        })
    }

    /// Angle of the rotor at an instant in s.
    fn angle(&self, t_s: f64) -> f64 {
        let (angle, at_s, omega) = self.rotor;
        angle + omega * (t_s - at_s)
    }

    fn voltage_angle(&self, t_s: f64) -> f64 {
        self.angle(t_s) + self.ahead
    }

    /// The pulses' volt-seconds less those of the fundamental, (α, β) in Wb.
    fn ripple(&self, (alpha, beta): (f64, f64), t_s: f64) -> (f64, f64) {
        let (sin, cos) = self.voltage_angle(t_s).sin_cos();
        let length = self.voltage_v / self.rotor.2;
        // The integral of a rotating vector lags it by a quarter of a turn.
        (alpha - length * sin, beta + length * cos)
    }

    /// Current of phase u with that ripple around the operating point, row by row.
    fn phase_u(&self, ripple: &[(f64, f64)], instant: impl Fn(usize) -> f64) -> Vec<f64> {
        let count = ripple.len() as f64;
        let mean = ripple.iter().fold((0.0, 0.0), |sum, of| (sum.0 + of.0 / count, sum.1 + of.1 / count));
        let [of_dd, of_dq, of_qd, of_qq] = self.softness;
        let sample = |(sample, (alpha, beta)): (usize, &(f64, f64))| {
            let (alpha, beta) = (alpha - mean.0, beta - mean.1);
            let (sin, cos) = self.angle(instant(sample)).sin_cos();
            let (d, q) = (alpha * cos + beta * sin, beta * cos - alpha * sin);
            let id = self.current_a.0 + of_dd * d + of_dq * q;
            let iq = self.current_a.1 + of_qd * d + of_qq * q;
            id * cos - iq * sin
        };
        let samples: Vec<f64> = ripple.iter().enumerate().map(sample).collect();
        samples.chunks(WITHIN_ROW).map(|row| row.iter().sum::<f64>() / row.len() as f64).collect()
    }
}
