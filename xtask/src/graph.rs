//! The call graph. Direct branches are decoded; a function that holds another one's address (assembled by MOVW and MOVT, or as a literal) is taken to
//! call it; a function that branches through a register may also go to any function whose address stands in the data.

use crate::elf::Image;
use crate::thumb::Flow;
use std::collections::{BTreeMap, BTreeSet, VecDeque};

/// The calls of an image, by the addresses of its functions.
#[derive(Debug, Default)]
pub struct CallGraph {
    calls: BTreeMap<u32, BTreeSet<u32>>,
    /// Branches to where no function is: (function, address).
    pub astray: Vec<(u32, u32)>,
}

impl CallGraph {
    /// Reads every function of the image.
    pub fn new(image: &Image) -> Self {
        let in_data: BTreeSet<u32> =
            image.data_words.iter().filter_map(|word| pointed_function(image, *word)).collect();
        let mut graph = Self::default();
        for (&start, function) in &image.functions {
            let mut calls = held(image, start, function.size);
            for (_, instruction) in image.instructions_of(start) {
                match instruction.flow {
                    Flow::To(target) => match image.function_at(target) {
                        Some(function) => _ = calls.insert(function),
                        None => graph.astray.push((start, target)),
                    },
                    Flow::Indirect => calls.extend(&in_data),
                    _ => {}
                }
            }
            calls.remove(&start);
            graph.calls.insert(start, calls);
        }
        graph
    }

    /// The shortest way from each function that can be reached from `start` back to it, by predecessor.
    pub fn reach(&self, start: u32) -> BTreeMap<u32, Option<u32>> {
        let mut came_from = BTreeMap::from([(start, None)]);
        let mut queue = VecDeque::from([start]);
        while let Some(caller) = queue.pop_front() {
            for &callee in self.calls.get(&caller).into_iter().flatten() {
                came_from.entry(callee).or_insert_with(|| {
                    queue.push_back(callee);
                    Some(caller)
                });
            }
        }
        came_from
    }
}

/// The function a word points to, as a function pointer does: at its start, with the Thumb bit.
fn pointed_function(image: &Image, word: u32) -> Option<u32> {
    let start = word & !1;
    (word & 1 == 1 && image.functions.contains_key(&start)).then_some(start)
}

/// The functions whose addresses a function holds, assembled from halves or as literals.
fn held(image: &Image, start: u32, size: u32) -> BTreeSet<u32> {
    let literals = (start.next_multiple_of(4)..start.saturating_add(size)).step_by(4);
    let mut words: Vec<u32> =
        literals.filter(|at| !image.is_code(*at)).filter_map(|at| image.word(at)).collect();
    let mut low_halves = BTreeMap::new();
    for (_, instruction) in image.instructions_of(start) {
        match instruction.flow {
            Flow::Low { register, half } => _ = low_halves.insert(register, half),
            Flow::High { register, half } => {
                let low = low_halves.get(&register);
                words.extend(low.map(|low| u32::from(half) << 16 | u32::from(*low)));
            }
            _ => {}
        }
    }
    words.into_iter().filter_map(|word| pointed_function(image, word)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elf::tests::small_elf;

    fn graph(image: &Image, from: u32) -> Vec<u32> {
        CallGraph::new(image).reach(from).into_keys().collect()
    }

    fn image(functions: &[(&str, u32, &[u16])]) -> Image {
        Image::parse(&small_elf(0x100, functions)).unwrap()
    }

    #[test]
    fn direct_calls_are_followed() {
        // 0x100: bl 0x110, bx lr; 0x110: b.w 0x120; 0x130 stands alone.
        let image = image(&[
            ("a", 0x100, &[0xF000, 0xF806, 0x4770]),
            ("b", 0x110, &[0xF000, 0xB806]),
            ("c", 0x120, &[0x4770]),
            ("d", 0x130, &[0x4770]),
        ]);
        assert_eq!(graph(&image, 0x100), [0x100, 0x110, 0x120]);
        assert_eq!(graph(&image, 0x130), [0x130]);
    }

    #[test]
    fn an_address_in_halves_or_as_a_literal_is_a_call() {
        // movw r0, #0x121; movt r0, #0; blx r0.
        let mut image = image(&[
            ("a", 0x100, &[0xF240, 0x1021, 0xF2C0, 0x0000, 0x4780]),
            ("literal", 0x110, &[0x4800, 0x4780, 0x0121, 0x0000]),
            ("c", 0x120, &[0x4770]),
        ]);
        image.mapping = BTreeMap::from([(0x100, true), (0x114, false), (0x120, true)]);
        image.read_instructions().unwrap();
        assert_eq!(graph(&image, 0x100), [0x100, 0x120]);
        assert_eq!(graph(&image, 0x110), [0x110, 0x120]);
    }

    #[test]
    fn an_indirect_branch_may_go_to_any_function_in_the_data() {
        let mut image = image(&[
            ("indirect", 0x100, &[0x4718]),
            ("direct", 0x110, &[0x4770]),
            ("virtual", 0x120, &[0x4770]),
        ]);
        image.data_words.insert(0x121);
        assert_eq!(graph(&image, 0x100), [0x100, 0x120]);
        assert_eq!(graph(&image, 0x110), [0x110]);
    }

    #[test]
    fn literals_are_not_taken_for_instructions() {
        // The literal reads as `bl 0x110` if it is decoded.
        let mut image = image(&[("a", 0x100, &[0x4770, 0xBF00, 0xF000, 0xF804]), ("b", 0x110, &[0x4770])]);
        assert_eq!(graph(&image, 0x100), [0x100, 0x110]);
        image.mapping = BTreeMap::from([(0x100, true), (0x104, false), (0x110, true)]);
        image.read_instructions().unwrap();
        assert_eq!(graph(&image, 0x100), [0x100]);
    }

    #[test]
    fn a_branch_into_nowhere_is_kept() {
        let image = image(&[("a", 0x100, &[0xF000, 0xF810, 0x4770])]);
        assert_eq!(CallGraph::new(&image).astray, [(0x100, 0x124)]);
    }
}
