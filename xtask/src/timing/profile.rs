//! The places of the instructions: by function, inlined ones told apart by the debug information.

use super::tally::Tally;
use addr2line::{Context as Lines, gimli};
use anyhow::{Context, Result};
use object::{Object, ObjectSection};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

type Reader<'a> = gimli::EndianSlice<'a, gimli::LittleEndian>;

/// Instructions in a function itself, with what the standard library put into it, and with everything that it calls.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Share {
    pub own: u64,
    pub with_callees: u64,
}

/// The origin of an instruction.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// Demangled.
    pub function: String,
    /// Its path on the machine that built the image; empty if the debug information names none.
    pub file: String,
}

/// The knowledge about a drive's instructions.
pub struct Profile<'a> {
    lines: Lines<Reader<'a>>,
}

impl<'a> Profile<'a> {
    /// With the debug information in the bytes of an image.
    pub fn new(bytes: &'a [u8]) -> Result<Self> {
        let file = object::File::parse(bytes)?;
        let dwarf = gimli::Dwarf::load(|id| -> Result<Reader, gimli::Error> {
            let data = file.section_by_name(id.name()).and_then(|section| section.data().ok());
            Ok(gimli::EndianSlice::new(data.unwrap_or(&[]), gimli::LittleEndian))
        })?;
        Ok(Self { lines: Lines::from_dwarf(dwarf)? })
    }

    /// Every function's share of an exception's instructions. `hits` are executed addresses, `behind` the instructions inside each call by its return
    /// address.
    pub fn shares(&self, exception: u32, hits: &Tally, behind: &Tally) -> Result<BTreeMap<String, Share>> {
        let mut shares = BTreeMap::<String, Share>::new();
        for (address, count) in hits.of(exception) {
            let chain = self.chain(address)?;
            if let Some(owner) = owner(&chain) {
                shares.entry(owner.clone()).or_default().own += count;
            }
            for function in chain.into_iter().collect::<BTreeSet<_>>() {
                shares.entry(function).or_default().with_callees += count;
            }
        }
        for (back, count) in behind.of(exception) {
            // The call stands right before it.
            for function in self.chain(back - 2)?.into_iter().collect::<BTreeSet<_>>() {
                shares.entry(function).or_default().with_callees += count;
            }
        }
        Ok(shares)
    }

    /// The function at an address and those that it was inlined into, the innermost first.
    fn chain(&self, address: u32) -> Result<Vec<String>> {
        Ok(self.places(address)?.into_iter().map(|place| place.function).collect())
    }

    /// The same with their source files.
    pub fn places(&self, address: u32) -> Result<Vec<Place>> {
        let mut frames = self.lines.find_frames(address.into()).skip_all_loads()?;
        let mut places = Vec::new();
        while let Some(frame) = frames.next()? {
            let Some(function) = frame.function else { continue };
            let function = format!("{:#}", rustc_demangle::demangle(&function.raw_name()?));
            let file = frame.location.and_then(|location| location.file).unwrap_or_default().to_owned();
            places.push(Place { function, file });
        }
        Ok(places)
    }
}

/// The owner of an instruction: the innermost of our own functions, else the one that stands out of line.
fn owner(chain: &[String]) -> Option<&String> {
    chain.iter().find(|name| name.contains("tractive::")).or(chain.last())
}

/// Reads an image's bytes.
pub fn bytes(path: &Path) -> Result<Vec<u8>> {
    std::fs::read(path).with_context(|| path.display().to_string())
}

/// The first `count` functions by their own instructions and by all, of `calls` interrupts.
pub fn table(name: &str, shares: &BTreeMap<String, Share>, calls: usize, count: usize) -> String {
    let mut text = String::new();
    for order in ["own", "all"] {
        let of = |share: &Share| if order == "own" { share.own } else { share.with_callees };
        let mut rows: Vec<_> =
            shares.iter().filter(|(name, _)| name.contains("tractive::") || order == "own").collect();
        rows.sort_by_key(|(_, share)| std::cmp::Reverse(of(share)));
        text += &format!("\n{name}, instructions a call, by {order}\n{:>8} {:>8}\n", "own", "all");
        for (function, share) in rows.into_iter().take(count) {
            let mean = |sum: u64| sum as f64 / calls.max(1) as f64;
            text += &format!("{:>8.1} {:>8.1}  {function}\n", mean(share.own), mean(share.with_callees));
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_instruction_belongs_to_the_innermost_of_ours() {
        let chain = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
        let inlined = chain(&["core::slice::get", "tractive::cell::load", "tractive::drive::run", "TIMER0"]);
        assert_eq!(owner(&inlined).unwrap(), "tractive::cell::load");
        assert_eq!(owner(&chain(&["libm::sqrt", "sqrtf"])).unwrap(), "sqrtf");
        assert_eq!(owner(&[]), None);
    }

    #[test]
    fn the_table_is_sorted_and_cut() {
        let share = |own, with_callees| Share { own, with_callees };
        let shares = BTreeMap::from([
            ("tractive::a".to_owned(), share(10, 100)),
            ("tractive::b".to_owned(), share(30, 30)),
            ("tractive::c".to_owned(), share(20, 20)),
        ]);
        let text = table("pwm", &shares, 10, 2);
        assert!(
            text.contains("     3.0      3.0  tractive::b\n     2.0      2.0  tractive::c\n\n"),
            "{text}"
        );
        assert!(text.contains("     1.0     10.0  tractive::a\n     3.0"), "{text}");
    }
}
