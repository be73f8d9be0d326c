//! From the emulator's log to the interrupts: which instruction belongs to which handler.

use super::log::Event;
use super::tally::Tally;
use crate::elf::Image;
use crate::thumb::cost::{ENTRY_AND_RETURN, EXCEPTION_FRAME, REFILL};
use crate::thumb::{Flow, Instruction};
use anyhow::{Result, bail};
use std::collections::{BTreeMap, BTreeSet};

/// One interrupt, from the first instruction of its handler to its return.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Call {
    /// Number of the exception.
    pub exception: u32,
    /// Instructions, without the link and without what other handlers executed meanwhile.
    pub instructions: u32,
    /// Cycles that these take at most.
    pub cycles: u32,
    /// Instructions from pending to entry.
    pub latency: u32,
    /// Handlers that were active with it.
    pub depth: usize,
    /// The exception whose handler it interrupted; `None`: the idle loop.
    pub within: Option<u32>,
}

/// The instructions that one interrupt executed, in their order, without the link.
#[derive(Clone, Debug, Default)]
pub struct Path {
    pub addresses: Vec<u32>,
    /// Instructions before each of them, with the link's where the log has them.
    pub elapsed: Vec<u32>,
}

/// Follows the log.
#[derive(Default)]
pub struct Meter {
    /// By half-words, quick to look up.
    code: Vec<Instruction>,
    /// Starts of the functions that are not counted.
    link: BTreeSet<u32>,
    active: Vec<Handler>,
    /// Instructions since the exception became pending.
    pending: BTreeMap<u32, u32>,
    /// Every interrupt that has returned, in the order of their returns.
    pub calls: Vec<Call>,
    /// `true` if the instructions that each of them executed are kept.
    pub keeps_paths: bool,
    /// The instructions that each of them executed, if they are kept.
    pub paths: Vec<Path>,
    /// The number of executions of each address.
    pub hits: Tally,
    /// The instructions that were executed inside each call, by its return address.
    pub behind: Tally,
    /// Bytes of stack that each exception takes at most, with its frame.
    pub deepest: BTreeMap<u32, i32>,
    /// Of each exception the addresses that its longest interrupt executed.
    pub longest: BTreeMap<u32, Vec<u32>>,
}

/// A handler on its way.
#[derive(Default)]
struct Handler {
    call: Call,
    /// Return address and stack of the functions it is in.
    within: Vec<(u32, i32)>,
    /// The stack's depth before it, and its depth now.
    base: i32,
    stack: i32,
    /// In the link, until this address.
    resumes: Option<u32>,
    /// The address of the next instruction unless the last one branched.
    next: Option<u32>,
    /// The addresses that were executed.
    addresses: Vec<u32>,
    /// Instructions before each of them, and by now, with the link's where the log has them.
    elapsed: Vec<u32>,
    by_now: u32,
}

impl Meter {
    /// A meter for an image; functions that start at `link` are not counted.
    pub fn new(image: &Image, link: BTreeSet<u32>) -> Self {
        let end = image.instructions.keys().next_back().map_or(0, |last| last / 2 + 1);
        let mut code = vec![Instruction::default(); end as usize];
        for (address, instruction) in &image.instructions {
            code[(address / 2) as usize] = *instruction;
        }
        Self { code, link, ..Self::default() }
    }

    /// Takes the next event.
    pub fn take(&mut self, event: Event) -> Result<()> {
        match event {
            Event::Step(address) => self.step(address),
            Event::Pending(exception) => _ = self.pending.entry(exception).or_insert(0),
            Event::Entered(exception) => self.enter(exception),
            Event::Returned(exception) => self.leave(exception)?,
        }
        Ok(())
    }

    fn enter(&mut self, exception: u32) {
        let base = self.active.last().map_or(0, |handler| handler.stack);
        let call = Call {
            exception,
            within: self.active.last().map(|handler| handler.call.exception),
            latency: self.pending.remove(&exception).unwrap_or(0),
            cycles: ENTRY_AND_RETURN,
            ..Call::default()
        };
        self.active.push(Handler { call, base, stack: base + EXCEPTION_FRAME, ..Handler::default() });
        let depth = self.active.len();
        for handler in &mut self.active {
            handler.call.depth = handler.call.depth.max(depth);
        }
    }

    fn leave(&mut self, exception: u32) -> Result<()> {
        match self.active.pop() {
            Some(handler) if handler.call.exception == exception => {
                self.calls.push(handler.call);
                if self.keeps_paths {
                    self.paths.push(Path { addresses: handler.addresses.clone(), elapsed: handler.elapsed });
                }
                let longest = self.longest.entry(exception).or_default();
                if handler.addresses.len() > longest.len() {
                    *longest = handler.addresses;
                }
            }
            Some(handler) => bail!("exception {exception} returns within {}", handler.call.exception),
            None => bail!("exception {exception} returns and was never entered"),
        }
        Ok(())
    }

    fn step(&mut self, address: u32) {
        let Some(handler) = self.active.last_mut() else { return };
        let before = handler.by_now;
        handler.by_now += 1;
        if let Some(resumes) = handler.resumes {
            if resumes != address {
                return;
            }
            handler.resumes = None;
        }
        if let Some((back, stack)) = handler.within.last().copied()
            && back == address
        {
            handler.within.pop();
            handler.stack = stack;
        }
        let instruction = self.code.get((address / 2) as usize).copied().unwrap_or_default();
        if handler.next.is_some_and(|next| next != address) {
            handler.call.cycles += REFILL;
        }
        handler.next = Some(address + instruction.length);
        handler.call.instructions += 1;
        handler.addresses.push(address);
        if self.keeps_paths {
            handler.elapsed.push(before);
        }
        handler.call.cycles += instruction.cycles;
        handler.stack -= instruction.stack_move;
        let deepest = self.deepest.entry(handler.call.exception).or_default();
        *deepest = (*deepest).max(handler.stack - handler.base);
        self.hits.add(handler.call.exception, address);
        for (back, _) in &handler.within {
            self.behind.add(handler.call.exception, *back);
        }
        for waited in self.pending.values_mut() {
            *waited += 1;
        }
        let Flow::To(target) = instruction.flow else { return };
        let back = address + instruction.length;
        if self.link.contains(&target) {
            // There and back. Without a link, execution continues at the caller's caller, or at none.
            let callers = handler.within.last().map_or(u32::MAX, |(back, _)| *back);
            handler.resumes = Some(if instruction.links { back } else { callers });
            handler.call.cycles += 2 * REFILL;
        } else if instruction.links {
            handler.within.push((back, handler.stack));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elf::tests::small_elf;

    /// handler: push {r4, lr}, bl helper, bl link, pop {r4, pc}; helper: bx lr; link: bx lr; other: nop, bx lr.
    fn image() -> Image {
        let functions: [(&str, u32, &[u16]); 4] = [
            ("handler", 0x100, &[0xB510, 0xF000, 0xF805, 0xF000, 0xF80B, 0xBD10]),
            ("helper", 0x110, &[0x4770]),
            ("link", 0x120, &[0x4770]),
            ("other", 0x130, &[0xBF00, 0x4770]),
        ];
        Image::parse(&small_elf(0x100, &functions)).unwrap()
    }

    /// Feeds what happened: `p24` pending, `e24` entered, `r24` returned, else the address of what was executed.
    fn measure(happened: &str) -> Result<(Vec<Call>, Tally, i32)> {
        let image = image();
        let link = BTreeSet::from([0x120]);
        let mut meter = Meter::new(&image, link);
        for word in happened.split_whitespace() {
            let number = || word[1..].parse().unwrap();
            meter.take(match word.split_at(1).0 {
                "p" => Event::Pending(number()),
                "e" => Event::Entered(number()),
                "r" => Event::Returned(number()),
                _ => Event::Step(u32::from_str_radix(word, 16).unwrap()),
            })?;
        }
        let stack_bytes = meter.deepest.values().sum();
        Ok((meter.calls, meter.hits, stack_bytes))
    }

    #[test]
    fn helpers_count_and_the_link_does_not() {
        let (calls, hits, stack) = measure("p24 e24 100 102 110 106 120 10a r24").unwrap();
        assert_eq!((calls.len(), calls[0].exception, calls[0].instructions), (1, 24, 5));
        assert_eq!((calls[0].latency, calls[0].depth), (0, 1));
        let executed: Vec<_> = hits.of(24).map(|(address, _)| address).collect();
        assert_eq!(executed, [0x100, 0x102, 0x106, 0x10A, 0x110]);
        assert_eq!(stack, EXCEPTION_FRAME + 8);
        // push 3, bl 1, bx 1, bl 1, pop 3; refills after bl, bx, bl, the link's return.
        assert_eq!(calls[0].cycles, ENTRY_AND_RETURN + 9 + 4 * REFILL);
    }

    #[test]
    fn what_a_higher_interrupt_executes_is_its_own() {
        let (calls, _, stack) = measure("e24 100 102 p26 e26 130 132 r26 110 106 10a r24").unwrap();
        let counted: Vec<_> = calls.iter().map(|call| (call.exception, call.instructions)).collect();
        assert_eq!(counted, [(26, 2), (24, 5)]);
        assert_eq!(calls[1].depth, 2);
        assert_eq!(stack, 2 * EXCEPTION_FRAME + 8);
    }

    #[test]
    fn who_waits_for_a_handler_waits_its_instructions() {
        let (calls, _, _) = measure("p26 e26 130 p24 132 r26 e24 100 r24").unwrap();
        assert_eq!((calls[0].latency, calls[1].latency), (0, 1));
    }

    #[test]
    fn a_log_that_makes_no_sense_is_refused() {
        assert!(measure("r24").is_err());
        assert!(measure("e24 100 r26").is_err());
        let (calls, _, _) = measure("100 130").unwrap();
        assert!(calls.is_empty());
    }
}
