//! The watch for a voltage that nothing explains.
//!
//! At each boundary the control law compares the flux linkage that currents and angle show with the volt-seconds that acted. The average that remains
//! unexplained is small while the angle is the rotor's: it comes from a warm winding, the devices, an inaccurate map. An angle that stands still or
//! counts the wrong way while the rotor turns leaves the whole EMF unexplained.

use super::{FailedCheck, Fault};
use crate::frames::Dq;
use crate::machine::Tables;

/// Shares of the drop of the largest current in the resistance, of the nominal link, and of the EMF of the flux linkage at full torque, which
/// together may remain unexplained for ever: a hot winding, with devices and their dead time; and an inaccurate map or angle.
const DROP_SHARE: f32 = 0.8;
const LINK_SHARE: f32 = 0.01;
const EMF_SHARE: f32 = 0.25;
/// Share of that flux linkage that the voltage beyond these may add up to: a reversal of the torque with a map that is a fifth off adds up to two
/// fifths at most, less the parts above.
const FLUX_SHARE: f32 = 0.2;
/// Ratio of the knee of the weakening tables to the flux linkage at full torque.
const KNEE_PER_FLUX: f32 = 0.345;

/// The watch for a voltage that nothing explains.
#[derive(Clone, Copy, Debug, Default)]
pub struct UnexplainedWatch {
    /// Volt-seconds beyond those that may remain unexplained, in V·s.
    excess_wb: f32,
}

impl UnexplainedWatch {
    /// A watch that has seen nothing yet.
    pub const fn new() -> Self {
        Self { excess_wb: 0.0 }
    }

    /// A boundary has passed after a half of this many seconds, with an unexplained voltage, in V, rotor frame. A configured dead time may account
    /// for a part of it, at most the second argument, in V, from 0. The electrical speed is in rad/s.
    #[inline(always)]
    pub fn step(&mut self, unexplained_v: Dq, dead_v: f32, omega: f32, half_s: f32, tables: &Tables) {
        let ratings = &tables.ratings;
        let still_v = DROP_SHARE * ratings.stator_resistance_ohm * ratings.max_current_a
            + LINK_SHARE * ratings.dc_link_nominal_v;
        let may_be_v = still_v + dead_v + EMF_SHARE * full_flux_wb(tables) * omega.abs();
        let excess_wb = self.excess_wb + (unexplained_v.length() - may_be_v) * half_s;
        // NaN is found elsewhere.
        self.excess_wb = if excess_wb > 0.0 { excess_wb } else { 0.0 };
    }

    /// The fault, once the volt-seconds exceed their limit.
    #[inline(always)]
    pub fn check(&self, tables: &Tables) -> Option<FailedCheck> {
        let limit_wb = FLUX_SHARE * full_flux_wb(tables);
        (self.excess_wb > limit_wb).then_some((Fault::VoltageUnexplained, self.excess_wb, limit_wb))
    }
}

/// The flux linkage at full torque, in Wb.
#[inline(always)]
fn full_flux_wb(tables: &Tables) -> f32 {
    tables.weakening.flux_knee_wb * (1.0 / KNEE_PER_FLUX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::built_in::traction::BUILT_IN;
    use crate::built_in::zs9;
    use crate::control::{flux_linkage, mtpa};
    use crate::machine::Ratings;

    const HALF_S: f32 = 0.5e-3;

    /// The number of halves until a voltage of the machine with these tables, of which a dead time may account for a part, is a fault, in V at an
    /// electrical speed in rad/s; `None` of 2,000.
    fn found_after(unexplained_v: f32, dead_v: f32, omega: f32, tables: &Tables) -> Option<u32> {
        let mut watch = UnexplainedWatch::new();
        (1..2_000).find(|_| {
            watch.step(Dq { d: 0.0, q: unexplained_v }, dead_v, omega, HALF_S, tables);
            watch.check(tables).is_some()
        })
    }

    /// The EMF of a rotor that turns while its angle stands still is found within half a turn; a voltage that may remain unexplained never is.
    #[test]
    fn an_emf_is_found_and_what_may_be_is_not() {
        for tables in [&BUILT_IN, &zs9::BUILT_IN] {
            let Ratings { stator_resistance_ohm, max_current_a, dc_link_nominal_v, magnet_flux_wb, .. } =
                tables.ratings;
            let (drop_v, flux_wb) = (stator_resistance_ohm * max_current_a, full_flux_wb(tables));
            for omega in [0.0, 100.0, -800.0_f32] {
                let dead_v = 7.0;
                let may_be_v =
                    dead_v + 0.8 * drop_v + 0.01 * dc_link_nominal_v + 0.25 * flux_wb * omega.abs();
                assert_eq!(found_after(0.999 * may_be_v, dead_v, omega, tables), None, "{omega} rad/s");
                // An additional volt until it is a fifth of the flux linkage.
                let halves = found_after(may_be_v + 1.0, dead_v, omega, tables).unwrap();
                assert!((halves as f32 * HALF_S / (0.2 * flux_wb) - 1.0).abs() < 0.01, "{halves} halves");
            }
            let turning = 500.0;
            let halves = found_after(magnet_flux_wb * turning, 0.0, 0.0, tables).unwrap();
            assert!(halves as f32 * HALF_S * turning < core::f32::consts::PI, "{halves} halves");
        }
    }

    /// Volt-seconds of short voltages are forgotten; a lasting voltage is reported with the excess and the limit; NaN is no voltage.
    #[test]
    fn volt_seconds_beyond_it_add_up_and_are_forgotten() {
        let (limit_wb, mut watch) = (0.2 * full_flux_wb(&BUILT_IN), UnexplainedWatch::new());
        let mut step = |volts: f32| {
            watch.step(Dq { d: volts, q: 0.0 }, 0.0, 0.0, HALF_S, &BUILT_IN);
            watch.check(&BUILT_IN)
        };
        for _ in 0..20 {
            assert!((0..20).all(|_| step(45.0).is_none()));
            assert!((0..10).all(|_| step(0.0).is_none()));
        }
        assert_eq!(step(f32::NAN), None);
        let (fault, excess_wb, told_wb) = (0..60).find_map(|_| step(45.0)).unwrap();
        assert_eq!((fault, told_wb), (Fault::VoltageUnexplained, limit_wb));
        assert!((1.0..1.05).contains(&(excess_wb / limit_wb)), "{excess_wb} V·s");
    }

    /// The flux linkage at full torque agrees with the map's within a tenth.
    #[test]
    fn the_flux_linkage_is_that_of_full_torque() {
        for tables in [&BUILT_IN, &zs9::BUILT_IN] {
            let current = mtpa(tables.ratings.max_torque_nm, tables);
            let share = full_flux_wb(tables) / flux_linkage(tables, current).length();
            assert!((0.9..1.1).contains(&share), "{} {share}", tables.name);
        }
    }
}
