//! The instructions of a control interrupt at which a carrier boundary can come, and those that were hit.

use super::{Call, INSTRUCTIONS_PER_TICK};
use crate::elf::Image;
use crate::fault_injector::Seen;
use std::collections::{BTreeMap, HashSet};

/// A control interrupt samples at once. If it has not begun a sixteenth of its period after its timer, it counts as lost. So no delay brings a boundary
/// before the samples if the boundary comes later than this part of the period, which is a little less.
const BEGUN_PART: u32 = 18;
/// The number of instructions by which a landing may deviate from the ticks that are left.
pub const NEAR: u32 = 2 * INSTRUCTIONS_PER_TICK;
/// The most instructions of the PWM interrupts within a control interrupt, with their link, and a little for control's own entry.
const ALLOWANCE: u32 = 6_000;

/// A control interrupt of a run, between its boundaries.
pub struct Stand<'a> {
    pub number: usize,
    pub call: &'a Call,
    /// From one control interrupt to the next, in ticks.
    control_ticks: u32,
    /// From its coming to the next carrier boundary, in ticks.
    pub left_ticks: u32,
    /// Since the last one; `None` before the first.
    pub since_ticks: Option<u32>,
    /// The number of instructions by which it may begin later and still end in time.
    pub most: u32,
    /// Instructions that it has executed when the boundary comes, if it does not wait; unknown before one has landed in it.
    pub boundary: Option<u32>,
}

/// The reason why no boundary can come at an instruction of a control interrupt.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Why {
    BehindBoundary,
    BehindLanding,
    OfCommand,
    BeforeFirst,
    BeforeSamples,
}

impl Why {
    const fn text(self) -> &'static str {
        match self {
            Self::BehindBoundary => {
                "only in the first control interrupt behind a boundary, and the next boundary comes after its period"
            }
            Self::BehindLanding => {
                "only where a boundary has come in the same control interrupt already, and the next comes after its period"
            }
            Self::OfCommand => {
                "only in the control interrupt that makes the next boundary's command, and the boundary comes after its period"
            }
            Self::BeforeFirst => "only before the first boundary of all",
            Self::BeforeSamples => {
                "before the samples, which are taken at once, and every boundary comes later"
            }
        }
    }
}

impl<'a> Stand<'a> {
    /// Of each control interrupt that was seen.
    pub fn all(calls: &'a [Call], seen: &[Seen], control_ticks: u32, deadline_ticks: u32) -> Vec<Self> {
        let (mut last, mut next): (Option<u32>, Option<u32>) = (None, None);
        let stand = |seen: &Seen| {
            let call = calls.get(seen.number)?;
            let comes = control_ticks * seen.number as u32;
            let boundary = comes + seen.left_ticks;
            if next.is_some_and(|next| next != boundary) {
                last = next;
            }
            next = Some(boundary);
            let length = call.path.last().map_or(0, |(_, before)| *before) + ALLOWANCE;
            Some(Self {
                number: seen.number,
                call,
                control_ticks,
                left_ticks: seen.left_ticks,
                since_ticks: last.map(|last| comes.saturating_sub(last)),
                most: (deadline_ticks * INSTRUCTIONS_PER_TICK).saturating_sub(length),
                boundary: None,
            })
        };
        seen.iter().filter_map(stand).collect()
    }

    /// The reason why no boundary can come at the point this many instructions after its beginning.
    pub fn why(&self, before: u32) -> Option<Why> {
        let far = self.left_ticks > self.control_ticks;
        if before > self.left_ticks * INSTRUCTIONS_PER_TICK + NEAR {
            return Some(Why::BehindLanding);
        }
        match self.since_ticks {
            None if far => Some(Why::BeforeFirst),
            Some(since) if far && since < self.control_ticks => Some(Why::BehindBoundary),
            Some(_) if far && self.left_ticks < 2 * self.control_ticks => Some(Why::OfCommand),
            _ if before < self.call.sampled && self.left_ticks > self.control_ticks / BEGUN_PART => {
                Some(Why::BeforeSamples)
            }
            _ => None,
        }
    }
}

/// The instructions that the runs of a course have hit.
#[derive(Default)]
pub struct Reached {
    /// Of each mode the instructions that were executed, and those that were hit.
    all: BTreeMap<String, HashSet<u32>>,
    hit: BTreeMap<String, HashSet<u32>>,
    /// The reason why no boundary can come at an instruction, in each control interrupt that executes it; `None` if one could in some of them.
    whys: BTreeMap<u32, Option<Why>>,
    pub preemption: usize,
    pub passes: usize,
}

impl Reached {
    pub fn add(&mut self, mode: &str, address: u32) {
        self.preemption += 1;
        self.hit.entry(mode.to_owned()).or_default().insert(address);
    }

    pub fn has(&self, mode: &str, address: u32) -> bool {
        self.hit.get(mode).is_some_and(|hit| hit.contains(&address))
    }

    /// Instructions that were hit in any mode.
    pub fn hit_in_any(&self) -> HashSet<u32> {
        self.hit.values().flatten().copied().collect()
    }

    /// Takes what a run has executed.
    pub fn judge(&mut self, stands: &[Stand]) {
        for stand in stands {
            let all = self.all.entry(stand.call.mode.clone()).or_default();
            for (address, before) in &stand.call.path {
                all.insert(*address);
                let why = stand.why(*before);
                self.whys.entry(*address).and_modify(|of| *of = of.and(why)).or_insert(why);
            }
        }
    }

    /// Instructions executed and hit, by mode, and those that no boundary can reach.
    pub fn table(&self) -> String {
        let hit = self.hit_in_any();
        let counts = self.all.iter().map(|(mode, all)| {
            let hit = all.iter().filter(|address| self.has(mode, **address)).count();
            (mode.as_str(), [all.len(), hit])
        });
        let any = [self.whys.len(), self.whys.keys().filter(|address| hit.contains(address)).count()];
        let mut text = format!("{:<16} {:>12} {:>6} {:>6}\n", "mode", "instructions", "hit", "%");
        for (mode, [all, hit]) in counts.chain([("any", any)]) {
            let percent = 100.0 * hit as f64 / all.max(1) as f64;
            text += &format!("{mode:<16} {all:>12} {hit:>6} {percent:>6.1}\n");
        }
        let mut whys: BTreeMap<Why, usize> = BTreeMap::new();
        for (_, why) in self.whys.iter().filter(|(address, _)| !hit.contains(address)) {
            if let Some(why) = why {
                *whys.entry(*why).or_default() += 1;
            }
        }
        for (why, count) in whys {
            text += &format!("{count} cannot be hit: {}\n", why.text());
        }
        text
    }

    /// Instructions that could have been hit and were not.
    pub fn missing(&self) -> impl Iterator<Item = u32> {
        let hit = self.hit_in_any();
        let could = self.whys.iter().filter(|(_, why)| why.is_none()).map(|(address, _)| *address);
        could.filter(move |address| !hit.contains(address))
    }

    /// A line for each of them.
    pub fn findings(&self, image: &Image) -> Vec<String> {
        self.missing()
            .map(|address| format!("{address:x} in {} was not hit", image.name_at(address)))
            .collect()
    }
}
