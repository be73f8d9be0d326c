//! The edges that a sequence of halves puts on the gates' pins, and how far those that were there are off them.

use super::host::Begun;
use crate::time::Time;
use crate::world::Edge;
use tractive::modulation::Mode;

/// The time after the first half with pulses begins in which software switches the outputs on.
const SWITCHING_ON: Time = 20 * crate::time::MICROSECOND;

/// The farthest that two edges may be apart to be one.
const NEARBY: Time = 20 * crate::time::MICROSECOND;

/// The instants of a timeline.
#[derive(Clone, Copy, Debug)]
pub struct Scale {
    /// The timers' start.
    pub started: Time,
    /// A tick of the drive's.
    pub tick: Time,
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

/// A span of pulses.
struct Span {
    from: Time,
    until: Time,
    edges: Vec<Edge>,
}

/// Compares.
pub fn compare(halves: &[Begun], pins: &[Edge], scale: &Scale) -> Compared {
    let mut outcome = Compared { all: pins.len(), ..Compared::default() };
    for span in spans(halves, scale) {
        let inside = |edge: &&Edge| edge.at >= span.from && edge.at < span.until.min(scale.ended);
        for gate in 0..6 {
            let of = |edge: &&Edge| edge.gate == gate;
            let wanted: Vec<_> = span.edges.iter().filter(inside).filter(of).collect();
            let found: Vec<_> = pins.iter().filter(inside).filter(of).collect();
            outcome.take(&wanted, &found, scale.tick);
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

/// The spans of halves with pulses, and the edges in them: where a leg turns, the device that goes off does so at once, the other one goes
/// on the dead time later.
fn spans(halves: &[Begun], scale: &Scale) -> Vec<Span> {
    let mut spans: Vec<Span> = Vec::new();
    let mut levels = None;
    for Begun { begins, half } in halves {
        let at = |ticks: u32| scale.started + Time::from(begins + ticks) * scale.tick;
        if half.mode == Mode::Off {
            levels = None;
            continue;
        }
        let before = levels.unwrap_or_else(|| {
            spans.push(Span { from: at(0) + SWITCHING_ON, until: at(0), edges: Vec::new() });
            half.start_levels
        });
        let Some(span) = spans.last_mut() else { continue };
        span.until = at(half.period_ticks);
        let mut now = before;
        for (phase, now) in now.iter_mut().enumerate() {
            let (start, ticks) = (half.start_levels[phase], half.compare_ticks[phase]);
            let turn = (ticks < half.period_ticks).then_some((!start, ticks));
            for (level, ticks) in [(start, 0)].into_iter().chain(turn) {
                if std::mem::replace(now, level) == level {
                    continue;
                }
                let [on, off] = [usize::from(!level), usize::from(level)].map(|lower| 2 * phase + lower);
                span.edges.push(Edge { at: at(ticks), gate: off, on: false });
                span.edges.push(Edge { at: at(ticks) + scale.dead, gate: on, on: true });
            }
        }
        levels = Some(now);
    }
    spans
}
