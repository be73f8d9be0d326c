//! The inside of a carrier half: the currents at the legs' edges, which decide on the inverter's voltage error.
//!
//! The volt-seconds of a half determine its pulses, as the free carrier makes them: each leg has one edge, and the zero vectors are divided equally
//! between both ends. The flux linkage along the way and the incremental inductance give the current at each edge. A falling edge is late by the dead
//! time if the leg's current is negative, a rising one if it is positive.

use core::f64::consts::FRAC_PI_3;

/// A half between two boundaries, stationary frame.
pub struct Half {
    /// Current at both ends, in A.
    pub ends: [[f64; 2]; 2],
    /// Volt-seconds, in V·s.
    pub acted: [f64; 2],
    /// Length, in s.
    pub length_s: f64,
    /// DC-link voltage, in V.
    pub udc_v: f64,
    /// Current, in A, per small flux linkage, in Wb; zero while that is not known.
    pub per_flux: [[f64; 2]; 2],
    /// `true` if it begins with the upper devices on: its edges fall.
    pub falls: bool,
}

/// Sums over a half.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Inside {
    /// `∫i dt`, in A·s.
    pub charge: [f64; 2],
    /// Volt-seconds that a dead time of one second would take away, in V.
    pub lacking: [f64; 2],
    /// Volt-seconds that a threshold of one volt would take away, in s.
    pub opposed: [f64; 2],
    /// Edges whose sign is uncertain, each in proportion.
    pub unsure: f64,
}

/// Direction of a phase's axis.
fn axis(phase: usize) -> [f64; 2] {
    let (sin, cos) = (2.0 * FRAC_PI_3 * phase as f64).sin_cos();
    [cos, sin]
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// The sum of a vector and a multiple of another.
pub fn add(a: [f64; 2], b: [f64; 2], scale: f64) -> [f64; 2] {
    [a[0] + scale * b[0], a[1] + scale * b[1]]
}

/// Mean of a current's sign on its way from one value to another, in A: proportional below `small_a`.
fn mean_sign([from, to]: [f64; 2], small_a: f64) -> f64 {
    // The integral of the sign.
    let integral = |a: f64| if a.abs() < small_a { 0.5 * a * a / small_a } else { a.abs() - 0.5 * small_a };
    let way = to - from;
    if way.abs() < 1e-3 * small_a {
        (from / small_a).clamp(-1.0, 1.0)
    } else {
        (integral(to) - integral(from)) / way
    }
}

impl Half {
    /// Time of each leg's edge, in s.
    fn edges_s(&self) -> [f64; 3] {
        let shares = [0, 1, 2].map(|phase| dot(self.acted, axis(phase)) / (self.udc_v * self.length_s));
        let high = shares.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let low = shares.iter().copied().fold(f64::INFINITY, f64::min);
        shares.map(|share| {
            let on = (share + 0.5 * (1.0 - high - low)).clamp(0.0, 1.0);
            self.length_s * if self.falls { on } else { 1.0 - on }
        })
    }

    /// Current that belongs to a flux linkage, in A.
    fn current(&self, flux: [f64; 2]) -> [f64; 2] {
        self.per_flux.map(|row| dot(row, flux))
    }

    /// The sums; phase currents of less than `small_a` may have either sign and count in proportion.
    pub fn inside(&self, small_a: f64) -> Inside {
        let [start, end] = self.ends;
        let edges = self.edges_s();
        let mut order = [0, 1, 2];
        order.sort_by(|a, b| edges[*a].total_cmp(&edges[*b]));
        // The part that both ends leave unexplained is spread evenly.
        let drift = add(add(end, start, -1.0), self.current(self.acted), -1.0);
        let mut found = Inside::default();
        let (mut at_s, mut flux, mut before, mut voltage) = (0.0, [0.0; 2], start, [0.0; 2]);
        for phase in order {
            let passed_s = edges[phase] - at_s;
            flux = add(flux, voltage, passed_s);
            at_s = edges[phase];
            let here = add(add(start, self.current(flux), 1.0), drift, at_s / self.length_s);
            found.passed([before, here], passed_s, small_a);
            before = here;
            let own = axis(phase);
            let sign = (dot(here, own) / small_a).clamp(-1.0, 1.0);
            found.unsure += 1.0 - sign.abs();
            let (level, late) =
                if self.falls { (-1.0, 0.5 * (1.0 - sign)) } else { (1.0, -0.5 * (1.0 + sign)) };
            voltage = add(voltage, own, 2.0 / 3.0 * level * self.udc_v);
            found.lacking = add(found.lacking, own, -2.0 / 3.0 * late * self.udc_v);
        }
        found.passed([before, end], self.length_s - at_s, small_a);
        found
    }
}

impl Inside {
    /// Adds a time in which no leg has an edge, with the current at both of its ends.
    fn passed(&mut self, [from, to]: [[f64; 2]; 2], passed_s: f64, small_a: f64) {
        self.charge = add(add(self.charge, from, 0.5 * passed_s), to, 0.5 * passed_s);
        for phase in 0..3 {
            let own = axis(phase);
            let sign = mean_sign([dot(from, own), dot(to, own)], small_a);
            self.opposed = add(self.opposed, own, 2.0 / 3.0 * sign * passed_s);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HALF: Half = Half {
        ends: [[10.0, -4.0], [14.0, -4.0]],
        acted: [0.04, 0.0],
        length_s: 5e-4,
        udc_v: 400.0,
        per_flux: [[100.0, 0.0], [0.0, 100.0]],
        falls: true,
    };

    #[test]
    fn the_edges_make_the_volt_seconds() {
        for falls in [true, false] {
            let half = Half { falls, acted: [0.03, 0.02], ..HALF };
            let edges = half.edges_s();
            let on = edges.map(|edge| if falls { edge } else { half.length_s - edge });
            let made =
                (0..3).fold([0.0; 2], |sum, phase| add(sum, axis(phase), 2.0 / 3.0 * half.udc_v * on[phase]));
            assert!((made[0] - 0.03).abs() < 1e-12 && (made[1] - 0.02).abs() < 1e-12, "{made:?}");
        }
    }

    #[test]
    fn a_current_of_each_sign_lacks_half_a_dead_time_from_its_mean() {
        // Phase a is positive, b and c are negative, in both kinds of half: −½ (1, −1, −1) plus the common part, which is zero.
        for falls in [true, false] {
            let lacking = Half { falls, ..HALF }.inside(0.1).lacking;
            assert!(
                (lacking[0] - 0.5 * 400.0 * 4.0 / 3.0).abs() < 1e-9 && lacking[1].abs() < 1e-9,
                "{lacking:?}"
            );
        }
    }

    #[test]
    fn a_threshold_acts_over_the_whole_half_against_each_current() {
        let opposed = HALF.inside(0.1).opposed;
        assert!((opposed[0] - 4.0 / 3.0 * 5e-4).abs() < 1e-9 && opposed[1].abs() < 1e-9, "{opposed:?}");
        // A current that comes from one side of zero and goes equally far to the other has no sign on average.
        assert!(
            mean_sign([-5.0, 5.0], 0.1).abs() < 1e-12 && (mean_sign([-5.0, 15.0], 0.1) - 0.5).abs() < 1e-2
        );
    }

    #[test]
    fn the_charge_is_that_of_both_ends_where_pulses_lie_in_the_middle() {
        let charge = HALF.inside(0.1).charge;
        assert!(
            (charge[0] - 12.0 * 5e-4).abs() < 1e-9 && (charge[1] + 4.0 * 5e-4).abs() < 1e-9,
            "{charge:?}"
        );
    }
}
