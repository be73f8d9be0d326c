//! The incremental inductance where the current is, as the pulses show it.

use super::noise::Noise;
use crate::frames::{Dq, limit};

/// A symmetric matrix of inductances, in H: 0 along an axis of which nothing is known, and the coupling with q.
#[derive(Clone, Copy, Debug)]
struct Matrix {
    dd: f32,
    dq: f32,
    qq: f32,
}

impl Matrix {
    const NOTHING: Self = Self { dd: 0.0, dq: 0.0, qq: 0.0 };

    /// This matrix, with everything that another one knows in its place.
    fn and(self, other: Self) -> Self {
        self.with(other, [other.dd > 0.0, other.qq > 0.0])
    }

    /// This matrix, with another's values along d, and along q, in their place.
    fn with(self, other: Self, [d, q]: [bool; 2]) -> Self {
        let dd = if d { other.dd } else { self.dd };
        let [dq, qq] = if q { [other.dq, other.qq] } else { [self.dq, self.qq] };
        Self { dd, dq, qq }
    }
}

/// Share of a half's evidence that is believed at once.
const GAIN: f32 = 0.7;
/// Weight of the coupling of both axes beside their own inductances, if a change of current does not tell them apart.
const COUPLING_WEIGHT: f32 = 0.08;
/// Square of the largest coupling, as a share of the product of the own inductances.
const COUPLING: f32 = 0.6;
/// Least and most of an own inductance, as shares of its previous value, after a half; and the least of all along q, as a share of the least along d.
const LEAST_SHARE: f32 = 0.4;
const MOST_SHARE: f32 = 1.4;
const FLOOR_SHARE: f32 = 0.5;

/// Fields of the plane of currents in which each inductance is remembered: along d from beyond the bound on, along q for both signs.
const ALONG_D: usize = 9;
const ALONG_Q: usize = 8;
/// Fields in a bound of current.
const PER_BOUND: f32 = 6.5;
/// Place of no current along d.
const MIDDLE_D: f32 = 7.0;

/// Inductances all over the plane.
#[derive(Clone, Copy, Debug)]
pub struct Inductance {
    /// The one of the present current.
    here: Matrix,
    field: usize,
    fields: [Matrix; ALONG_D * ALONG_Q],
    /// The newest inductance for each current along q, whatever flows along d: iron saturates along q with it.
    along_q: [Matrix; ALONG_Q],
    /// Share of the coupling that acts here: odd in the current along q.
    coupled: f32,
    /// The least own inductances, in H.
    floor_h: Dq,
}

impl Inductance {
    /// Nothing is known: any change of current is answered with no voltage.
    pub const UNKNOWN: Self = Self::round(0.0);

    /// The same along both axes and at every current, in H.
    pub const fn round(henry: f32) -> Self {
        let here = Matrix { dd: henry, dq: 0.0, qq: henry };
        Self {
            here,
            field: usize::MAX,
            fields: [Matrix::NOTHING; ALONG_D * ALONG_Q],
            along_q: [Matrix::NOTHING; ALONG_Q],
            coupled: 1.0,
            floor_h: Dq { d: 0.0, q: 0.0 },
        }
    }

    /// The first guess has not been made yet.
    pub fn is_unknown(&self) -> bool {
        self.here.dd <= 0.0
    }

    /// Takes the same inductance along both axes, in H, while nothing is known.
    pub fn guess(&mut self, henry: f32) {
        self.here = Matrix { dd: henry, dq: 0.0, qq: henry };
    }

    /// Scales that inductance by a factor.
    pub fn scale(&mut self, by: f32) {
        let Matrix { dd, dq, qq } = self.here;
        self.here = Matrix { dd: dd * by, dq: dq * by, qq: qq * by };
    }

    /// Makes the least inductance seen along d so far the measure of the least of all: along d this share of it.
    pub fn settle(&mut self, share: f32) {
        let mut least_h = self.here.dd;
        // Without current along q: the first field of each row.
        for Matrix { dd, .. } in self.fields.iter().step_by(ALONG_Q) {
            if *dd > 0.0 && *dd < least_h {
                least_h = *dd;
            }
        }
        self.floor_h = Dq { d: share * least_h, q: FLOOR_SHARE * least_h };
    }

    /// Moves to a current, in A. For each part of the matrix, the value remembered for this current holds; else the one remembered for its part along q; else
    /// the one from where it comes.
    pub fn at(&mut self, current: Dq, bound_a: f32) {
        let per_a = PER_BOUND / bound_a;
        self.coupled = limit(current.q * per_a, -1.0, 1.0);
        // The conversion makes 0 of what is below 0.
        let row = ((MIDDLE_D + current.d * per_a) as usize).min(ALONG_D - 1);
        let column = ((current.q.abs() * per_a) as usize).min(ALONG_Q - 1);
        let field = row * ALONG_Q + column;
        if field != self.field {
            self.field = field;
            let known = |of: &[Matrix], place: usize| of.get(place).copied().unwrap_or(Matrix::NOTHING);
            self.here = self.here.and(known(&self.along_q, column)).and(known(&self.fields, field));
        }
    }

    /// Flux linkage, in Wb, for a change of current, in A.
    pub fn flux(&self, change: Dq) -> Dq {
        let Matrix { dd, dq, qq } = self.here;
        let dq = dq * self.coupled;
        Dq { d: dd * change.d + dq * change.q, q: dq * change.d + qq * change.q }
    }

    /// Flux linkages, in Wb, for the parts of a change of current along d and along q, in A.
    pub fn fluxes(&self, change: Dq) -> [Dq; 2] {
        let Matrix { dd, dq, qq } = self.here;
        let dq = dq * self.coupled;
        [Dq { d: dd * change.d, q: dq * change.d }, Dq { d: dq * change.q, q: qq * change.q }]
    }

    /// Change of current, in A, for a flux linkage, in Wb; none while nothing is known.
    pub fn current(&self, flux: Dq) -> Dq {
        let Matrix { dd, dq, qq } = self.here;
        let dq = dq * self.coupled;
        let determinant = dd * qq - dq * dq;
        if determinant <= 0.0 {
            return Dq { d: 0.0, q: 0.0 };
        }
        Dq { d: qq * flux.d - dq * flux.q, q: dd * flux.q - dq * flux.d } * (1.0 / determinant)
    }

    /// Learns that a change of current took so much flux linkage, beside noise. The matrix moves by the least that explains a share of it, the coupling
    /// less readily than the rest. Noise makes the inductance along d look smaller, which is made up for: where pulses lie
    /// along q, changes along d are small. Made up for along q too, much saturation took the current to 1.15 of its bound.
    pub fn learn(&mut self, change: Dq, flux: Dq, noise: &Noise) {
        let left = flux - self.flux(change);
        let (Dq { d, q }, Dq { d: left_d, q: left_q }) = (change, left);
        // With x = (dd, dq, qq) and the coupled share s: flux_d = d x₀ + s q x₁, flux_q = s d x₁ + q x₂.
        let w_s = COUPLING_WEIGHT * self.coupled;
        let w = w_s * self.coupled;
        let (made_up, noise) = (noise.made_up() * GAIN, noise.change_a() * noise.change_a());
        let (a, b, c) = (d * d + w * q * q + noise, w * d * q, w * d * d + q * q + noise);
        let scale = GAIN / (a * c - b * b);
        let (x, y) = ((c * left_d - b * left_q) * scale, (a * left_q - b * left_d) * scale);
        let before = self.here;
        let own = |known: f32, more: f32, least: f32| {
            let changed = limit(known + more, LEAST_SHARE * known, MOST_SHARE * known);
            if changed > least { changed } else { least }
        };
        let more_d = d * x + before.dd * made_up / a;
        let (dd, qq) = (own(before.dd, more_d, self.floor_h.d), own(before.qq, q * y, self.floor_h.q));
        let dq = before.dq + w_s * (q * x + d * y);
        let most = COUPLING * dd * qq;
        let dq = if dq * dq > most { dq * (most / (dq * dq)) } else { dq };
        self.here = Matrix { dd, dq, qq };
        // A part that no change has shown is not remembered: elsewhere it would replace what is known better. Of 56 experiments with an L_q that
        // falls to 0.4 of itself 5 would go a tenth beyond the bound.
        let shown = [d * d > noise, q * q > noise];
        if let Some(field) = self.fields.get_mut(self.field) {
            *field = field.with(self.here, shown);
        }
        if let Some(column) = self.along_q.get_mut(self.field % ALONG_Q) {
            *column = column.with(self.here, shown);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sensors without noise, with which changes of so little, in A, count as such.
    fn noise(change_a: f32) -> Noise {
        let mut noise = Noise::UNKNOWN;
        noise.shows(Dq { d: 0.0, q: 0.0 }, 100.0 * change_a);
        noise
    }

    #[test]
    fn changes_of_both_axes_show_the_whole_matrix() {
        let mut truth = Inductance::round(1e-3);
        truth.here = Matrix { dd: 1e-3, dq: -4e-4, qq: 9e-3 };
        let mut found = Inductance::round(2e-3);
        let changes = [Dq { d: 4.0, q: 20.0 }, Dq { d: 4.0, q: -20.0 }, Dq { d: 20.0, q: 3.0 }];
        for change in changes.into_iter().cycle().take(120) {
            found.learn(change, truth.flux(change), &noise(1.0));
        }
        let near = |a: f32, b: f32| (a - b).abs() < 0.03 * b.abs();
        let (found_is, truth_is) = (found.here, truth.here);
        assert!(near(found_is.dd, truth_is.dd) && near(found_is.dq, truth_is.dq), "{found_is:?}");
        assert!(near(found_is.qq, truth_is.qq), "{found_is:?}");
        let back = found.current(found.flux(changes[0]));
        assert!((back - changes[0]).length() < 1e-3, "{back:?}");
    }

    #[test]
    fn a_current_that_comes_back_finds_what_was_learnt_there() {
        let (bound_a, there) = (100.0, Dq { d: -80.0, q: 50.0 });
        let mut found = Inductance::round(2e-3);
        found.at(there, bound_a);
        for _ in 0..20 {
            let change = Dq { d: 0.0, q: 10.0 };
            found.learn(change, change * 9e-3, &noise(0.1));
        }
        found.at(Dq { d: 0.0, q: 0.0 }, bound_a);
        for _ in 0..20 {
            let change = Dq { d: 0.0, q: 10.0 };
            found.learn(change, change * 1e-3, &noise(0.1));
        }
        assert!((found.here.qq - 1e-3).abs() < 1e-5);
        // The other sign of the current along q is its mirror image.
        found.at(Dq { d: -80.0, q: -50.0 }, bound_a);
        assert!((found.here.qq - 9e-3).abs() < 1e-4, "{:?}", found.here);
    }

    /// A change of current along one axis is remembered for that axis alone: what is known of the other one stays.
    #[test]
    fn what_no_change_has_shown_is_not_remembered() {
        let (bound_a, nowhere) = (100.0, Dq { d: 0.0, q: 0.0 });
        let mut found = Inductance::round(2e-3);
        let pulses = |found: &mut Inductance, at: Dq, change: Dq, henry: f32| {
            found.at(at, bound_a);
            (0..20).for_each(|_| found.learn(change, change * henry, &noise(0.1)));
        };
        pulses(&mut found, Dq { d: -80.0, q: 0.0 }, Dq { d: 10.0, q: 0.0 }, 1e-3);
        pulses(&mut found, nowhere, Dq { d: 0.0, q: 10.0 }, 9e-3);
        found.at(Dq { d: -80.0, q: 0.0 }, bound_a);
        let Matrix { dd, qq, .. } = found.here;
        assert!((dd - 1e-3).abs() < 1e-5 && (qq - 9e-3).abs() < 1e-4, "{:?}", found.here);
    }
}
