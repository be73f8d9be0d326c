//! The operating point: MTPA, field weakening, and the switch between them.
//!
//! At a given speed the voltage limit is a limit of flux linkage. A table holds the current for a torque on the circle of that
//! flux; of this current and the MTPA point, the one further left in i_d keeps both limits. In square
//! wave the voltage is fixed, so the point lies on the circle on either side of MTPA.

use super::{flux_linkage, mtpa};
use crate::frames::{Dq, root, six_step_v, sqrt};
use crate::machine::{Tables, Weakening};
use crate::named;

named! {
    /// The source of an operating point.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    #[cfg_attr(feature = "defmt", derive(defmt::Format))]
    #[non_exhaustive]
    pub enum Region {
        /// Least current for the torque; the voltage suffices.
        Mtpa => "mtpa",
        /// On the voltage limit, the torque as demanded.
        Weakening => "fw",
        /// On the voltage limit, with the most torque that current and voltage allow.
        Limit => "limit",
    }
}

/// The limit of the inverter's voltage.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct VoltageLimit {
    /// DC-link voltage, in V.
    pub udc_v: f32,
    /// Largest fundamental, as a share of six-step.
    pub modulation_index: f32,
    /// `true` if the fundamental is always that large (square wave).
    pub filled: bool,
}

/// A current reference and what it stands for.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct OperatingPoint {
    /// Current, in A.
    pub current: Dq,
    /// Flux linkage for that current by the map, in Wb.
    pub flux: Dq,
    /// Torque that it gives, in N·m.
    pub torque_nm: f32,
    /// Its source.
    pub region: Region,
    /// Voltage of the MTPA point at this speed, as a share of six-step (above 1 if weakening is needed).
    pub modulation_index: f32,
}

/// Share of the voltage limit below which the MTPA point needs no weakening, by the flux map that the target has; above it, the
/// circles decide.
const SURELY_WITHIN: f32 = 0.98;
/// A point on the circle of the voltage limit counts as left of the MTPA point until it is right of it by this share of the
/// largest current: the possible error of the MTPA point. Near the optimum the magnitude hardly changes.
const MTPA_OFF: f32 = 0.002;

/// The current for a torque in N·m at an electrical angular speed in rad/s. The voltage is that of equation (3) on the flux map.
///
/// ```
/// use tractive_control::control::{Region, VoltageLimit, operating_point};
/// # fn main() -> Result<(), tractive_tablegen::InputError> {
/// let folder = std::path::Path::new("../tables/pmasynrm-180kw");
/// let tables = tractive_tablegen::MachineFolder::read(folder)?.tables();
/// let limit = VoltageLimit { udc_v: 1_500.0, modulation_index: 1.0, filled: false };
/// let at_rpm = |torque_nm, rpm: f32| {
///     let omega = rpm / 60.0 * core::f32::consts::TAU * tables.ratings.pole_pairs;
///     operating_point(torque_nm, omega, &limit, &tables)
/// };
/// // At 200 r/min the voltage suffices for the least current; at 1,905 r/min the same torque is held on the voltage limit with
/// // more negative i_d; at twice that speed the torque is what is left.
/// let (slow, base, fast) = (at_rpm(1_235.0, 200.0), at_rpm(1_235.0, 1_905.0), at_rpm(1_235.0, 3_810.0));
/// assert_eq!([slow.region, base.region, fast.region], [Region::Mtpa, Region::Weakening, Region::Limit]);
/// assert!(base.current.d < slow.current.d && base.torque_nm == 1_235.0 && fast.torque_nm < 900.0);
/// # Ok(())
/// # }
/// ```
pub fn operating_point(torque_nm: f32, omega: f32, limit: &VoltageLimit, tables: &Tables) -> OperatingPoint {
    point(torque_nm, omega, limit, tables.ratings.stator_resistance_ohm, tables)
}

/// The same at another stator resistance, in ohm.
#[inline(always)]
pub(super) fn point(
    torque_nm: f32,
    omega: f32,
    limit: &VoltageLimit,
    resistance: f32,
    tables: &Tables,
) -> OperatingPoint {
    // The torque axis ends where the current does.
    let most = tables.mtpa.start.last();
    let beyond = torque_nm.abs() > most;
    let torque_nm = if beyond { most.copysign(torque_nm) } else { torque_nm };
    let region = if beyond { Region::Limit } else { Region::Mtpa };
    let best = mtpa(torque_nm, tables);
    let flux = flux_linkage(tables, best);
    let steady_v = flux.j() * omega + best * resistance;
    let six_step_v = six_step_v(limit.udc_v);
    let voltage_v = limit.modulation_index * six_step_v;
    let modulation_index = steady_v.length() / six_step_v;
    let unweakened = OperatingPoint { current: best, flux, torque_nm, region, modulation_index };
    let within_v = SURELY_WITHIN * voltage_v;
    if steady_v.squared() <= within_v * within_v && !limit.filled {
        return unweakened;
    }
    let Weakened { current, torque_nm, region, inside } =
        weakened(torque_nm, best.squared(), &Electrical { omega, voltage_v, resistance }, tables);
    let right = current.d - best.d >= MTPA_OFF * tables.ratings.max_current_a;
    let is_least = match region {
        Region::Weakening => right || inside,
        // If the voltage slightly exceeds the need, the circle of its flux linkage may meet the largest current at less torque.
        _ => steady_v.squared() <= voltage_v * voltage_v,
    };
    if is_least && !limit.filled {
        return unweakened;
    }
    OperatingPoint { current, flux: flux_linkage(tables, current), torque_nm, region, modulation_index }
}

/// Electrical angular speed in rad/s, largest voltage in V and stator resistance in ohm.
struct Electrical {
    omega: f32,
    voltage_v: f32,
    resistance: f32,
}

/// A point on a circle of flux linkage.
struct Weakened {
    current: Dq,
    torque_nm: f32,
    region: Region,
    /// `true` if the torque is too large for the circle, but not for what is inside it.
    inside: bool,
}

/// The point on the circle of flux linkage that the voltage allows, for either sign of torque. From (3) squared,
/// `u² = (ωψ)² + 2 R ω T/(1.5 n_p) + R² i²`, all multiplied by 1/ω². Inlined, so that the compiler knows the tables.
#[inline(always)]
fn weakened(torque_nm: f32, mtpa_squared: f32, at: &Electrical, tables: &Tables) -> Weakened {
    let Electrical { omega, voltage_v, resistance } = *at;
    let Weakening { currents, torque, flux_knee_wb, share_knee } = &tables.weakening;
    let ratings = &tables.ratings;
    let factor = 1.5 * ratings.pole_pairs;
    let speed = omega.abs();
    let last = torque.last();
    // Position on the tables' axis of the flux linkage √square/ω.
    let place = |square: f32| {
        let root = sqrt(square);
        root / (root + flux_knee_wb * speed)
    };
    let resistance_squared = resistance * resistance;
    let largest_squared = ratings.max_current_a * ratings.max_current_a;
    // First without torque and with the largest current; from there the most torque along its slope: its own drop leaves less flux, or
    // more when braking. Since the slope is the least one, the flux comes out too small rather than too large.
    let square = voltage_v * voltage_v - resistance_squared * largest_squared;
    let [_, most, slope, above, rise] = torque.at(place(square));
    let drop = torque_nm.signum() * omega * (2.0 * resistance / factor);
    let most = most * speed * speed / (speed * speed + drop * slope);
    let magnitude = torque_nm.abs();
    let flowing = if magnitude > most { most } else { magnitude };
    let squared = mtpa_squared + above + rise * (1.0 - root(1.0 - flowing / most));
    let below = if squared < largest_squared { largest_squared - squared } else { 0.0 };
    let at = place(square + resistance_squared * below - drop * flowing);
    let at = if at > last { last } else { at };
    let [circle, most, ..] = torque.at(at);
    let limited = magnitude > most;
    let inside = magnitude > circle;
    let share = if inside { 1.0 } else { magnitude / circle };
    let given = share * circle;
    let left = root(1.0 - share);
    let [d, effective] = currents.at(at, (1.0 - left) / ((1.0 + share_knee) - left));
    let torque_nm = if torque_nm < 0.0 { -given } else { given };
    Weakened {
        // Beyond the narrowest circle the table would continue.
        current: Dq { d: ratings.kept_id_a(d), q: torque_nm / (factor * effective) },
        torque_nm,
        region: if limited { Region::Limit } else { Region::Weakening },
        inside,
    }
}

#[cfg(test)]
mod tests {
    use super::Region;

    #[test]
    fn a_region_has_its_name_in_files() {
        assert_eq!(
            [Region::Mtpa, Region::Weakening, Region::Limit].map(Region::name),
            ["mtpa", "fw", "limit"]
        );
    }
}
