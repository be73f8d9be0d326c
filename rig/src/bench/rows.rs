//! Rows of a trace, one step after the other.

use super::Timeline;
use crate::trace::Tick;

/// Largest number of rows for which memory is reserved in advance.
const MOST_ROWS: usize = 1 << 20;

/// Rows at one step.
pub struct Rows<R> {
    step_s: f64,
    /// Instant of the next one.
    pub next: Tick,
    /// Rows that have been due.
    due: u64,
    rows: Vec<R>,
}

impl<R> Rows<R> {
    /// None yet, from the recording's beginning on; memory is reserved for this duration, in s.
    pub fn new(step_s: f64, duration_s: f64, time: &Timeline) -> Self {
        let room = MOST_ROWS.min((duration_s / step_s) as usize + 2);
        Self { step_s, next: time.lead, due: 0, rows: Vec::with_capacity(room) }
    }

    /// Time of the next one from the recording's beginning, in s.
    pub fn next_s(&self) -> f64 {
        self.due as f64 * self.step_s
    }

    /// Time at which the one that ends next began, in s.
    pub fn begun_s(&self) -> f64 {
        self.due.saturating_sub(1) as f64 * self.step_s
    }

    /// Number of those that end by a time, in s.
    pub fn until(&self, end_s: f64) -> u64 {
        (end_s / self.step_s).round() as u64
    }

    /// `true` if more than `count` have been due, the first at the recording's beginning.
    pub fn has(&self, count: u64) -> bool {
        self.due > count
    }

    /// Adds the next one; does nothing if the recording is over.
    pub fn push(&mut self, row: Option<R>, time: &Timeline) {
        self.rows.extend(row);
        self.due += 1;
        self.next = time.row_end(self.next_s());
    }

    /// Takes the existing ones.
    pub fn take(&mut self) -> Vec<R> {
        std::mem::take(&mut self.rows)
    }

    /// The existing ones.
    pub fn as_slice(&self) -> &[R] {
        &self.rows
    }

    /// All of them.
    pub fn into_vec(self) -> Vec<R> {
        self.rows
    }
}
