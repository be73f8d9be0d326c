//! Faults, limits, and the safe state.
//!
//! A fault is named, latched with the value and the limit that it broke, and puts the gates into the safe state in the
//! very interrupt that finds it.

#![forbid(unsafe_code)]

use crate::control::{Demand, Measurements};
use crate::frames::{Abc, Angle, SQRT_3};
use crate::machine::Ratings;
use crate::time::Instant;

/// Why the drive tripped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Fault {
    /// A phase current above its trip level, in A.
    Overcurrent = 1,
    /// DC link above its trip level, in V.
    DcOvervoltage,
    /// DC link below its trip level, in V.
    DcUndervoltage,
    /// Rotor faster than its trip level, in mechanical rad/s.
    Overspeed,
    /// The three phase currents do not add up to zero, in A.
    PhaseSum,
    /// A measurement or a result is NaN or infinite.
    NotFinite,
    /// Measurements repeat themselves to the last bit although current flows or the rotor turns, in control periods.
    Frozen,
    /// The control interrupt ended after its period, in s.
    ControlDeadline,
    /// The newest voltage command is too old, in s.
    StaleCommand,
    /// ZS9: the source is shorted or too low, in V.
    SourceUndervoltage,
    /// ZS9: a capacitor of the network above its trip level, in V.
    CapacitorOvervoltage,
    /// ZS9: a shoot-through duty outside what the network is made for.
    DutyRange,
    /// ZS9: the upper motor's angle is far off what its speed tells, or stands still while it should turn, in electrical rad; or
    /// its sensor says so itself: then the value is 1 and the limit 0.
    SensorLost1,
    /// ZS9: the same of the lower motor.
    SensorLost2,
    /// Gates did not do what they were told. The value has a bit for each: of the ZS9 in the order of
    /// [`crate::nine_switch::GATES`], of the PMaSynRM drive from u on for the legs.
    LegStuck,
    /// A gate driver is not ready, or its wire is broken: the hardware holds the gates off.
    GateDriver,
    /// A comparator has seen a phase current beyond its threshold.
    HardwareOvercurrent,
    /// The chip's own break: crystal stopped, processor locked up, or a memory word with a two-bit error.
    ClockFailure,
    /// A carrier half ended before its interrupt did, or control saw none come, in s.
    PwmDeadline,
    /// The board did not leave the safe state when it was told to.
    GatesHeld,
    /// A current sensor shows a current where there is none, in A.
    CurrentOffset,
    /// The link's voltage cannot be what it is measured as, in V.
    LinkImplausible,
    /// The position sensor does not answer, or the rotor's speed does not settle while it should stand still.
    PositionSensor,
    /// The configuration was refused, or nobody has checked it.
    Configuration,
    /// The link did not reach its voltage in time, in V.
    PrechargeTimeout,
    /// A contactor does not do what it is told; the value is 1 for the main contactor, 2 for the precharge relay.
    Contactor,
    /// The link did not lose its voltage in time, in V.
    DischargeTimeout,
    /// The angle is far off what the speed makes of the one before, in electrical rad.
    AngleLost,
    /// Drivers found their devices short-circuited and block them; the value has a bit for each, from bit 0 on uh ul vh vl wh wl.
    DriverBlocked,
}

impl Fault {
    /// All of them, in the order of their codes, which begin at 1.
    pub const ALL: [Self; 29] = [
        Self::Overcurrent,
        Self::DcOvervoltage,
        Self::DcUndervoltage,
        Self::Overspeed,
        Self::PhaseSum,
        Self::NotFinite,
        Self::Frozen,
        Self::ControlDeadline,
        Self::StaleCommand,
        Self::SourceUndervoltage,
        Self::CapacitorOvervoltage,
        Self::DutyRange,
        Self::SensorLost1,
        Self::SensorLost2,
        Self::LegStuck,
        Self::GateDriver,
        Self::HardwareOvercurrent,
        Self::ClockFailure,
        Self::PwmDeadline,
        Self::GatesHeld,
        Self::CurrentOffset,
        Self::LinkImplausible,
        Self::PositionSensor,
        Self::Configuration,
        Self::PrechargeTimeout,
        Self::Contactor,
        Self::DischargeTimeout,
        Self::AngleLost,
        Self::DriverBlocked,
    ];

    /// The fault with this code; `None` for 0 or an unknown number.
    pub fn from_code(code: u32) -> Option<Self> {
        Self::ALL.get((code as usize).wrapping_sub(1)).copied()
    }

    /// The name in traces.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Overcurrent => "overcurrent",
            Self::DcOvervoltage => "dc_overvoltage",
            Self::DcUndervoltage => "dc_undervoltage",
            Self::Overspeed => "overspeed",
            Self::PhaseSum => "phase_sum",
            Self::NotFinite => "not_finite",
            Self::Frozen => "frozen",
            Self::ControlDeadline => "control_deadline",
            Self::StaleCommand => "stale_command",
            Self::SourceUndervoltage => "source_undervoltage",
            Self::CapacitorOvervoltage => "capacitor_overvoltage",
            Self::DutyRange => "duty_range",
            Self::SensorLost1 => "sensor_lost_1",
            Self::SensorLost2 => "sensor_lost_2",
            Self::LegStuck => "leg_stuck",
            Self::GateDriver => "gate_driver",
            Self::HardwareOvercurrent => "hardware_overcurrent",
            Self::ClockFailure => "clock_failure",
            Self::PwmDeadline => "pwm_deadline",
            Self::GatesHeld => "gates_held",
            Self::CurrentOffset => "current_offset",
            Self::LinkImplausible => "link_implausible",
            Self::PositionSensor => "position_sensor",
            Self::Configuration => "configuration",
            Self::PrechargeTimeout => "precharge_timeout",
            Self::Contactor => "contactor",
            Self::DischargeTimeout => "discharge_timeout",
            Self::AngleLost => "angle_lost",
            Self::DriverBlocked => "driver_blocked",
        }
    }
}

/// A fault with its circumstances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trip {
    /// What happened.
    pub fault: Fault,
    /// The value that broke the limit, in the fault's unit.
    pub value: f32,
    /// The limit, in the same unit.
    pub limit: f32,
    /// When it was measured.
    pub at: Instant,
    /// What was done with the gates.
    pub safe: SafeState,
}

/// The inverter's safe states.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum SafeState {
    /// All gates off.
    GatesOff,
    /// The three lower devices on: the machine's short-circuit current stays inside its limit, and its EMF does not
    /// reach the link through the diodes.
    ShortCircuit,
    /// The three upper devices on: the same where a leg is stuck at the upper rail.
    UpperShortCircuit,
}

impl SafeState {
    /// The state with this discriminant; gates off for any other number.
    pub const fn from_code(code: u32) -> Self {
        match code {
            1 => Self::ShortCircuit,
            2 => Self::UpperShortCircuit,
            _ => Self::GatesOff,
        }
    }
}

/// Checks that are switched off, to see what is lost without them: on the host, never in a firmware.
#[derive(Clone, Copy, Debug, Default)]
pub struct Disarmed {
    /// A bit for each fault's discriminant.
    #[cfg(not(target_os = "none"))]
    faults: u32,
}

impl Disarmed {
    /// Every check is on.
    pub const NONE: Self = Self {
        #[cfg(not(target_os = "none"))]
        faults: 0,
    };

    /// All but the check that finds this fault.
    #[cfg(not(target_os = "none"))]
    pub const fn of(fault: Fault) -> Self {
        Self { faults: 1 << fault as u32 }
    }

    /// Whether the check that finds this fault is off.
    #[cfg(not(target_os = "none"))]
    pub(crate) const fn has(&self, fault: Fault) -> bool {
        self.faults & 1 << fault as u32 != 0
    }

    #[cfg(target_os = "none")]
    pub(crate) const fn has(&self, _fault: Fault) -> bool {
        false
    }
}

/// Margin below the speed where the diodes begin to rectify.
const RECTIFYING_MARGIN: f32 = 0.9;

/// The safe state for an electrical angular speed in rad/s: gates off below `0.9 udc/(√3 ψ_f)`, short circuit above. What is not
/// finite counts as slow, because a short circuit at speed zero would be safe as well, but open gates need no gate supply.
/// A link above its nominal voltage counts as nominal: it will not stay there.
#[inline(never)]
pub fn safe_state(omega: f32, udc_v: f32, ratings: &Ratings) -> SafeState {
    let nominal_v = ratings.dc_link_nominal_v;
    let udc_v = if udc_v < nominal_v { udc_v } else { nominal_v };
    if emf_v(omega, ratings) > RECTIFYING_MARGIN * udc_v {
        SafeState::ShortCircuit
    } else {
        SafeState::GatesOff
    }
}

/// What the power stage tells of itself: nothing, mostly.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LegFaults {
    /// Devices whose drivers have found a short circuit and block, a bit each, from bit 0 on uh ul vh vl wh wl.
    pub blocked: u8,
    /// Legs whose output stayed at the lower rail while the upper device was to conduct, a bit each from u on.
    pub low: u8,
    /// Legs whose output stayed at the upper rail while the lower device was to conduct.
    pub high: u8,
}

impl LegFaults {
    /// The fault, if there is one.
    pub fn check(&self) -> Option<Violation> {
        if self.blocked != 0 {
            return Some((Fault::DriverBlocked, f32::from(self.blocked), 0.0));
        }
        let astray = self.low | self.high;
        (astray != 0).then_some((Fault::LegStuck, f32::from(astray), 0.0))
    }

    /// The safe state with such legs, for an electrical angular speed in rad/s; with sound ones that of [`safe_state`].
    ///
    /// - A driver that blocks alone has found the other device of its leg conducting: then the short circuit at that one's rail is
    ///   safe at every speed. With the gates off this leg and the diodes of the others would rectify the EMF into one half-wave
    ///   of several times the short circuit's current; and at the other rail the machine would have the whole link across it.
    /// - A leg without both devices makes the short circuit lopsided: gates off for as long as the link stands the EMF.
    /// - A leg without one of its devices takes part in the short circuit at the rail where it was seen.
    pub fn safe_state(&self, omega: f32, udc_v: f32, ratings: &Ratings) -> SafeState {
        const UPPER: u8 = 0b01_0101;
        let (upper, lower) = (self.blocked & UPPER, self.blocked >> 1 & UPPER);
        if lower & !upper != 0 {
            return SafeState::UpperShortCircuit;
        }
        if upper & !lower != 0 {
            return SafeState::ShortCircuit;
        }
        let usual = safe_state(omega, udc_v, ratings);
        let stands_emf = emf_v(omega, ratings) < ratings.trip_dc_over_v;
        match usual {
            SafeState::ShortCircuit if self.blocked != 0 && stands_emf => SafeState::GatesOff,
            SafeState::ShortCircuit if self.high != 0 => SafeState::UpperShortCircuit,
            usual => usual,
        }
    }
}

/// Peak of the EMF between two phases without current, in V.
fn emf_v(omega: f32, ratings: &Ratings) -> f32 {
    omega.abs() * SQRT_3 * ratings.magnet_flux_wb
}

/// How far an angle may be off what the speed makes of the one before, in electrical rad. The tracker's lag behind a rotor that
/// accelerates by itself is a fifth of it.
pub const SURPRISE_RAD: f32 = 0.05;

/// The angle, `surprise_rad` off what was expected.
pub fn check_angle(surprise_rad: f32) -> Option<Violation> {
    let off_rad = surprise_rad.abs();
    (off_rad > SURPRISE_RAD).then_some((Fault::AngleLost, off_rad, SURPRISE_RAD))
}

/// Share of the largest current that the sum of the phases may reach.
const PHASE_SUM_SHARE: f32 = 0.1;

/// The first limit that a fault breaks, with its value: (fault, value, limit).
pub type Violation = (Fault, f32, f32);

/// Phase currents alone, as both interrupts sample them.
pub fn check_currents(currents_a: &Abc, ratings: &Ratings) -> Option<Violation> {
    let sum = currents_a.a + currents_a.b + currents_a.c;
    if !sum.is_finite() {
        return Some((Fault::NotFinite, sum, f32::MAX));
    }
    let peak = currents_a.peak();
    if peak > ratings.trip_current_a {
        return Some((Fault::Overcurrent, peak, ratings.trip_current_a));
    }
    let sum_limit = PHASE_SUM_SHARE * ratings.max_current_a;
    if sum.abs() > sum_limit {
        return Some((Fault::PhaseSum, sum, sum_limit));
    }
    None
}

/// Everything the control interrupt measures; `omega` electrical, in rad/s.
pub fn check_measurements(measured: &Measurements, omega: f32, ratings: &Ratings) -> Option<Violation> {
    let udc = measured.udc_v;
    if !udc.is_finite() {
        return Some((Fault::NotFinite, udc, f32::MAX));
    }
    if udc > ratings.trip_dc_over_v {
        return Some((Fault::DcOvervoltage, udc, ratings.trip_dc_over_v));
    }
    check_speed(omega, ratings).or_else(|| check_currents(&measured.currents_a, ratings))
}

/// The link while the gates may be on: without them it may be empty.
pub fn check_undervoltage(udc_v: f32, ratings: &Ratings) -> Option<Violation> {
    (udc_v < ratings.trip_dc_under_v).then_some((Fault::DcUndervoltage, udc_v, ratings.trip_dc_under_v))
}

/// The operator's demand: any finite number is a demand, which the envelope limits.
pub fn check_demand(demand: &Demand) -> Option<Violation> {
    let torque = demand.torque_nm;
    if torque.is_finite() { None } else { Some((Fault::NotFinite, torque, f32::MAX)) }
}

/// The ZS9's limits besides those of its motors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkLimits {
    /// Source voltage below which the drive trips, in V.
    pub source_min_v: f32,
    /// Capacitor voltage above which it trips, in V.
    pub capacitor_max_v: f32,
    /// Largest shoot-through duty, 0 ..= 0.5.
    pub duty_max: f32,
}

impl LinkLimits {
    /// The duty that a link voltage needs, `(1 − U_dc/U_in)/2`, if it is outside the range.
    pub fn check_link_reference(&self, link_v: f32, source_v: f32) -> Option<Violation> {
        if !link_v.is_finite() {
            return Some((Fault::NotFinite, link_v, f32::MAX));
        }
        let duty = if link_v > source_v { 0.5 - 0.5 * source_v / link_v } else { 0.0 };
        self.check_duty(duty)
    }

    /// A duty that is commanded.
    pub fn check_duty(&self, duty: f32) -> Option<Violation> {
        // Not a number is outside as well.
        let inside = (0.0..=self.duty_max).contains(&duty);
        (!inside).then_some((Fault::DutyRange, duty, self.duty_max))
    }

    /// Source and capacitors.
    pub fn check_link(&self, source_v: f32, capacitor_v: f32) -> Option<Violation> {
        if !(source_v + capacitor_v).is_finite() {
            return Some((Fault::NotFinite, source_v + capacitor_v, f32::MAX));
        }
        if source_v < self.source_min_v {
            return Some((Fault::SourceUndervoltage, source_v, self.source_min_v));
        }
        if capacitor_v > self.capacitor_max_v {
            return Some((Fault::CapacitorOvervoltage, capacitor_v, self.capacitor_max_v));
        }
        None
    }
}

/// Mechanical overspeed, for an electrical speed in rad/s.
pub fn check_speed(omega: f32, ratings: &Ratings) -> Option<Violation> {
    if omega.abs() > ratings.trip_speed_rad_s * ratings.pole_pairs {
        return Some((Fault::Overspeed, omega.abs() / ratings.pole_pairs, ratings.trip_speed_rad_s));
    }
    None
}

/// Control periods for which a measurement may repeat to the last bit.
const FROZEN_PERIODS: u32 = 20;
/// Share of the largest current above which a current that never changes is suspicious.
const FROZEN_CURRENT_SHARE: f32 = 0.05;
/// What the rotor must have turned, by its last known speed, before an unmoving angle is suspicious, in electrical rad.
const FROZEN_TURN_RAD: f32 = 0.2;
/// How long that speed is believed, in s: a sensor that stands still is found above 10 rad/s, and a rotor that stops within a count
/// of its encoder is not taken for one.
const BELIEVED_S: f32 = 0.02;

/// Looks for measurements that no longer move.
#[derive(Clone, Copy, Debug)]
pub struct FrozenWatch {
    /// Currents and angle of the last period.
    last: Option<(Abc, Angle)>,
    currents_for: u32,
    angle_for: u32,
    /// Electrical speed while the angle last moved, fading, in rad/s: the tracker soon believes a sensor that stands still.
    moving: f32,
    turned_rad: f32,
}

impl FrozenWatch {
    /// Nothing seen yet.
    pub const fn new() -> Self {
        Self { last: None, currents_for: 0, angle_for: 0, moving: 0.0, turned_rad: 0.0 }
    }

    /// What the rotor should have turned while its angle stood still, and how much of that is a fault, in electrical rad.
    pub fn turned_rad(&self) -> (f32, f32) {
        (self.turned_rad, FROZEN_TURN_RAD)
    }

    /// Whether the angle was the same in the last two periods.
    pub fn angle_stands(&self) -> bool {
        self.angle_for > 0
    }

    /// One control period; `omega` is the electrical speed, in rad/s. Call it while pulses are made.
    pub fn check(
        &mut self,
        measured: &Measurements,
        omega: f32,
        period_s: f32,
        ratings: &Ratings,
    ) -> Option<Violation> {
        let (currents_a, angle) = self.last.replace((measured.currents_a, measured.angle))?;
        let flowing = || measured.currents_a.peak() > FROZEN_CURRENT_SHARE * ratings.max_current_a;
        let same_currents = currents_a == measured.currents_a;
        self.currents_for = if same_currents && flowing() { self.currents_for + 1 } else { 0 };
        if angle == measured.angle {
            self.angle_for += 1;
            self.turned_rad += self.moving * period_s;
            self.moving -= self.moving * (period_s / BELIEVED_S);
        } else {
            self.angle_for = 0;
            self.moving = omega.abs();
            self.turned_rad = 0.0;
        }
        let frozen_angle = self.turned_rad > FROZEN_TURN_RAD;
        let periods = if frozen_angle { self.angle_for } else { self.currents_for };
        if frozen_angle || self.currents_for >= FROZEN_PERIODS {
            return Some((Fault::Frozen, periods as f32, FROZEN_PERIODS as f32));
        }
        None
    }
}

impl Default for FrozenWatch {
    fn default() -> Self {
        Self::new()
    }
}
