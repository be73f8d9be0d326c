//! The errors of flux map, magnets and resistance, and their use.
//!
//! If the machine's flux linkage is ψ (1 + ε) + m, with ψ the map's and m what its magnets have more, and its resistance, with what dead time
//! and devices take along the current, ΔR more than it is taken for, then u = −jω(εψ + m) − ΔR i stays unexplained. Another machine's map or a
//! link sensor make ε, hot or cold magnets m, which lies along d alone. A voltage has two components and these are three: of all that
//! explain what is left of u, the likeliest are taken, by what each may be off by. With M = ∂u/∂(ε, m, ΔR) as a matrix, W that of the squared
//! doubts and N that of what else a voltage may hold, the step is W Mᵀ (M W Mᵀ + N)⁻¹ of what is missing.
//!
//! So the resistance is learnt at standstill and known at speed; the magnets show at speed, where a resistance hardly does; no speed is a
//! border, and what is known keeps where nothing new tells otherwise.
//!
//! The estimate of ε is reported. The operating point takes m into account, and of ε what is beyond a link sensor's error: such a machine needs
//! for a torque the current that the map gives for T/(1 + ε + ΔT/T), ΔT = 3/2 p m i_q, and the voltage that it gives on a link of udc/(1 + ε).

use super::Target;
use crate::frames::{Dq, limit_magnitude};
use crate::machine::Ratings;

/// Likely errors of the map: ε, and m as a share of the flux linkage.
const SHARE_DOUBT: f32 = 0.2;
const MAGNET_DOUBT: f32 = 0.02;
/// Flux linkage whose EMF a voltage may hold besides, as a share of all; and the speed below which that stays the same, as a share of the largest.
const ELSE_DOUBT: f32 = 0.01;
const ELSE_FROM: f32 = 0.005;
/// Bandwidth of the estimate, in rad/s.
const BANDWIDTH_RAD_S: f32 = 5.0;
/// ε that is left alone: what a link sensor may look like.
const LEFT_ALONE: f32 = 0.03;
/// Share of the largest torque of which the magnets' part is taken for half as much.
const LEAST_TORQUE: f32 = 0.02;
/// Share of the torque that the magnets may seem to make: what dead time and a resistance may look like.
const LEFT_TO_MAGNETS: f32 = 0.003;
/// Largest correction.
const MOST: f32 = 0.15;

/// The disturbance over a time, and what was aimed at.
pub struct Input {
    /// Mean, in V.
    pub disturbance: Dq,
    /// In A.
    pub current: Dq,
    /// Flux linkage, in Wb.
    pub flux: Dq,
    /// Electrical angular speed, in rad/s.
    pub omega: f32,
    /// The time, in s.
    pub period_s: f32,
    /// Likely error of the resistance, in Ω, from 0.
    pub doubt_ohm: f32,
    /// Largest electrical angular speed, in rad/s.
    pub fastest: f32,
}

#[derive(Clone, Copy, Debug)]
pub struct MapError {
    share: f32,
    /// Of `share`: made where that changes, since it is wanted far more often.
    scale: f32,
    magnets_wb: f32,
    more_ohm: f32,
}

impl MapError {
    pub const fn new() -> Self {
        Self { share: 0.0, scale: 1.0, magnets_wb: 0.0, more_ohm: 0.0 }
    }

    /// ε, as far as it is known.
    pub fn share(&self) -> f32 {
        self.share
    }

    /// 1 + ε, as far as it is believed.
    pub fn scale(&self) -> f32 {
        self.scale
    }

    /// 1 + ε with nothing of a believed ε left alone: for the flux linkage of the magnets in a machine that is caught.
    pub fn caught_scale(&self) -> f32 {
        if self.scale == 1.0 { 1.0 } else { self.known_scale() }
    }

    /// 1 + ε, as far as it is known.
    pub fn known_scale(&self) -> f32 {
        1.0 + limit_magnitude(self.share, MOST)
    }

    /// ΔT/T at a target, as far as it is believed: next to no torque less and less of it, so that the torque's sign stays.
    pub fn magnets_share(&self, target: &Target, ratings: &Ratings) -> f32 {
        let least_nm = LEAST_TORQUE * ratings.max_torque_nm;
        let more_nm = 1.5 * ratings.pole_pairs * self.magnets_wb * target.current.q;
        let map_nm = target.torque_nm - more_nm;
        let share = more_nm * map_nm / (map_nm * map_nm + least_nm * least_nm);
        limit_magnitude(share - limit_magnitude(share, LEFT_TO_MAGNETS), MOST)
    }

    /// A time with a mean disturbance.
    pub fn step(&mut self, input: &Input) {
        let Input { disturbance, current, flux, omega, period_s, doubt_ohm, fastest } = *input;
        let emf = flux.j() * omega;
        let explained =
            emf * self.share + Dq { d: 0.0, q: omega * self.magnets_wb } + current * self.more_ohm;
        let missing = disturbance + explained;
        let length = flux.squared();
        let (turning, slowest) = (omega * omega, ELSE_FROM * fastest);
        let share = SHARE_DOUBT * SHARE_DOUBT;
        let magnets = MAGNET_DOUBT * MAGNET_DOUBT * length;
        let resistance = doubt_ohm * doubt_ohm;
        let besides = ELSE_DOUBT * ELSE_DOUBT * length * (turning + slowest * slowest);
        let dd = share * emf.d * emf.d + resistance * current.d * current.d + besides;
        let qq = share * emf.q * emf.q + resistance * current.q * current.q + besides + magnets * turning;
        let dq = share * emf.d * emf.q + resistance * current.d * current.q;
        let determinant = dd * qq - dq * dq;
        if determinant <= 0.0 {
            return;
        }
        let gain = BANDWIDTH_RAD_S * period_s / determinant;
        let left = Dq { d: qq * missing.d - dq * missing.q, q: dd * missing.q - dq * missing.d } * gain;
        self.share -= share * emf.dot(left);
        self.magnets_wb -= magnets * omega * left.q;
        self.more_ohm -= resistance * current.dot(left);
        self.scale = if self.share.abs() > LEFT_ALONE {
            1.0 + limit_magnitude(self.share - LEFT_ALONE.copysign(self.share), MOST)
        } else {
            1.0
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CURRENT: Dq = Dq { d: -120.0, q: 160.0 };
    const FLUX: Dq = Dq { d: -0.4, q: 1.1 };
    /// Flux linkage without current.
    const NO_LOAD: Dq = Dq { d: 0.35, q: 0.0 };

    /// 1 s of a machine whose flux linkage is so much larger, whose magnets have so many Wb and whose windings so many Ω more.
    fn pass(error: &mut MapError, [share, magnets_wb, more_ohm]: [f32; 3], current: Dq, omega: f32) {
        let flux = if current == Dq::default() { NO_LOAD } else { FLUX };
        let more = flux * share + Dq { d: magnets_wb, q: 0.0 };
        let disturbance = more.j() * -omega - current * more_ohm;
        for _ in 0..1_000 {
            error.step(&Input {
                disturbance,
                current,
                flux,
                omega,
                period_s: 1e-3,
                doubt_ohm: 0.06,
                fastest: 2_500.0,
            });
        }
    }

    #[test]
    fn at_speed_map_and_magnets_are_told_from_a_resistance() {
        for omega in [1_000.0, -1_000.0, 2_000.0] {
            for off in
                [[0.1, 0.0, 0.0], [0.0, 0.02, 0.0], [0.0, -0.08, 0.0], [-0.05, 0.05, 0.0], [0.0, 0.0, 0.05]]
            {
                let mut error = MapError::new();
                pass(&mut error, off, CURRENT, omega);
                let missed = [error.share - off[0], error.magnets_wb - off[1]];
                assert!(
                    missed.iter().all(|missed| missed.abs() < 0.02),
                    "{missed:?} of {off:?} at {omega} rad/s"
                );
            }
        }
    }

    #[test]
    fn what_was_learnt_elsewhere_holds() {
        for (share, magnets_wb) in [(0.0, 0.0), (0.08, 0.0)] {
            let (mut error, off) = (MapError::new(), [share, magnets_wb, 0.05]);
            pass(&mut error, off, CURRENT, 0.0);
            assert_eq!((error.share, error.magnets_wb), (0.0, 0.0));
            pass(&mut error, off, CURRENT, 100.0);
            assert!((error.share - share).abs() < 0.01, "{error:?}");
            assert!((error.magnets_wb - magnets_wb).abs() < 0.01, "{error:?}");
        }
        // Hot magnets, learnt at speed, at a tenth of it.
        let (mut error, off) = (MapError::new(), [0.0, -0.08, 0.0]);
        pass(&mut error, off, CURRENT, 1_500.0);
        let before = error;
        pass(&mut error, off, CURRENT, 150.0);
        assert!((error.magnets_wb - before.magnets_wb).abs() < 0.01, "{before:?} {error:?}");
    }

    #[test]
    fn without_current_the_flux_linkage_alone_is_asked() {
        let mut error = MapError::new();
        pass(&mut error, [0.1, 0.0, 0.0], Dq::default(), 300.0);
        let more_wb = error.share * NO_LOAD.d + error.magnets_wb;
        assert!((more_wb / NO_LOAD.d - 0.1).abs() < 1e-3 && error.magnets_wb.abs() < 1e-3, "{error:?}");
    }

    #[test]
    fn a_machine_without_flux_linkage_tells_nothing() {
        let mut error = MapError::new();
        let disturbance = Dq { d: 1.0, q: -1.0 };
        let [current, flux] = [Dq::default(); 2];
        error.step(&Input {
            disturbance,
            current,
            flux,
            omega: 500.0,
            period_s: 1e-3,
            doubt_ohm: 0.0,
            fastest: 2_500.0,
        });
        assert_eq!((error.share, error.magnets_wb, error.more_ohm), (0.0, 0.0, 0.0));
    }

    fn ratings() -> Ratings {
        Ratings {
            pole_pairs: 4.0,
            stator_resistance_ohm: 0.1,
            max_torque_nm: 1_000.0,
            max_power_w: 180e3,
            max_current_a: 230.0,
            max_speed_rad_s: 630.0,
            magnet_flux_wb: 0.35,
            dc_link_min_v: 1_000.0,
            dc_link_nominal_v: 1_500.0,
            dc_link_max_v: 1_800.0,
            max_switching_hz: 900.0,
            trip_current_a: 300.0,
            trip_dc_over_v: 2_000.0,
            trip_dc_under_v: 900.0,
            trip_speed_rad_s: 690.0,
            torque_slew_nm_s: 8_000.0,
        }
    }

    #[test]
    fn the_magnets_part_of_the_torque_is_bounded_and_small_ones_are_left_alone() {
        let share = |magnets_wb: f32, torque_nm: f32, q: f32| {
            let target = Target { torque_nm, current: Dq { d: 0.0, q }, ..Target::NONE };
            MapError { magnets_wb, ..MapError::new() }.magnets_share(&target, &ratings())
        };
        for (torque_nm, q) in [(0.0, 50.0), (0.0, 0.0), (-5.0, 50.0), (900.0, 180.0), (5.0, 0.0)] {
            for magnets_wb in [-0.1, 0.1] {
                let share = share(magnets_wb, torque_nm, q);
                assert!(share.abs() <= MOST, "{share} for {torque_nm} N·m");
            }
        }
        // 24 N·m less than the map's 424, and as much more; less than 0.3 % of a torque is left alone.
        assert!((share(-0.04, 400.0, 100.0) + 24.0 / 424.0 - LEFT_TO_MAGNETS).abs() < 1e-3);
        assert!((share(0.04, -400.0, -100.0) - 24.0 / 376.0 + LEFT_TO_MAGNETS).abs() < 1e-3);
        assert_eq!(share(0.001, 400.0, 100.0), 0.0);
    }
}
