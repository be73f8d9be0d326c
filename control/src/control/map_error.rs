//! What machine and link differ by from what they are taken for, and its use.
//!
//! If the machine's flux linkage is ψ + Δψ, with ψ the map's, and its resistance, with what dead time and devices take along the current, ΔR more than it is taken for,
//! then u = −jωΔψ − ΔR i stays unexplained. Four things make it up: all of the flux linkage or the link's sensor by ε, iron across the magnets by κ, magnets by m:
//!
//! Δψ = εψ + (m, κψ_q), u_d = ωψ_q (ε + κ) − ΔR i_d, u_q = −ω (εψ_d + m) − ΔR i_q
//!
//! These are four unknowns of two components: a Kalman filter begins with what each is likely to be off by, takes one component at a time, and remembers what it has seen at
//! other currents and speeds, which is what tells the four apart. What it was told it forgets within half a minute of others' being told, never by itself.
//!
//! A link that is read too large by ε and a machine of which the flux linkage is larger by it are one and the same for the loop: all volt-seconds are then those of a link of
//! udc/(1 + ε). The torque tells them apart: as much of ε as a link sensor may be off is taken for that, and the larger it is beyond, the less of it can be the sensor's. What is
//! left is the machine's, and the operating point takes it into account: it needs for a torque the current that the map gives for T/(1 + ΔT/T), and the voltage that it gives on a
//! link of udc/(1 + Δψ/ψ). What [`super::Warmth`] explains of it is taken into account whole, for torque and flux linkage each by its own amount, and only the rest is an error.

use super::{Scales, flux_linkage, torque_nm};
use crate::frames::{Dq, limit_magnitude};
use crate::machine::{Ratings, Tables};

/// Speed from which the voltage tells something of the flux linkage, as a share of the largest.
const FROM: f32 = 0.015;
/// Standard deviations, before anything is known, of ε, of κ, and of m as a share of the magnets' flux linkage. That of ΔR is a gain.
const SHARE: f32 = 0.1;
const ACROSS: f32 = 0.05;
const MAGNETS: f32 = 0.17;
/// What else a voltage holds: the EMF of this share of the flux linkage, this share of the nominal link, and where next to no current flows, whose sign says what dead time takes,
/// this one; and the share of the largest current that is next to none.
const EMF_NOISE: f32 = 0.02;
const LINK_NOISE: f32 = 0.13e-3;
const DEAD_TIME_NOISE: f32 = 2e-3;
const NONE: f32 = 0.05;
/// Time in which that stays as it is, and time in which what is known is forgotten, in s.
const ALIKE_S: f32 = 0.2;
const KNOWN_S: f32 = 30.0;
/// Largest ΔT/T that is all the link sensor's, if ε is; of twice as much none is.
const LINK: f32 = 0.035;
/// ε that is left alone: a sensor and a machine without an error are used as they are, bit for bit.
const LEFT_ALONE: f32 = 0.005;
/// Share of torque, and of flux linkage, of magnets and iron that is left alone: what resistance and dead time may look like.
const LEFT_TO_MACHINE: f32 = 0.02;
/// Largest correction.
const MOST: f32 = 0.25;
/// Share of the largest torque next to which less and less of ΔT/T counts, so that torque keeps its sign.
const LEAST_TORQUE: f32 = 0.02;

/// The unexplained voltage, and the operating point.
pub struct Input<'a> {
    /// The unexplained voltage: mean, in V.
    pub disturbance: Dq,
    /// Current that is aimed at, in A.
    pub current: Dq,
    /// Electrical angular speed, in rad/s.
    pub omega: f32,
    /// Resistance that it is taken for, in Ω.
    pub resistance: f32,
    /// Standard deviation of ΔR, as a share of the rated one.
    pub resistance_doubt: f32,
    pub tables: &'a Tables,
}

const NOTHING: Dq = Dq { d: 0.0, q: 0.0 };

/// What is unknown, each over its standard deviation: ε, κ, m, ΔR.
type Unknown = [f32; 4];

/// The part of an explanation that is next.
#[derive(Clone, Copy, Debug)]
enum Next {
    AlongD,
    AlongQ,
    Scales,
}

#[derive(Clone, Copy, Debug)]
pub struct MapError {
    mean: Unknown,
    covariance: [Unknown; 4],
    next: Next,
    /// EMF by the map in V, current in A and electrical speed in rad/s, followed as the unexplained voltage is.
    emf: Dq,
    current: Dq,
    omega: f32,
    /// ε that the newest volt-seconds have already, the same followed likewise, and the time between two operating points, in s.
    newest: f32,
    explained: f32,
    period_s: f32,
    /// Of a warm machine, as far as its temperatures are known: what they explain is no error. And the magnets' part of it.
    warm: Scales,
    warm_magnets: f32,
    /// Reported, without bounds: Δψ along ψ over ψ, torque over the map's.
    share: f32,
    known_torque: f32,
    /// Made where they change, since they are wanted far more often.
    believed: Scales,
    link_scale: f32,
}

impl MapError {
    pub const fn new() -> Self {
        Self {
            mean: [0.0; 4],
            covariance: [
                [1.0, 0.0, 0.0, 0.0],
                [0.0, 1.0, 0.0, 0.0],
                [0.0, 0.0, 1.0, 0.0],
                [0.0, 0.0, 0.0, 1.0],
            ],
            next: Next::AlongD,
            emf: NOTHING,
            current: NOTHING,
            omega: 0.0,
            newest: 0.0,
            explained: 0.0,
            period_s: 0.0,
            warm: Scales::NONE,
            warm_magnets: 0.0,
            share: 0.0,
            known_torque: 1.0,
            believed: Scales::NONE,
            link_scale: 1.0,
        }
    }

    /// By how much the flux linkage is larger, along itself, as far as it is known.
    pub fn share(&self) -> f32 {
        self.share
    }

    /// Torque and flux linkage over those of the map, as far as it is believed or known by temperatures.
    pub fn scales(&self) -> Scales {
        self.believed
    }

    /// The link's voltage over what its sensor reads, as far as the loop is concerned: 1/(1 + ε).
    pub fn link_scale(&self) -> f32 {
        self.link_scale
    }

    /// Torque over that of the map, as far as it is known.
    pub fn known_torque_scale(&self) -> f32 {
        self.known_torque
    }

    /// Knowledge by temperatures: torque and flux linkage, the magnets' flux linkage over the map's, less 1, and the new part of the resistance, over its standard deviation: what
    /// was an error until now is none.
    pub fn warm(&mut self, warm: Scales, magnets: f32, resistance: f32) {
        let [_, _, wb, ohm] = &mut self.mean;
        *wb -= (magnets - self.warm_magnets) * (1.0 / MAGNETS);
        *ohm -= resistance;
        (self.warm, self.warm_magnets) = (warm, magnets);
    }

    /// A new operating point, so long after the last one, in s, with volt-seconds that have this ε already.
    #[inline(always)]
    pub fn aim(&mut self, explained: f32, period_s: f32) {
        (self.newest, self.period_s) = (explained, period_s);
    }

    /// A carrier half whose voltage has become a share of the disturbance, with its flux linkage by the map in Wb, its current in A and its electrical speed in rad/s.
    #[inline(always)]
    pub fn see(&mut self, flux: Dq, current: Dq, omega: f32, share: f32) {
        self.emf = self.emf + (flux * omega - self.emf) * share;
        self.current = self.current + (current - self.current) * share;
        self.omega += (omega - self.omega) * share;
        self.explained += (self.newest - self.explained) * share;
    }

    /// A disturbance that was set to what is believed of a flux linkage in Wb at an electrical speed in rad/s; at 0 to nothing.
    pub fn begin(&mut self, flux: Dq, omega: f32) {
        (self.emf, self.current, self.omega, self.explained) = (flux * omega, NOTHING, omega, self.newest);
    }

    /// What a flux linkage by the map, in Wb, is believed to have more in the machine, as a link that is scaled sees it.
    pub fn more_wb(&self, flux: Dq, ratings: &Ratings) -> Dq {
        if self.believed == Scales::NONE {
            return Dq::default();
        }
        let [across, wb] = self.machine(ratings);
        Dq { d: wb + self.warm_magnets * ratings.magnet_flux_wb, q: across * flux.q } * self.link_scale
    }

    /// κ, and in Wb m without what the temperatures explain.
    fn machine(&self, ratings: &Ratings) -> [f32; 2] {
        let [_, across, magnets, _] = self.mean;
        [across * ACROSS, magnets * MAGNETS * ratings.magnet_flux_wb]
    }

    /// A third of what a disturbance tells; call once a control period where there is time.
    #[inline(never)]
    pub fn step(&mut self, input: &Input) {
        let Input { disturbance, current, omega, resistance, resistance_doubt, tables } = *input;
        let ratings = &tables.ratings;
        let is_slow = omega.abs() < FROM * (ratings.max_speed_rad_s * ratings.pole_pairs);
        let (emf, magnets) = (self.emf, self.omega * ratings.magnet_flux_wb);
        let ohm = resistance_doubt * ratings.stator_resistance_ohm;
        // On the link that is read.
        let known = (emf.j() + self.current * resistance) * self.explained;
        let unexplained = (disturbance - known) * (1.0 / (1.0 - self.explained));
        match if is_slow { Next::Scales } else { self.next } {
            Next::AlongD => {
                let row = [emf.q * SHARE, emf.q * ACROSS, 0.0, -ohm * self.current.d];
                self.observe(unexplained.d, row, ratings);
                self.next = Next::AlongQ;
            }
            Next::AlongQ => {
                let row = [-emf.d * SHARE, 0.0, -MAGNETS * magnets, -ohm * self.current.q];
                self.observe(unexplained.q + magnets * self.warm_magnets, row, ratings);
                self.next = Next::Scales;
            }
            Next::Scales => {
                self.believe(current, tables);
                self.next = Next::AlongD;
            }
        }
    }

    /// A component of the unexplained voltage in V, with what each unknown makes of it.
    #[inline(always)]
    fn observe(&mut self, voltage_v: f32, row: Unknown, ratings: &Ratings) {
        let (link_v, none_a) = (ratings.dc_link_nominal_v, NONE * ratings.max_current_a);
        let none = none_a * none_a / (none_a * none_a + self.current.squared());
        let squared = link_v * link_v * (LINK_NOISE * LINK_NOISE + DEAD_TIME_NOISE * DEAD_TIME_NOISE * none);
        let noise = (EMF_NOISE * EMF_NOISE * self.emf.squared() + squared) * (ALIKE_S / self.period_s);
        let forgotten = self.period_s * (1.0 / KNOWN_S);
        let gain = self.covariance.map(|line| dot(line, row));
        let per = 1.0 / (dot(gain, row) + noise);
        let missing = (voltage_v - dot(self.mean, row)) * per;
        for (mean, gain) in self.mean.iter_mut().zip(gain) {
            *mean += gain * missing;
        }
        for (number, (line, along)) in self.covariance.iter_mut().zip(gain).enumerate() {
            let less = along * per;
            for (across, (entry, gain)) in line.iter_mut().zip(gain).enumerate() {
                let first = if across == number { forgotten } else { 0.0 };
                *entry = (*entry - less * gain) * (1.0 - forgotten) + first;
            }
        }
    }

    /// The use of what is known.
    fn believe(&mut self, current: Dq, tables: &Tables) {
        let (ratings, flux) = (&tables.ratings, flux_linkage(tables, current));
        let [across, wb] = self.machine(ratings);
        let (map_nm, least_nm) = (torque_nm(tables, flux, current), LEAST_TORQUE * ratings.max_torque_nm);
        let more_nm = torque_nm(tables, Dq { d: wb, q: across * flux.q }, current);
        let turning = more_nm * map_nm / (map_nm * map_nm + least_nm * least_nm);
        let per = 1.0 / flux.squared();
        let along = |wb: f32| (wb * flux.d + across * flux.q * flux.q) * per;
        let [share, ..] = self.mean;
        let share = share * SHARE;
        self.share = finite(share + along(wb + self.warm_magnets * ratings.magnet_flux_wb));
        self.known_torque = (1.0 + held(share + turning)) * self.warm.torque;
        let (more, flux_more) = (share + turning, along(wb));
        let others =
            limit_magnitude(within(more, LINK), share.abs() + within(turning, LEFT_TO_MACHINE).abs());
        let whole = 1.0 + held(share - limit_magnitude(share, LEFT_ALONE));
        self.link_scale = 1.0 / whole;
        self.believed = Scales {
            torque: (1.0 + held(more - others)) * self.warm.torque,
            flux: (whole + held(flux_more - within(flux_more, LEFT_TO_MACHINE))) * self.warm.flux,
        };
    }
}

/// The part of an error that is another's, who may be off by so much at most: all of it up to there, none of it from twice as much on.
fn within(share: f32, most: f32) -> f32 {
    let less = 2.0 * most - share.abs();
    if less > 0.0 { limit_magnitude(share, less) } else { 0.0 }
}

/// The number, or 0 for what is none.
fn finite(share: f32) -> f32 {
    if share.is_finite() { share } else { 0.0 }
}

fn held(share: f32) -> f32 {
    limit_magnitude(finite(share), MOST)
}

fn dot(a: Unknown, b: Unknown) -> f32 {
    let [a0, a1, a2, a3] = a;
    let [b0, b1, b2, b3] = b;
    a0 * b0 + a1 * b1 + a2 * b2 + a3 * b3
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_is_anothers_up_to_what_he_may_be_off_and_never_from_twice_that_on() {
        for (share, part) in [(0.0, 0.0), (0.02, 0.02), (0.03, 0.03), (0.04, 0.02), (0.06, 0.0), (0.2, 0.0)] {
            assert!(
                (within(share, 0.03) - part).abs() < 1e-6 && within(-share, 0.03) == -within(share, 0.03)
            );
        }
    }
}
