//! The difference of machine and link from what they are taken for, and its use.
//!
//! If the machine's flux linkage is ψ + Δψ, with ψ the map's, and its resistance ΔR more than it is taken for, then the voltage jωΔψ + ΔR i is needed that nothing
//! explains. Three unknowns make it up: ε of the whole flux linkage, m of the magnets' along d, and ΔR with what dead time and devices take along the current:
//!
//! Δψ = ε ψ + m, u_d = −ωε ψ_q + ΔR i_d, u_q = ω (ε ψ_d + m) + ΔR i_q
//!
//! At one operating point ε and m make any Δψ, and a voltage has two components: three unknowns are not to be told apart there. A Kalman filter begins with what each is
//! likely to be off by, takes the means of some halves at a time, and remembers what it has seen at other currents and speeds: without a current, which says nothing of
//! the resistance, all the more of the magnets; of a rotor that stands the resistance alone. What nothing tells of stays; what something tells of is less sure after a
//! while of it. ΔR is no one resistance: what devices take grows less than the current, `σ (R + V/√(i² + i₀²)) i` for a standard deviation, with σ the doubt of the resistance.
//!
//! A link that is read too large by ε looks like a machine of which the flux linkage is larger by it, and for the loop both are the same. The torque tells
//! them apart: as much of ε as a link sensor may be off is taken for that, and all volt-seconds are then those of a link of udc/(1 + ε); the larger ε is beyond, the less of it can
//! be the sensor's, and the rest is the machine's. The operating point takes that into account: such a machine needs for a torque the current that the map gives for
//! T/(1 + ΔT/T), and the voltage that it gives on a link of udc/(1 + Δψ/ψ).

use super::{Scales, flux_linkage, torque_nm};
use crate::frames::{Dq, limit_magnitude, sqrt};
use crate::machine::Tables;
use crate::time::Clock;

/// Speed from which a voltage tells something of the flux linkage, as a share of the largest.
const FROM: f32 = 0.015;
/// Halves are averaged for so long, in s: what ripple and sixth harmonic make of them is nothing over some turns.
const BLOCK_S: f32 = 0.025;
/// Standard deviations, before anything is known, of ε, and of m as a share of the magnets' flux linkage.
const SHARE: f32 = 0.1;
const MAGNETS: f32 = 0.15;
/// That of the voltage along a current, beyond the resistance's, over the doubt of the resistance, as a share of the nominal link: half of it is what devices take of a usual
/// inverter, of a small current the less the smaller it is.
const DROP: f32 = 4e-3;
/// Share of the largest current below which that falls with the current, and below which its sign is not known in all phases.
const SMALL: f32 = 0.05;
/// Voltage that a mean holds besides, as shares of the nominal link and of the EMF.
const LINK_NOISE: f32 = 3e-3;
const EMF_NOISE: f32 = 4e-3;
/// EMF over what the dead time may take from which it tells of the flux linkage.
const TELLING: f32 = 6.0;
/// Part of what the dead time may take where the signs of all currents are known, in legs of two gates.
const LEFT_SHARE: f32 = 0.2;
/// Part of what the dead time takes that says nothing.
const UNSAID: f32 = 0.25;
/// Standard deviations of a voltage that is learnt from: an inverter or a link with a fault has more, and is no error of the machine.
const LIKELY: f32 = 1.5;
/// Time of telling in which what was told of each is forgotten, in s: a winding warms in a minute.
const KNOWN_S: [f32; 3] = [30.0, 30.0, 10.0];
/// Error that is the link sensor's: what it may look like.
const LINK: f32 = 0.03;
/// Part of that which is left alone: a sensor without an error is used as it is, bit for bit.
const LEFT_ALONE: f32 = 0.003;
/// Part of the magnets' flux linkage that is left alone, as resistance and dead time may look like it.
const LEFT_TO_MAGNETS: f32 = 0.02;
/// Share of the largest current by which an operating point is another one.
const MOVED: f32 = 0.01;
/// Share of the largest current below which i_q makes no torque that tells.
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

/// The use that is made of the errors.
#[derive(Clone, Copy, Debug)]
struct Use {
    /// Torque and flux linkage over those of the map, as far as they are corrected for.
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
    /// Voltage that it takes of a phase where nobody knows the sign of its current, in V.
    pub voltage_v: f32,
    /// Part of that which is left where the signs of all currents are known and the pulses make up for it, 0 ..= 1.
    pub left_share: f32,
    /// By how much an edge comes late where nobody makes up for it, in s.
    pub time_s: f32,
}

impl DeadTime {
    /// Of legs of two gates: so many ticks in carriers of `carrier_ticks`, on a link of `link_v`.
    #[inline]
    pub fn of(ticks: u32, carrier_ticks: u32, link_v: f32, clock: &Clock) -> Self {
        let (ticks, carrier_ticks) = (ticks as f32, carrier_ticks as f32);
        let voltage_v = link_v * ticks / carrier_ticks;
        Self { voltage_v, left_share: LEFT_SHARE, time_s: ticks / clock.ticks_per_s }
    }
}

/// Everything that a step works on.
pub struct Input<'a> {
    /// Of the operating point, in A.
    pub current: Dq,
    /// In Ω, and its likely error as a share of the rating.
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
    /// Points where the sums began and of the newest use.
    first: Point,
    newest: Point,
    block: Block,
    next: Next,
    /// ε that the volt-seconds have already.
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

    /// By how much the flux linkage is larger than the map's, along itself, as a share.
    pub fn share(&self) -> f32 {
        self.used.share
    }

    /// Torque and flux linkage over those of the map, as far as they are corrected for.
    pub fn scales(&self) -> Scales {
        self.used.scales
    }

    /// The link's voltage over what its sensor reads, as far as it is known: 1/(1 + ε), within 3e-5, of what ε may be the sensor's.
    pub fn link_scale(&self) -> f32 {
        self.used.link_scale
    }

    /// Flux linkage, in Wb, that the machine has beyond one by the map, as far as it is corrected for.
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

    /// Volt-seconds are those of a link of so many times what is read.
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

    /// A part of what there is to be done, of which each takes one call: use for the present current, and of each block either component. Call where there is time.
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

    /// Makes means of the sums and begins anew.
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

    /// Voltage that is needed beyond EMF and drop on the link that is read, in V, where on the scaled one so much is.
    fn needed(&self, voltage_v: f32, emf_v: f32, drop_v: f32) -> f32 {
        (voltage_v + self.explained * (emf_v + drop_v)) / (1.0 - self.explained)
    }

    /// Likely voltage along the current, over it.
    fn drop_ohm(&self, input: &Input) -> f32 {
        let ratings = &input.tables.ratings;
        let small_a = SMALL * ratings.max_current_a;
        let likely_a = sqrt(self.block.current.squared() + small_a * small_a);
        input.resistance_doubt * (ratings.stator_resistance_ohm + DROP * ratings.dc_link_nominal_v / likely_a)
    }

    /// Voltage that the dead time may take, in V: less the larger the current, as its sign is then known.
    fn dead_v(&self, input: &Input) -> f32 {
        let small_a = SMALL * input.tables.ratings.max_current_a;
        let (small, large) = (small_a * small_a, self.block.current.squared());
        let unsure = (small + input.dead.left_share * large) / (small + large);
        input.dead.voltage_v * unsure
    }

    /// A component of the voltage that is needed, in V, with what each unknown makes of it.
    #[inline(never)]
    fn observe(&mut self, voltage_v: f32, row: Unknown, input: &Input) {
        let ratings = &input.tables.ratings;
        let link_v = LINK_NOISE * ratings.dc_link_nominal_v;
        let (dead_v, emf_square) = (self.dead_v(input), self.block.emf.squared());
        let noise = link_v * link_v + dead_v * dead_v + (EMF_NOISE * EMF_NOISE) * emf_square;
        let [.., drop] = row;
        // Where the dead time may take much of the EMF that says nothing of the flux linkage: what is known of it stays.
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
        // What the dead time explains says nothing, and what is hardly likely no more than what is.
        let missing = missing - limit_magnitude(missing, UNSAID * dead_v);
        let missing = limit_magnitude(missing, LIKELY * sqrt(variance)) * per;
        // Of each component half.
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

    /// The use of what is known, with a current.
    fn make_use(&mut self, input: &Input) {
        let Input { current, tables, .. } = *input;
        let ratings = &tables.ratings;
        let flux = flux_linkage(tables, current);
        self.newest = Point { current, flux };
        if self.sums.time_s == 0.0 {
            self.first = self.newest;
        }
        // What a weber of the magnets makes of torque and flux linkage, as shares.
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

/// The number within what may be corrected, or 0 for what is none, as of a machine without magnets.
fn held(share: f32) -> f32 {
    if share.is_finite() { limit_magnitude(share, MOST) } else { 0.0 }
}

/// The part of an error that is another's, who may be off by so much at most: all of it up to there, none of it from twice as much on.
fn within(share: f32, most: f32) -> f32 {
    let less = 2.0 * most - share.abs();
    if less > 0.0 { limit_magnitude(share, less) } else { 0.0 }
}

fn dot(a: Unknown, b: Unknown) -> f32 {
    let ([a0, a1, a2], [b0, b1, b2]) = (a, b);
    let flux = a0 * b0 + a1 * b1;
    flux + a2 * b2
}
