//! The obstacles to an interrupt's entry: instructions that mask it, and the instruction in progress.

use super::tally::Tally;
use crate::elf::Image;
use std::collections::BTreeSet;

/// The functions outside the link in which an instruction masks interrupts.
pub fn masking(image: &Image, is_link: impl Fn(&[String]) -> bool) -> BTreeSet<String> {
    let functions = image.functions.iter().filter(|(_, function)| !is_link(&function.names));
    let masking = functions.filter(|(start, _)| image.instructions_of(**start).any(|(_, of)| of.masks));
    masking.map(|(_, function)| function.names.first().cloned().unwrap_or_default()).collect()
}

/// The instruction with the most cycles among those that an exception executed, for which the next interrupt may have to wait, and these cycles.
pub fn longest(image: &Image, hits: &Tally, exception: u32) -> Option<(u32, u32)> {
    let executed = hits.of(exception).filter_map(|(address, _)| image.instructions.get_key_value(&address));
    let priced = executed.map(|(address, instruction)| (instruction.cycles, *address));
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
