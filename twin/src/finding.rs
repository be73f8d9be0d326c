//! The findings: what the image did that the chip, or the board, does not allow.

use crate::time::{Time, seconds};
use std::fmt;

/// An offence, with the instant and the place in the program.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// The instant.
    pub at: Time,
    /// The beginning of the basic block that was executed.
    pub pc: u32,
    /// The address, if an access to it is what was found.
    pub address: Option<u32>,
    /// In words.
    pub text: String,
    /// The number of times that it occurred, this one included.
    pub count: u64,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { at, pc, address, text, count } = self;
        write!(f, "{:.6} s, block {pc:#010x}", seconds(*at))?;
        if let Some(address) = address {
            write!(f, ", access to {address:#010x}")?;
        }
        write!(f, ": {text}")?;
        if *count > 1 { write!(f, " ({count} times)") } else { Ok(()) }
    }
}

/// The findings of a run, each text once per place.
#[derive(Debug, Default)]
pub struct Findings {
    /// All of them, in their order.
    pub all: Vec<Finding>,
    /// The instant and the place of what is executed now.
    pub now: (Time, u32),
    /// The address that is accessed now.
    pub access: Option<u32>,
}

impl Findings {
    /// One more.
    pub fn add(&mut self, text: impl Into<String>) {
        let (text, (at, pc), address) = (text.into(), self.now, self.access);
        match self.all.iter_mut().find(|known| known.text == text && known.pc == pc) {
            Some(known) => known.count += 1,
            None => self.all.push(Finding { at, pc, address, text, count: 1 }),
        }
    }

    /// One more if a condition does not hold.
    pub fn expect(&mut self, holds: bool, text: impl FnOnce() -> String) {
        if !holds {
            self.add(text());
        }
    }
}
