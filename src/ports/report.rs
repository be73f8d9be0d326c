//! The control tasks' reports of a period, for traces, operator and telemetry.

use crate::cell::Words;
use crate::frames::Angle;
use crate::modulation::Mode;
use crate::nine_switch::Scheme;
use crate::protection::{Trip, trip_from_words, trip_to_words};

/// The control task's report of one period, for traces and telemetry.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Report {
    /// Torque demand after envelope, slew and voltage limit, in N·m.
    pub torque_nm: f32,
    /// Torque of the machine from currents and map, smoothed, in N·m; not a number if the law does not estimate it.
    pub flowing_nm: f32,
    /// Current reference, d axis, in A.
    pub id_a: f32,
    /// Current reference, q axis, in A.
    pub iq_a: f32,
    /// Commanded fundamental, peak phase, in V.
    pub voltage_v: f32,
    /// Electrical angular speed, in rad/s, negative backward.
    pub omega: f32,
    /// Share by which the machine's flux linkage seems to exceed the map's; 0 if it turns too slowly to tell.
    pub map_error: f32,
    /// The latched fault, if any.
    pub trip: Option<Trip>,
    /// DC-link voltage, in V.
    pub udc_v: f32,
    /// Largest magnitude of a phase current, in A.
    pub current_a: f32,
    /// Sum of the squares of the phase currents, in A²: the copper loss over the resistance.
    pub squares_a2: f32,
    /// `true` once the speed has been followed long enough to be used.
    pub speed_known: bool,
    /// Number of the acknowledge that both interrupts have carried out.
    pub acknowledged: u8,
    /// Pulse pattern for which the voltage was made.
    pub mode: Mode,
    /// Correction of the position sensor's zero, electrical: the drive adds it to the sensor's angle.
    pub angle_zero: Angle,
    /// `true` while that is being found.
    pub calibrating: bool,
}

impl Report {
    /// The report of a drive that has not started: the fault that gives the reason, and no measurement.
    pub fn refused(trip: Trip) -> Self {
        Self { udc_v: f32::NAN, trip: Some(trip), ..Self::default() }
    }
}

impl Words<15> for Report {
    #[inline]
    fn to_words(self) -> [u32; 15] {
        let [code, value, limit, at] = trip_to_words(self.trip);
        let flags = u32::from(self.acknowledged)
            | u32::from(self.speed_known) << 8
            | u32::from(self.calibrating) << 9;
        let code = code | flags << 16 | (self.mode as u32) << 26;
        [
            self.torque_nm.to_bits(),
            self.id_a.to_bits(),
            self.iq_a.to_bits(),
            self.voltage_v.to_bits(),
            self.omega.to_bits(),
            self.map_error.to_bits(),
            code,
            value,
            limit,
            at,
            self.udc_v.to_bits(),
            self.current_a.to_bits(),
            self.flowing_nm.to_bits(),
            self.angle_zero.0,
            self.squares_a2.to_bits(),
        ]
    }

    fn from_words(words: [u32; 15]) -> Self {
        let [torque, id, iq, voltage, omega, map_error, code, value, limit, at, measured @ ..] = words;
        let [udc, current, flowing, angle_zero, squares] = measured;
        Self {
            torque_nm: f32::from_bits(torque),
            id_a: f32::from_bits(id),
            iq_a: f32::from_bits(iq),
            voltage_v: f32::from_bits(voltage),
            omega: f32::from_bits(omega),
            map_error: f32::from_bits(map_error),
            trip: trip_from_words([code, value, limit, at]),
            udc_v: f32::from_bits(udc),
            current_a: f32::from_bits(current),
            squares_a2: f32::from_bits(squares),
            flowing_nm: f32::from_bits(flowing),
            speed_known: code >> 24 & 1 != 0,
            acknowledged: (code >> 16) as u8,
            mode: Mode::from_code(code >> 26),
            angle_zero: Angle(angle_zero),
            calibrating: code >> 25 & 1 != 0,
        }
    }
}

/// The report of the ZS9's control task of one period, for traces and telemetry.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DualReport {
    /// Torque references after all limits, in N·m: upper motor, lower motor.
    pub torque_nm: [f32; 2],
    /// Commanded peak phase voltages, in V.
    pub voltage_v: [f32; 2],
    /// Flags of the motors that are at their voltage limit.
    pub weakening: [bool; 2],
    /// Shoot-through duty.
    pub duty: f32,
    /// Reference of the inductor current, in A.
    pub inductor_ref_a: f32,
    /// The place of the zero vectors.
    pub scheme: Scheme,
    /// The latched fault, if any.
    pub trip: Option<Trip>,
    /// Electrical speeds, in rad/s.
    pub omega: [f32; 2],
    /// Largest magnitudes of a phase current, in A.
    pub current_a: [f32; 2],
    /// Capacitor voltage, in V.
    pub capacitor_v: f32,
    /// Source voltage, in V.
    pub source_v: f32,
    /// `true` once both speeds have been followed long enough to be used.
    pub speed_known: bool,
    /// Number of the acknowledge that both interrupts have carried out.
    pub acknowledged: u8,
    /// Corrections of the position sensors' zeros, electrical: the drive adds each to its sensor's angle.
    pub angle_zeros: [Angle; 2],
    /// Flags of those that are just being found.
    pub calibrating: [bool; 2],
}

impl DualReport {
    /// The report of a drive that has not started: the fault that gives the reason, and no measurement.
    pub fn refused(trip: Trip) -> Self {
        Self { capacitor_v: f32::NAN, source_v: f32::NAN, trip: Some(trip), ..Self::default() }
    }

    /// Link voltage outside shoot-through, in V.
    pub const fn link_v(&self) -> f32 {
        2.0 * self.capacitor_v - self.source_v
    }
}

const SPEED_KNOWN: u32 = 1 << 24;
const WEAKENING: [u32; 2] = [1 << 25, 1 << 26];
const SCHEME: u32 = 27;
const CALIBRATING: [u32; 2] = [1 << 30, 1 << 31];

impl Words<18> for DualReport {
    #[inline]
    fn to_words(self) -> [u32; 18] {
        let [t1, t2] = self.torque_nm.map(f32::to_bits);
        let [v1, v2] = self.voltage_v.map(f32::to_bits);
        let [w1, w2] = self.omega.map(f32::to_bits);
        let [i1, i2] = self.current_a.map(f32::to_bits);
        let [code, value, limit, at] = trip_to_words(self.trip);
        let flag = |set: bool, bit: u32| if set { bit } else { 0 };
        let ([weak1, weak2], [first, second]) = (self.weakening, WEAKENING);
        let ([calibrates1, calibrates2], [third, fourth]) = (self.calibrating, CALIBRATING);
        let code = code
            | u32::from(self.acknowledged) << 16
            | flag(self.speed_known, SPEED_KNOWN)
            | flag(weak1, first)
            | flag(weak2, second)
            | flag(calibrates1, third)
            | flag(calibrates2, fourth)
            | (self.scheme as u32) << SCHEME;
        let [duty, inductor, capacitor, source] =
            [self.duty, self.inductor_ref_a, self.capacitor_v, self.source_v].map(f32::to_bits);
        let [zero1, zero2] = self.angle_zeros.map(|Angle(angle)| angle);
        [
            t1, t2, v1, v2, duty, inductor, code, value, limit, at, w1, w2, i1, i2, capacitor, source, zero1,
            zero2,
        ]
    }

    fn from_words(words: [u32; 18]) -> Self {
        let [t1, t2, v1, v2, duty, inductor, code, value, limit, at, measured @ .., zero1, zero2] = words;
        let [w1, w2, i1, i2, capacitor_v, source_v] = measured.map(f32::from_bits);
        Self {
            torque_nm: [t1, t2].map(f32::from_bits),
            voltage_v: [v1, v2].map(f32::from_bits),
            weakening: WEAKENING.map(|bit| code & bit != 0),
            duty: f32::from_bits(duty),
            inductor_ref_a: f32::from_bits(inductor),
            scheme: Scheme::from_code(code >> SCHEME & 7),
            trip: trip_from_words([code, value, limit, at]),
            omega: [w1, w2],
            current_a: [i1, i2],
            capacitor_v,
            source_v,
            speed_known: code & SPEED_KNOWN != 0,
            acknowledged: (code >> 16) as u8,
            angle_zeros: [zero1, zero2].map(Angle),
            calibrating: CALIBRATING.map(|bit| code & bit != 0),
        }
    }
}
