//! The machine as the control task knows it: ratings, and tables made offline by `tractive-tablegen`.
//!
//! A drive takes `&'static Tables` and does not care who made them: `tractive-tablegen` writes a machine folder out as read-only
//! data in a build script, or makes the tables at run time.
//!
//! Convention: d along the magnet flux, amplitude-invariant peak values, electrical angles,
//! `Te = 1.5 n_p (psi_d i_q − psi_q i_d)`.

#![forbid(unsafe_code)]

mod iron_loss;
mod lookup;

pub use iron_loss::IronLoss;
pub use lookup::{Curve, Grid};

/// Scalars of a machine folder. SI units, peak values of phase quantities.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Ratings {
    /// Pole pairs, n_p.
    pub pole_pairs: f32,
    /// Stator resistance of one phase, in ohm.
    pub stator_resistance_ohm: f32,
    /// Largest torque, in N·m, at any speed.
    pub max_torque_nm: f32,
    /// Largest mechanical power, in W: the torque envelope above the base speed.
    pub max_power_w: f32,
    /// Largest current space vector, peak, in A.
    pub max_current_a: f32,
    /// Least direct-axis current, −`max_current_a` ..= 0, in A: the magnets' demagnetisation limit; −`max_current_a` limits nothing.
    pub min_id_a: f32,
    /// Largest mechanical speed, in rad/s.
    pub max_speed_rad_s: f32,
    /// Magnet flux linkage psi_d(0, 0), in Wb; 0 for a machine without magnets.
    pub magnet_flux_wb: f32,
    /// Lowest DC-link voltage of normal operation, in V.
    pub dc_link_min_v: f32,
    /// Nominal DC-link voltage, in V.
    pub dc_link_nominal_v: f32,
    /// Highest DC-link voltage of normal operation, in V.
    pub dc_link_max_v: f32,
    /// Highest switching frequency of any device, in Hz.
    pub max_switching_hz: f32,
    /// Phase current that trips the drive, in A (instantaneous).
    pub trip_current_a: f32,
    /// DC-link voltage above which the drive trips, in V.
    pub trip_dc_over_v: f32,
    /// DC-link voltage below which the drive trips, in V.
    pub trip_dc_under_v: f32,
    /// Mechanical speed above which the drive trips, in rad/s.
    pub trip_speed_rad_s: f32,
    /// Slew rate of the torque demand, in N·m/s.
    pub torque_slew_nm_s: f32,
    /// Largest acceleration of the rotor, electrical, in rad/s²: that of the largest torque on its inertia.
    pub max_acceleration_rad_s2: f32,
    /// Iron loss, if all of the loss that the folder names were the iron's.
    pub iron: IronLoss,
    /// The iron's share of that loss, 0 ..= 1, as far as it is known.
    pub iron_share: f32,
}

impl Ratings {
    /// The demagnetisation limit, in A; `None` if there is none. Inlined, so that the compiler leaves it out of an image whose machine has
    /// none.
    #[inline(always)]
    pub const fn least_id_a(&self) -> Option<f32> {
        if self.min_id_a > -self.max_current_a { Some(self.min_id_a) } else { None }
    }

    /// `true` for a machine with magnets: without them the rotor is the same after half an electrical turn.
    pub const fn has_magnets(&self) -> bool {
        // Less is rounding of the tables.
        self.magnet_flux_wb > 1e-9
    }

    /// Mechanical speed below which a rotor counts as standing, in rad/s: half of that at which the largest torque gives the shaft the copper loss of the
    /// largest current, `ω T = 1.5 R I²`. Slower, torque in either direction takes power from the link.
    #[inline]
    pub const fn standing_rad_s(&self) -> f32 {
        let copper_w = 1.5 * self.stator_resistance_ohm * self.max_current_a * self.max_current_a;
        0.5 * copper_w / self.max_torque_nm
    }

    /// A direct-axis current, in A, no lower than the demagnetisation limit.
    #[inline(always)]
    pub(crate) fn kept_id_a(&self, id_a: f32) -> f32 {
        match self.least_id_a() {
            Some(least_a) if id_a < least_a => least_a,
            _ => id_a,
        }
    }
}

/// MTPA tables: the paper's universal curve, the parameters it is fed with, and where its first pass starts.
#[derive(Clone, Copy, Debug)]
pub struct Mtpa {
    /// The universal curve i_dn = f(t_en) of equation (12), over `x = s/(1+s)` with `s = √|t_en|`,
    /// `x` in 0..=1: the nodes hold `−i_dn/s` (0 at `x = 0`, 1 at `x = 1`), so the whole half-axis of t_en fits.
    pub universal: Curve<1>,
    /// `[psi_f (Wb), L_q − L_d (H)]` over (i_d, |i_q|): the only combination that equations (7)–(13) need.
    /// Both are kept positive by the generator, also for a machine without magnets or without saliency.
    pub parameters: Grid<2>,
    /// `[i_d start, i_q start, i_d trim, i_q trim]`, in A, over |T| in N·m (0 ..= largest torque): the
    /// point at which the first pass reads `parameters`, and the addition to the second pass' result.
    pub start: Curve<4>,
    /// `[along, across]`, in N·m/Wb², over |T| likewise: the excess of mean torque over a flux ripple around the MTPA point beyond the torque
    /// there, over the ripple's mean square along the flux linkage and across it: half of the torque's second differences.
    pub curvature: Curve<2>,
}

/// Field-weakening tables: the constant-torque curves cut with circles of constant flux linkage.
///
/// A circle stands at `x = psi / (psi + flux_knee_wb)`, a torque on it at `y = w / (w + share_knee)` with
/// `w = 1 − √(1 − |T|/T_circle)`: nodes stand closer where there is little flux or little torque. Values read
/// between the nodes have no more flux linkage and no more current than was asked for.
#[derive(Clone, Copy, Debug)]
pub struct Weakening {
    /// `[i_d, psi_T]`, in A and Wb, over (`x`, `y`): with the effective flux linkage `psi_T = T/(1.5 n_p i_q)`, above zero, i_q
    /// follows from the torque itself.
    pub currents: Grid<2>,
    /// `[T_circle, T_limit, dT_limit/dpsi², a, b]`, in N·m, N·m/Wb² and A², over `x`: the most torque on that circle;
    /// the most on it or inside it, both within the current limit; how fast that grows, at least; and the square of a
    /// current on that circle exceeds that of the MTPA point of the same torque by `a + b w` at most.
    pub torque: Curve<5>,
    /// Flux linkage at which `x` is one half, in Wb.
    pub flux_knee_wb: f32,
    /// `w` at which `y` is one half.
    pub share_knee: f32,
}

/// Everything the control task knows of a machine.
#[derive(Clone, Copy, Debug)]
pub struct Tables {
    /// Name of the machine folder's `name` key.
    pub name: &'static str,
    /// Ratings and limits.
    pub ratings: Ratings,
    /// `[psi_d, psi_q]`, in Wb, over (i_d, |i_q|), in A; the map is even in i_q (psi_q odd).
    pub flux: Grid<2>,
    /// MTPA.
    pub mtpa: Mtpa,
    /// Field weakening.
    pub weakening: Weakening,
    /// Source and network of a nine-switch inverter; a two-level one has neither.
    pub z_source: ZSourceNetwork,
}

/// A Z-source network with the source before it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ZSourceNetwork {
    /// Voltage of the source, nominally, in V, above 0.
    pub source_v: f32,
    /// Inductance of each inductor, in H, above 0.
    pub inductance_h: f32,
    /// Resistance of each inductor, in ohm, from 0.
    pub resistance_ohm: f32,
    /// Capacitance of each capacitor, in F, above 0.
    pub capacitance_f: f32,
}

/// The source of a task's tables: a reference if they are made at run time; in an image a type without fields, so that the
/// compiler knows every number of them.
pub trait Machine: Copy {
    /// The tables.
    fn tables(self) -> &'static Tables;
}

impl Machine for &'static Tables {
    #[inline(always)]
    fn tables(self) -> &'static Tables {
        self
    }
}
