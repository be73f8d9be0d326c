//! Alternating pulses within a bound of current, under which a free rotor swings and stays where it is.

use super::course::Seen;
use super::inductance::Inductance;
use crate::frames::{Dq, limit};
use crate::machine::Ratings;

/// The region that the current may move in, and the axis that pulses move it along.
pub struct Region<'a> {
    /// Pulses along q, or else along d.
    pub along_q: bool,
    /// The current at which an axis without pulses is held, in A.
    pub held: Dq,
    /// Largest current, in A.
    pub bound_a: f32,
    /// The most volt-seconds of a command, in V·s.
    pub reach: f32,
    /// The machine's ratings.
    pub ratings: &'a Ratings,
}

/// The pulses' state.
#[derive(Clone, Copy, Debug)]
pub struct Pulses {
    /// Directions of the pulses.
    d: f32,
    q: f32,
    /// Turn of the rotor since the experiment began, electrical, in rad; and its speed, in rad/s.
    turned_rad: f32,
    omega: f32,
    /// Length of a half, in s.
    length_s: f32,
    /// Share of the bound that the next pulse may reach, and the one that the current has reached.
    share: f32,
    within: f32,
    /// The change along q made by the newest half on the way outward, over the expected one, from 1.
    further: f32,
}

/// Change of current of a command, as a share of the bound: along d alone, along q, and along d beside q.
const D_SHARE: f32 = 0.06;
const Q_SHARE: f32 = 0.058;
const SLOW_SHARE: f32 = 0.017;
/// Share of the volt-seconds that d takes at most.
const D_REACH: f32 = 0.7;
/// Share of the way to the held current of an axis without pulses that one command covers.
const HELD_SHARE: f32 = 0.4;
/// Part of their share of the bound that the boundaries' currents keep to: between them there is ripple. Increase of the share with each command:
/// outward step by step, so that each step is known from the one before it. Decrease of the share over the current seen beyond it
/// and beyond the tolerance: if iron saturates much, the next pulse may go further.
const KEPT_SHARE: f32 = 0.964;
const WIDENING: f32 = 0.003;
const OVER_GAIN: f32 = 8.0;
const TOLERATED_SHARE: f32 = 0.02;
/// Share of the bound within which a change of current is too coarse to tell: the least that this leaves.
const FAR_SHARE: f32 = 0.6;
/// The change along q that a command may make if the iron saturates as the current goes outward, over the intended one.
const OUTWARD: f32 = 1.7;
/// Largest change in a half on the way outward, over the expected one, that is believed.
const FURTHEST: f32 = 2.0;
/// Largest current along +d, as a share of the bound.
const POSITIVE_SHARE: f32 = 0.2;
/// Turn, mechanical, at which the side that makes it is given no more, in rad; and the time over which the speed counts: so many halves, for the
/// pulse under way, and a time in s that damps the swing of any rotor.
const MOST_RAD: f32 = 0.028;
const AHEAD_HALVES: f32 = 6.0;
const AHEAD_S: f32 = 0.02;
/// Least share of the bound that a side keeps.
const LEAST_SIDE: f32 = 0.1;
/// Current along q that takes the rotor back beside currents along d, as a share of the bound: at the largest permitted turn, and at most,
/// which saturates no iron that is not known yet.
const BACK_GAIN: f32 = 0.15;
/// The part of that turn up to which a rotor stays in place by itself.
const STAYS: f32 = 0.2;
const BACK_S: f32 = 0.025;
const BACK_SHARE: f32 = 0.15;

impl Pulses {
    /// The state before the first pulse.
    pub const fn new() -> Self {
        Self {
            d: -1.0,
            q: 1.0,
            turned_rad: 0.0,
            omega: 0.0,
            length_s: 1.0,
            share: 1.0,
            within: 1.0,
            further: 1.0,
        }
    }

    /// A number of this a half, per s.
    pub fn per_s(&self, number: f32) -> f32 {
        number / self.length_s
    }

    /// Begins with pulses up to a share of the bound.
    pub fn begin(&mut self, share: f32) {
        (self.share, self.within) = (share, share);
    }

    /// The share of the bound that the next pulse may reach.
    pub fn share(&self) -> f32 {
        self.share
    }

    /// Notes the rotor's turn in a half, and whether the current has gone beyond its bound, in A.
    pub fn turned(&mut self, seen: &Seen, bound_a: f32) {
        let over = seen.current.length() / bound_a - self.within - TOLERATED_SHARE;
        if self.within > FAR_SHARE && over > 0.0 {
            self.share = limit(self.within - OVER_GAIN * over, FAR_SHARE, self.share);
        }
        self.turned_rad += seen.turned;
        self.omega = seen.omega;
    }

    /// Notes the change along q made by a half, over the expected one. The next one outward is asked for less, by its fourth power: iron that saturates as the
    /// current goes outward saturates even more in the half that is commanded and the one behind it. Without this, three of 168 experiments whose L_q falls to
    /// 0.4 of itself went beyond 1.1 of the bound of current, by up to 1.18; now none.
    pub fn went(&mut self, is_outward: bool, over_expected: f32) {
        self.further = if is_outward { limit(over_expected, 1.0, FURTHEST) } else { 1.0 };
    }

    /// Turn of the rotor since the experiment began, electrical, in rad.
    pub fn turned_rad(&self) -> f32 {
        self.turned_rad
    }

    /// The turn expected soon, over the largest permitted one.
    fn away(&self, pole_pairs: f32, ahead_s: f32) -> f32 {
        let comes = self.turned_rad + self.omega * ahead_s;
        comes / (pole_pairs * MOST_RAD)
    }

    /// The current along q over the bound that takes the rotor back to where it was, beside a negative one along d. If currents meant to
    /// lie along d turn the rotor, because its angle's zero is off, the rotor comes to rest where this current cancels their torque.
    pub fn back_share(&self, pole_pairs: f32) -> f32 {
        let away = self.away(pole_pairs, BACK_S);
        limit(-BACK_GAIN * (away - limit(away, -STAYS, STAYS)), -BACK_SHARE, BACK_SHARE)
    }

    /// Notes the length of a half, in s.
    pub fn lasts(&mut self, length_s: f32) {
        self.length_s = length_s;
    }

    /// The change of current that the command is to make from the current `ahead`: on as before, unless that would leave the region.
    pub fn change(&mut self, ahead: Dq, region: &Region, inductance: &Inductance) -> Dq {
        let bound_a = self.share * KEPT_SHARE * region.bound_a;
        if ahead.squared() <= bound_a * bound_a {
            self.within = self.share;
        }
        let inside = |Dq { d, q }: Dq| (ahead + Dq { d, q: q * OUTWARD }).squared() <= bound_a * bound_a;
        let before = self.along(region);
        let mut change = self.wanted(ahead, region, inductance);
        let beyond = if region.along_q {
            let [negative, positive] = self.sides(region);
            let next = ahead.q + change.q;
            if self.q > 0.0 { next > positive } else { next < -negative }
        } else {
            let next = ahead.d + change.d;
            let least_a = self.share * KEPT_SHARE * region.ratings.min_id_a;
            if self.d > 0.0 { next > POSITIVE_SHARE * bound_a } else { next < least_a }
        };
        if beyond {
            self.turn_to(-before, region);
            change = self.wanted(ahead, region, inductance);
        }
        let flows = if region.along_q { ahead.q } else { ahead.d };
        let inward = if flows > 0.0 { -1.0 } else { 1.0 };
        if !inside(change) && self.along(region) != inward {
            self.turn_to(inward, region);
            change = self.wanted(ahead, region, inductance);
        }
        self.share = limit(self.share + WIDENING, 0.0, 1.0);
        change
    }

    /// The direction of the pulses along their axis.
    fn along(&self, region: &Region) -> f32 {
        if region.along_q { self.q } else { self.d }
    }

    /// Takes another direction along their axis.
    fn turn_to(&mut self, direction: f32, region: &Region) {
        *(if region.along_q { &mut self.q } else { &mut self.d }) = direction;
    }

    /// The change of current that the pulses' directions ask for.
    fn wanted(&self, ahead: Dq, region: &Region, inductance: &Inductance) -> Dq {
        let (d_step, q_step) = (region.bound_a * D_SHARE, region.bound_a * Q_SHARE);
        let back = (region.held - ahead) * HELD_SHARE;
        let change = if region.along_q {
            let slow = region.bound_a * SLOW_SHARE;
            let squared = if ahead.q * self.q > 0.0 { self.further * self.further } else { 1.0 };
            Dq { d: limit(back.d, -slow, slow), q: self.q * q_step / (squared * squared) }
        } else {
            Dq { d: self.d * d_step, q: limit(back.q, -q_step, q_step) }
        };
        reached(change, region.reach, inductance)
    }

    /// The largest negative and positive current along q, in A.
    fn sides(&self, region: &Region) -> [f32; 2] {
        let share = self.away(region.ratings.pole_pairs, AHEAD_HALVES * self.length_s + AHEAD_S);
        [1.0 + share, 1.0 - share]
            .map(|side| limit(side, LEAST_SIDE, 1.0) * self.share * KEPT_SHARE * region.bound_a)
    }
}

/// A change of current, shortened to what the volt-seconds can make of it: what d leaves of them is for q.
fn reached(change: Dq, reach: f32, inductance: &Inductance) -> Dq {
    let [takes_d, takes_q] = inductance.fluxes(change).map(Dq::length);
    let d = if takes_d > D_REACH * reach { change.d * (D_REACH * reach / takes_d) } else { change.d };
    let rest = if takes_d > D_REACH * reach { reach - D_REACH * reach } else { reach - takes_d };
    Dq { d, q: if takes_q > rest { change.q * (rest / takes_q) } else { change.q } }
}
