//! Figures compared with their required values.

use crate::options::RunOptions;
use serde::Serialize;

/// The words of a verdict if the bound is violated.
pub const FALLS_SHORT: &str = "falls short";
/// The words of a verdict if the run contained nothing of the kind: that does not count as a pass.
pub const NOT_SEEN: &str = "not seen";

/// A figure, its bound, and the verdict.
#[derive(Clone, Debug, Serialize)]
pub struct Verdict {
    /// The quantity that is judged, with its unit.
    pub what: String,
    /// The value found; `None` if the run contained nothing of the kind.
    pub found: Option<f64>,
    /// The upper bound; `None` if the figure is only reported.
    pub at_most: Option<f64>,
    /// `pass`, `falls short`, `reported` or `not seen`.
    pub verdict: &'static str,
}

impl Verdict {
    /// Judges a figure against an upper bound; with an infinite bound it is only reported. A value that is not a number falls short.
    pub fn at_most(what: &str, found: impl Into<Option<f64>>, at_most: f64) -> Self {
        let (found, at_most) = (found.into(), at_most.is_finite().then_some(at_most));
        let verdict = match (found, at_most) {
            (None, _) => NOT_SEEN,
            (_, None) => "reported",
            (Some(found), Some(at_most)) if found <= at_most => "pass",
            _ => FALLS_SHORT,
        };
        Self { what: what.to_owned(), found, at_most, verdict }
    }

    /// The same for a figure that must occur: if the run contained nothing of the kind, it falls short.
    pub fn wanted(self) -> Self {
        let verdict = if self.verdict == NOT_SEEN { FALLS_SHORT } else { self.verdict };
        Self { verdict, ..self }
    }

    /// Something that must not occur, as 0 or 1.
    pub fn never(what: &str, is: bool) -> Self {
        Self::at_most(what, f64::from(u8::from(is)), 0.0)
    }
}

/// The largest of some values; `None` if there are none, and not a number if one of them is not.
pub fn worst(values: impl Iterator<Item = f64>) -> Option<f64> {
    values.reduce(|worst, value| if worst.is_nan() || worst > value { worst } else { value })
}

/// A bound for ideal inverter and sensors, and one for flaws.
pub fn bound(options: &RunOptions, ideal: f64, with_flaws: f64) -> f64 {
    if options.is_ideal() { ideal } else { with_flaws }
}

/// A bound on the mean torque's error. A wrong angle or a wrong map makes the torque wrong: in that case it is only reported.
pub fn torque_bound(options: &RunOptions, ideal: f64, with_flaws: f64) -> f64 {
    let misled = options.angle_error != 0.0 || options.map_error != 0.0;
    if misled { f64::INFINITY } else { bound(options, ideal, with_flaws) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn verdict(found: Option<f64>, at_most: f64) -> &'static str {
        Verdict::at_most("", found, at_most).verdict
    }

    #[test]
    fn only_a_number_within_its_bound_passes() {
        assert_eq!(verdict(Some(1.0), 1.0), "pass");
        assert_eq!(verdict(Some(1.1), 1.0), FALLS_SHORT);
        assert_eq!(verdict(Some(f64::NAN), 1.0), FALLS_SHORT);
        assert_eq!(verdict(Some(f64::INFINITY), 1.0), FALLS_SHORT);
        assert_eq!(verdict(Some(f64::NAN), f64::INFINITY), "reported");
        assert_eq!(verdict(None, 1.0), NOT_SEEN);
        assert_eq!(verdict(None, f64::INFINITY), NOT_SEEN);
        for at_most in [1.0, f64::INFINITY] {
            assert_eq!(Verdict::at_most("", None, at_most).wanted().verdict, FALLS_SHORT);
        }
        assert_eq!(Verdict::at_most("", 1.0, f64::INFINITY).wanted().verdict, "reported");
    }

    #[test]
    fn the_worst_hides_nothing() {
        assert_eq!(worst([].into_iter()), None);
        assert_eq!(worst([-3.0, -1.0, -2.0].into_iter()), Some(-1.0));
        for values in [[f64::NAN, 1.0, 2.0], [1.0, f64::NAN, 2.0], [1.0, 2.0, f64::NAN]] {
            assert!(worst(values.into_iter()).is_some_and(f64::is_nan), "{values:?}");
        }
    }
}
