//! The paper's figures of the machine and of the modes on a run's page, drawn from the project's own tables and pulses.

use crate::analysis::SteadyPoint;
use crate::machine::Machine;
use crate::pictures::chai::{machine as plane, modes, runs};
use crate::pictures::ink::draw as svg;
use crate::report::Page;
use crate::trace::Recording;
use tractive::modulation::{Ladder, Mode};

/// Figures 1, 3, 4, 6, 7 and 10 next to the project's own, the pulses with control at a rate in Hz or at the machine's usual one.
pub fn draw(
    page: &mut Page,
    recording: &Recording,
    points: &[SteadyPoint],
    control_hz: Option<u32>,
    machine: &Machine,
) {
    let rated_nm = machine.folder.parameters.rated_torque_nm;
    page.picture("figure 10", "torque accuracy, efficiency, current", runs::accuracy(points, rated_nm));
    page.picture("figure 1", "current loci", plane::loci(machine));
    page.picture("figure 3", "Ld over id, for several iq", plane::inductance(machine, true));
    page.picture("figure 4", "Lq over iq, for several id", plane::inductance(machine, false));
    page.picture("figure 6", "the modes over frequency", modes::strategy(recording, machine));
    for mode in Mode::ALL.into_iter().filter(|mode| mode.is_pattern() && !mode.is_whole()) {
        let drawn = modes::middle60(machine, control_hz, mode).and_then(|panel| svg((860, 260), &[panel]));
        let figure = Ladder::PAPER.modes().any(|own| own == mode).then_some("figure 7");
        page.picture(figure, "middle 60°: legs u, v, w", drawn);
    }
}
