//! Counts by exception and address, quick to add to.

/// A count for each half-word of code, separately for each exception.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    counts: Vec<(u32, Vec<u64>)>,
}

impl Tally {
    /// One more.
    pub fn add(&mut self, exception: u32, address: u32) {
        self.add_many(exception, address, 1);
    }

    /// Adds all counts of another.
    pub fn merge(&mut self, other: &Self) {
        for exception in other.counts.iter().map(|(exception, _)| *exception) {
            for (address, count) in other.of(exception) {
                self.add_many(exception, address, count);
            }
        }
    }

    /// Addresses and their counts, without zeros.
    pub fn of(&self, exception: u32) -> impl Iterator<Item = (u32, u64)> {
        let counts =
            self.counts.iter().filter(move |(of, _)| *of == exception).flat_map(|(_, counts)| counts);
        counts.enumerate().filter(|(_, count)| **count > 0).map(|(half, count)| (half as u32 * 2, *count))
    }

    fn add_many(&mut self, exception: u32, address: u32, count: u64) {
        let found = self.counts.iter().position(|(of, _)| *of == exception);
        let index = found.unwrap_or_else(|| {
            self.counts.push((exception, Vec::new()));
            self.counts.len() - 1
        });
        let (_, counts) = &mut self.counts[index];
        let half = (address / 2) as usize;
        if counts.len() <= half {
            counts.resize(half + 1, 0);
        }
        counts[half] += count;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_stay_apart_and_add_up() {
        let mut tally = Tally::default();
        for (exception, address) in [(24, 0x100), (24, 0x100), (26, 0x100), (24, 0x82)] {
            tally.add(exception, address);
        }
        let mut sum = tally.clone();
        sum.merge(&tally);
        assert_eq!(tally.of(24).collect::<Vec<_>>(), [(0x82, 1), (0x100, 2)]);
        assert_eq!(sum.of(24).collect::<Vec<_>>(), [(0x82, 2), (0x100, 4)]);
        assert_eq!(sum.of(26).collect::<Vec<_>>(), [(0x100, 2)]);
        assert_eq!(sum.of(25).count(), 0);
    }
}
