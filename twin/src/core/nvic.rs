//! The nested vectored interrupt controller and the system control block, after ARMv7-M (DDI 0403E, B3).

use crate::finding::Findings;
use crate::time::Time;

/// The number of external interrupts that the chip has (RM0440, vector table).
pub const LINES: usize = 102;
/// The number of the first external interrupt as an exception.
const EXTERNAL: usize = 16;
/// The non-maskable interrupt and the hard fault, as exceptions.
pub const NMI: usize = 2;
/// See [`NMI`].
pub const HARD_FAULT: usize = 3;
/// The bits of a priority that the chip has: the upper four.
const PRIORITY_BITS: u8 = 0xF0;
/// The priority at which nothing is active.
const IDLE: i32 = 256;

/// The state.
#[derive(Debug)]
pub struct Nvic {
    /// A bit each.
    enabled: u128,
    pending: u128,
    /// The lines' own levels: an interrupt whose line is still high when its handler returns comes again.
    lines: [bool; LINES],
    priorities: [u8; LINES],
    /// The instants from which each could have been taken, and the longest time that each has waited since then.
    since: [Time; LINES],
    waited: [Time; LINES],
    /// The processor's own exceptions that are pending: the non-maskable interrupt, the hard fault.
    system: [bool; 2],
    /// The active exceptions, the innermost last.
    pub active: Vec<usize>,
    /// CPACR.
    pub cpacr: u32,
    vtor: u32,
}

impl Default for Nvic {
    fn default() -> Self {
        Self {
            enabled: 0,
            pending: 0,
            lines: [false; LINES],
            priorities: [0; LINES],
            since: [0; LINES],
            waited: [0; LINES],
            system: [false; 2],
            active: Vec::new(),
            cpacr: 0,
            vtor: 0,
        }
    }
}

impl Nvic {
    /// Sets the level of an interrupt's line; a rising one pends it.
    pub fn drive(&mut self, line: usize, high: bool, now: Time) {
        if high && !self.lines[line] {
            self.pend_line(line, now);
        }
        self.lines[line] = high;
    }

    fn pend_line(&mut self, line: usize, now: Time) {
        if self.pending >> line & 1 == 0 {
            self.since[line] = now;
        }
        self.pending |= 1 << line;
    }

    /// The longest time that an interrupt, by its number as an exception, has waited until it began.
    pub fn waited(&self, exception: usize) -> Time {
        exception.checked_sub(EXTERNAL).map_or(0, |line| self.waited[line])
    }

    /// Pends one of the processor's own exceptions.
    pub fn pend(&mut self, exception: usize) {
        self.system[usize::from(exception == HARD_FAULT)] = true;
    }

    fn priority(&self, exception: usize) -> i32 {
        let own = if exception == NMI { -2 } else { -1 };
        exception.checked_sub(EXTERNAL).map_or(own, |line| i32::from(self.priorities[line]))
    }

    /// The priority of what is executed.
    fn running(&self) -> i32 {
        self.active.iter().map(|exception| self.priority(*exception)).min().unwrap_or(IDLE)
    }

    /// The exception that is taken next, if any may be: of the highest priority, of equal ones the lowest number.
    pub fn next(&self, primask: bool) -> Option<usize> {
        let own = [NMI, HARD_FAULT].into_iter().zip(self.system).find(|(_, pending)| *pending);
        if let Some((exception, _)) = own.filter(|(exception, _)| self.priority(*exception) < self.running())
        {
            return Some(exception);
        }
        let ready = self.enabled & self.pending;
        if primask || ready == 0 {
            return None;
        }
        let ready = (0..LINES).filter(|line| ready >> line & 1 != 0);
        let first = ready.min_by_key(|line| (self.priorities[*line], *line))?;
        (i32::from(self.priorities[first]) < self.running()).then_some(EXTERNAL + first)
    }

    /// `true` in an interrupt: an exception of the chip's, not the core's own.
    pub fn in_interrupt(&self) -> bool {
        self.active.last().is_some_and(|exception| *exception >= EXTERNAL)
    }

    /// An exception becomes active.
    pub fn enter(&mut self, exception: usize, now: Time) {
        match exception.checked_sub(EXTERNAL) {
            Some(line) => {
                self.pending &= !(1 << line);
                self.waited[line] = self.waited[line].max(now.saturating_sub(self.since[line]));
            }
            None => self.system[usize::from(exception == HARD_FAULT)] = false,
        }
        self.active.push(exception);
    }

    /// The innermost exception returns.
    pub fn leave(&mut self, now: Time) -> Option<usize> {
        let left = self.active.pop()?;
        if let Some(line) = left.checked_sub(EXTERNAL)
            && self.lines[line]
        {
            self.pend_line(line, now);
        }
        Some(left)
    }

    /// A word of the private peripheral bus is read.
    pub fn read(&mut self, address: u32, findings: &mut Findings) -> u32 {
        let word = |of: u128, from: u32| (of >> ((address - from) * 8)) as u32;
        match address {
            0xE000_E100..0xE000_E110 => word(self.enabled, 0xE000_E100),
            0xE000_E200..0xE000_E210 => word(self.pending, 0xE000_E200),
            // ICSR.VECTACTIVE.
            0xE000_ED04 => self.active.last().map_or(0, |exception| *exception as u32),
            0xE000_ED08 => self.vtor,
            0xE000_ED88 => self.cpacr,
            // No debugger.
            0xE000_EDF0 => 0,
            _ => {
                findings.add(format!(
                    "the private peripheral bus is read at {address:#010x}, which the twin does not model"
                ));
                0
            }
        }
    }

    /// A word, or for the priorities a byte, of the private peripheral bus is written.
    pub fn write(&mut self, address: u32, size: usize, value: u32, findings: &mut Findings) {
        let (now, _) = findings.now;
        let lines = |from: u32| {
            let first = (address - from) as usize * 8;
            (0..32)
                .filter(move |bit| value & 1 << bit != 0)
                .map(move |bit| first + bit)
                .filter(|line| *line < LINES)
        };
        match address {
            0xE000_E100..0xE000_E110 => lines(0xE000_E100).for_each(|line| {
                self.enabled |= 1 << line;
                self.since[line] = now;
            }),
            0xE000_E180..0xE000_E190 => lines(0xE000_E180).for_each(|line| self.enabled &= !(1 << line)),
            0xE000_E200..0xE000_E210 => lines(0xE000_E200).for_each(|line| self.pend_line(line, now)),
            0xE000_E280..0xE000_E290 => lines(0xE000_E280).for_each(|line| self.pending &= !(1 << line)),
            0xE000_E400..0xE000_E4F0 => {
                let first = (address - 0xE000_E400) as usize;
                for (byte, line) in (first..first + size).enumerate().filter(|(_, line)| *line < LINES) {
                    self.priorities[line] = (value >> (8 * byte)) as u8 & PRIORITY_BITS;
                }
            }
            0xE000_ED08 => {
                findings.expect(value & 0x1FF == 0, || format!("VTOR is {value:#010x}, not a multiple of 512"));
                self.vtor = value;
            }
            0xE000_ED88 => self.cpacr = value,
            _ => findings.add(format!(
                "the private peripheral bus is written at {address:#010x} with {value:#010x}, which the twin does not model"
            )),
        }
    }

    /// `true` if the program may use the floating-point unit.
    pub fn has_fpu(&self) -> bool {
        self.cpacr >> 20 & 0xF == 0xF
    }

    /// The vector table's address.
    pub fn vectors(&self) -> u32 {
        self.vtor
    }
}
