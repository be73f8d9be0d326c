//! The instants of the conversions beside the edges of the gates.

use crate::chip::adc::Sampling;
use crate::time::{SECOND, Time};
use crate::world::Edge;
use std::fmt;

/// The shortest and the longest of some times; nothing before the first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Range {
    /// The shortest.
    pub least: Time,
    /// The longest.
    pub most: Time,
}

impl Range {
    const NONE: Self = Self { least: Time::MAX, most: 0 };

    fn take(&mut self, time: Time) {
        (self.least, self.most) = (self.least.min(time), self.most.max(time));
    }
}

impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let us = |time: Time| 1e6 * time as f64 / SECOND as f64;
        match (self.least, self.most) {
            (least, most) if least > most => write!(f, "never"),
            (least, most) if least == most => write!(f, "{:.3}", us(least)),
            (least, most) => write!(f, "{:.3} to {:.3}", us(least), us(most)),
        }
    }
}

/// A converter's instants over a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Instants {
    /// The converter.
    pub name: &'static str,
    /// Sequences that a timer started.
    pub sequences: usize,
    /// The time from one's start to the next one's.
    pub apart: Range,
    /// The time from a sequence's start to the end of each of its samplings.
    pub ends: Vec<Range>,
    /// The shortest time from an edge of a gate to the end of a sampling, and the samplings in which an edge lies.
    pub settled: Option<Time>,
    /// See [`Self::settled`].
    pub edged: usize,
}

impl Instants {
    /// Of a converter's samplings, beside the gates' edges.
    pub fn of(name: &'static str, samplings: &[Sampling], edges: &[Edge]) -> Self {
        let mut told =
            Self { name, sequences: 0, apart: Range::NONE, ends: Vec::new(), settled: None, edged: 0 };
        let (mut before, mut past) = (None, 0);
        for Sampling { triggered, rank, from, until } in samplings {
            if *rank == 0 {
                told.sequences += 1;
                if let Some(before) = before.replace(*triggered) {
                    told.apart.take(triggered - before);
                }
            }
            let rank = *rank as usize;
            told.ends.resize(told.ends.len().max(rank + 1), Range::NONE);
            told.ends[rank].take(until - triggered);
            past += edges[past..].iter().take_while(|edge| edge.at <= *until).count();
            if let Some(last) = past.checked_sub(1).map(|index| edges[index].at) {
                told.settled = Some(told.settled.map_or(until - last, |known| known.min(until - last)));
                told.edged += usize::from(last > *from);
            }
        }
        told
    }
}

impl fmt::Display for Instants {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { name, sequences, apart, ends, settled, edged } = self;
        let ends: Vec<_> = ends.iter().map(Range::to_string).collect();
        write!(
            f,
            "{name}: {sequences} sequences, {apart} µs apart; sampled {} µs after the timer's event",
            ends.join(", ")
        )?;
        let Some(settled) = settled else { return Ok(()) };
        let nearest = Range { least: *settled, most: *settled };
        write!(f, "; an edge of a gate {nearest} µs before at least, {edged} times within a sampling")
    }
}
