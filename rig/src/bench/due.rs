//! Effects that are due later, in their order.

use super::Tick;
use std::collections::VecDeque;

/// Values with the ticks from which on they hold.
#[derive(Clone, Debug)]
pub struct Due<T>(VecDeque<(Tick, T)>);

impl<T> Default for Due<T> {
    fn default() -> Self {
        Self(VecDeque::new())
    }
}

impl<T> Due<T> {
    /// Adds one, later than those before.
    pub fn push(&mut self, at: Tick, value: T) {
        self.0.push_back((at, value));
    }

    /// The time at which the next one takes effect.
    pub fn next(&self) -> Option<Tick> {
        self.0.front().map(|(at, _)| *at)
    }

    /// The last one in the queue.
    pub fn last(&self) -> Option<&T> {
        self.0.back().map(|(_, value)| value)
    }

    /// Takes out the next one that holds now.
    pub fn take(&mut self, now: Tick) -> Option<T> {
        if self.next()? > now {
            return None;
        }
        self.0.pop_front().map(|(_, value)| value)
    }
}
