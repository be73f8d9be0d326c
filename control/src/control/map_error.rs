//! The difference of machine and link from what they are assumed to be, and its use.
//!
//! If the machine's flux linkage is ψ + Δψ, with ψ the map's, and its resistance exceeds the assumed one by ΔR, then a voltage jωΔψ + ΔR i is needed that
//! nothing explains. That voltage has three unknowns: ε of the whole flux linkage, m of the magnets' along d, and ΔR with what dead time and devices take
//! along the current:
//!
//! Δψ = ε ψ + m, u_d = −ωε ψ_q + ΔR i_d, u_q = ω (ε ψ_d + m) + ΔR i_q
//!
//! At one operating point ε and m make any Δψ, and a voltage has two components, so the three unknowns cannot be told apart there. A Kalman filter begins with
//! the likely error of each, takes the means of some halves at a time, and remembers what it has seen at other currents and speeds: without a current, which
//! says nothing of the resistance, all the more of the magnets; with a rotor that stands, the resistance alone. An unknown that nothing shows stays; one that
//! something shows is less sure after a while of it. ΔR is no single resistance: the devices' drop grows less than the current, `σ (R + V/√(i² + i₀²)) i` for
//! a standard deviation, with σ the doubt of the resistance.
//!
//! A link that is read too large by ε looks like a machine whose flux linkage is larger by ε, and for the loop both are the same. The torque tells them apart.
//! As much of ε as a link sensor may be off counts as its error, and all volt-seconds are then those of a link of udc/(1 + ε); the larger ε is beyond, the
//! less of it can be the sensor's, and the rest is the machine's. The operating point takes that into account: for a torque such a machine needs the current
//! that the map gives for T/(1 + ΔT/T), and the voltage that it gives on a link of udc/(1 + Δψ/ψ).

use super::{Scales, flux_linkage, torque_nm};
use crate::frames::{Dq, limit_magnitude, sqrt};
use crate::machine::Tables;
use crate::time::Clock;

/// Speed from which a voltage shows something of the flux linkage, as a share of the largest.
const FROM: f32 = 0.015;
/// Time over which halves are averaged, in s: the effect of ripple and sixth harmonic on them is nothing over some turns.
const BLOCK_S: f32 = 0.025;
/// Standard deviations of ε, and of m as a share of the magnets' flux linkage, before anything is known.
const SHARE: f32 = 0.1;
const MAGNETS: f32 = 0.15;
/// Standard deviation of the voltage along a current, beyond the resistance's, over the doubt of the resistance, as a share of the nominal link: half of it is
/// what devices of a usual inverter take; for a small current it is the less the smaller the current.
const DROP: f32 = 4e-3;
/// Share of the largest current below which that falls with the current, and below which its sign is not known in all phases.
const SMALL: f32 = 0.05;
/// Other voltage contained in a mean, as shares of the nominal link and of the EMF.
const LINK_NOISE: f32 = 3e-3;
const EMF_NOISE: f32 = 4e-3;
/// EMF over the voltage that the dead time may take, from which the EMF shows the flux linkage.
const TELLING: f32 = 6.0;
/// Part of the voltage that the dead time may take if the signs of all currents are known, in legs of two gates.
const LEFT_SHARE: f32 = 0.2;
/// Part of the dead time's voltage that says nothing.
const UNSAID: f32 = 0.25;
/// Most standard deviations of a voltage that are learnt from: an inverter or a link with a fault has more, which is no error of the machine.
const LIKELY: f32 = 1.5;
/// Time of observation in which knowledge of each is forgotten, in s: a winding warms in a minute.
const KNOWN_S: [f32; 3] = [30.0, 30.0, 10.0];
/// Error that is the link sensor's: what it may look like.
const LINK: f32 = 0.03;
/// Share of the flux linkage that counts rather as the link's, over the covariance by which it may be the magnets' just as well: 0.46 before a current has flowed. By their
/// likely errors alone, two thirds of a link error of 3 % counted as magnets, and the first step of torque settled within 2 % after 9 ms instead of 2.4.
const RATHER: f32 = 0.05;
/// Part of that which is left alone: a sensor without an error is used as it is, bit for bit.
const LEFT_ALONE: f32 = 0.003;
/// Part of the magnets' flux linkage that is left alone, as resistance and dead time may look like it.
const LEFT_TO_MAGNETS: f32 = 0.02;
/// Share of the largest current by which an operating point counts as another one.
const MOVED: f32 = 0.01;
/// Share of the largest current below which i_q makes too little torque to tell.
const LITTLE: f32 = 1e-3;
/// Largest correction.
const MOST: f32 = 0.25;

/// ε, m and ΔR, each over its standard deviation before anything is known; or the volts that such a deviation of each makes.
type Unknown = [f32; 3];

const NOTHING: Dq = Dq { d: 0.0, q: 0.0 };

/// Sums over some halves.
#[derive(Clone, Copy, Debug)]
struct Sums {
    /// Unexplained volt-seconds, in V·s.
    voltage: Dq,
    /// Electrical turn, in rad.
    turn_rad: f32,
    /// In s.
    time_s: f32,
}

impl Sums {
    const NONE: Self = Self { voltage: NOTHING, turn_rad: 0.0, time_s: 0.0 };
}

/// Means over some halves.
#[derive(Clone, Copy, Debug)]
struct Block {
    /// Unexplained, in V.
    voltage: Dq,
    /// By the map, in Wb, times the electrical angular speed.
    emf: Dq,
    /// In A.
    current: Dq,
    /// Electrical angular speed, in rad/s.
    omega: f32,
    /// In s.
    time_s: f32,
}

impl Block {
    const NONE: Self = Self { voltage: NOTHING, emf: NOTHING, current: NOTHING, omega: 0.0, time_s: 0.0 };
}

/// The operating point of the newest use: current in A, flux linkage by the map in Wb.
#[derive(Clone, Copy, Debug)]
struct Point {
    current: Dq,
    flux: Dq,
}

impl Point {
    const NONE: Self = Self { current: NOTHING, flux: NOTHING };
}

/// The work of the next call.
#[derive(Clone, Copy, Debug)]
enum Next {
    Rest,
    Use,
    AlongD,
    AlongQ,
}

/// The use of the known errors.
#[derive(Clone, Copy, Debug)]
struct Use {
    /// Torque and flux linkage over those of the map, as far as they are corrected.
    scales: Scales,
    /// ε and m of them, m in Wb.
    whole: f32,
    magnets_wb: f32,
    /// Flux linkage, along itself, over that of the map, less 1, as far as it is known.
    share: f32,
    link_scale: f32,
}

/// A carrier half that has passed.
pub struct Half {
    /// Voltage that nothing explains: flux linkage rises by it although nobody asked, in V.
    pub unexplained: Dq,
    /// Electrical angular speed, in rad/s.
    pub omega: f32,
    /// In s.
    pub length_s: f32,
}

/// The inverter's dead time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeadTime {
    /// Voltage that it takes from a phase whose current has an unknown sign, in V.
    pub voltage_v: f32,
    /// Part of that which is left if the signs of all currents are known and the pulses compensate for it, 0 ..= 1.
    pub left_share: f32,
    /// Delay of an edge that nobody compensates for, in s.
    pub time_s: f32,
}

impl DeadTime {
    /// The dead time of legs of two gates: so many ticks in carriers of `carrier_ticks`, on a link of `link_v`.
    #[inline]
    pub fn of(ticks: u32, carrier_ticks: u32, link_v: f32, clock: &Clock) -> Self {
        let (ticks, carrier_ticks) = (ticks as f32, carrier_ticks as f32);
        let voltage_v = link_v * ticks / carrier_ticks;
        Self { voltage_v, left_share: LEFT_SHARE, time_s: ticks / clock.ticks_per_s }
    }
}

/// The inputs of a step.
pub struct Input<'a> {
    /// Current of the operating point, in A.
    pub current: Dq,
    /// Resistance in Ω, and its likely error as a share of the rating.
    pub resistance: f32,
    pub resistance_doubt: f32,
    pub dead: DeadTime,
    pub tables: &'a Tables,
}

/// The errors that are known, and how well.
#[derive(Clone, Copy, Debug)]
pub struct MapError {
    mean: Unknown,
    covariance: [Unknown; 3],
    sums: Sums,
    /// Points of the sums' beginning and of the newest use.
    first: Point,
    newest: Point,
    block: Block,
    next: Next,
    /// ε that the volt-seconds already contain.
    explained: f32,
    used: Use,
}

impl MapError {
    pub const fn new() -> Self {
        Self {
            mean: [0.0; 3],
            covariance: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            sums: Sums::NONE,
            first: Point::NONE,
            newest: Point::NONE,
            block: Block::NONE,
            next: Next::Use,
            explained: 0.0,
            used: Use { scales: Scales::NONE, whole: 0.0, magnets_wb: 0.0, share: 0.0, link_scale: 1.0 },
        }
    }

    /// Excess of the flux linkage over the map's, along itself, as a share.
    pub fn share(&self) -> f32 {
        self.used.share
    }

    /// Torque and flux linkage over those of the map, as far as they are corrected.
    pub fn scales(&self) -> Scales {
        self.used.scales
    }

    /// The link's voltage over its sensor's reading, as far as it is known: 1/(1 + ε), within 3e-5, for the part of ε that may be the sensor's.
    pub fn link_scale(&self) -> f32 {
        self.used.link_scale
    }

    /// Excess of the machine's flux linkage, in Wb, over one by the map, as far as it is corrected for.
    pub fn more_wb(&self, flux: Dq) -> Dq {
        let Use { whole, magnets_wb, .. } = self.used;
        Dq { d: flux.d * whole + magnets_wb, q: flux.q * whole }
    }

    /// Begins anew with the next half; what is known stays, and no current flows.
    pub fn pause(&mut self) {
        (self.sums, self.next) = (Sums::NONE, Next::Use);
        let [share, magnets, _] = self.mean;
        self.used.share = share * SHARE + magnets * MAGNETS;
    }

    /// Notes that volt-seconds are those of a link of so many times the reading.
    #[inline(always)]
    pub fn scaled(&mut self, link_scale: f32) {
        self.explained = 1.0 - link_scale;
    }

    /// Takes a half.
    #[inline(always)]
    pub fn see(&mut self, half: &Half) {
        let Half { unexplained, omega, length_s } = *half;
        self.sums.voltage = self.sums.voltage + unexplained * length_s;
        self.sums.turn_rad += omega * length_s;
        self.sums.time_s += length_s;
    }

    /// One part of the work, each of which takes one call: the use for the present current, and either component of each block. Call when there is time.
    #[inline(always)]
    pub fn step(&mut self, input: &Input) {
        let moved = (input.current - self.newest.current).squared();
        let little_a = MOVED * input.tables.ratings.max_current_a;
        if matches!(self.next, Next::Rest) && moved > little_a * little_a {
            self.next = Next::Use;
        }
        if !matches!(self.next, Next::Rest) || self.sums.time_s >= BLOCK_S {
            self.go_on(input);
        }
    }

    #[inline(never)]
    fn go_on(&mut self, input: &Input) {
        self.next = match self.next {
            Next::Rest => {
                self.close_block();
                Next::AlongD
            }
            Next::Use => {
                self.make_use(input);
                Next::Rest
            }
            Next::AlongD => {
                let Block { voltage, emf, current, .. } = self.block;
                let needed = self.needed(-voltage.d, -emf.q, current.d * input.resistance);
                let row = [-emf.q * SHARE, 0.0, current.d * self.drop_ohm(input)];
                self.observe(needed, row, input);
                Next::AlongQ
            }
            Next::AlongQ => {
                let Block { voltage, emf, current, omega, .. } = self.block;
                let magnets_v = omega * input.tables.ratings.magnet_flux_wb;
                let needed = self.needed(-voltage.q, emf.d, current.q * input.resistance);
                let row = [emf.d * SHARE, magnets_v * MAGNETS, current.q * self.drop_ohm(input)];
                self.observe(needed, row, input);
                Next::Use
            }
        };
    }

    /// Turns the sums into means and begins anew.
    fn close_block(&mut self) {
        let (sums, first, last) = (self.sums, self.first, self.newest);
        (self.sums, self.first) = (Sums::NONE, last);
        let per_s = 1.0 / sums.time_s;
        let omega = sums.turn_rad * per_s;
        self.block = Block {
            voltage: sums.voltage * per_s,
            // A demand moves along a straight line.
            emf: (first.flux + last.flux) * (0.5 * omega),
            current: (first.current + last.current) * 0.5,
            omega,
            time_s: sums.time_s,
        };
    }

    /// Voltage needed beyond EMF and drop on the link as read, in V, for this much on the scaled one.
    fn needed(&self, voltage_v: f32, emf_v: f32, drop_v: f32) -> f32 {
        (voltage_v + self.explained * (emf_v + drop_v)) / (1.0 - self.explained)
    }

    /// Likely voltage along the current, over the current.
    fn drop_ohm(&self, input: &Input) -> f32 {
        let ratings = &input.tables.ratings;
        let small_a = SMALL * ratings.max_current_a;
        let likely_a = sqrt(self.block.current.squared() + small_a * small_a);
        input.resistance_doubt * (ratings.stator_resistance_ohm + DROP * ratings.dc_link_nominal_v / likely_a)
    }

    /// Voltage that the dead time may take, in V: the larger the current the less, as its sign is then known.
    fn dead_v(&self, input: &Input) -> f32 {
        let small_a = SMALL * input.tables.ratings.max_current_a;
        let (small, large) = (small_a * small_a, self.block.current.squared());
        let unsure = (small + input.dead.left_share * large) / (small + large);
        input.dead.voltage_v * unsure
    }

    /// Takes a component of the needed voltage, in V, with the contribution of each unknown to it.
    #[inline(never)]
    fn observe(&mut self, voltage_v: f32, row: Unknown, input: &Input) {
        let ratings = &input.tables.ratings;
        let link_v = LINK_NOISE * ratings.dc_link_nominal_v;
        let (dead_v, emf_square) = (self.dead_v(input), self.block.emf.squared());
        let noise = link_v * link_v + dead_v * dead_v + (EMF_NOISE * EMF_NOISE) * emf_square;
        let [.., drop] = row;
        // If the dead time may take much of the EMF, that says nothing of the flux linkage: what is known of it stays.
        let slow = FROM * (ratings.max_speed_rad_s * ratings.pole_pairs);
        let tells = emf_square > (TELLING * TELLING) * (dead_v * dead_v) && self.block.omega.abs() >= slow;
        let told = if tells { row } else { [0.0, 0.0, drop] };
        let gain = self.covariance.map(|line| dot(line, told));
        let variance = dot(gain, told) + noise;
        let per = 1.0 / variance;
        let missing = voltage_v - dot(self.mean, row);
        if !missing.is_finite() {
            return;
        }
        // The part that the dead time explains says nothing, and an unlikely value says no more than a likely one.
        let missing = missing - limit_magnitude(missing, UNSAID * dead_v);
        let missing = limit_magnitude(missing, LIKELY * sqrt(variance)) * per;
        // Half for each component.
        let passed_s = 0.5 * self.block.time_s;
        let lost = told.map(|tells| if tells == 0.0 { 0.0 } else { passed_s });
        let [share, magnets, drop] = lost;
        let lost = [share * (1.0 / KNOWN_S[0]), magnets * (1.0 / KNOWN_S[1]), drop * (1.0 / KNOWN_S[2])];
        for (number, ((line, along), mine)) in self.covariance.iter_mut().zip(gain).zip(lost).enumerate() {
            for (across, ((entry, gain), others)) in line.iter_mut().zip(gain).zip(lost).enumerate() {
                let first = if across == number { mine } else { 0.0 };
                *entry = (*entry - along * per * gain) * (1.0 - 0.5 * (mine + others)) + first;
            }
        }
        for (mean, gain) in self.mean.iter_mut().zip(gain) {
            *mean += gain * missing;
        }
    }

    /// Uses what is known at a current.
    fn make_use(&mut self, input: &Input) {
        let Input { current, tables, .. } = *input;
        let ratings = &tables.ratings;
        let flux = flux_linkage(tables, current);
        self.newest = Point { current, flux };
        if self.sums.time_s == 0.0 {
            self.first = self.newest;
        }
        // The effect of a weber of the magnets on torque and flux linkage, as shares.
        let per_wb = Scales {
            torque: if current.q.abs() < LITTLE * ratings.max_current_a {
                1.0 / ratings.magnet_flux_wb
            } else {
                (1.5 * ratings.pole_pairs) * current.q / torque_nm(tables, flux, current)
            },
            flux: flux.d / flux.squared(),
        };
        let [share, magnets, _] = self.mean;
        let (share, magnets) = (share * SHARE, magnets * MAGNETS);
        // Where ε and m cannot be told apart, as much of their sum as the link sensor may be off by is rather the link's, and a larger sum rather the magnets' alone.
        let [[_, against, _], ..] = self.covariance;
        let unsure = if against < 0.0 { -RATHER * against } else { 0.0 };
        let links_rather = limit_magnitude(within(share + magnets, LINK) - share, unsure);
        let (share, magnets) = (share + links_rather, magnets - links_rather);
        let links = within(share, LINK);
        let late = self.block.omega.abs() * input.dead.time_s;
        let error = links - within(links, LEFT_ALONE + late);
        let corrected = limit_magnitude(share - links, MOST);
        let known_wb = magnets * ratings.magnet_flux_wb;
        let corrected_wb = known_wb - within(magnets, LEFT_TO_MAGNETS) * ratings.magnet_flux_wb;
        self.used = Use {
            scales: Scales {
                torque: 1.0 + corrected + held(corrected_wb * per_wb.torque),
                flux: 1.0 + corrected + held(corrected_wb * per_wb.flux),
            },
            whole: corrected,
            magnets_wb: corrected_wb,
            share: share + held(known_wb * per_wb.flux),
            link_scale: 1.0 - error + error * error,
        };
    }
}

/// The number within the limit of correction, or 0 if it is not finite, as for a machine without magnets.
fn held(share: f32) -> f32 {
    if share.is_finite() { limit_magnitude(share, MOST) } else { 0.0 }
}

/// The part of an error that is another's, which may be off by so much at most: all of it up to there, none of it from twice as much on.
fn within(share: f32, most: f32) -> f32 {
    let less = 2.0 * most - share.abs();
    if less > 0.0 { limit_magnitude(share, less) } else { 0.0 }
}

fn dot(a: Unknown, b: Unknown) -> f32 {
    let ([a0, a1, a2], [b0, b1, b2]) = (a, b);
    let flux = a0 * b0 + a1 * b1;
    flux + a2 * b2
}
