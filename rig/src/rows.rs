//! Rows of a trace, of either drive.

/// Something with a time.
pub trait Timed {
    /// In s from the recording's beginning.
    fn t_s(&self) -> f64;
}

/// The rows from `from_s` (included) to `to_s` (excluded).
pub fn between<R: Timed>(rows: &[R], from_s: f64, to_s: f64) -> &[R] {
    let first = rows.partition_point(|row| row.t_s() < from_s - 1e-9);
    let last = rows.partition_point(|row| row.t_s() < to_s - 1e-9);
    &rows[first..last.max(first)]
}

/// Mean around each value, over so many steps to either side of it, at least half of one; of the outermost values the part within them counts.
pub fn centred_means(values: &[f64], reach: impl Fn(usize) -> f64) -> Vec<f64> {
    let mut sums = vec![0.0; values.len() + 1];
    for (k, value) in values.iter().enumerate() {
        sums[k + 1] = sums[k] + value;
    }
    let mean = |k: usize| {
        let beyond = (reach(k) - 0.5).max(0.0);
        let (whole, part) = (beyond.floor() as usize, beyond.fract());
        let (first, last) = (k.saturating_sub(whole), (k + whole + 1).min(values.len()));
        let ends = [first.checked_sub(1), Some(last)].into_iter().flatten().filter_map(|at| values.get(at));
        let (sum, count) = ends
            .fold((sums[last] - sums[first], (last - first) as f64), |(sum, count), value| {
                (sum + part * value, count + part)
            });
        sum / count
    };
    (0..values.len()).map(mean).collect()
}

/// Mean over rows; 0 for none.
pub fn mean<R>(rows: &[R], value: impl Fn(&R) -> f64) -> f64 {
    rows.iter().map(value).sum::<f64>() / rows.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounded to 43 rows, the period of 41.7 left 3 % of its ripple, which steps of torque were judged by.
    #[test]
    fn a_mean_over_a_period_that_is_no_whole_number_of_rows_has_none_of_its_ripple() {
        let (period, count) = (125.0 / 3.0, 1_000);
        let ripple: Vec<_> =
            (0..count).map(|k| (std::f64::consts::TAU * f64::from(k) / period).sin()).collect();
        let most = |reach: f64| {
            centred_means(&ripple, |_| reach)[50..950]
                .iter()
                .fold(0.0, |most: f64, mean| most.max(mean.abs()))
        };
        assert!(most(0.5 * period) < 2e-3, "{}", most(0.5 * period));
        assert!(most(21.5) > 0.03, "{}", most(21.5));
    }
}
