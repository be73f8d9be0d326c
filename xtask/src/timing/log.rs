//! The emulator's log, line by line: executed instructions and what the interrupt controller did between them.
//!
//! QEMU runs blocks, straight runs of instructions. It lists a block's contents before running it for the first time, and announces each run. Announced
//! instructions count only when the next line has come: the announcement may be withdrawn as a whole, or end early if an access to a peripheral's
//! register has to be the last of its block; then the next block begins with that access.

use crate::elf::Image;
use anyhow::{Context, Result, bail};
use std::collections::HashMap;
use std::rc::Rc;

/// The emulator's arguments for that log, with no block chained to the next.
pub const ARGUMENTS: [&str; 2] =
    ["-d", "in_asm,exec,nochain,trace:nvic_set_pending,trace:nvic_acknowledge_irq,trace:nvic_complete_irq"];

/// The event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// The instruction at this address was executed.
    Step(u32),
    /// An enabled exception of this number became pending.
    Pending(u32),
    /// Its handler is entered.
    Entered(u32),
    /// Its handler has returned.
    Returned(u32),
}

/// Reads the log.
pub struct Log<'a> {
    image: &'a Image,
    /// The instructions of each block, by where the emulator keeps it.
    blocks: HashMap<u64, Rc<[u32]>>,
    /// First and last instruction of the block that was listed last.
    listed: Option<(u32, u32)>,
    /// The instructions that are about to be executed.
    announced: Rc<[u32]>,
    /// `true` if it ends where the next block begins.
    ends_early: bool,
}

impl<'a> Log<'a> {
    /// Of a run of the image, from its beginning.
    pub fn new(image: &'a Image) -> Self {
        Self { image, blocks: HashMap::new(), listed: None, announced: Rc::new([]), ends_early: false }
    }

    /// Takes the next line and returns what has happened by then.
    pub fn take(&mut self, line: &[u8], mut happened: impl FnMut(Event) -> Result<()>) -> Result<()> {
        if line.starts_with(b"Trace ") {
            let Some((block, start)) = announcement(line) else { return Ok(()) };
            self.commit(Some(start), &mut happened)?;
            self.announced = self.block(block, start)?;
        } else if line.starts_with(b"IN:") {
            self.listed = None;
        } else if let Some(address) = line.strip_prefix(b"0x").and_then(|digits| number(digits, 16)) {
            let first = self.listed.map_or(address, |(first, _)| first);
            self.listed = Some((first, address));
        } else if line.starts_with(b"Stopped ") {
            self.announced = Rc::new([]);
        } else if line.starts_with(b"cpu_io_recompile") {
            self.ends_early = true;
        } else if let Some(event) = of_controller(line) {
            self.commit(None, &mut happened)?;
            happened(event)?;
        }
        Ok(())
    }

    /// Takes the announced instructions as executed.
    fn commit(&mut self, next: Option<u32>, happened: &mut impl FnMut(Event) -> Result<()>) -> Result<()> {
        let announced = std::mem::replace(&mut self.announced, Rc::new([]));
        let mut executed = &*announced;
        if std::mem::take(&mut self.ends_early) {
            let end = announced.iter().position(|address| Some(*address) == next);
            let end = end.context("the emulator's log does not go on where a block ended early")?;
            executed = &announced[..end];
        }
        executed.iter().try_for_each(|address| happened(Event::Step(*address)))
    }

    /// The instructions of a block that is announced. One that is listed is announced next.
    fn block(&mut self, block: u64, start: u32) -> Result<Rc<[u32]>> {
        if let Some((first, last)) = self.listed.take() {
            let listed = self.image.instructions.range(first..=last);
            self.blocks.insert(block, listed.map(|(address, _)| *address).collect());
        }
        match self.blocks.get(&block) {
            Some(instructions) if instructions.first() == Some(&start) => Ok(Rc::clone(instructions)),
            _ => bail!("the emulator's log does not list what is in the block at {start:#x}"),
        }
    }
}

/// `Trace 0: 0x7f… [cs_base/pc/flags/…] name`: where the emulator keeps the block, and its first instruction.
fn announcement(line: &[u8]) -> Option<(u64, u32)> {
    let mut words = line.split(|byte| *byte == b' ').skip(2);
    let block = number(words.next()?.strip_prefix(b"0x")?, 16)?;
    let mut numbers = words.next()?.strip_prefix(b"[")?.split(|byte| *byte == b'/');
    Some((block, number(numbers.nth(1)?, 16)?))
}

/// The interrupt controller's event; `None` for a line about something else.
fn of_controller(line: &[u8]) -> Option<Event> {
    let is_enabled = || line.windows(10).any(|part| part == b"enabled: 1");
    let (known, event): (&[u8], fn(u32) -> Event) = match line {
        _ if line.starts_with(b"nvic_set_pending ") && is_enabled() => (b" irq ", Event::Pending),
        _ if line.starts_with(b"nvic_acknowledge_irq ") => (b" IRQ: ", Event::Entered),
        _ if line.starts_with(b"nvic_complete_irq ") => (b" complete IRQ ", Event::Returned),
        _ => return None,
    };
    let at = line.windows(known.len()).position(|part| part == known)? + known.len();
    number(line.get(at..)?, 10).map(event)
}

/// The number that the text begins with, if it is one of this size.
fn number<T: TryFrom<u64>>(text: &[u8], radix: u32) -> Option<T> {
    let mut value = None;
    for byte in text {
        let Some(digit) = char::from(*byte).to_digit(radix) else { break };
        value = Some(value.unwrap_or(0_u64).checked_mul(radix.into())?.checked_add(digit.into())?);
    }
    T::try_from(value?).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elf::tests::small_elf;

    /// push {r4, lr}, bl, str, pop {r4, pc}.
    fn image() -> Image {
        Image::parse(&small_elf(0x100, &[("handler", 0x100, &[0xB510, 0xF000, 0xF805, 0x6002, 0xBD10])]))
            .unwrap()
    }

    /// The events up to the last of these lines.
    fn read(lines: &[&str]) -> Result<Vec<Event>> {
        let image = image();
        let (mut log, mut events) = (Log::new(&image), Vec::new());
        for line in lines {
            log.take(line.as_bytes(), |event| {
                events.push(event);
                Ok(())
            })?;
        }
        Ok(events)
    }

    const LISTED: [&str; 6] = [
        "IN: handler",
        "0x00000100:  b510       push     {r4, lr}",
        "0x00000102:  f000 f805  bl       #0x110",
        "0x00000106:  6002       str      r2, [r0]",
        "0x00000108:  bd10       pop      {r4, pc}",
        "",
    ];
    const ANNOUNCED: &str = "Trace 0: 0x7f5604007100 [00800408/00000100/00000010/ff020200] handler";
    const REWOUND: &str = "cpu_io_recompile: rewound execution of TB to 00000106";
    const PENDING: &str = "nvic_set_pending NVIC set pending irq 24 secure-bank 0 targets_secure 0 derived 0";
    const ENTERED: &str = "nvic_acknowledge_irq NVIC acknowledge IRQ: 26 now active (prio 64)";
    const RETURNED: &str = "nvic_complete_irq NVIC complete IRQ 26 (secure 0)";

    #[test]
    fn a_block_counts_when_the_next_line_has_come() {
        let steps = [0x100, 0x102, 0x106, 0x108].map(Event::Step);
        let run = [&LISTED[..], &[ANNOUNCED]].concat();
        assert_eq!(read(&run).unwrap(), []);
        let again = [&run[..], &[ANNOUNCED, ENTERED, RETURNED]].concat();
        let expected = [&steps[..], &steps, &[Event::Entered(26), Event::Returned(26)]].concat();
        assert_eq!(read(&again).unwrap(), expected);
    }

    #[test]
    fn what_is_withdrawn_does_not_count() {
        let stopped = "Stopped execution of TB chain before 0x7f5604007100 [00000100] handler";
        let run = [&LISTED[..], &[ANNOUNCED, stopped, ENTERED]].concat();
        assert_eq!(read(&run).unwrap(), [Event::Entered(26)]);
    }

    #[test]
    fn a_block_that_ends_early_counts_as_far_as_the_next_one() {
        let next = ["IN: handler", "0x00000106:  6002", "Trace 0: 0x7f9 [0/00000106/0/0] handler", ENTERED];
        let run = [&LISTED[..], &[ANNOUNCED, REWOUND], &next].concat();
        let steps = [0x100, 0x102, 0x106].map(Event::Step);
        assert_eq!(read(&run).unwrap(), [&steps[..], &[Event::Entered(26)]].concat());
        assert!(read(&[&LISTED[..], &[ANNOUNCED, REWOUND, ENTERED]].concat()).is_err());
    }

    #[test]
    fn only_an_enabled_exception_becomes_pending() {
        let read = |enabled: u32| read(&[&format!("{PENDING} (enabled: {enabled} priority 128)")]).unwrap();
        assert_eq!(read(1), [Event::Pending(24)]);
        assert_eq!(read(0), []);
    }

    #[test]
    fn a_block_that_is_not_listed_is_refused_and_other_lines_are_nothing() {
        assert!(read(&[ANNOUNCED]).is_err());
        assert!(read(&[&LISTED[..], &["Trace 0: 0x7f5604007100 [0/00000102/0/0] x"]].concat()).is_err());
        let lines = ["", "Trace ", "Trace 0: 0x7f [00800408]", "IN: main", "nvic_complete_irq NVIC"];
        assert_eq!(read(&lines).unwrap(), []);
        assert_eq!(read(&["Trace 0: 0x7f [0/fffffffff/0/0] x", ENTERED]).unwrap(), [Event::Entered(26)]);
    }
}
