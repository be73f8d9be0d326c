//! MTPA by the paper's two passes: equations (7)–(13) with the errata.

use crate::frames::{Dq, sqrt};
use crate::machine::Tables;

/// The current of least magnitude for a torque in N·m (either sign, |T| within the machine's largest), in A; its i_d is no lower than the
/// demagnetisation limit.
///
/// The first pass reads ψ_f and L_q − L_d at the start point that the tables give for this torque; the second pass reads them at the
/// result of the first. The contents of start points and trims are decided offline.
///
/// ```
/// use tractive_control::control::{flux_linkage, mtpa, torque_nm};
/// use tractive_control::frames::Angle;
/// # fn main() -> Result<(), tractive_tablegen::InputError> {
/// let folder = std::path::Path::new("../tables/pmasynrm-180kw");
/// let tables = tractive_tablegen::MachineFolder::read(folder)?.tables();
/// let torque = |current| torque_nm(&tables, flux_linkage(&tables, current), current);
///
/// let current = mtpa(1_235.0, &tables);
/// assert!((torque(current) - 1_235.0).abs() < 12.0, "within 1 % of the demand on the saturated map");
/// // The same current, turned by 10° either way, gives less: it was the least one.
/// let ten_degrees = Angle::from_turns(10.0 / 360.0).sin_cos();
/// assert!(torque(current.turned(ten_degrees)) < 1_235.0);
/// assert!(torque(current.turned(ten_degrees.back())) < 1_235.0);
/// # Ok(())
/// # }
/// ```
pub fn mtpa(torque_nm: f32, tables: &Tables) -> Dq {
    let torque = torque_nm.abs();
    let [d_start, q_start, d_trim, q_trim] = tables.mtpa.start.at(torque);
    let start = Dq { d: d_start, q: q_start };
    let current = mtpa_passes::<2>(torque, start, tables) + Dq { d: d_trim, q: q_trim };
    Dq { d: tables.ratings.kept_id_a(current.d), q: if torque_nm < 0.0 { -current.q } else { current.q } }
}

/// `PASSES` of the paper's passes for a torque of at least zero, in N·m, the first with the parameters at `start`, in A. The
/// paper does not say where it starts; the plain reading is to start with the parameters of zero current.
pub fn mtpa_passes<const PASSES: usize>(torque_nm: f32, start: Dq, tables: &Tables) -> Dq {
    let mut current = start;
    for _ in 0..PASSES {
        current = pass(torque_nm, current, tables);
    }
    current
}

/// One look-up of the parameters and of the universal curve, for T ≥ 0. Inlined, so that the compiler knows the tables.
#[inline(always)]
fn pass(torque: f32, at: Dq, tables: &Tables) -> Dq {
    let [psi_f, saliency] = tables.mtpa.parameters.at(at.d, at.q);
    let torque_per_flux = torque * (1.0 / (1.5 * tables.ratings.pole_pairs));
    // t_en = T/t_eb with t_eb = 1.5 n_p psi_f i_b (9) and i_b = psi_f/(L_q − L_d) (10).
    // √t_en is root/psi_f, and i_dn the share of it.
    let root = sqrt(torque_per_flux * saliency);
    let [share] = tables.mtpa.universal.at(root / (psi_f + root));
    let weakening = root * share;
    Dq { d: -weakening / saliency, q: torque_per_flux / (psi_f + weakening) }
}
