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

/// Mean over rows; 0 for none.
pub fn mean<R>(rows: &[R], value: impl Fn(&R) -> f64) -> f64 {
    rows.iter().map(value).sum::<f64>() / rows.len().max(1) as f64
}
