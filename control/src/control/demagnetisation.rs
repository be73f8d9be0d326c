//! The demagnetisation limit on the way between two operating points.
//!
//! Each operating point keeps the limit by itself. A flux reference that turns on its circle from one point to another does not: with the same flux linkage
//! but a larger load angle it stands for a more negative i_d than either.

use crate::frames::Dq;
use crate::machine::Tables;

/// Steps to find the i_q at the limit; the map is a chain of straight lines along it.
const STEPS: u32 = 3;

/// A flux reference, in Wb, no lower in d than at the demagnetisation limit with the same ψ_q; `near_a` is an i_q to begin at.
///
/// At the same ψ_q, less ψ_d means a more negative i_d, because the map assigns one current to one flux linkage.
pub fn kept(flux: Dq, near_a: f32, tables: &Tables) -> Dq {
    let Some(least_a) = tables.ratings.least_id_a() else { return flux };
    let map = &tables.flux;
    let wanted = flux.q.abs();
    let step_a = 1.0 / map.inverse_column_step;
    let mut at_a = near_a.abs();
    for _ in 0..STEPS {
        let [_, here] = map.at(least_a, at_a);
        let [_, further] = map.at(least_a, at_a + step_a);
        let moved = at_a + (wanted - here) * step_a / (further - here);
        at_a = if moved > 0.0 { moved } else { 0.0 };
    }
    let [least, _] = map.at(least_a, at_a);
    Dq { d: if flux.d < least { least } else { flux.d }, q: flux.q }
}
