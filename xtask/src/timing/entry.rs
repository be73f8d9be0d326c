//! What could keep an interrupt from being entered at once: instructions that mask it, and the one under way.

use std::collections::BTreeSet;

use super::cost;
use super::tally::Tally;
use crate::elf::Image;
use crate::thumb::decode;

/// The functions outside the link in which an instruction masks interrupts.
pub fn masking(image: &Image, is_link: impl Fn(&[String]) -> bool) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for (&start, function) in image.functions.iter().filter(|(_, function)| !is_link(&function.names)) {
        let mut at = start;
        while at < start + function.size {
            let Some(first) = image.half_word(at) else { break };
            let second = image.half_word(at + 2).unwrap_or(0);
            let is_code = image.mapping.range(..=at).next_back().is_none_or(|(_, is_code)| *is_code);
            if !is_code {
                at += 2;
                continue;
            }
            if masks(first, second) {
                found.insert(function.names.first().cloned().unwrap_or_default());
            }
            at += decode(at, first, second).1;
        }
    }
    found
}

/// CPSID; MSR to PRIMASK, BASEPRI, BASEPRI_MAX or FAULTMASK.
fn masks(first: u16, second: u16) -> bool {
    let cpsid = first & 0xFFF8 == 0xB670;
    let msr = first & 0xFFF0 == 0xF380 && second & 0xFF00 == 0x8800;
    cpsid || msr && (16..=19).contains(&(second & 0xFF))
}

/// Of the instructions that an exception executed the one of the most cycles, which the next interrupt may have to wait for, and these.
pub fn longest(image: &Image, hits: &Tally, exception: u32) -> Option<(u32, u32)> {
    let priced = hits.of(exception).map(|(address, _)| {
        let halves = [address, address + 2].map(|at| image.half_word(at).unwrap_or(0));
        (cost::cycles(halves[0], halves[1]), address)
    });
    priced.max().map(|(cycles, address)| (address, cycles))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elf::tests::small_elf;

    #[test]
    fn what_masks_is_named_and_the_rest_is_not() {
        let functions: [(&str, u32, &[u16]); 5] = [
            ("cpsid", 0x100, &[0xBF00, 0xB672, 0x4770]),
            ("basepri", 0x110, &[0xF380, 0x8811, 0x4770]),
            ("cpsie", 0x120, &[0xB662, 0x4770]),
            ("psp", 0x130, &[0xF380, 0x8809, 0x4770]),
            ("link", 0x140, &[0xB672, 0x4770]),
        ];
        let image = Image::parse(&small_elf(0x100, &functions)).unwrap();
        let found = masking(&image, |names| names.iter().any(|name| name == "link"));
        assert_eq!(found.into_iter().collect::<Vec<_>>(), ["basepri", "cpsid"]);
    }
}
