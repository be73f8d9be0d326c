//! The error of the flux map, and its use.
//!
//! If the machine's flux linkage is (1 + ε) times the map's, and its resistance, with what dead time and devices take along the current,
//! ΔR more than it is taken for, then u = −ε jωψ − ΔR i stays unexplained. Least squares for both, with ΔR taken as 0 where there is hardly
//! a current to tell it from:
//!
//! ε = ((u·i)(jωψ·i) − (u·jωψ)(|i|² + i₀²)) / (|ωψ|² (|i|² + i₀²) − (jωψ·i)²)
//!
//! The estimate is reported, and used whole. As much of it as a link sensor may be off is taken for that: a link that is read too large by ε looks like it, and
//! all volt-seconds are then those of a link of udc/(1 + ε). What is beyond is the map's, and the operating point takes it into account: such a machine needs for a
//! torque the current that the map gives for T/(1 + ε), and the voltage that it gives on a link of udc/(1 + ε). What [`super::Warmth`] explains
//! of it is taken into account whole, for torque and flux linkage each by its own amount, and only the rest is an error.

use super::Scales;
use crate::frames::{Dq, limit_magnitude};

/// Speed from which the disturbance tells something of the map, as a share of the largest, over that of the largest current which tells
/// resistance and flux linkage apart: the more of the one counts as the other, the larger the EMF has to be beside it.
const FROM: f32 = 0.1;
/// Bandwidth of the estimate, in rad/s.
const BANDWIDTH_RAD_S: f32 = 5.0;
/// Error that is the link sensor's: what it, and where the current is small half as much resistance again, may look like.
const LINK: f32 = 0.03;
/// Part of that which is left alone: a sensor without an error is used as it is, bit for bit.
const LEFT_ALONE: f32 = 0.005;
/// Largest correction.
const MOST: f32 = 0.15;

/// The disturbance over a time, and what was aimed at.
pub struct Input {
    /// Mean, in V.
    pub disturbance: Dq,
    /// ε that is not in it, as the volt-seconds have it already.
    pub explained: f32,
    /// In A.
    pub current: Dq,
    /// Flux linkage, in Wb.
    pub flux: Dq,
    /// The least that tells something, in Wb.
    pub least_wb: f32,
    /// Electrical angular speed, in rad/s.
    pub omega: f32,
    /// The time, in s.
    pub period_s: f32,
    /// Current i₀ that tells resistance and flux linkage apart, as a share of the largest.
    pub resistance_from: f32,
    /// Largest current, in A.
    pub largest_a: f32,
    /// Largest electrical angular speed, in rad/s.
    pub fastest: f32,
}

#[derive(Clone, Copy, Debug)]
pub struct MapError {
    /// Without what temperatures explain.
    share: f32,
    /// Of a warm machine, as far as its temperatures are known: what they explain is no error.
    warm: Scales,
    explained: f32,
    /// Of `share` and `warm`: made where they change, since it is wanted far more often.
    believed: Scales,
}

impl MapError {
    pub const fn new() -> Self {
        Self { share: 0.0, warm: Scales::NONE, explained: 0.0, believed: Scales::NONE }
    }

    /// ε, as far as it is known.
    pub fn share(&self) -> f32 {
        self.share + self.explained
    }

    /// 1 + ε, as far as it is believed or known by temperatures: of the flux linkage, and of the torque.
    pub fn scales(&self) -> Scales {
        self.believed
    }

    /// Knowledge by temperatures: torque and flux linkage, the ε that a machine so warm shows with the present currents, and the part of it that is
    /// new, because the temperatures are: what was an error until now is none.
    pub fn warm(&mut self, warm: Scales, explained: f32, new: f32) {
        (self.warm, self.explained) = (warm, explained);
        self.share -= new;
        self.believe();
    }

    /// The link's voltage over what its sensor reads, as far as it is known: 1/(1 + ε), within 3e-5, of what ε may be the sensor's.
    pub fn link_scale(&self) -> f32 {
        let links = limit_magnitude(self.share, LINK);
        let error = links - limit_magnitude(links, LEFT_ALONE);
        1.0 - error + error * error
    }

    /// 1 + ε without the link sensor's part: for the flux linkage of the magnets in a machine that is caught.
    pub fn caught_scale(&self) -> f32 {
        let beyond = self.share() - limit_magnitude(self.share, LINK);
        if self.believed == Scales::NONE { 1.0 } else { 1.0 + limit_magnitude(beyond, MOST) }
    }

    /// Torque over that of the map, as far as it is known.
    pub fn known_torque_scale(&self) -> f32 {
        (1.0 + limit_magnitude(self.share, MOST)) * self.warm.torque
    }

    fn believe(&mut self) {
        let share = self.share;
        let believed = 1.0 + limit_magnitude(share - limit_magnitude(share, LINK), MOST);
        self.believed = Scales { torque: believed * self.warm.torque, flux: believed * self.warm.flux };
    }

    /// A time with a mean disturbance.
    pub fn step(&mut self, input: &Input) {
        let Input {
            disturbance,
            current,
            flux,
            least_wb,
            omega,
            period_s,
            resistance_from,
            largest_a,
            fastest,
            ..
        } = *input;
        // A machine with hardly any flux linkage, as one of reluctance alone with hardly a current, has nothing to tell by either.
        if omega.abs() < resistance_from * (FROM * fastest) || flux.squared() < least_wb * least_wb {
            return;
        }
        let seen = share_of(disturbance, omega, current, flux, resistance_from * largest_a);
        self.share += BANDWIDTH_RAD_S * period_s * (seen + input.explained - self.explained - self.share);
        self.believe();
    }
}

/// ε of a voltage in V that is unexplained at an electrical angular speed in rad/s, a current in A and its flux linkage by the map in Wb, with i₀ in A.
#[inline(always)]
pub fn share_of(voltage: Dq, omega: f32, current: Dq, flux: Dq, from_a: f32) -> f32 {
    let emf = flux.j();
    let along_emf = voltage.d * emf.d + voltage.q * emf.q;
    let along_current = voltage.d * current.d + voltage.q * current.q;
    let both = emf.d * current.d + emf.q * current.q;
    let squared = current.squared() + from_a * from_a;
    (along_current * both - along_emf * squared) / (omega * (flux.squared() * squared - both * both))
}

#[cfg(test)]
mod tests {
    use super::*;

    const CURRENT: Dq = Dq { d: -120.0, q: 160.0 };
    const FLUX: Dq = Dq { d: -0.4, q: 1.1 };

    /// The estimate after a second with this unexplained share of the flux linkage and this resistance in Ω.
    fn estimate(share: f32, more_ohm: f32, current: Dq, omega: f32) -> f32 {
        let mut error = MapError::new();
        let disturbance = FLUX.j() * (-share * omega) + current * -more_ohm;
        for _ in 0..2_000 {
            error.step(&Input {
                disturbance,
                explained: 0.0,
                current,
                flux: FLUX,
                least_wb: 0.03,
                omega,
                period_s: 1e-3,
                resistance_from: 0.15,
                largest_a: 267.0,
                fastest: 1_500.0,
            });
        }
        error.share()
    }

    #[test]
    fn a_resistance_feigns_less_than_half_a_percent() {
        for omega in [35.0, 300.0, -300.0] {
            for (share, more_ohm) in [(0.1, 0.0), (-0.1, 0.05), (0.0, 0.05), (0.03, -0.03)] {
                let told = estimate(share, more_ohm, CURRENT, omega);
                assert!((told - share).abs() < 5e-3, "{told} for {share} with {more_ohm} Ω at {omega} rad/s");
            }
        }
    }

    #[test]
    fn without_flux_linkage_nothing_is_told() {
        for flux_wb in [0.0, 1e-15, 0.029] {
            let mut error = MapError::new();
            error.step(&Input {
                disturbance: Dq { d: 3.0, q: -2.0 },
                explained: 0.0,
                current: Dq { d: 0.0, q: 0.0 },
                flux: Dq { d: flux_wb, q: 0.0 },
                least_wb: 0.03,
                omega: 300.0,
                period_s: 1e-3,
                resistance_from: 0.15,
                largest_a: 267.0,
                fastest: 1_500.0,
            });
            let found = (error.share(), error.link_scale(), error.scales());
            assert_eq!(found, (0.0, 1.0, Scales::NONE), "{flux_wb} Wb");
        }
    }

    /// A drive that makes use of the link's scale, in front of a machine with this share of more flux linkage: the estimate after two seconds,
    /// the scale, and what the map has of it.
    fn used(share: f32) -> [f32; 3] {
        let (mut error, omega) = (MapError::new(), 300.0);
        for _ in 0..2_000 {
            let scale = error.link_scale();
            error.step(&Input {
                disturbance: FLUX.j() * (omega * (1.0 - scale - share)),
                explained: 1.0 - scale,
                current: CURRENT,
                flux: FLUX,
                least_wb: 0.03,
                omega,
                period_s: 1e-3,
                resistance_from: 0.15,
                largest_a: 267.0,
                fastest: 1_500.0,
            });
        }
        [error.share(), error.link_scale(), error.scales().torque]
    }

    #[test]
    fn what_a_link_sensor_may_be_off_is_its_own_and_the_rest_the_maps() {
        for (share, link, map) in [
            (0.004, 0.0, 0.0),
            (0.03, 0.025, 0.0),
            (-0.03, -0.025, 0.0),
            (0.1, 0.025, 0.07),
            (-0.1, -0.025, -0.07),
        ] {
            let [told, scale, torque] = used(share);
            assert!((told - share).abs() < 1e-3, "{told} for {share}");
            assert!((scale * (1.0 + link) - 1.0).abs() < 2e-4, "{scale} for {share}");
            assert!((torque - 1.0 - map).abs() < 1e-3, "{torque} for {share}");
        }
        assert_eq!(used(0.004)[1], 1.0, "a good sensor is used as it is");
    }

    #[test]
    fn without_current_the_flux_linkage_alone_is_asked() {
        let told = estimate(0.1, 0.0, Dq::default(), 300.0);
        assert!((told - 0.1).abs() < 1e-3, "{told}");
    }

    #[test]
    fn the_lowest_speed_that_tells_is_its_border() {
        let border = 0.15 * (FROM * 1_500.0);
        for (omega, tells) in [(border, true), (-border, true), (0.999 * border, false)] {
            assert_eq!(estimate(0.1, 0.0, CURRENT, omega) != 0.0, tells, "{omega} rad/s");
        }
    }
}
