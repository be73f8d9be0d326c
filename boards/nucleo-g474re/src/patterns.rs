//! The pulse patterns of the PMaSynRM's image: those of the paper, or, with the feature `optimal`, the optimised ones, which a machine needs whose
//! `patterns` are "optimal".

use tractive::drive::traction::ControlTask;
use tractive::machine::Machine;
use tractive::time::Clock;

/// Highest frequency of the free carrier, as a share of the switches' frequency.
pub const FREE_CARRIER_SHARE: f32 =
    if cfg!(feature = "optimal") { tractive::modulation::FREE_CARRIER_SHARE } else { 1.0 };

/// A task with these patterns.
#[cfg(feature = "optimal")]
pub const fn chosen<M: Machine>(task: ControlTask<M>, clock: &Clock) -> ControlTask<M> {
    use tractive::modulation::{Ladder, Schedule};
    task.scheduled(Schedule::on(Ladder::OPTIMAL, clock))
}

/// A task with these patterns.
#[cfg(not(feature = "optimal"))]
pub const fn chosen<M: Machine>(task: ControlTask<M>, _clock: &Clock) -> ControlTask<M> {
    task
}
