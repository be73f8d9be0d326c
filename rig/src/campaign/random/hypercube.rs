//! A Latin hypercube: each run takes a different slice of every dimension.

use crate::shards::seed;
use rand::rngs::StdRng;
use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng};

/// The slices of every dimension, in the order in which the runs take them.
pub struct Hypercube {
    name: String,
    slices: Vec<Vec<u32>>,
}

impl Hypercube {
    /// The hypercube of a campaign with this name, for `runs` runs in this many dimensions.
    pub fn new(name: &str, runs: usize, dimensions: usize) -> Self {
        let slices = (0..dimensions).map(|dimension| {
            let mut order: Vec<u32> = (0..).take(runs).collect();
            let seed = seed(&format!("{name}, order"), dimension as u64);
            order.shuffle(&mut StdRng::seed_from_u64(seed));
            order
        });
        Self { name: name.to_owned(), slices: slices.collect() }
    }

    /// The point of a run, each coordinate from 0 (included) to 1; `None` if there is no such run.
    pub fn point(&self, run: usize) -> Option<Vec<f64>> {
        let mut random = StdRng::seed_from_u64(seed(&self.name, run as u64));
        let within = |order: &Vec<u32>| {
            Some((f64::from(*order.get(run)?) + random.random_range(0.0..1.0)) / order.len() as f64)
        };
        self.slices.iter().map(within).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_slice_of_every_dimension_is_taken_once() {
        let cube = Hypercube::new("test 1", 50, 4);
        for dimension in 0..4 {
            let mut taken: Vec<_> =
                (0..50).map(|run| (50.0 * cube.point(run).unwrap()[dimension]) as usize).collect();
            assert_ne!(taken, (0..50).collect::<Vec<_>>(), "in no order");
            taken.sort_unstable();
            assert_eq!(taken, (0..50).collect::<Vec<_>>());
        }
        assert!(cube.point(50).is_none());
        assert_ne!(cube.point(0), Hypercube::new("test 2", 50, 4).point(0));
    }
}
