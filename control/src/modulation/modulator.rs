//! The modulator: one half after the other, and the switches between modes.

use super::carrier::{self, Zeros};
use super::flying_start::{self, FlyingStart};
use super::half::boundary;
#[cfg(feature = "optimal")]
use super::optimal::{self, Branch};
use super::{
    CarrierHalf, Mode, Reference, Schedule, SwitchLimits, first_half, middle60, ripple_at, schedule,
};
#[cfg(feature = "optimal")]
use crate::frames::six_step_v;
use crate::frames::{AlphaBeta, Angle, UNITS_PER_RADIAN, limit};
use crate::time::Instant;

/// The modulator's state.
#[derive(Clone, Copy, Debug)]
pub struct Modulator {
    devices: SwitchLimits,
    schedule: Schedule,
    mode: Mode,
    /// Number of the half that comes next, in the numbering of [`CarrierHalf::half`].
    next_half: u32,
    mirrored: bool,
    plan: Option<Plan>,
    /// Ticks by which the half before ended after its boundary, if a pattern gives way to another there; 0 otherwise.
    late_ticks: f32,
    /// Fundamental of the pattern's previous half, in V.
    voltage_v: f32,
    /// The pattern that ended with the half before, and the number that its next half would have had; a carrier follows.
    left: Option<(Mode, u8)>,
    /// Carriers for which an optimised pattern has waited to take over from a free one.
    #[cfg(feature = "optimal")]
    waited: u32,
    /// Number of the half with which an optimised pattern takes over from a free carrier.
    #[cfg(feature = "optimal")]
    joined: u32,
}

/// Share of a half that is zero voltage, over half the zero voltage of a sector of 60° as an angle in rad.
const ZERO_OF_HALF: f32 = 1.0 / core::f32::consts::FRAC_PI_6;

/// A switch that has been announced: between locked modes, or from a free carrier to an optimised pattern.
#[derive(Clone, Copy, Debug)]
struct Plan {
    to: Mode,
    /// Number, in the present mode, of the half that is the new mode's first.
    at: u32,
}

/// The largest distance of a carrier from its angle at which it gives way to a pattern: 6°, less than half of its shortest half.
const KEPT_ANGLE: Angle = Angle(71_582_788);

/// Carriers for which an optimised pattern waits for an angle at which it should take over from a free one.
#[cfg(feature = "optimal")]
const LONGEST_WAIT: u32 = 100;

/// Halves by which a switch between locked modes is announced beforehand.
const AHEAD: u32 = 2;

/// Shortest and longest half, as shares of the nominal one, while it catches up with its angle, or for a free carrier with an optimised pattern's angle.
/// A triangular carrier's voltage has the right angle wherever its carrier stands, so it need not be longer, and its ripple stays
/// small; a pattern's angle is that of its boundaries.
const CARRIER_STRETCH: (f32, f32) = (0.8, 1.05);
const PATTERN_STRETCH: (f32, f32) = (0.5, 2.0);

impl Modulator {
    /// A modulator at rest: its first half is `Off`.
    pub const fn new(devices: SwitchLimits, schedule: Schedule) -> Self {
        Self {
            devices,
            schedule,
            mode: Mode::Off,
            next_half: 0,
            mirrored: false,
            plan: None,
            late_ticks: 0.0,
            voltage_v: 0.0,
            left: None,
            #[cfg(feature = "optimal")]
            waited: 0,
            #[cfg(feature = "optimal")]
            joined: 0,
        }
    }

    /// `true` while the machine is seen in the mirror, because it turns backward.
    pub const fn is_mirrored(&self) -> bool {
        self.mirrored
    }

    /// The half carrier that begins at `start`; `None` as reference: all gates off. Inlined, so that the stack of a call is not needed twice.
    #[inline(always)]
    pub fn step(&mut self, start: Instant, reference: Option<&Reference>) -> CarrierHalf {
        let Some(reference) = reference else {
            return self.rest(start, None);
        };
        self.turn_mirror(reference.rate);
        let seen = if self.mirrored { reference.mirrored() } else { *reference };
        let pulse = seen.pulse_at(start);
        let from = self.mode;
        self.choose_mode(start, pulse, &seen);
        let led = self.led(&seen);
        let flies = from == Mode::Off && self.mode.is_pattern();
        let flying = if flies { self.start_flying(start, pulse, &seen) } else { None };
        let mut half = match flying {
            Some(half) => half,
            None if self.mode == Mode::Async => self.free(start, pulse, &seen, led),
            None => self.locked(start, pulse, &seen, led),
        };
        half.mode = self.mode;
        half.half = self.number() as u8;
        half.ahead = self.ahead(self.next_half);
        self.next_half = self.half_after(self.next_half, 1);
        self.left = None;
        if self.mirrored {
            half.compare_ticks.swap(1, 2);
            half.start_levels.swap(1, 2);
        }
        half
    }

    /// A free half ([`CarrierHalf::is_free`]) that begins at `start`, made anew from a newer reference.
    pub fn revised(&self, half: &CarrierHalf, start: Instant, reference: &Reference) -> CarrierHalf {
        let seen = if self.mirrored { reference.mirrored() } else { *reference };
        let time = (start, self.devices.shortest_half_ticks);
        let mut revised =
            carrier::asynchronous(half.half.into(), time, &seen, AlphaBeta::default(), &self.devices);
        (revised.mode, revised.half, revised.ahead) = (half.mode, half.half, half.ahead);
        if self.mirrored {
            revised.compare_ticks.swap(1, 2);
            revised.start_levels.swap(1, 2);
        }
        revised
    }

    /// All gates off; if a reference is known, the mode that it would begin with is announced.
    #[inline(never)]
    pub fn rest(&mut self, start: Instant, reference: Option<&Reference>) -> CarrierHalf {
        self.mode = Mode::Off;
        self.plan = None;
        self.late_ticks = 0.0;
        let mut half = CarrierHalf::off(self.devices.shortest_half_ticks);
        if let Some(reference) = reference {
            let seen = if reference.rate < 0.0 { reference.mirrored() } else { *reference };
            half.ahead = [self.schedule.wanted(start, Mode::Off, &seen, &self.devices); 2];
        }
        half
    }

    /// Lets the mirror follow the sign of rotation, but only while the carrier is not locked to the angle.
    fn turn_mirror(&mut self, rate: f32) {
        if matches!(self.mode, Mode::Off | Mode::Async) {
            self.mirrored = rate < 0.0;
        }
    }

    /// The mode of the half that begins at `start`. Between locked modes, and from a free carrier to an optimised pattern, a switch is announced two halves
    /// ahead, so that control can lead the flux to where the new pattern begins.
    fn choose_mode(&mut self, start: Instant, pulse: Angle, seen: &Reference) {
        if let Some(plan) = self.plan {
            // A torque step may have come since.
            if self.mode.is_carrier() && !self.may_begin(plan.to, pulse) {
                self.plan = None;
            } else if plan.at == self.next_half {
                self.switch_to(start, plan.to, pulse);
            }
            return;
        }
        let wanted = self.schedule.wanted(start, self.mode, seen, &self.devices);
        if wanted == self.mode {
            return;
        }
        if self.mode.carriers() > 0 && wanted.carriers() > 0 {
            let at = self.half_after(self.next_half, AHEAD);
            if self.may_begin(wanted, pulse) && schedule::may_switch(self.mode, wanted, at) {
                self.plan = Some(Plan { to: wanted, at });
            }
        } else if schedule::may_switch(self.mode, wanted, self.next_half) {
            if self.joins_free(wanted) {
                self.plan = self.calm_plan(wanted, pulse, seen.rate);
            } else {
                self.switch_to(start, wanted, pulse);
            }
        }
    }

    /// The plan by which an optimised pattern takes over from a free carrier: at a place where its flux lies next to the fundamental and the next two halves
    /// can end. The wait is limited: at some speeds none of a hundred carriers comes so near.
    #[cfg(feature = "optimal")]
    fn calm_plan(&mut self, to: Mode, pulse: Angle, rate: f32) -> Option<Plan> {
        let branch = to.branch()?;
        let nominal = rate * (AHEAD * self.devices.shortest_half_ticks) as f32;
        let (shortest, longest) = (CARRIER_STRETCH.0 * nominal, CARRIER_STRETCH.1 * nominal);
        let middle = Angle((0.5 * (shortest + longest)) as u32);
        let first = schedule::nearest(2 * to.carriers(), pulse + middle);
        let turn = (boundary(first, to.carriers()) - pulse).0 as f32;
        let is_calm = branch.is_calm(first) && turn > shortest && turn < longest;
        self.waited = if is_calm || self.waited >= LONGEST_WAIT { 0 } else { self.waited + 1 };
        self.joined = first;
        (self.waited == 0).then_some(Plan { to, at: self.next_half })
    }

    #[cfg(not(feature = "optimal"))]
    #[inline(always)]
    fn calm_plan(&self, _to: Mode, _pulse: Angle, _rate: f32) -> Option<Plan> {
        None
    }

    /// `true` if the locked half that begins at pulse angle `pulse` begins where it should, or a carrier is to follow. After a torque step a
    /// carrier catches up with its angle over many halves; a pattern that began meanwhile would have its pulses in the wrong place.
    fn may_begin(&self, wanted: Mode, pulse: Angle) -> bool {
        let off = boundary(self.next_half, self.mode.carriers()) - pulse;
        self.mode == Mode::Async || wanted.is_carrier() || off.signed().unsigned_abs() < KEPT_ANGLE.0
    }

    fn switch_to(&mut self, start: Instant, mode: Mode, pulse: Angle) {
        let from = self.mode;
        self.left = (from.has_path() && mode.is_carrier()).then_some((from, self.next_half as u8));
        self.next_half = self.first(mode, self.next_half, pulse);
        self.mode = mode;
        self.plan = None;
        self.schedule.switched(start);
    }

    /// Modes of the two halves that follow half number `half` of the present mode.
    fn ahead(&self, half: u32) -> [Mode; 2] {
        let Some(plan) = self.plan else {
            return [self.mode; 2];
        };
        let next = plan.at == self.half_after(half, 1);
        let next_but_one = next || plan.at == self.half_after(half, AHEAD);
        [if next { plan.to } else { self.mode }, if next_but_one { plan.to } else { self.mode }]
    }

    /// `true` if this mode is to take over from a free carrier at an angle: an optimised pattern.
    fn joins_free(&self, to: Mode) -> bool {
        self.mode == Mode::Async && to.is_optimal()
    }

    /// The number, in the mode `to`, of the half with which that mode takes over at the place where this one's half `next_half` would begin.
    fn first(&self, to: Mode, next_half: u32, pulse: Angle) -> u32 {
        #[cfg(feature = "optimal")]
        if self.joins_free(to) {
            return self.joined;
        }
        first_half(self.mode, to, next_half, pulse)
    }

    /// The number by which control knows the next half: a free carrier's last halves are numbered up to the pattern's first one.
    fn number(&self) -> u32 {
        #[cfg(feature = "optimal")]
        if let Some(plan) = self.plan.filter(|plan| self.joins_free(plan.to)) {
            return if self.joined == 0 { 2 * plan.to.carriers() - 1 } else { self.joined - 1 };
        }
        self.next_half
    }

    /// The number of the half that comes `later` halves (fewer than a turn) after number `half`.
    const fn half_after(&self, half: u32, later: u32) -> u32 {
        let (sum, turn) = (half + later, self.halves());
        if sum >= turn { sum - turn } else { sum }
    }

    /// Number of halves after which the numbering starts anew: a turn of a locked carrier, a period of a free one.
    const fn halves(&self) -> u32 {
        match self.mode.carriers() {
            0 => 2,
            carriers => carriers * 2,
        }
    }

    /// The place of the zero vectors in the next half.
    fn zeros(&self) -> Zeros {
        match self.ahead(self.next_half) {
            [next, _] if next.is_pattern() => Zeros::Early,
            _ if self.left.is_some_and(|(from, _)| from.is_pattern()) => Zeros::Late,
            _ => Zeros::Even,
        }
    }

    /// The first half of a pattern that follows no pulses: a carrier's, which leads the machine's flux to where the pattern begins. If the diodes
    /// conduct there is none, and the pattern continues from the half that begins nearest: the diodes lead the flux as it would.
    #[cold]
    #[inline(never)]
    fn start_flying(&mut self, start: Instant, pulse: Angle, seen: &Reference) -> Option<CarrierHalf> {
        let emf = seen.share_within(start, 0);
        if flying_start::diodes_lead(emf, pulse, seen) {
            self.next_half = schedule::nearest(2 * self.mode.carriers(), pulse);
            return None;
        }
        let FlyingStart { half, turned, share } = FlyingStart::new(self.mode, pulse, emf, seen);
        self.next_half = half;
        let period_ticks = self.whole_ticks(turned.0 as f32 / seen.rate);
        Some(carrier::synchronous(half, period_ticks, Zeros::Early, share, &self.devices))
    }

    /// One half of the free carrier; the last ones before an optimised pattern end together where it begins.
    #[inline(always)]
    fn free(&self, start: Instant, _pulse: Angle, seen: &Reference, led: AlphaBeta) -> CarrierHalf {
        let period_ticks = self.devices.shortest_half_ticks;
        #[cfg(feature = "optimal")]
        let period_ticks = self.plan.map_or(period_ticks, |plan| {
            let halves = if plan.at == self.next_half { AHEAD } else { 1 };
            let turn = (boundary(self.joined, plan.to.carriers()) - _pulse).0 as f32;
            let (nominal, (shortest, longest)) = (period_ticks as f32, CARRIER_STRETCH);
            self.whole_ticks(limit(turn / (halves as f32 * seen.rate), shortest * nominal, longest * nominal))
        });
        carrier::asynchronous(self.next_half, (start, period_ticks), seen, led, &self.devices)
    }

    /// One half of a carrier locked to the pulse angle.
    fn locked(&mut self, start: Instant, pulse: Angle, seen: &Reference, led: AlphaBeta) -> CarrierHalf {
        let carriers = self.mode.carriers();
        let end = boundary(self.next_half + 1, carriers);
        let ticks_per_unit = 1.0 / seen.rate;
        let nominal = boundary(1, carriers).0 as f32 * ticks_per_unit;
        let wanted = (end - pulse).signed() as f32 * ticks_per_unit;
        let is_carrier = self.mode.is_carrier();
        let (shortest, longest) = if is_carrier { CARRIER_STRETCH } else { PATTERN_STRETCH };
        let wanted = limit(wanted, shortest * nominal, longest * nominal);
        if is_carrier {
            let period_ticks = self.whole_ticks(wanted);
            let share = seen.share_within(start, period_ticks) + led * (1.0 / period_ticks as f32);
            return carrier::synchronous(self.next_half, period_ticks, self.zeros(), share, &self.devices);
        }
        #[cfg(feature = "optimal")]
        if let Some(branch) = self.mode.branch() {
            let period_ticks = self.whole_ticks(wanted);
            return self.optimal(branch, start, period_ticks, (seen, led));
        }
        let own_rad = middle60::zero_rad(self.mode, seen.voltage_v, seen.udc_v);
        let late_ticks = core::mem::take(&mut self.late_ticks);
        let due = wanted + late_ticks;
        let mut notch = due * (own_rad * ZERO_OF_HALF);
        // Where hexagons meet, an edge has its proper length, and the remaining time is zero voltage.
        let beside_edge = |zero_rad: f32| due - nominal * (1.0 - zero_rad * ZERO_OF_HALF);
        if let Some(next) = self.gives_way_to().map(|plan| plan.to).filter(|next| next.is_pattern()) {
            let old_rad = middle60::zero_rad(self.mode, self.voltage_v, seen.udc_v);
            let next_rad = middle60::least_zero_rad(next, seen, &self.devices);
            notch = beside_edge(old_rad);
            self.late_ticks = (old_rad - next_rad) * (2.0 * UNITS_PER_RADIAN) * ticks_per_unit;
        } else if late_ticks != 0.0 {
            notch = beside_edge(own_rad);
        }
        self.voltage_v = seen.voltage_v;
        let notched = !self.mode.is_whole() || own_rad > 0.0;
        let period_ticks = self.whole_ticks(wanted + self.late_ticks);
        middle60::half(self.mode, self.next_half, period_ticks, notched.then_some(notch), &self.devices)
    }

    /// The volt-ticks, over the link's voltage, by which the next half leads the flux from where an old pattern has left it and to where the following
    /// pattern begins. A carrier's flux is the fundamental itself at its boundaries; a pattern of middle 60° leads nothing.
    #[inline(always)]
    fn led(&self, seen: &Reference) -> AlphaBeta {
        let next = self.gives_way_to();
        if next.is_none() && self.left.is_none() || self.mode.is_pattern() {
            return AlphaBeta::default();
        }
        let per_tick = seen.rate * (1.0 / UNITS_PER_RADIAN);
        let at = |mode: Mode, half: u32| ripple_at(mode, half, seen.voltage_v, seen.udc_v, per_tick);
        let end = self.half_after(self.next_half, 1);
        let begins = next.map_or(AlphaBeta::default(), |plan| {
            at(plan.to, self.first(plan.to, self.next_half + 1, Angle::ZERO))
        });
        let (mode, half) = self.left.unwrap_or((self.mode, end as u8));
        (begins - at(mode, half.into())) * (1.0 / seen.udc_v)
    }

    /// The mode that takes over after the next half, if one does.
    fn gives_way_to(&self) -> Option<Plan> {
        self.plan.filter(|plan| plan.at == self.half_after(self.next_half, 1))
    }

    /// One half of an optimised pattern, its edges moved by the difference of the wanted mean voltage from the pattern's fundamental.
    #[cfg(feature = "optimal")]
    #[inline(never)]
    fn optimal(
        &self,
        branch: &Branch,
        start: Instant,
        period_ticks: u32,
        (seen, led): (&Reference, AlphaBeta),
    ) -> CarrierHalf {
        let carriers = self.mode.carriers();
        let middle = boundary(self.next_half, carriers) + Angle(boundary(1, carriers).0 / 2);
        let round = (middle - Angle::DEG_90).sin_cos();
        let index = branch.within(seen.voltage_v / six_step_v(seen.udc_v));
        let own = AlphaBeta { alpha: round.cos, beta: round.sin } * (index * core::f32::consts::FRAC_2_PI);
        let more_ticks = (seen.share_within(start, period_ticks) - own) * period_ticks as f32 + led;
        let (half, wanted) = (self.next_half, (index, more_ticks));
        match self.gives_way_to().and_then(|plan| plan.to.branch()) {
            Some(next) => optimal::last_half((branch, next), half, period_ticks, wanted, &self.devices),
            None => optimal::half(branch, half, period_ticks, wanted, &self.devices),
        }
    }

    /// A length in whole ticks. Below the async mode's range there is nothing to lock to: the length stays that
    /// of a stopped carrier.
    #[inline(never)]
    fn whole_ticks(&self, period: f32) -> u32 {
        ((period + 0.5) as u32).min(self.devices.longest_half_ticks()).max(1)
    }
}

#[cfg(test)]
mod proofs;

#[cfg(all(test, feature = "optimal"))]
mod tests {
    use super::*;
    use crate::modulation::Ladder;
    use crate::time::Clock;

    /// Up and down by the modulation index alone, also between the frequencies at which seven pulses give way to five and take over again.
    #[test]
    fn seven_pulses_follow_the_modulation_index_at_one_frequency() {
        let clock = Clock::new(25_000_000, 2_500);
        let devices = SwitchLimits::new(250, 0, 900.0, &clock);
        for hz in [120.0, 128.6] {
            let mut modulator = Modulator::new(devices, Schedule::on(Ladder::OPTIMAL, &clock));
            let rate = (hz * 4_294_967_296.0 / 25e6) as f32;
            let mut now = Instant(0);
            for (index, mode) in [
                (0.92, Mode::Opp7c),
                (0.96, Mode::Opp7d),
                (0.97, Mode::Opp7e),
                (0.96, Mode::Opp7d),
                (0.92, Mode::Opp7c),
                (0.8, Mode::Opp7b),
            ] {
                for _ in 0..2_000 {
                    let angle = Angle((f64::from(rate) * f64::from(now.0)) as u64 as u32);
                    let reference =
                        Reference::turning(index * six_step_v(1_500.0), angle, rate, now, 1_500.0);
                    now = now.after(modulator.step(now, Some(&reference)).period_ticks);
                }
                assert_eq!(modulator.mode, mode, "{hz} Hz, {index}");
            }
        }
    }

    /// From whatever angle, the free carrier's last two halves end together where the pattern is calm, and announce it; a hundred carriers are enough at 40 Hz.
    #[test]
    fn a_free_carrier_ends_where_the_optimised_pattern_begins() {
        let clock = Clock::new(25_000_000, 2_500);
        let devices = SwitchLimits::new(250, 0, 900.0, &clock);
        let rate = (40.0 * 4_294_967_296.0 / 25e6) as f32;
        let reference = |start: u32, now: Instant| {
            let angle = (f64::from(rate) * f64::from(now.0)) as u64 as u32;
            let index = if now.0 < 60_000 { 0.0 } else { 0.3 };
            Reference {
                modulation_index: index,
                ..Reference::turning(
                    index * six_step_v(1_500.0),
                    Angle(angle.wrapping_add(start)),
                    rate,
                    now,
                    1_500.0,
                )
            }
        };
        for start in (0..64).map(|part| part << 26) {
            let mut modulator = Modulator::new(devices, Schedule::on(Ladder::OPTIMAL, &clock));
            let mut now = Instant(0);
            let mut last: [CarrierHalf; 3] = Default::default();
            while !last[2].mode.is_optimal() {
                last.rotate_left(1);
                last[2] = modulator.step(now, Some(&reference(start, now)));
                now = now.after(last[2].period_ticks);
                assert!(now.0 < 6_000_000, "{start:x}");
            }
            let [one, two, first] = last;
            let nominal = devices.shortest_half_ticks as f32;
            for half in [one, two] {
                let stretch = half.period_ticks as f32 / nominal;
                assert!(half.mode == Mode::Async && (0.8..1.05).contains(&stretch), "{start:x} {half:?}");
            }
            assert_eq!((one.ahead, two.ahead), ([Mode::Async, first.mode], [first.mode; 2]));
            let turn = 2 * first.mode.carriers();
            assert!(first.mode.branch().is_some_and(|branch| branch.is_calm(first.half.into())));
            assert_eq!((u32::from(two.half) + 1) % turn, first.half.into());
            let begins = now.0 - first.period_ticks;
            let off = boundary(first.half.into(), turn / 2)
                - reference(start, Instant(begins)).pulse_at(Instant(begins));
            assert!(off.signed().unsigned_abs() < 2 * rate as u32, "{start:x} {off:?}");
        }
    }
}
