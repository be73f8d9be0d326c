//! The emulator's log, line by line: executed instructions and what the interrupt controller did between them.

/// How the emulator is asked for that log: one instruction a block, no block chained to the next.
pub const ARGUMENTS: [&str; 3] = [
    "-singlestep",
    "-d",
    "exec,nochain,trace:nvic_set_pending,trace:nvic_acknowledge_irq,trace:nvic_complete_irq",
];

/// What a line says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// The instruction at this address is about to be executed.
    Step(u32),
    /// The one announced last is not executed yet, but later.
    Withdrawn,
    /// An enabled exception of this number became pending.
    Pending(u32),
    /// Its handler is entered.
    Entered(u32),
    /// Its handler has returned.
    Returned(u32),
}

/// The event in a line; `None` for a line about something else.
pub fn event(line: &[u8]) -> Option<Event> {
    if line.starts_with(b"Trace ") {
        return program_counter(line).map(Event::Step);
    }
    // An access to a peripheral's register is announced, withdrawn and announced anew.
    if line.starts_with(b"Stopped ") || line.starts_with(b"cpu_io_recompile") {
        return Some(Event::Withdrawn);
    }
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

/// `Trace 0: 0x… [cs_base/pc/flags/…] name`: the second of the numbers in brackets.
fn program_counter(line: &[u8]) -> Option<u32> {
    let bracket = line.iter().position(|byte| *byte == b'[')?;
    let rest = line.get(bracket..)?;
    let slash = rest.iter().position(|byte| *byte == b'/')?;
    number(rest.get(slash + 1..)?, 16)
}

/// The number that the text begins with.
fn number(text: &[u8], radix: u32) -> Option<u32> {
    let mut value = None;
    for byte in text {
        let Some(digit) = char::from(*byte).to_digit(radix) else { break };
        value = Some(value.unwrap_or(0_u32).checked_mul(radix)?.checked_add(digit)?);
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recorded_lines() {
        let read = |line: &str| event(line.as_bytes());
        let step = "Trace 0: 0x7f5604007100 [00800408/0000428c/00000010/ff020201] _ZN8tractive4link7Request";
        assert_eq!(read(step), Some(Event::Step(0x428C)));
        let stopped = "Stopped execution of TB chain before 0x7f5604007100 [0000428c] DUALTIMER";
        assert_eq!(read(stopped), Some(Event::Withdrawn));
        let rewound = "cpu_io_recompile: rewound execution of TB to 0000123c";
        assert_eq!(read(rewound), Some(Event::Withdrawn));
        let pending = "nvic_set_pending NVIC set pending irq 24 secure-bank 0 targets_secure 0 derived 0 ";
        assert_eq!(read(&format!("{pending}(enabled: 1 priority 128)")), Some(Event::Pending(24)));
        assert_eq!(read(&format!("{pending}(enabled: 0 priority 0)")), None);
        let entered = "nvic_acknowledge_irq NVIC acknowledge IRQ: 26 now active (prio 64)";
        assert_eq!(read(entered), Some(Event::Entered(26)));
        assert_eq!(read("nvic_complete_irq NVIC complete IRQ 26 (secure 0)"), Some(Event::Returned(26)));
    }

    #[test]
    fn other_lines_and_broken_ones_are_nothing() {
        for line in ["", "Trace ", "Trace 0: 0x7f [00800408]", "IN: main", "nvic_complete_irq NVIC"] {
            assert_eq!(event(line.as_bytes()), None, "{line}");
        }
        assert_eq!(event(b"Trace 0: 0x7f [0/fffffffff/0/0] x"), None);
    }
}
