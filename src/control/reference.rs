//! The operating point: MTPA, field weakening, and the switch between them.
//!
//! At a speed the voltage limit is a limit of flux linkage. The current for a torque on the circle of that flux
//! stands in a table; whichever of it and the MTPA point lies further left in i_d keeps both limits. In square
//! wave the voltage is what it is, so the point lies on the circle on either side of MTPA.

use super::{flux_linkage, mtpa};
use crate::frames::{Dq, sqrt};
use crate::machine::Tables;

/// Where an operating point comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Region {
    /// Least current for the torque; the voltage suffices.
    Mtpa,
    /// On the voltage limit, the torque as demanded.
    Weakening,
    /// On the voltage limit, with the most torque that current and voltage allow.
    Limit,
}

impl Region {
    /// The name in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Mtpa => "mtpa",
            Self::Weakening => "fw",
            Self::Limit => "limit",
        }
    }
}

/// What the inverter can give.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoltageLimit {
    /// DC-link voltage, in V.
    pub udc_v: f32,
    /// Largest fundamental, as a share of six-step.
    pub depth: f32,
    /// Whether the fundamental always is that large (square wave).
    pub filled: bool,
}

/// A current reference and what it stands for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OperatingPoint {
    /// Current, in A.
    pub current: Dq,
    /// Flux linkage that belongs to it by the map, in Wb.
    pub flux: Dq,
    /// Torque that it gives, in N·m.
    pub torque_nm: f32,
    /// Where it comes from.
    pub region: Region,
    /// Voltage of the MTPA point at this speed, as a share of six-step (above 1 where weakening is needed).
    pub depth: f32,
}

/// Peak phase voltage of the six-step fundamental, 2 udc/π, in V.
pub fn six_step_v(udc_v: f32) -> f32 {
    udc_v * (2.0 * core::f32::consts::FRAC_1_PI)
}

/// The current for a torque in N·m at an electrical angular speed in rad/s. The voltage is that of equation (3) on the flux map.
pub fn operating_point(torque_nm: f32, omega: f32, limit: &VoltageLimit, tables: &Tables) -> OperatingPoint {
    // The torque axis ends where the current does.
    let most = tables.mtpa.start.last();
    let wanted_nm = torque_nm;
    let torque_nm = crate::frames::limit(wanted_nm, -most, most);
    let region = if torque_nm == wanted_nm { Region::Mtpa } else { Region::Limit };
    let best = mtpa(torque_nm, tables);
    let flux = flux_linkage(tables, best);
    let resistance = tables.ratings.stator_resistance_ohm;
    let steady_v = (flux.j() * omega + best * resistance).length();
    let depth = steady_v / six_step_v(limit.udc_v);
    let unweakened = OperatingPoint { current: best, flux, torque_nm, region, depth };
    if depth <= limit.depth && !limit.filled {
        return unweakened;
    }
    let Some(psi) = flux_limit(torque_nm, best.squared(), omega, limit, tables) else {
        return unweakened;
    };
    // Less torque leaves less resistive drop, and so more flux: where it ends, the flux is that of the torque that is left.
    let [_, most] = tables.weakening.torque.at(psi);
    let left_nm = crate::frames::limit(torque_nm, -most, most);
    let psi = if left_nm == torque_nm {
        psi
    } else {
        flux_limit(left_nm, best.squared(), omega, limit, tables).unwrap_or(psi)
    };
    let Weakened { current, torque_nm, region } = weakened(torque_nm, psi, tables);
    if region == Region::Weakening && current.d >= best.d && !limit.filled {
        return unweakened;
    }
    OperatingPoint { current, flux: flux_linkage(tables, current), torque_nm, region, depth }
}

/// Largest flux linkage that the voltage allows, in Wb; `None` where it lies beyond the tables, so that no weakening
/// is needed. From `u² = (ωψ)² + 2 R ω T/(1.5 n_p) + R² i²`, which is (3) squared.
fn flux_limit(
    torque_nm: f32,
    current_squared: f32,
    omega: f32,
    limit: &VoltageLimit,
    tables: &Tables,
) -> Option<f32> {
    let resistance = tables.ratings.stator_resistance_ohm;
    let voltage = limit.depth * six_step_v(limit.udc_v);
    let copper_power = torque_nm * omega / (1.5 * tables.ratings.pole_pairs);
    let left =
        voltage * voltage - 2.0 * resistance * copper_power - resistance * resistance * current_squared;
    let speed = omega.abs();
    let largest = tables.weakening.torque.last();
    let reach = speed * largest;
    if left >= reach * reach && !limit.filled {
        return None;
    }
    let psi = sqrt(left) / speed;
    Some(if psi > largest { largest } else { psi })
}

/// A point on a circle of flux linkage.
struct Weakened {
    current: Dq,
    torque_nm: f32,
    region: Region,
}

/// The point on the circle of flux linkage `psi`, for either sign of torque. Inlined, so that the compiler knows the tables.
#[inline(always)]
fn weakened(torque_nm: f32, psi: f32, tables: &Tables) -> Weakened {
    let [circle, most] = tables.weakening.torque.at(psi);
    let torque = torque_nm.abs();
    let limited = torque > most;
    let torque = if limited { most } else { torque };
    let share = if torque > circle { 1.0 } else { torque / circle };
    let [d, q] = tables.weakening.currents.at(psi, 1.0 - sqrt(1.0 - share));
    let negative = torque_nm < 0.0;
    Weakened {
        current: Dq { d, q: if negative { -q } else { q } },
        torque_nm: if negative { -torque } else { torque },
        region: if limited { Region::Limit } else { Region::Weakening },
    }
}
