//! The check of the map from the pulses at standstill: it is compared with the flux linkages from the turning rotor's voltage.
//!
//! While the current is constant in the rotor's frame the volt-seconds are `∫u dt = ψ e^{jθ} + D ∫e^{jθ} dt + a constant`. D is the voltage of resistance and
//! inverter beyond the fit's values for both. When currents along q of either sign speed the rotor up and brake it, ψ_q and D_q change their signs, ψ_d and
//! D_d do not. So resistance, dead time and thresholds drop out, as in the mean of a motoring and a braking voltage at one speed. When coasting, ψ_q and D_q
//! are zero.

use super::boundary::{Boundary, turned};
use super::fit::{Fit, Turning};
use nalgebra::{DMatrix, DVector};
use tractive::identification::Stage;

/// Distance of a current along q from that of its part of the turn, as a share of the largest one: at most this.
const WITHIN: f64 = 0.25;
/// Fewest boundaries of a part, and fewest electrical radians that the rotor turns in it.
const LEAST: usize = 40;
const LEAST_RAD: f64 = 3.0;

/// A part of the turn in which the current is constant: sine and cosine of the d axis at each boundary, volt-seconds and `∫e^{jθ} dt` from the first
/// one on, and the mean of the current.
struct Part {
    frames: Vec<[f64; 2]>,
    volt_seconds: Vec<[f64; 2]>,
    whiles: Vec<[f64; 2]>,
    current: (f64, f64),
}

impl Part {
    /// The longest run of boundaries whose current along q is this one, in A, within a tolerance; `None` if the rotor turns too little in it.
    fn of(turn: &[&Boundary], fit: &Fit, iq_a: f64, within_a: f64) -> Option<Self> {
        let rows = turn.split(|boundary| (boundary.current.1 - iq_a).abs() > within_a);
        let row = rows.max_by_key(|row| row.len()).filter(|row| row.len() >= LEAST)?;
        let mean = |of: fn(&Boundary) -> f64| row.iter().map(|b| of(b)).sum::<f64>() / row.len() as f64;
        let current = (mean(|b| b.current.0), mean(|b| b.current.1));
        let middle = fit.flux_at_standstill(current.0, current.1);
        let mut part = Self { frames: vec![], volt_seconds: vec![], whiles: vec![], current };
        let (mut whiles, mut turned_rad) = ([0.0; 2], 0.0);
        let mut before: Option<(&Boundary, [f64; 2])> = None;
        for boundary in row {
            let (sin, cos) = boundary.frame;
            if let Some((last, frame)) = before {
                let length_s = boundary.passed_s - last.passed_s;
                whiles = [0, 1].map(|k| whiles[k] + 0.5 * length_s * (frame[k] + [cos, sin][k]));
                turned_rad += (sin * frame[0] - cos * frame[1]).asin();
            }
            before = Some((boundary, [cos, sin]));
            // The map is accurate enough for the current's own deviations from its mean.
            let here = fit.flux_at_standstill(boundary.current.0, boundary.current.1);
            let more = turned(boundary.frame, [here.0 - middle.0, here.1 - middle.1]);
            let taken = fit.taken(boundary);
            part.frames.push([cos, sin]);
            part.volt_seconds.push([0, 1].map(|k| boundary.volt_seconds[k] - taken[k] - more[k]));
            part.whiles.push(whiles);
        }
        (turned_rad.abs() > LEAST_RAD).then_some(part)
    }

    /// Two rows of equations for each boundary: ψ_d, ψ_q, D_d, D_q, those along q with this sign, and the right side; each relative to its mean.
    fn rows(&self, sign: f64) -> Vec<[f64; 5]> {
        let mut rows = Vec::with_capacity(2 * self.frames.len());
        for axis in 0..2 {
            let of = |[cos, sin]: [f64; 2]| if axis == 0 { [cos, -sign * sin] } else { [sin, sign * cos] };
            let own: Vec<[f64; 5]> = (0..self.frames.len())
                .map(|k| {
                    let ([d, q], [drop_d, drop_q]) = (of(self.frames[k]), of(self.whiles[k]));
                    [d, q, drop_d, drop_q, self.volt_seconds[k][axis]]
                })
                .collect();
            let mean: [f64; 5] = core::array::from_fn(|column| {
                own.iter().map(|row| row[column]).sum::<f64>() / own.len() as f64
            });
            rows.extend(own.into_iter().map(|row| core::array::from_fn::<_, 5, _>(|k| row[k] - mean[k])));
        }
        rows
    }
}

/// ψ_d and ψ_q from rows, by least squares; `along_q`: `false` if the latter is absent.
fn solved(rows: &[[f64; 5]], along_q: bool) -> Option<(f64, f64)> {
    let columns: &[usize] = if along_q { &[0, 1, 2, 3] } else { &[0, 2] };
    let matrix = DMatrix::from_fn(rows.len(), columns.len(), |row, column| rows[row][columns[column]]);
    let right = DVector::from_fn(rows.len(), |row, _| rows[row][4]);
    let found = (matrix.transpose() * &matrix).lu().solve(&(matrix.transpose() * right))?;
    let own = (found[0], if along_q { found[1] } else { 0.0 });
    (own.0.is_finite() && own.1.is_finite()).then_some(own)
}

/// Flux linkages of the turning rotor: sped up and braked, and coasting. Those that the turn does not determine are left out.
pub fn turning(boundaries: &[Boundary], fit: &Fit) -> Vec<Turning> {
    let turn: Vec<&Boundary> = boundaries.iter().filter(|b| b.stage == Stage::Turn).collect();
    let mut along_q: Vec<f64> = turn.iter().map(|b| b.current.1.abs()).collect();
    along_q.sort_by(f64::total_cmp);
    // The rotor coasts for most of the turn; this avoids the largest noise.
    let most_a = along_q.get(19 * along_q.len() / 20).copied().unwrap_or(0.0);
    let within_a = WITHIN * most_a;
    let part = |share: f64| Part::of(&turn, fit, share * most_a, within_a);
    let [motor, coast, brake] = [1.0, 0.0, -1.0].map(part);
    let mut found = Vec::new();
    let mut add = |current: (f64, f64), flux: Option<(f64, f64)>| {
        let turning =
            |flux| Turning { current, found: flux, map: fit.flux_at_standstill(current.0, current.1) };
        found.extend(flux.map(turning));
    };
    if let (Some(motor), Some(brake)) = (motor, brake) {
        let rows = [motor.rows(1.0), brake.rows(-1.0)].concat();
        let mean = |a: f64, b: f64| 0.5 * (a + b);
        let current = (mean(motor.current.0, brake.current.0), mean(motor.current.1, -brake.current.1));
        add(current, solved(&rows, true));
    }
    if let Some(coast) = coast {
        add((coast.current.0, 0.0), solved(&coast.rows(1.0), false));
    }
    found
}

impl Turning {
    /// The difference, in Wb.
    pub fn off_wb(&self) -> f64 {
        (self.found.0 - self.map.0).hypot(self.found.1 - self.map.1)
    }

    /// Difference of the torque, in N·m.
    pub fn off_nm(&self, pole_pairs: f64) -> f64 {
        let (id, iq) = self.current;
        1.5 * pole_pairs * ((self.found.0 - self.map.0) * iq - (self.found.1 - self.map.1) * id).abs()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A part of the turn, with voltage drops that nothing else shows; ψ_d, ψ_q and the drops along d and q change their signs with the current.
    fn part(omega: [f64; 2], [psi_d, psi_q]: [f64; 2], [drop_d, drop_q]: [f64; 2]) -> Part {
        const LENGTH_S: f64 = 5e-4;
        let turned = |[d, q]: [f64; 2], theta: f64| turned(theta.sin_cos(), [d, q]);
        let mut part = Part { frames: vec![], volt_seconds: vec![], whiles: vec![], current: (0.0, 0.0) };
        let (mut theta, mut lost, mut whiles) = (0.3_f64, [0.0; 2], [0.0; 2]);
        for k in 0..400 {
            let speed = omega[0] + (omega[1] - omega[0]) * f64::from(k) / 400.0;
            let before = theta;
            theta += speed * LENGTH_S;
            let drop = turned([drop_d, drop_q], 0.5 * (before + theta));
            lost = [0, 1].map(|axis| lost[axis] + LENGTH_S * drop[axis]);
            let mean = [0.5 * (before.cos() + theta.cos()), 0.5 * (before.sin() + theta.sin())];
            whiles = [0, 1].map(|axis| whiles[axis] + LENGTH_S * mean[axis]);
            let flux = turned([psi_d, psi_q], theta);
            part.frames.push([theta.cos(), theta.sin()]);
            part.volt_seconds.push([0, 1].map(|axis| flux[axis] + lost[axis] + 7.0));
            part.whiles.push(whiles);
        }
        part
    }

    #[test]
    fn resistance_and_the_inverters_error_drop_out() {
        for [d, q] in [[0.0, 0.0], [-8.0, 15.0]] {
            let motor = part([5.0, 60.0], [0.4, 0.5], [d, q]);
            let brake = part([60.0, 5.0], [0.4, -0.5], [d, -q]);
            let (psi_d, psi_q) = solved(&[motor.rows(1.0), brake.rows(-1.0)].concat(), true).unwrap();
            assert!((psi_d - 0.4).abs() < 1e-3 && (psi_q - 0.5).abs() < 1e-3, "{psi_d}, {psi_q}");
            let coast = part([60.0, 60.0], [0.4, 0.0], [d, 0.0]);
            let (psi_d, psi_q) = solved(&coast.rows(1.0), false).unwrap();
            assert!((psi_d - 0.4).abs() < 1e-3 && psi_q == 0.0, "{psi_d}");
        }
    }

    #[test]
    fn what_the_map_has_wrong_is_told() {
        let turning = Turning { current: (-10.0, 20.0), found: (0.4, 0.5), map: (0.39, 0.5) };
        assert!((turning.off_wb() - 0.01).abs() < 1e-12);
        assert!((turning.off_nm(2.0) - 1.5 * 2.0 * 0.01 * 20.0).abs() < 1e-12);
    }
}
