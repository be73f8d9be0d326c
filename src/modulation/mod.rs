//! WHICH pulses: the modulator of a two-level inverter.
//!
//! Every mode is one carrier with one compare value a phase. The PWM interrupt comes once per carrier half and
//! describes the half after the running one, as a timer's shadow registers take it: its length, each phase's level at
//! its start, and the instant at which that level toggles. In the synchronous modes the halves are locked to
//! the pulse angle (voltage angle + 90°: phase a's reference is the sine of it): the length of each half takes the
//! carrier to its next boundary angle, so phase errors vanish within a half and nothing accumulates.
//!
//! Backward rotation is forward rotation seen in a mirror: the angle changes sign, phases b and c change places.

#![forbid(unsafe_code)]

mod carrier;
mod catch;
mod dead_time;
mod growth;
mod middle60;
mod ripple;
mod schedule;

use crate::frames::{AlphaBeta, Angle, UNITS_PER_RADIAN, limit};
use crate::time::{Clock, Instant};

use carrier::Zeros;
use catch::Catch;
pub use dead_time::compensated;
pub use growth::GROWTH_SECTORS;
use growth::Growth;
pub use ripple::{RippleFlux, ripple_share};
pub use schedule::{Schedule, depth_limit, first_half};

/// How the pulses are made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
pub enum Mode {
    /// All gates off.
    #[default]
    Off,
    /// Asynchronous SPWM with zero sequence at the highest switching frequency.
    Async,
    /// Synchronous, 15 carriers per turn.
    Sync15,
    /// Synchronous, 12 carriers per turn.
    Sync12,
    /// Middle 60°, 7 pulses: 18 carriers per turn with one notch each.
    Mid7,
    /// Middle 60°, 3 pulses: 6 carriers per turn with one notch each.
    Mid3,
    /// Square wave: 6 carriers per turn without a notch.
    Square,
}

impl Mode {
    /// Every mode, in the order of its discriminant.
    pub const ALL: [Self; 7] =
        [Self::Off, Self::Async, Self::Sync15, Self::Sync12, Self::Mid7, Self::Mid3, Self::Square];

    /// The mode with this discriminant; `Off` for any other number.
    pub fn from_code(code: u32) -> Self {
        match code {
            1 => Self::Async,
            2 => Self::Sync15,
            3 => Self::Sync12,
            4 => Self::Mid7,
            5 => Self::Mid3,
            6 => Self::Square,
            _ => Self::Off,
        }
    }

    /// The name in traces and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::Async => "async",
            Self::Sync15 => "sync15",
            Self::Sync12 => "sync12",
            Self::Mid7 => "mid7",
            Self::Mid3 => "mid3",
            Self::Square => "square",
        }
    }

    /// Carriers per turn of the pulse angle; 0 where the carrier is not locked to it.
    pub const fn carriers(self) -> u32 {
        match self {
            Self::Off | Self::Async => 0,
            Self::Sync15 => 15,
            Self::Sync12 => 12,
            Self::Mid7 => 18,
            Self::Mid3 | Self::Square => 6,
        }
    }

    /// Whether it is a pattern of whole edges of a flux hexagon: middle 60° or square wave.
    pub const fn is_pattern(self) -> bool {
        matches!(self, Self::Mid7 | Self::Mid3 | Self::Square)
    }

    /// Halves in a sector of 60° of a pattern.
    pub const fn sector_halves(self) -> u32 {
        self.carriers() / 3
    }

    /// Carriers in a sector of 60° of a pattern, each with a notch or with room for one.
    const fn notches(self) -> u32 {
        self.carriers() / 6
    }

    /// Whether the mean voltage of each carrier half follows the command: the modes with a triangular carrier.
    pub const fn is_carrier(self) -> bool {
        matches!(self, Self::Async | Self::Sync15 | Self::Sync12)
    }
}

/// The pulse angle of boundary number `half` of `2 * carriers` halves a turn, rounded to the nearest angle unit.
fn boundary(half: u32, carriers: u32) -> Angle {
    let halves = carriers.max(1) * 2;
    // 2³² = quotient · halves + rest, without numbers of 64 bits.
    let quotient = u32::MAX / halves;
    let rest = u32::MAX - quotient * halves + 1;
    Angle((half * quotient).wrapping_add((half * rest + halves / 2) / halves))
}

/// One interval between two PWM interrupts: one half of a carrier.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CarrierPeriod {
    /// Length, in ticks.
    pub period_ticks: u32,
    /// Instant after the start at which each phase's level toggles, in ticks; at or beyond `period_ticks`: never.
    pub compare_ticks: [u32; 3],
    /// Level at the start of each phase (true: upper device on). Without meaning in [`Mode::Off`].
    pub start_levels: [bool; 3],
    /// The mode that made it.
    pub mode: Mode,
    /// Number of the half within the turn, for locked modes (in the mirrored turn when turning backward); otherwise
    /// 0 for the rising and 1 for the falling carrier.
    pub half: u8,
    /// Modes of the two halves that follow, as far as they are decided.
    pub ahead: [Mode; 2],
}

impl CarrierPeriod {
    /// All gates off for this long.
    pub const fn off(period_ticks: u32) -> Self {
        Self {
            period_ticks,
            compare_ticks: [u32::MAX; 3],
            start_levels: [false; 3],
            mode: Mode::Off,
            half: 0,
            ahead: [Mode::Off; 2],
        }
    }

    /// Whether it is a half of the free carrier and two more follow: its length depends on nothing.
    pub fn is_free(&self) -> bool {
        (self.mode, self.ahead) == (Mode::Async, [Mode::Async; 2])
    }

    /// For how many ticks each phase is at the upper level, from `from` ticks after the start to the end.
    pub fn on_ticks(&self, from: u32) -> [u32; 3] {
        let (mut on, end) = ([0; 3], self.period_ticks);
        let from = from.min(end);
        let phases = on.iter_mut().zip(self.compare_ticks).zip(self.start_levels);
        for ((ticks, compare), level) in phases {
            let toggle = compare.min(end).max(from);
            *ticks = if level { toggle - from } else { end - toggle };
        }
        on
    }

    /// The boundary's pulse angle at the end of this half, in the mirrored turn when turning backward; `None` for a
    /// carrier that is not locked.
    pub fn end_angle(&self) -> Option<Angle> {
        match self.mode.carriers() {
            0 => None,
            carriers => Some(boundary(u32::from(self.half) + 1, carriers)),
        }
    }
}

/// What the modulator is asked for: a fundamental that turns on by itself from one control period to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reference {
    /// Fundamental phase voltage, peak, in V.
    pub voltage_v: f32,
    /// The same as a vector at `at`, in V.
    pub vector: AlphaBeta,
    /// Angle of the vector to which a locked carrier keeps, at `at`: without what regulation adds for one half only.
    pub carrier_angle: Angle,
    /// Angle units (2⁻³² turn) per tick by which it turns; negative backward.
    pub rate: f32,
    /// The instant of `vector`.
    pub at: Instant,
    /// DC-link voltage, in V, greater than zero.
    pub udc_v: f32,
    /// Fundamental that the operating point asks for, as a share of the six-step voltage 2 udc/π: chooses the mode.
    pub depth: f32,
}

impl Reference {
    /// A fundamental with its vector and its carrier at one angle, and a mode by its own depth.
    pub fn turning(voltage_v: f32, angle: Angle, rate: f32, at: Instant, udc_v: f32) -> Self {
        let direction = angle.sin_cos();
        let vector = AlphaBeta { alpha: direction.cos, beta: direction.sin } * voltage_v;
        let depth = voltage_v / (udc_v * (2.0 * core::f32::consts::FRAC_1_PI));
        Self { voltage_v, vector, carrier_angle: angle, rate, at, udc_v, depth }
    }

    /// The vector at an instant, turned on at constant rate.
    fn vector_at(&self, instant: Instant) -> AlphaBeta {
        self.vector.turned(self.turned(instant).sin_cos())
    }

    /// The vector in the middle of a half, as a share of the link's voltage: there the mean of a turning vector stands.
    #[inline(never)]
    fn share_within(&self, start: Instant, period_ticks: u32) -> AlphaBeta {
        self.vector_at(start.after(period_ticks / 2)) * (1.0 / self.udc_v)
    }

    /// The pulse angle at an instant: that of the carrier's vector and 90°.
    fn pulse_at(&self, instant: Instant) -> Angle {
        self.carrier_angle + self.turned(instant) + Angle::DEG_90
    }

    fn turned(&self, instant: Instant) -> Angle {
        Angle((self.rate * instant.since(self.at) as f32) as i32 as u32)
    }

    /// The same fundamental in the mirror: turning forward.
    fn mirrored(self) -> Self {
        let vector = AlphaBeta { beta: -self.vector.beta, ..self.vector };
        Self { vector, carrier_angle: -self.carrier_angle, rate: -self.rate, ..self }
    }
}

/// What the inverter's devices ask of every pulse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Devices {
    /// Shortest pulse or pause of a device, in ticks, dead time included.
    pub min_pulse_ticks: u32,
    /// Dead time between the two devices of a leg, in ticks; the hardware inserts it.
    pub dead_time_ticks: u32,
    /// Length of the shortest carrier half, in ticks: half a period of the highest switching frequency.
    pub shortest_half_ticks: u32,
}

impl Devices {
    /// From times in ticks and the highest switching frequency in Hz. A half lasts two control periods at least, so
    /// that each has a command of its own: beyond a quarter of the control rate the devices switch less than they could.
    pub const fn new(
        min_pulse_ticks: u32,
        dead_time_ticks: u32,
        max_switching_hz: f32,
        clock: &Clock,
    ) -> Self {
        // One tick more than the quotient's whole part: never above the highest frequency.
        let half = (clock.ticks_per_s / (2.0 * max_switching_hz)) as u32 + 1;
        let commanded = 2 * clock.control_ticks;
        Self {
            min_pulse_ticks,
            dead_time_ticks,
            shortest_half_ticks: if half > commanded { half } else { commanded },
        }
    }
}

/// The modulator's state.
#[derive(Clone, Copy, Debug)]
pub struct Modulator {
    devices: Devices,
    schedule: Schedule,
    mode: Mode,
    /// Number of the half that comes next, in the numbering of [`CarrierPeriod::half`].
    next_half: u32,
    mirrored: bool,
    plan: Option<Plan>,
    growth: Growth,
    /// Whether the half before was a pattern's and the next one is a carrier's.
    after_pattern: bool,
    /// Half the zero voltage of the present pattern's sectors, as an angle in rad.
    zero_rad: f32,
}

/// Share of a half that is zero voltage, over half the zero voltage of a sector of 60° as an angle in rad.
const ZERO_OF_HALF: f32 = 1.0 / core::f32::consts::FRAC_PI_6;

/// A switch between locked modes that has been announced.
#[derive(Clone, Copy, Debug)]
struct Plan {
    to: Mode,
    /// Number, in the present mode, of the half that is the new mode's first.
    at: u32,
}

/// How far a carrier may be from its angle when it gives way to a pattern: 6°, less than half of its shortest half.
const KEPT_ANGLE: Angle = Angle(71_582_788);

/// Halves by which a switch between locked modes is announced.
const AHEAD: u32 = 2;

/// How much shorter or longer than nominal a locked half may be while it catches up with its angle. A triangular
/// carrier's voltage has the right angle wherever its carrier stands, so it may take its time, and its ripple stays
/// small; a pattern's angle is that of its boundaries.
const CARRIER_STRETCH: (f32, f32) = (0.95, 1.05);
const PATTERN_STRETCH: (f32, f32) = (0.5, 2.0);

impl Modulator {
    /// A modulator at rest: its first half is `Off`.
    pub const fn new(devices: Devices, schedule: Schedule) -> Self {
        Self {
            devices,
            schedule,
            mode: Mode::Off,
            next_half: 0,
            mirrored: false,
            plan: None,
            growth: Growth::DONE,
            after_pattern: false,
            zero_rad: 0.0,
        }
    }

    /// Whether the machine is seen in the mirror, because it turns backward.
    pub const fn is_mirrored(&self) -> bool {
        self.mirrored
    }

    /// The half carrier that begins at `start`; `None` as reference: all gates off. Inlined: the stack of a call is not needed twice.
    #[inline(always)]
    pub fn step(&mut self, start: Instant, reference: Option<&Reference>) -> CarrierPeriod {
        let Some(reference) = reference else {
            return self.rest(start, None);
        };
        self.turn_mirror(reference.rate);
        let seen = if self.mirrored { reference.mirrored() } else { *reference };
        let pulse = seen.pulse_at(start);
        let from = self.mode;
        self.choose_mode(start, pulse, &seen);
        let mut half = if from == Mode::Off && self.mode.is_pattern() {
            self.catch(start, pulse, &seen)
        } else if self.mode == Mode::Async {
            carrier::asynchronous(self.next_half, start, &seen, &self.devices)
        } else {
            self.locked(start, pulse, &seen)
        };
        half.mode = self.mode;
        half.half = self.next_half as u8;
        half.ahead = self.ahead(self.next_half);
        self.next_half = self.half_after(self.next_half, 1);
        self.after_pattern = false;
        if self.mirrored {
            half.compare_ticks.swap(1, 2);
            half.start_levels.swap(1, 2);
        }
        half
    }

    /// A free half ([`CarrierPeriod::is_free`]) that begins at `start`, made anew from a newer reference.
    pub fn revised(&self, half: &CarrierPeriod, start: Instant, reference: &Reference) -> CarrierPeriod {
        let seen = if self.mirrored { reference.mirrored() } else { *reference };
        let mut revised = carrier::asynchronous(half.half.into(), start, &seen, &self.devices);
        (revised.mode, revised.half, revised.ahead) = (half.mode, half.half, half.ahead);
        if self.mirrored {
            revised.compare_ticks.swap(1, 2);
            revised.start_levels.swap(1, 2);
        }
        revised
    }

    /// All gates off; where a reference is known, with the mode that it would begin with announced.
    #[inline(never)]
    pub fn rest(&mut self, start: Instant, reference: Option<&Reference>) -> CarrierPeriod {
        self.mode = Mode::Off;
        self.plan = None;
        let mut half = CarrierPeriod::off(self.devices.shortest_half_ticks);
        if let Some(reference) = reference {
            let seen = if reference.rate < 0.0 { reference.mirrored() } else { *reference };
            half.ahead = [self.schedule.wanted(start, Mode::Off, &seen, &self.devices); 2];
        }
        half
    }

    /// The mirror follows the sign of rotation, but only where the carrier is not locked to the angle.
    fn turn_mirror(&mut self, rate: f32) {
        if matches!(self.mode, Mode::Off | Mode::Async) {
            self.mirrored = rate < 0.0;
        }
    }

    /// The mode of the half that begins at `start`. Between locked modes a switch is announced two halves ahead, so that
    /// control can lead the flux to where the new pattern begins.
    fn choose_mode(&mut self, start: Instant, pulse: Angle, seen: &Reference) {
        if let Some(plan) = self.plan {
            if plan.at == self.next_half {
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
            let keeps_angle = wanted.is_carrier() || self.keeps_its_angle(pulse);
            if keeps_angle && schedule::may_switch(self.mode, wanted, at) {
                self.plan = Some(Plan { to: wanted, at });
            }
        } else if schedule::may_switch(self.mode, wanted, self.next_half) {
            self.switch_to(start, wanted, pulse);
        }
    }

    /// Whether the locked half that begins at pulse angle `pulse` begins where it should. After a step of torque a carrier catches up
    /// with its angle over many halves; a pattern that began then would have its pulses in the wrong place.
    fn keeps_its_angle(&self, pulse: Angle) -> bool {
        (boundary(self.next_half, self.mode.carriers()) - pulse).signed().unsigned_abs() < KEPT_ANGLE.0
    }

    fn switch_to(&mut self, start: Instant, mode: Mode, pulse: Angle) {
        let from = self.mode;
        self.next_half = first_half(from, mode, self.next_half, pulse);
        self.mode = mode;
        self.plan = None;
        self.after_pattern = from.is_pattern() && mode.is_carrier();
        self.growth = if from.is_pattern() { Growth::begun(self.zero_rad) } else { Growth::DONE };
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

    /// The number of the half that comes `later` halves (fewer than a turn) after number `half`.
    const fn half_after(&self, half: u32, later: u32) -> u32 {
        let (sum, turn) = (half + later, self.halves());
        if sum >= turn { sum - turn } else { sum }
    }

    /// Halves after which the numbering begins anew: a turn of a locked carrier, a period of a free one.
    const fn halves(&self) -> u32 {
        match self.mode.carriers() {
            0 => 2,
            carriers => carriers * 2,
        }
    }

    /// Where the zero vectors of the next half belong.
    fn zeros(&self) -> Zeros {
        match self.ahead(self.next_half) {
            [next, _] if !next.is_carrier() => Zeros::Early,
            _ if self.after_pattern => Zeros::Late,
            _ => Zeros::Even,
        }
    }

    /// The first half of a pattern after none: one of a carrier, which leads the machine's flux to where the pattern begins.
    #[cold]
    #[inline(never)]
    fn catch(&mut self, start: Instant, pulse: Angle, seen: &Reference) -> CarrierPeriod {
        let Catch { half, turned, share } = Catch::new(self.mode, pulse, seen.share_within(start, 0), seen);
        self.next_half = half;
        let period_ticks = self.whole_ticks(turned.0 as f32 / seen.rate);
        carrier::synchronous(half, period_ticks, Zeros::Early, share, &self.devices)
    }

    /// One half of a carrier that is locked to the pulse angle.
    fn locked(&mut self, start: Instant, pulse: Angle, seen: &Reference) -> CarrierPeriod {
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
            let share = seen.share_within(start, period_ticks);
            return carrier::synchronous(self.next_half, period_ticks, self.zeros(), share, &self.devices);
        }
        let own_rad = middle60::zero_rad(self.mode, seen.voltage_v, seen.udc_v);
        self.zero_rad = own_rad;
        let (period, notch) = match self.growth.sector(own_rad, self.mode.sector_halves()) {
            Some(sector) => {
                // The edge has the length that it should have, and whatever time is left is zero voltage.
                let zero = nominal * (sector.zero_rad * ZERO_OF_HALF);
                let edge = nominal - zero;
                let left = wanted - sector.lead_rad * UNITS_PER_RADIAN * ticks_per_unit - edge;
                let notch = self.growth.notch(left, zero, self.devices.min_pulse_ticks as f32);
                (edge + notch.unwrap_or(0.0), notch)
            }
            None => {
                let notched = self.mode != Mode::Square || own_rad > 0.0;
                (wanted, notched.then_some(wanted * (own_rad * ZERO_OF_HALF)))
            }
        };
        middle60::half(self.mode, self.next_half, self.whole_ticks(period), notch, &self.devices)
    }

    /// A length in whole ticks. Slower than the async mode's range there is nothing to lock to: the length stays that
    /// of a stopped carrier.
    #[inline(never)]
    fn whole_ticks(&self, period: f32) -> u32 {
        ((period + 0.5) as u32).min(self.devices.shortest_half_ticks * 4).max(1)
    }
}
