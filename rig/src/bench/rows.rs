//! Rows of a trace, one step after the other.

use super::Timeline;
use crate::trace::{Row, Tick};

/// Rows for which room is made at once.
const MOST_ROWS: usize = 1 << 20;

/// Rows at one step.
pub struct Rows {
    step_s: f64,
    /// Instant of the next one.
    pub next: Tick,
    /// Rows that have been due.
    due: u64,
    rows: Vec<Row>,
}

impl Rows {
    /// None yet, from the recording's beginning on; for so long there is room, in s.
    pub fn new(step_s: f64, duration_s: f64, time: &Timeline) -> Self {
        let room = MOST_ROWS.min((duration_s / step_s) as usize + 2);
        Self { step_s, next: time.lead, due: 0, rows: Vec::with_capacity(room) }
    }

    /// Time of the next one from the recording's beginning, in s.
    pub fn next_s(&self) -> f64 {
        self.due as f64 * self.step_s
    }

    /// The next one; nothing where the recording is over.
    pub fn push(&mut self, row: Option<Row>, time: &Timeline) {
        self.rows.extend(row);
        self.due += 1;
        self.next = time.row_end(self.next_s());
    }

    /// Takes those there are.
    pub fn take(&mut self) -> Vec<Row> {
        std::mem::take(&mut self.rows)
    }

    /// Those there are.
    pub fn as_slice(&self) -> &[Row] {
        &self.rows
    }

    /// All of them.
    pub fn into_vec(self) -> Vec<Row> {
        self.rows
    }
}
