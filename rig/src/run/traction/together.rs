//! Several drives on one link: each with its own bench, tasks and machine, all of them behind one line filter.
//!
//! Between two events of any drive, the link's voltage is held and all machines turn on at that voltage; then the link supplies what they
//! took together. With one drive, its own bench does the same.

use crate::bench::{Bench, Simulated, Terminal, Tick};
use crate::plant::FilteredLink;
use crate::run::Interrupts;
use anyhow::Result;

/// A drive on its bench.
pub struct OnBench<T> {
    /// The bench, of [`crate::bench::Supply::Shared`].
    pub bench: Bench,
    /// The drive's tasks.
    pub tasks: T,
}

impl<T: Interrupts<Bench = Bench>> OnBench<T> {
    /// The tick of its next interrupt.
    fn next_call(&self) -> Tick {
        self.bench.time().widen(self.tasks.next_call(&self.bench))
    }
}

/// The link and the drives on it; all of them share the first one's line.
pub struct Together<T> {
    /// The link.
    pub link: FilteredLink,
    /// The first drive.
    pub first: OnBench<T>,
    /// The others.
    pub others: Vec<OnBench<T>>,
}

impl<T: Interrupts<Bench = Bench>> Together<T> {
    /// Runs until the first drive's recording is complete; `show` is told the progress.
    pub fn drive(&mut self, mut show: impl FnMut(f64)) -> Result<()> {
        while !self.first.bench.is_done() {
            let next = self.all().map(|drive| drive.next_call()).fold(Tick::MAX, Tick::min);
            self.advance(next)?;
            for OnBench { bench, tasks } in self.all().filter(|drive| drive.next_call() == next) {
                tasks.call(bench)?;
            }
            show(self.first.bench.progress());
        }
        Ok(())
    }

    fn all(&mut self) -> impl Iterator<Item = &mut OnBench<T>> {
        std::iter::once(&mut self.first).chain(&mut self.others)
    }

    /// Runs all benches to `tick`.
    fn advance(&mut self, tick: Tick) -> Result<()> {
        while self.first.bench.time().now < tick {
            let due = self.all().fold(tick, |due, drive| drive.bench.due(due));
            let line = self.first.bench.line_now();
            let dt_s = self.first.bench.seconds_to(due);
            let drawn_j = self.all().map(|drive| drive.bench.turn_on(dt_s)).sum();
            self.link.advance(drawn_j, dt_s, line);
            let terminal = Terminal { udc_v: self.link.udc_v, line_a: self.link.choke_a };
            for drive in self.all() {
                drive.bench.arrive(due, terminal)?;
            }
        }
        Ok(())
    }
}
