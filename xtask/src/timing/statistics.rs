//! The statistics of all drives together about each interrupt in each mode.

use super::drive::Drive;
use super::meter::Call;
use anyhow::{Result, bail};
use std::collections::BTreeMap;

/// The interrupts by the numbers of their exceptions on the emulated board: sixteen more than the interrupt's.
pub const INTERRUPTS: [(&str, u32); 2] = [("control", 16 + 8), ("pwm", 16 + 10)];

const CONTROL_HZ: f64 = 10_000.0;
/// The STM32G474's clock.
const PROCESSOR_HZ: f64 = 170e6;

/// Smallest, mean and largest of something.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    pub min: u32,
    pub max: u32,
    pub sum: u64,
    pub count: u64,
}

impl Default for Spread {
    fn default() -> Self {
        Self { min: u32::MAX, max: 0, sum: 0, count: 0 }
    }
}

impl Spread {
    fn of(value: u32) -> Self {
        Self { min: value, max: value, sum: value.into(), count: 1 }
    }

    fn add(&mut self, value: u32) {
        (self.min, self.max) = (self.min.min(value), self.max.max(value));
        self.sum += u64::from(value);
        self.count += 1;
    }

    /// 0 of nothing.
    pub fn mean(&self) -> f64 {
        if self.count == 0 { 0.0 } else { self.sum as f64 / self.count as f64 }
    }
}

/// One interrupt in one mode.
#[derive(Clone, Copy, Debug, Default)]
pub struct Row {
    pub instructions: Spread,
    pub cycles: Spread,
    pub latency: Spread,
    pub depth: usize,
}

impl Row {
    fn add(&mut self, call: &Call) {
        self.instructions.add(call.instructions);
        self.cycles.add(call.cycles);
        self.latency.add(call.latency);
        self.depth = self.depth.max(call.depth);
    }
}

/// The entry into an interrupt from somewhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entry {
    pub interrupt: &'static str,
    /// `idle`, or the interrupt that it interrupted.
    pub from: &'static str,
    /// Instructions from its event to the first one of its handler.
    pub latency: Spread,
}

/// Share of the processor, in percent.
#[derive(Clone, Copy, Debug)]
pub struct Load {
    pub mean: f64,
    /// If every interrupt took as long as the longest one.
    pub max: f64,
}

/// Mode, direction and interrupt; without a direction: all of the mode's interrupts.
type Key = (String, Option<&'static str>, String);

/// By mode, direction and interrupt.
#[derive(Clone, Debug, Default)]
pub struct Statistics {
    rows: BTreeMap<Key, Row>,
    /// Modes in the order in which they came.
    seen: Vec<String>,
    /// Largest stator frequency, in Hz.
    pub hertz: f64,
    /// Bytes of stack that each exception takes at most, with its frame.
    deepest: BTreeMap<u32, i32>,
    pub entries: Vec<Entry>,
}

impl Statistics {
    /// Adds a drive: the n-th interrupt of a kind in the log is the n-th that the rig served.
    pub fn add(&mut self, drive: &Drive) -> Result<()> {
        for (name, exception) in INTERRUPTS {
            let calls: Vec<&Call> = drive.calls.iter().filter(|call| call.exception == exception).collect();
            let served: Vec<_> = drive.served.iter().filter(|served| served.interrupt == name).collect();
            if calls.len() != served.len() || calls.is_empty() {
                bail!("the log holds {} {name} interrupts, the rig served {}", calls.len(), served.len());
            }
            for (call, served) in calls.into_iter().zip(served) {
                if !self.seen.contains(&served.mode) {
                    self.seen.push(served.mode.clone());
                }
                for direction in [None].into_iter().chain(served.direction.map(Some)) {
                    let key = (served.mode.clone(), direction, name.to_owned());
                    self.rows.entry(key).or_default().add(call);
                }
                self.hertz = self.hertz.max(served.hertz.abs());
                self.enter(name, call);
            }
        }
        for (exception, bytes) in &drive.deepest {
            let deepest = self.deepest.entry(*exception).or_default();
            *deepest = (*deepest).max(*bytes);
        }
        Ok(())
    }

    /// The modes that were seen: first those of a list in its order, then the others in the order in which they came, without pulses last.
    pub fn modes(&self, first: &str) -> Vec<&str> {
        let mut modes: Vec<_> = self.seen.iter().map(String::as_str).collect();
        let place = |mode: &str| first.split(' ').position(|known| known == mode).unwrap_or(usize::MAX);
        modes.sort_by_key(|mode| (*mode == "off", place(mode)));
        modes
    }

    /// Bytes of stack below the idle loop's, if the higher interrupt comes where control's stack is deepest.
    pub fn stack_bytes(&self) -> i32 {
        self.deepest.values().sum()
    }

    fn enter(&mut self, interrupt: &'static str, call: &Call) {
        let named = |exception| INTERRUPTS.iter().find(|(_, number)| *number == exception);
        let from = call.within.map_or("idle", |exception| named(exception).map_or("other", |(name, _)| name));
        let known = self.entries.iter_mut().find(|entry| entry.interrupt == interrupt && entry.from == from);
        match known {
            Some(entry) => entry.latency.add(call.latency),
            None => self.entries.push(Entry { interrupt, from, latency: Spread::of(call.latency) }),
        }
    }

    /// The number of instructions by which the entries of an interrupt differ, wherever it comes.
    pub fn entry_spread(&self, interrupt: &str) -> u32 {
        let entries = || self.entries.iter().filter(|entry| entry.interrupt == interrupt);
        let latest = entries().map(|entry| entry.latency.max).max();
        let first = entries().map(|entry| entry.latency.min).min();
        latest.unwrap_or(u32::MAX) - first.unwrap_or(0)
    }

    /// One interrupt in one mode, and in one direction if one is named; `None` if it was not seen there.
    pub fn row(&self, mode: &str, direction: Option<&'static str>, interrupt: &str) -> Option<&Row> {
        self.rows.get(&(mode.to_owned(), direction, interrupt.to_owned()))
    }

    /// Share of the processor that both interrupts take in a mode, and in one direction if one is named.
    pub fn load(&self, mode: &str, direction: Option<&'static str>) -> Option<Load> {
        let row = |interrupt| self.row(mode, direction, interrupt);
        let (control, pwm) = (row("control")?, row("pwm")?);
        let pwm_hertz = CONTROL_HZ * pwm.cycles.count as f64 / control.cycles.count as f64;
        let percent =
            |control: f64, pwm: f64| 100.0 * (control * CONTROL_HZ + pwm * pwm_hertz) / PROCESSOR_HZ;
        Some(Load {
            mean: percent(control.cycles.mean(), pwm.cycles.mean()),
            max: percent(control.cycles.max.into(), pwm.cycles.max.into()),
        })
    }

    /// The largest load of the most expensive mode, in percent.
    pub fn worst_load(&self) -> f64 {
        let modes = self.rows.keys().map(|(mode, ..)| mode).filter(|mode| *mode != "off");
        modes.filter_map(|mode| self.load(mode, None)).map(|load| load.max).fold(0.0, f64::max)
    }

    /// Mean over everything that was counted; the cycles include entries and returns.
    pub fn cycles_per_instruction(&self) -> f64 {
        let sum = |of: fn(&Row) -> &Spread| self.whole().map(|(_, row)| of(row).sum).sum::<u64>() as f64;
        sum(|row| &row.cycles) / sum(|row| &row.instructions).max(1.0)
    }

    /// The rows of one interrupt over all modes. A PWM interrupt that finds a fault makes no more pulses, so it is among `off`.
    pub fn of<'a>(&'a self, interrupt: &'a str) -> impl Iterator<Item = &'a Row> {
        self.whole().filter(move |((.., name), _)| name == interrupt).map(|(_, row)| row)
    }

    /// The rows of all directions together.
    fn whole(&self) -> impl Iterator<Item = (&Key, &Row)> {
        self.rows.iter().filter(|((_, direction, _), _)| direction.is_none())
    }
}
