//! What travels between the interrupts, and what control reports.

use crate::cell::Words;
use crate::frames::{Abc, Angle};
use crate::modulation::{CarrierPeriod, Mode, Reference};
use crate::protection::{Fault, SafeState, Trip};
use crate::time::Instant;

/// What control wants of the gates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gates {
    /// Pulses.
    Pulse,
    /// All off.
    Off,
}

/// From control to the modulator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoltageCommand {
    /// The fundamental; its `at` is the sample's instant.
    pub reference: Reference,
    /// From when on the command may be used: a fixed time after its sample, whenever the task really finished.
    pub valid_from: Instant,
    /// Whether to make pulses at all.
    pub gates: Gates,
    /// Whether it is for the half that is already committed, not for the one after it.
    pub revises: bool,
    /// Number of the operator's last acknowledge.
    pub acknowledge: u8,
}

impl Words<9> for VoltageCommand {
    fn to_words(self) -> [u32; 9] {
        let reference = self.reference;
        [
            reference.voltage_v.to_bits(),
            reference.angle.0,
            reference.carrier_angle.0,
            reference.rate.to_bits(),
            reference.at.0,
            reference.udc_v.to_bits(),
            reference.depth.to_bits(),
            self.valid_from.0,
            u32::from(self.gates == Gates::Pulse)
                | u32::from(self.revises) << 1
                | u32::from(self.acknowledge) << 8,
        ]
    }

    fn from_words(words: [u32; 9]) -> Self {
        let [voltage, angle, carrier_angle, rate, at, udc, depth, valid_from, flags] = words;
        Self {
            reference: Reference {
                voltage_v: f32::from_bits(voltage),
                angle: Angle(angle),
                carrier_angle: Angle(carrier_angle),
                rate: f32::from_bits(rate),
                at: Instant(at),
                udc_v: f32::from_bits(udc),
                depth: f32::from_bits(depth),
            },
            valid_from: Instant(valid_from),
            gates: if flags & 1 != 0 { Gates::Pulse } else { Gates::Off },
            revises: flags & 2 != 0,
            acknowledge: (flags >> 8) as u8,
        }
    }
}

/// From the modulator to control: three consecutive carrier halves and the samples at their boundaries, so that control
/// can look at the state of affairs at its own sample even if the PWM interrupt came in between.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Applied {
    /// Instant at which `running` began.
    pub at: Instant,
    /// The half before `running`.
    pub before: CarrierPeriod,
    /// The half that began at `at`.
    pub running: CarrierPeriod,
    /// The half that follows, already committed.
    pub next: CarrierPeriod,
    /// Phase currents at `at`, in A.
    pub currents_a: Abc,
    /// Phase currents at the boundary before, in A.
    pub currents_before_a: Abc,
    /// Whether the modulator sees the machine in the mirror (turning backward).
    pub mirrored: bool,
    /// A fault that the PWM interrupt found.
    pub trip: Option<Trip>,
    /// Number of the acknowledge that it carried out last, at `at` and at the boundary before.
    pub acknowledged: [u8; 2],
}

impl Applied {
    /// Gates off, in halves of one length, the present one from `at` on.
    pub const fn at_rest(at: Instant, off: CarrierPeriod) -> Self {
        let currents_a = Abc { a: 0.0, b: 0.0, c: 0.0 };
        Self {
            at,
            before: off,
            running: off,
            next: off,
            currents_a,
            currents_before_a: currents_a,
            mirrored: false,
            trip: None,
            acknowledged: [0; 2],
        }
    }
}

impl Words<27> for Applied {
    fn to_words(self) -> [u32; 27] {
        let [b0, b1, b2, b3, b4] = half_to_words(self.before);
        let [r0, r1, r2, r3, r4] = half_to_words(self.running);
        let [n0, n1, n2, n3, n4] = half_to_words(self.next);
        let [ia, ib, ic] = currents_to_words(self.currents_a);
        let [ja, jb, jc] = currents_to_words(self.currents_before_a);
        let [t0, t1, t2, t3] = trip_to_words(self.trip);
        let [now, before] = self.acknowledged.map(u32::from);
        let (at, mirrored) = (self.at.0, u32::from(self.mirrored) | now << 8 | before << 16);
        [
            at, b0, b1, b2, b3, b4, r0, r1, r2, r3, r4, n0, n1, n2, n3, n4, ia, ib, ic, ja, jb, jc, mirrored,
            t0, t1, t2, t3,
        ]
    }

    fn from_words(words: [u32; 27]) -> Self {
        let [at, b0, b1, b2, b3, b4, r0, r1, r2, r3, r4, n0, n1, n2, n3, n4, rest @ ..] = words;
        let [ia, ib, ic, ja, jb, jc, mirrored, trip @ ..] = rest;
        Self {
            at: Instant(at),
            before: half_from_words([b0, b1, b2, b3, b4]),
            running: half_from_words([r0, r1, r2, r3, r4]),
            next: half_from_words([n0, n1, n2, n3, n4]),
            currents_a: currents_from_words([ia, ib, ic]),
            currents_before_a: currents_from_words([ja, jb, jc]),
            mirrored: mirrored & 1 != 0,
            trip: trip_from_words(trip),
            acknowledged: [(mirrored >> 8) as u8, (mirrored >> 16) as u8],
        }
    }
}

/// A carrier half as five words: period, three compares, and levels, modes and number packed.
pub fn half_to_words(half: CarrierPeriod) -> [u32; 5] {
    let [u, v, w] = half.compare_ticks;
    let [lu, lv, lw] = half.start_levels.map(u32::from);
    let [first, second] = half.ahead.map(|mode| mode as u32);
    let packed = lu | lv << 1 | lw << 2 | (half.mode as u32) << 8 | u32::from(half.half) << 16;
    let packed = packed | first << 24 | second << 28;
    [half.period_ticks, u, v, w, packed]
}

/// The inverse of [`half_to_words`].
pub fn half_from_words(words: [u32; 5]) -> CarrierPeriod {
    let [period_ticks, u, v, w, packed] = words;
    CarrierPeriod {
        period_ticks,
        compare_ticks: [u, v, w],
        start_levels: [packed & 1 != 0, packed & 2 != 0, packed & 4 != 0],
        mode: Mode::from_code(packed >> 8 & 0xFF),
        half: (packed >> 16) as u8,
        ahead: [Mode::from_code(packed >> 24 & 0xF), Mode::from_code(packed >> 28)],
    }
}

fn currents_to_words(currents: Abc) -> [u32; 3] {
    [currents.a.to_bits(), currents.b.to_bits(), currents.c.to_bits()]
}

fn currents_from_words(words: [u32; 3]) -> Abc {
    let [a, b, c] = words;
    Abc { a: f32::from_bits(a), b: f32::from_bits(b), c: f32::from_bits(c) }
}

/// A latched fault as four words: fault and safe state, value, limit, instant; zeros for none.
pub fn trip_to_words(trip: Option<Trip>) -> [u32; 4] {
    match trip {
        None => [0; 4],
        Some(trip) => [
            trip.fault as u32 | (trip.safe as u32) << 8,
            trip.value.to_bits(),
            trip.limit.to_bits(),
            trip.at.0,
        ],
    }
}

/// The inverse of [`trip_to_words`].
pub fn trip_from_words(words: [u32; 4]) -> Option<Trip> {
    let [code, value, limit, at] = words;
    Some(Trip {
        fault: Fault::from_code(code & 0xFF)?,
        value: f32::from_bits(value),
        limit: f32::from_bits(limit),
        at: Instant(at),
        safe: SafeState::from_code(code >> 8 & 0xFF),
    })
}

/// What the control task did in one period, for traces and telemetry.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Report {
    /// Torque demand after envelope, slew and voltage limit, in N·m.
    pub torque_nm: f32,
    /// Current reference, d axis, in A.
    pub id_a: f32,
    /// Current reference, q axis, in A.
    pub iq_a: f32,
    /// Commanded fundamental, peak phase, in V.
    pub voltage_v: f32,
    /// Stator frequency, in Hz, negative backward.
    pub frequency_hz: f32,
    /// By how much the machine's flux linkage seems to exceed the map's, as a share; 0 where it turns too slowly to tell.
    pub map_error: f32,
    /// The latched fault, if any.
    pub trip: Option<Trip>,
    /// DC-link voltage, in V.
    pub udc_v: f32,
    /// Largest magnitude of a phase current, in A.
    pub current_a: f32,
    /// Whether the speed has been followed long enough to be used.
    pub speed_known: bool,
    /// Number of the acknowledge that both interrupts have carried out.
    pub acknowledged: u8,
}

impl Words<12> for Report {
    fn to_words(self) -> [u32; 12] {
        let [code, value, limit, at] = trip_to_words(self.trip);
        let code = code | u32::from(self.acknowledged) << 16 | u32::from(self.speed_known) << 24;
        [
            self.torque_nm.to_bits(),
            self.id_a.to_bits(),
            self.iq_a.to_bits(),
            self.voltage_v.to_bits(),
            self.frequency_hz.to_bits(),
            self.map_error.to_bits(),
            code,
            value,
            limit,
            at,
            self.udc_v.to_bits(),
            self.current_a.to_bits(),
        ]
    }

    fn from_words(words: [u32; 12]) -> Self {
        let [torque, id, iq, voltage, frequency, map_error, code, value, limit, at, udc, current] = words;
        Self {
            torque_nm: f32::from_bits(torque),
            id_a: f32::from_bits(id),
            iq_a: f32::from_bits(iq),
            voltage_v: f32::from_bits(voltage),
            frequency_hz: f32::from_bits(frequency),
            map_error: f32::from_bits(map_error),
            trip: trip_from_words([code, value, limit, at]),
            udc_v: f32::from_bits(udc),
            current_a: f32::from_bits(current),
            speed_known: code >> 24 & 1 != 0,
            acknowledged: (code >> 16) as u8,
        }
    }
}
