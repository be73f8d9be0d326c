//! The number of instructions by which each control interrupt is to begin later.

use super::INSTRUCTIONS_PER_TICK;
use super::reach::{NEAR, Reached, Stand};
use crate::fault_injector::Seen;
use std::collections::{HashMap, HashSet};

/// The wanted instruction: whether it was hit in another mode; mode and address.
type Wanted<'a> = (bool, &'a str, u32);

/// The control interrupts of a run, and what is known of them.
pub struct Search<'a> {
    pub stands: Vec<Stand<'a>>,
    /// Offset from the ticks that are left, in instructions, to [`Stand::boundary`]: the same for all that begin when their timer fires.
    usual: u32,
}

impl<'a> Search<'a> {
    pub fn new(stands: Vec<Stand<'a>>) -> Self {
        Self { stands, usual: NEAR }
    }

    fn boundary(&self, stand: &Stand) -> u32 {
        stand.boundary.unwrap_or(stand.left_ticks * INSTRUCTIONS_PER_TICK + self.usual)
    }

    /// The delay that puts the boundary at an instruction, if there is one.
    fn delay(&self, stand: &Stand, before: u32) -> Option<u16> {
        if stand.why(before).is_some() {
            return None;
        }
        let delay = self.boundary(stand).checked_sub(before).filter(|delay| *delay <= stand.most)?;
        u16::try_from(delay).ok()
    }

    /// The number of instructions by which each control interrupt is to begin later in the next passes. Instructions that were hit in no mode come
    /// first, and among them those that the fewest reach. `None`: no instruction is left that was hit in no mode.
    pub fn delays(&self, calls: usize, passes: usize, reached: &Reached) -> Option<Vec<Vec<u16>>> {
        let hit = reached.hit_in_any();
        let mut ways: HashMap<Wanted, Vec<(usize, u16)>> = HashMap::new();
        for (index, stand) in self.stands.iter().enumerate() {
            let mode = stand.call.mode.as_str();
            for (address, before) in &stand.call.path {
                let Some(delay) = self.delay(stand, *before) else { continue };
                let was_hit = hit.contains(address);
                if !was_hit || !reached.has(mode, *address) {
                    ways.entry((was_hit, mode, *address)).or_default().push((index, delay));
                }
            }
        }
        let mut wanted: Vec<_> = ways.into_iter().collect();
        wanted.sort_unstable_by_key(|((hit, mode, address), ways)| (*hit, ways.len(), *address, *mode));
        if wanted.first().is_none_or(|((hit, ..), _)| *hit) {
            return None;
        }
        let (mut delays, mut taken) = (vec![vec![0; calls]; passes], HashSet::new());
        for (_, ways) in wanted {
            let mut free = (0..passes).flat_map(|pass| ways.iter().map(move |way| (pass, way)));
            let Some((pass, (index, delay))) = free.find(|(pass, (index, _))| taken.insert((*pass, *index)))
            else {
                continue;
            };
            if let Some(place) = delays[pass].get_mut(self.stands[*index].number) {
                *place = *delay;
            }
        }
        Some(delays)
    }

    /// Takes in the outcome.
    pub fn take(&mut self, delays: &[u16], seen: &[Seen], reached: &mut Reached) {
        let landed: HashMap<usize, u32> =
            seen.iter().filter_map(|seen| Some((seen.number, seen.landed?))).collect();
        let mut usual = Vec::new();
        let usually = self.usual;
        for stand in &mut self.stands {
            let Some(address) = landed.get(&stand.number) else { continue };
            let left = stand.left_ticks * INSTRUCTIONS_PER_TICK;
            let guess = left + usually;
            let delay = u32::from(delays.get(stand.number).copied().unwrap_or(0));
            let places = stand.call.path.iter().filter(|(at, _)| at == address);
            let boundary = places.map(|(_, before)| before + delay).min_by_key(|at| at.abs_diff(guess));
            let Some(boundary) = boundary else { continue };
            reached.add(&stand.call.mode, *address);
            if boundary.abs_diff(guess) <= 2 * NEAR {
                stand.boundary = Some(boundary);
                usual.push(boundary.saturating_sub(left));
            }
        }
        usual.sort_unstable();
        self.usual = usual.get(usual.len() / 2).copied().unwrap_or(self.usual);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::preemption::Call;

    /// Ten instructions from 0 on, the samples before the sixth, a link of thirty between.
    fn call() -> Call {
        let path = (0..10).map(|n| (2 * n, if n < 5 { n } else { n + 30 })).collect();
        Call { mode: "async".to_owned(), path, sampled: 35 }
    }

    /// The image's account if the interrupt lands where the boundary comes, this many instructions after the beginning.
    fn landed(call: &Call, left_ticks: u32, boundary: u32, delay: u16) -> Seen {
        let before = boundary - u32::from(delay);
        let landed = call.path.iter().find(|(_, at)| *at == before).map(|(address, _)| *address);
        Seen { number: 0, left_ticks, landed }
    }

    #[test]
    fn each_instruction_behind_the_samples_is_hit_and_none_before_where_the_boundary_is_late() {
        let (calls, mut reached) = ([call()], Reached::default());
        // 500 ticks are left; entry and the wait's own way take 7 more.
        let (left, boundary) = (500, 5_007);
        let seen = [Seen { number: 0, left_ticks: left, landed: None }];
        let mut search = Search::new(Stand::all(&calls, &seen, 2_500, 2_500));
        search.usual = 7;
        while let Some(delays) = search.delays(1, 1, &reached) {
            search.take(&delays[0], &[landed(&calls[0], left, boundary, delays[0][0])], &mut reached);
        }
        reached.judge(&search.stands);
        assert_eq!(reached.hit_in_any(), HashSet::from([10, 12, 14, 16, 18]));
        assert!(reached.table().contains("5 cannot be hit: before the samples"), "{}", reached.table());
        assert_eq!(reached.missing().count(), 0);
    }

    #[test]
    fn what_could_be_hit_and_was_not_is_missing() {
        let (calls, mut reached) = ([call()], Reached::default());
        let seen = [Seen { number: 0, left_ticks: 100, landed: None }];
        reached.judge(&Search::new(Stand::all(&calls, &seen, 2_500, 2_500)).stands);
        assert_eq!(reached.missing().count(), 10);
        // Just after a boundary nothing can be hit.
        let calls = [call(), call()];
        let seen = [(0, 100), (1, 12_000)];
        let seen = seen.map(|(number, left_ticks)| Seen { number, left_ticks, landed: None });
        let mut reached = Reached::default();
        reached.judge(&Stand::all(&calls, &seen, 2_500, 2_500)[1..]);
        assert_eq!(reached.missing().count(), 0);
    }
}
