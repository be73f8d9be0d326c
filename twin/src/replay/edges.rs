//! The edges that the host's pulses put on the gates' pins, and how far the edges that were there deviate from them.

use crate::time::Time;
use crate::world::Edge;

/// The farthest that two edges may be apart to be one.
const NEARBY: Time = 20 * crate::time::MICROSECOND;

/// The instants of a timeline.
#[derive(Clone, Copy, Debug)]
pub struct Scale {
    /// The timers' start.
    pub started: Time,
    /// A cycle of the core and of the timers.
    pub cycle: Time,
    /// The dead time.
    pub dead: Time,
    /// The end of the run.
    pub ended: Time,
}

/// The outcome of a comparison.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Compared {
    /// The edges that were compared, and all that were at the pins.
    pub edges: usize,
    /// See [`Self::edges`].
    pub all: usize,
    /// The largest distance of an edge at a pin from the host's.
    pub worst: Time,
    /// Edges that are farther off than a tick, or that only one of the two has.
    pub missed: usize,
    /// The gate and the instant of the first of them.
    pub first: Option<(usize, Time)>,
}

/// An interval in which all edges come from the pulses.
pub struct Span {
    /// Its beginning.
    pub from: Time,
    /// Its end.
    pub until: Time,
    /// The host's edges, those of a gate in their order.
    pub edges: Vec<Edge>,
}

/// Compares for so many gates; two edges are the same if at most a tick lies between them.
pub fn compare(spans: &[Span], pins: &[Edge], gates: usize, tick: Time, ended: Time) -> Compared {
    let mut outcome = Compared { all: pins.len(), ..Compared::default() };
    for span in spans {
        let inside = |edge: &&Edge| edge.at >= span.from && edge.at < span.until.min(ended);
        for gate in 0..gates {
            let of = |edge: &&Edge| edge.gate == gate;
            let wanted: Vec<_> = span.edges.iter().filter(inside).filter(of).collect();
            let found: Vec<_> = pins.iter().filter(inside).filter(of).collect();
            outcome.take(&wanted, &found, tick);
        }
    }
    outcome
}

impl Compared {
    /// Edges of one gate, both in their order. What has no partner nearby is alone.
    fn take(&mut self, wanted: &[&Edge], found: &[&Edge], tick: Time) {
        let (mut wanted, mut found) = (wanted.iter().peekable(), found.iter().peekable());
        loop {
            let (alone, edge) = match (wanted.peek(), found.peek()) {
                (Some(own), Some(other)) if own.at.abs_diff(other.at) <= NEARBY && own.on == other.on => {
                    let off = own.at.abs_diff(other.at);
                    self.edges += 1;
                    self.worst = self.worst.max(off);
                    found.next();
                    (off > tick, wanted.next())
                }
                (Some(own), Some(other)) if own.at <= other.at => (true, wanted.next()),
                (Some(_), None) => (true, wanted.next()),
                (_, Some(_)) => (true, found.next()),
                (None, None) => return,
            };
            let Some(edge) = edge.filter(|_| alone) else { continue };
            self.missed += 1;
            if self.first.is_none_or(|(_, at)| edge.at < at) {
                self.first = Some((edge.gate, edge.at));
            }
        }
    }
}
