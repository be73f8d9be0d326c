//! The data that the drive's side and the page's side exchange.

use serde_json::{Value, json};
use std::collections::VecDeque;
use std::sync::{Mutex, PoisonError};

/// Step of the telemetry, in s: that of STATUS.
pub const STEP_S: f64 = 0.01;
/// Rows that are kept: ten seconds.
const KEPT: usize = 1000;
/// Lines that may wait.
const MOST_LINES: usize = 100;

/// A row of telemetry; a value that was not sent is `None`.
pub type Row = Vec<Option<f64>>;

#[derive(Default)]
struct Inner {
    rows: VecDeque<Row>,
    /// Number of the first row that is kept.
    first: usize,
    state: Value,
    armed: bool,
    lines: VecDeque<String>,
}

/// The shared data.
pub struct Shared {
    permitted: bool,
    inner: Mutex<Inner>,
}

impl Shared {
    /// The data before any telemetry; commands are permitted or not.
    pub fn new(permitted: bool) -> Self {
        Self { permitted, inner: Mutex::default() }
    }

    fn with<T>(&self, does: impl FnOnce(&mut Inner) -> T) -> T {
        does(&mut self.inner.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Puts a row that was received at a time in s, with the drive's state. Rows lost on the way repeat the one before.
    pub fn put(&self, t_s: f64, row: Row, state: Value) {
        let place = (t_s / STEP_S).round().max(0.0) as usize;
        self.with(|inner| {
            inner.state = state;
            let next = inner.first + inner.rows.len();
            if place > next + KEPT {
                (inner.rows, inner.first) = (VecDeque::new(), place);
            }
            let before = inner.rows.back().cloned();
            for _ in inner.first + inner.rows.len()..place {
                inner.rows.push_back(before.clone().unwrap_or_else(|| vec![None; row.len()]));
            }
            inner.rows.push_back(row);
            let gone = inner.rows.len().saturating_sub(KEPT);
            inner.rows.drain(..gone);
            inner.first += gone;
        });
    }

    /// The rows from a number on, and the drive's state.
    pub fn rows(&self, from: usize) -> Value {
        self.with(|inner| {
            let from = from.max(inner.first);
            let rows: Vec<_> = inner.rows.iter().skip(from - inner.first).flatten().collect();
            json!({ "from": from, "rows": rows, "state": inner.state })
        })
    }

    /// Sends commands from now on, or no longer. The error says why not.
    pub fn arm(&self, armed: bool) -> Result<(), &'static str> {
        if armed && !self.permitted {
            return Err("commands are not permitted: --commands permits them");
        }
        self.with(|inner| {
            inner.armed = armed;
            inner.lines.clear();
        });
        Ok(())
    }

    /// `true` while commands are sent.
    pub fn is_armed(&self) -> bool {
        self.with(|inner| inner.armed)
    }

    /// Takes a line for the drive, as in a script of `talk`. The error says why it is refused.
    pub fn say(&self, line: &str) -> Result<(), &'static str> {
        self.with(|inner| match () {
            () if !inner.armed => Err("commands are not switched on"),
            () if inner.lines.len() >= MOST_LINES => Err("too many commands wait"),
            () => {
                inner.lines.push_back(line.to_owned());
                Ok(())
            }
        })
    }

    /// The oldest line that waits.
    pub fn line(&self) -> Option<String> {
        self.with(|inner| inner.lines.pop_front())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_sent_that_is_not_permitted_and_switched_on() {
        let shared = Shared::new(false);
        assert!(shared.arm(true).is_err() && !shared.is_armed());
        assert!(shared.say("charge").is_err());
        let shared = Shared::new(true);
        assert!(shared.say("charge").is_err());
        shared.arm(true).unwrap();
        shared.say("charge").unwrap();
        assert_eq!(shared.line().as_deref(), Some("charge"));
        shared.say("enable").unwrap();
        shared.arm(false).unwrap();
        assert_eq!(shared.line(), None);
    }

    #[test]
    fn rows_have_their_places_and_lost_ones_are_as_before() {
        let shared = Shared::new(false);
        for (t_s, value) in [(0.0, 1.0), (0.01, 2.0), (0.0402, 3.0)] {
            shared.put(t_s, vec![Some(value)], Value::Null);
        }
        let told = shared.rows(1);
        assert_eq!((&told["from"], &told["rows"]), (&json!(1), &json!([2.0, 2.0, 2.0, 3.0])));
        for k in 5..2000_u32 {
            shared.put(f64::from(k) * STEP_S, vec![Some(0.0)], Value::Null);
        }
        assert_eq!(shared.rows(0)["from"], json!(1000));
    }
}
