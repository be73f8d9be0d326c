//! A timer (RM0440, chapters 28 to 30): counter, shadow registers, slave modes, capture, encoder.

mod control;
mod main_output;

use super::output::{self, Reference, Stand};
use crate::finding::Findings;
use crate::time::Time;

const CR1: usize = 0x00;
const CR2: usize = 0x04;
const SMCR: usize = 0x08;
const DIER: usize = 0x0C;
const SR: usize = 0x10;
const EGR: usize = 0x14;
const CCMR1: usize = 0x18;
const CCMR2: usize = 0x1C;
const CCER: usize = 0x20;
const CNT: usize = 0x24;
const PSC: usize = 0x28;
const ARR: usize = 0x2C;
const RCR: usize = 0x30;
const CCR1: usize = 0x34;
const BDTR: usize = 0x44;
const CCR5: usize = 0x48;
const CCR6: usize = 0x4C;
const ECR: usize = 0x58;
const AF1: usize = 0x60;

const UIF: u32 = 1;
const CC3IF: u32 = 1 << 3;
const BIF: u32 = 1 << 7;
const SBIF: u32 = 1 << 13;
const IDXIF: u32 = 1 << 20;
const CEN: u32 = 1;
const URS: u32 = 1 << 2;
const DIR: u32 = 1 << 4;
const CMS: u32 = 0b11 << 5;
const ARPE: u32 = 1 << 7;
const MOE: u32 = 1 << 15;
const BKE: u32 = 1 << 12;
const BKP: u32 = 1 << 13;

/// Triggers that a timer has given.
#[derive(Clone, Copy, Debug, Default)]
pub struct Triggers {
    /// TRGO.
    pub first: bool,
    /// TRGO2.
    pub second: bool,
}

/// The position of the encoder as a timer sees it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tracks {
    /// Counts since power-up, of either sign; `None` if a track does not arrive.
    pub counts: Option<i64>,
    /// Counts in a turn, at whose multiples the index lies.
    pub turn: i64,
    /// The index arrives.
    pub has_index: bool,
}

#[derive(Clone, Copy, Debug)]
struct Shadow {
    prescaler: u32,
    reload: u32,
    compares: [u32; 4],
}

/// A timer.
#[derive(Debug)]
pub struct Timer {
    /// Its name.
    pub name: &'static str,
    /// It has gates, and a break.
    has_outputs: bool,
    words: [u32; 32],
    shadow: Shadow,
    /// The position in the period, and the instant at which it was reached. Counting up and down, the way down follows the way up.
    base: (u32, Time),
    followed: Option<i64>,
    triggers: Triggers,
    references: [Reference; 4],
    /// A break input is active, and the chip's own.
    broken: (bool, bool),
    locked: u32,
    /// A debugger holds it, with its outputs off.
    frozen: bool,
    /// The last instant at which it was looked at.
    seen: Time,
}

impl Timer {
    /// After a reset.
    pub fn new(name: &'static str) -> Self {
        let mut words = [0; 32];
        let widest = if name == "TIM2" { u32::MAX } else { 0xFFFF };
        words[ARR / 4] = widest;
        let has_outputs = ["TIM1", "TIM8", "TIM17", "TIM20"].contains(&name);
        words[AF1 / 4] = u32::from(has_outputs);
        Self {
            name,
            has_outputs,
            words,
            shadow: Shadow { prescaler: 0, reload: widest, compares: [0; 4] },
            base: (0, 0),
            followed: None,
            triggers: Triggers::default(),
            references: [Reference::default(); 4],
            broken: (false, false),
            locked: 0,
            frozen: false,
            seen: 0,
        }
    }

    fn word(&self, register: usize) -> u32 {
        self.words[register / 4]
    }

    /// It counts an encoder's tracks.
    pub fn is_encoder(&self) -> bool {
        self.mode() == 3
    }

    /// SMCR.SMS.
    fn mode(&self) -> u32 {
        let word = self.word(SMCR);
        word & 7 | (word >> 16 & 1) << 3
    }

    /// SMCR.TS.
    fn trigger_selection(&self) -> u32 {
        let word = self.word(SMCR);
        word >> 4 & 7 | (word >> 20 & 3) << 3
    }

    fn is_running(&self) -> bool {
        self.word(CR1) & CEN != 0 && !self.is_encoder() && !self.frozen
    }

    fn tick(&self, cycle: Time) -> Time {
        Time::from(self.shadow.prescaler + 1) * cycle
    }

    /// It counts up and down (CR1.CMS).
    fn is_centred(&self) -> bool {
        self.word(CR1) & CMS != 0
    }

    fn position(&self, now: Time, cycle: Time) -> u32 {
        if !self.is_running() {
            return self.base.0;
        }
        let passed = (now - self.base.1) / self.tick(cycle);
        let last = if self.is_centred() { 2 * self.reload() - 1 } else { self.shadow.reload };
        (Time::from(self.base.0) + passed).min(last.into()) as u32
    }

    /// The counter at a position, with its direction.
    fn stand(&self, position: u32) -> Stand {
        let peak = self.reload();
        match self.is_centred() && position >= peak {
            true => Stand { count: 2 * peak - position, down: true },
            false => Stand { count: position, down: false },
        }
    }

    /// The main output is on.
    pub fn is_on(&self) -> bool {
        self.word(BDTR) & MOE != 0
    }

    /// The level of the interrupt's line.
    pub fn interrupts(&self) -> bool {
        self.word(SR) & self.word(DIER) & 0xFF != 0
    }

    /// The triggers since the last time.
    pub fn take_triggers(&mut self) -> Triggers {
        std::mem::take(&mut self.triggers)
    }

    fn update(&mut self, position: u32, now: Time, by_software: bool) {
        self.shadow = Shadow {
            prescaler: self.word(PSC),
            reload: self.word(ARR),
            compares: [0, 1, 2, 3].map(|channel| self.word(CCR1 + 4 * channel)),
        };
        self.base = (position, now);
        if !by_software || self.word(CR1) & URS == 0 {
            self.words[SR / 4] |= UIF;
        }
        let cr2 = self.word(CR2);
        self.triggers.first |= cr2 >> 4 & 7 == 2;
        self.triggers.second |= cr2 >> 20 & 0xF == 2;
    }

    /// Another timer's TRGO: internal triggers 0 ..= 3 are TIM1 to TIM4, 5 is TIM8, 9 is TIM20 (RM0440, internal trigger connection).
    pub fn triggered(&mut self, source: &str, now: Time) {
        let selected = match self.trigger_selection() {
            0 => "TIM1",
            1 => "TIM2",
            2 => "TIM3",
            3 => "TIM4",
            9 => "TIM8",
            13 => "TIM20",
            _ => return,
        };
        if selected != source {
            return;
        }
        match self.mode() {
            4 => self.update(0, now, true),
            6 => self.start(now),
            8 => {
                self.update(0, now, true);
                self.start(now);
            }
            _ => {}
        }
        if self.word(CCMR2) & 0b11 == 0b11 && self.word(CCER) & 1 << 8 != 0 {
            self.words[(CCR1 + 8) / 4] = self.base.0;
            self.words[SR / 4] |= CC3IF;
        }
    }

    /// A debugger halts it: the counter stands still and the outputs are off, as without MOE.
    pub fn freeze(&mut self, now: Time, cycle: Time) {
        self.base = (self.position(now, cycle), now);
        self.frozen = true;
    }

    fn start(&mut self, now: Time) {
        if self.word(CR1) & CEN == 0 {
            self.base.1 = now;
            self.words[CR1 / 4] |= CEN;
        }
    }

    /// The mode of an output channel; `None` for an input.
    fn output_mode(&self, channel: usize) -> Option<u32> {
        let word = self.word(if channel < 2 { CCMR1 } else { CCMR2 }) >> (8 * (channel % 2));
        (word & 0b11 == 0).then_some(word >> 4 & 7 | (word >> 16 & 1) << 3)
    }

    fn compare(&self, channel: usize) -> u32 {
        let word = self.word(if channel < 2 { CCMR1 } else { CCMR2 }) >> (8 * (channel % 2));
        if word & 1 << 3 != 0 { self.shadow.compares[channel] } else { self.word(CCR1 + 4 * channel) }
    }

    fn reload(&self) -> u32 {
        if self.word(CR1) & ARPE != 0 { self.shadow.reload } else { self.word(ARR) }
    }

    fn refer(&mut self, now: Time, cycle: Time) {
        if !self.has_outputs {
            return;
        }
        let stand = self.stand(self.position(now, cycle));
        for channel in 0..4 {
            let Some(mode) = self.output_mode(channel) else { continue };
            let other = channel ^ 1;
            let partner = self.output_mode(other).unwrap_or(0);
            if let Some(high) =
                output::level(mode, stand, self.compare(channel), partner, self.compare(other))
            {
                self.references[channel].set(high, now);
            }
        }
    }

    /// The next instant at which its outputs, flags or triggers may change.
    pub fn next_event(&self, cycle: Time) -> Time {
        let mut next = Time::MAX;
        if self.is_running() {
            let tick = self.tick(cycle);
            let compares = (0..if self.has_outputs { 4 } else { 0 }).map(|channel| self.compare(channel));
            let reload = self.reload();
            let mut look = |threshold: u32| {
                if threshold > self.base.0 {
                    next = next.min(self.base.1 + Time::from(threshold - self.base.0) * tick);
                }
            };
            let (is_centred, compares) = (self.is_centred(), compares.filter(|compare| *compare <= reload));
            for threshold in compares.chain([if is_centred { reload } else { reload + 1 }]) {
                look(threshold);
                if is_centred {
                    look(2 * reload - threshold);
                }
            }
            if is_centred {
                look(2 * reload);
            }
        }
        let dead = self.dead(cycle);
        let settling = self.references.iter().filter_map(|reference| reference.settles(dead, self.seen));
        settling.fold(next, Time::min)
    }

    /// Does what is due.
    pub fn act(&mut self, now: Time, cycle: Time) {
        self.seen = now;
        self.refer(now, cycle);
        if self.is_running() {
            let tick = self.tick(cycle);
            let position = Time::from(self.base.0) + (now - self.base.1) / tick;
            let peak = self.reload();
            let next = match self.is_centred() {
                true if self.base.0 < peak && position >= peak.into() => Some(peak),
                true => (position >= (2 * peak).into()).then_some(0),
                false => (position > peak.into()).then_some(0),
            };
            if let Some(next) = next {
                self.update(next, now, false);
                self.refer(now, cycle);
            } else if position as u32 > self.base.0 {
                let passed = position - Time::from(self.base.0);
                self.base = (position as u32, self.base.1 + passed * tick);
            }
        }
    }

    /// A register is read.
    pub fn read(&mut self, offset: u32, now: Time, cycle: Time) -> Option<u32> {
        match offset as usize {
            CNT => Some(self.stand(self.position(now, cycle)).count),
            CR1 if self.is_centred() => {
                let down = self.stand(self.position(now, cycle)).down;
                Some(self.word(CR1) & !DIR | if down { DIR } else { 0 })
            }
            EGR => None,
            register @ (CR1..=BDTR | CCR5 | CCR6 | ECR | AF1) => Some(self.word(register)),
            _ => None,
        }
    }

    /// A register is written; `false` if the twin has no such register.
    pub fn write(
        &mut self,
        offset: u32,
        value: u32,
        now: Time,
        cycle: Time,
        findings: &mut Findings,
    ) -> bool {
        let register = offset as usize;
        self.check_lock(register, value, findings);
        match register {
            CR1 => self.control(value, now, cycle, findings),
            SR => {
                self.words[SR / 4] &= value;
                // A flag whose cause is still there is set again.
                let (pin, chip) = self.broken;
                self.words[SR / 4] |= if pin { BIF } else { 0 } | if chip { SBIF } else { 0 };
            }
            EGR => self.generate(value, now, findings),
            SMCR => {
                let moved = value ^ self.word(SMCR);
                let busy = moved & 0x0030_0070 != 0 && self.mode() != 0;
                findings
                    .expect(!busy, || format!("{}.SMCR.TS is changed while a slave mode uses it", self.name));
                self.words[SMCR / 4] = value;
            }
            ARR if self.word(CR1) & ARPE == 0 => {
                let moves = self.has_outputs && self.is_running() && value != self.shadow.reload;
                findings.expect(!moves, || {
                    format!(
                        "{}.ARR is changed within a period of its outputs: it is not preloaded",
                        self.name
                    )
                });
                self.words[ARR / 4] = value;
                self.shadow.reload = value;
            }
            BDTR => self.write_break(value, findings),
            CR2 | DIER | CCMR1 | CCMR2 | CCER | PSC | ARR | RCR | CCR1..BDTR | CCR5 | CCR6 | ECR | AF1 => {
                self.words[register / 4] = value;
            }
            CNT => self.base = (value, now),
            _ => return false,
        }
        self.refer(now, cycle);
        true
    }
}
