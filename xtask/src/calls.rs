//! Who calls whom in a Thumb-2 image.
//!
//! Direct calls and jumps (`bl`, `b.w`) are decoded; a word in a function's literal pool that is a function's address is
//! taken as a call as well, since it may be called through a register.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

/// A function: its first address and its bytes.
#[derive(Clone, Debug)]
pub struct Function {
    /// Name, demangled.
    pub name: String,
    /// Address, the Thumb bit cleared.
    pub address: u32,
    /// Code and literal pool.
    pub bytes: Vec<u8>,
}

/// The address that a 32-bit branch at `address` goes to; `None` for any other instruction.
fn branch_target(address: u32, first: u16, second: u16) -> Option<u32> {
    // BL (encoding T1) is 11110S.. 11.1J.; B.W (T4) is 11110S.. 10.1J.
    let is_branch = first & 0xF800 == 0xF000 && (second & 0xD000 == 0xD000 || second & 0xD000 == 0x9000);
    if !is_branch {
        return None;
    }
    let (first, second) = (u32::from(first), u32::from(second));
    let sign = first >> 10 & 1;
    let (j1, j2) = (second >> 13 & 1, second >> 11 & 1);
    let (i1, i2) = (!(j1 ^ sign) & 1, !(j2 ^ sign) & 1);
    let offset = sign << 24 | i1 << 23 | i2 << 22 | (first & 0x3FF) << 12 | (second & 0x7FF) << 1;
    // Sign extension from 25 bits.
    let offset = ((offset << 7) as i32) >> 7;
    Some(address.wrapping_add(4).wrapping_add_signed(offset))
}

/// Whether a half word begins a 32-bit instruction.
fn is_wide(half: u16) -> bool {
    half >> 11 >= 0b11101
}

/// Addresses that a function may go to, outside itself.
fn targets(function: &Function, entries: &BTreeMap<u32, usize>) -> BTreeSet<usize> {
    let half = |at: usize| function.bytes.get(at..at + 2).map(|pair| u16::from_le_bytes([pair[0], pair[1]]));
    let mut found = BTreeSet::new();
    let mut at = 0;
    while let Some(first) = half(at) {
        if is_wide(first) {
            if let Some(second) = half(at + 2)
                && let Some(target) = branch_target(function.address + at as u32, first, second)
            {
                found.extend(entries.get(&target));
            }
            at += 4;
        } else {
            at += 2;
        }
    }
    for word in function.bytes.chunks_exact(4) {
        let word = u32::from_le_bytes([word[0], word[1], word[2], word[3]]);
        if word & 1 == 1 {
            found.extend(entries.get(&(word & !1)));
        }
    }
    found
}

/// The shortest way from one of the roots to a function that is `unwanted`, as names; `None` if there is none.
pub fn path_to(
    functions: &[Function],
    roots: &[u32],
    unwanted: impl Fn(&str) -> bool,
) -> Option<Vec<String>> {
    let entries: BTreeMap<u32, usize> =
        functions.iter().enumerate().map(|(index, function)| (function.address, index)).collect();
    let mut from: BTreeMap<usize, Option<usize>> = BTreeMap::new();
    let mut queue: VecDeque<usize> =
        roots.iter().filter_map(|root| entries.get(&(root & !1)).copied()).collect();
    from.extend(queue.iter().map(|root| (*root, None)));
    while let Some(index) = queue.pop_front() {
        if unwanted(&functions[index].name) {
            let way = std::iter::successors(Some(index), |at| from.get(at).copied().flatten());
            let mut names: Vec<_> = way.map(|at| functions[at].name.clone()).collect();
            names.reverse();
            return Some(names);
        }
        for target in targets(&functions[index], &entries) {
            from.entry(target).or_insert_with(|| {
                queue.push_back(target);
                Some(index)
            });
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn branches_are_decoded() {
        // bl .+0 is f7ff fffe; bl .+0x100 from 0 is f000 f87e; b.w .-0x1000 is f7fe bffe.
        assert_eq!(branch_target(0x1000, 0xF7FF, 0xFFFE), Some(0x1000));
        assert_eq!(branch_target(0, 0xF000, 0xF87E), Some(0x100));
        assert_eq!(branch_target(0x2000, 0xF7FE, 0xBFFE), Some(0x1000));
        // mov.w r0, #0 and a conditional branch are none.
        assert_eq!(branch_target(0, 0xF04F, 0x0000), None);
        assert_eq!(branch_target(0, 0xF43F, 0xAFFE), None);
    }

    fn function(name: &str, address: u32, bytes: &[u8]) -> Function {
        Function { name: name.to_owned(), address, bytes: bytes.to_vec() }
    }

    #[test]
    fn a_way_is_found_through_calls_and_literals() {
        let functions = [
            // bl 0x100
            function("handler", 0x0, &[0x00, 0xF0, 0x7E, 0xF8]),
            // A literal: 0x201.
            function("middle", 0x100, &[0x01, 0x02, 0x00, 0x00]),
            function("core::panicking::panic", 0x200, &[0x70, 0x47]),
            function("core::panicking::other", 0x300, &[0x70, 0x47]),
        ];
        let way = path_to(&functions, &[0x1], |name| name.contains("panicking"));
        assert_eq!(way.unwrap(), ["handler", "middle", "core::panicking::panic"]);
        assert_eq!(path_to(&functions, &[0x201], |name| name.contains("other")), None);
    }
}
