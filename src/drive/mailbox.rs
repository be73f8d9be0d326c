//! The mailboxes between the operator in the idle loop and the control interrupt: words with instants, so that the same control period
//! sees the same command wherever the idle loop stood.

use crate::cell::{Mailbox, Seqlock, Words};
use crate::control::{Demand, LinkWindow};
use crate::modulation::Mode;
use crate::nine_switch::Scheme;
use crate::ports::{DriveCommand, DualDriveCommand, DualReport, MotorDemand, Report};
use crate::protection::{Trip, trip_from_words, trip_to_words};
use crate::time::{Clock, Instant};
use core::sync::atomic::{AtomicU32, Ordering};

/// Control periods in a slot, the operator's step.
pub const SLOT_PERIODS: u32 = 10;

/// Between the PMaSynRM drive's operator and its control interrupt.
pub type OperatorMailboxes = Mailboxes<DriveCommand, Observation, 7, 12>;
/// Between the ZS9's operator and its control interrupt.
pub type DualOperatorMailboxes = Mailboxes<DualDriveCommand, DualObservation, 7, 17>;

/// The drive's observation of itself: words of one control interrupt.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Observation {
    /// The control instant.
    pub at: Instant,
    /// DC-link voltage, in V.
    pub udc_v: f32,
    /// Largest magnitude of a phase current, in A.
    pub current_a: f32,
    /// Electrical angular speed, in rad/s.
    pub omega: f32,
    /// `true` once the speed has been followed long enough to be used.
    pub speed_known: bool,
    /// Torque demand after envelope, slew and limits, in N·m.
    pub torque_nm: f32,
    /// The fault that either side has latched.
    pub trip: Option<Trip>,
    /// Number of the last acknowledge that both sides have carried out.
    pub acknowledged: u8,
    /// Current reference, d axis, in A.
    pub id_ref_a: f32,
    /// Current reference, q axis, in A.
    pub iq_ref_a: f32,
    /// Commanded fundamental, peak phase, in V.
    pub voltage_v: f32,
    /// Pulse pattern that control worked for.
    pub mode: Mode,
}

/// The ZS9's observation of itself: words of one control interrupt.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DualObservation {
    /// The control instant.
    pub at: Instant,
    /// The report of its control task.
    pub report: DualReport,
}

/// The observation that a drive makes of itself in the control interrupt that begins a slot.
pub trait Slotted: Copy {
    /// The control interrupt's report.
    type Report;
    /// The observation of a report, at its instant.
    fn of(at: Instant, report: &Self::Report) -> Self;
    /// That instant.
    fn at(&self) -> Instant;
    /// The word of a drive that has not started: the fault that says why, and no measurement.
    fn refused(at: Instant, trip: Trip) -> Self;
}

impl Slotted for Observation {
    type Report = Report;

    #[inline]
    fn of(at: Instant, report: &Report) -> Self {
        Self {
            at,
            udc_v: report.udc_v,
            current_a: report.current_a,
            omega: report.frequency_hz * core::f32::consts::TAU,
            speed_known: report.speed_known,
            torque_nm: report.torque_nm,
            trip: report.trip,
            acknowledged: report.acknowledged,
            id_ref_a: report.id_a,
            iq_ref_a: report.iq_a,
            voltage_v: report.voltage_v,
            mode: report.mode,
        }
    }

    #[inline]
    fn at(&self) -> Instant {
        self.at
    }

    fn refused(at: Instant, trip: Trip) -> Self {
        let report = Report { udc_v: f32::NAN, trip: Some(trip), ..Report::default() };
        Self::of(at, &report)
    }
}

impl Slotted for DualObservation {
    type Report = DualReport;

    #[inline]
    fn of(at: Instant, report: &DualReport) -> Self {
        Self { at, report: *report }
    }

    #[inline]
    fn at(&self) -> Instant {
        self.at
    }

    fn refused(at: Instant, trip: Trip) -> Self {
        let (capacitor_v, source_v) = (f32::NAN, f32::NAN);
        Self { at, report: DualReport { capacitor_v, source_v, trip: Some(trip), ..DualReport::default() } }
    }
}

/// A command and from when on it holds; that is the first word.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timed<C> {
    command: C,
    from: Instant,
}

/// The word of [`Timed`] that says from when on it holds.
const FROM: usize = 0;

impl Words<7> for Timed<DriveCommand> {
    fn to_words(self) -> [u32; 7] {
        let DriveCommand { enable, demand, window, acknowledge } = self.command;
        let flags = u32::from(enable) | u32::from(demand.slew_limited) << 1 | u32::from(acknowledge) << 8;
        [
            self.from.0,
            flags,
            demand.torque_nm.to_bits(),
            window.motoring_none_v.to_bits(),
            window.motoring_full_v.to_bits(),
            window.braking_full_v.to_bits(),
            window.braking_none_v.to_bits(),
        ]
    }

    fn from_words(words: [u32; 7]) -> Self {
        let [from, flags, torque, motoring_none, motoring_full, braking_full, braking_none] = words;
        Self {
            command: DriveCommand {
                enable: flags & 1 != 0,
                demand: Demand { torque_nm: f32::from_bits(torque), slew_limited: flags & 2 != 0 },
                window: LinkWindow {
                    motoring_none_v: f32::from_bits(motoring_none),
                    motoring_full_v: f32::from_bits(motoring_full),
                    braking_full_v: f32::from_bits(braking_full),
                    braking_none_v: f32::from_bits(braking_none),
                },
                acknowledge: (flags >> 8) as u8,
            },
            from: Instant(from),
        }
    }
}

impl Words<7> for Timed<DualDriveCommand> {
    fn to_words(self) -> [u32; 7] {
        let DualDriveCommand { enable, demands, speed_torque_nm, link_ref_v, scheme, acknowledge } =
            self.command;
        let word = |demand| match demand {
            MotorDemand::Torque(Demand { torque_nm, .. }) => (0, torque_nm.to_bits()),
            MotorDemand::Speed(speed) => (1, speed.to_bits()),
        };
        let [(kind1, d1), (kind2, d2)] = demands.map(word);
        let [l1, l2] = speed_torque_nm.map(f32::to_bits);
        let flags = u32::from(enable) | kind1 << 1 | kind2 << 2 | u32::from(acknowledge) << 8;
        let flags = flags | (scheme as u32) << 16;
        [self.from.0, flags, d1, d2, l1, l2, link_ref_v.to_bits()]
    }

    fn from_words(words: [u32; 7]) -> Self {
        let [from, flags, d1, d2, l1, l2, link_ref] = words;
        let demand = |bit: u32, word| match flags & bit {
            0 => MotorDemand::Torque(Demand { torque_nm: f32::from_bits(word), slew_limited: true }),
            _ => MotorDemand::Speed(f32::from_bits(word)),
        };
        Self {
            command: DualDriveCommand {
                enable: flags & 1 != 0,
                demands: [demand(2, d1), demand(4, d2)],
                speed_torque_nm: [l1, l2].map(f32::from_bits),
                link_ref_v: f32::from_bits(link_ref),
                scheme: Scheme::from_code(flags >> 16),
                acknowledge: (flags >> 8) as u8,
            },
            from: Instant(from),
        }
    }
}

impl Words<12> for Observation {
    fn to_words(self) -> [u32; 12] {
        let [code, value, limit, tripped_at] = trip_to_words(self.trip);
        let flags = u32::from(self.acknowledged) | u32::from(self.speed_known) << 8;
        let code = code | flags << 16 | (self.mode as u32) << 26;
        let measured = [self.udc_v, self.current_a, self.omega, self.torque_nm].map(f32::to_bits);
        let [udc, current, omega, torque] = measured;
        let [id, iq, voltage] = [self.id_ref_a, self.iq_ref_a, self.voltage_v].map(f32::to_bits);
        [self.at.0, udc, current, omega, torque, code, value, limit, tripped_at, id, iq, voltage]
    }

    fn from_words(words: [u32; 12]) -> Self {
        let [at, udc, current, omega, torque, code, value, limit, tripped_at, id, iq, voltage] = words;
        Self {
            at: Instant(at),
            udc_v: f32::from_bits(udc),
            current_a: f32::from_bits(current),
            omega: f32::from_bits(omega),
            speed_known: code >> 24 & 1 != 0,
            torque_nm: f32::from_bits(torque),
            trip: trip_from_words([code, value, limit, tripped_at]),
            acknowledged: (code >> 16) as u8,
            id_ref_a: f32::from_bits(id),
            iq_ref_a: f32::from_bits(iq),
            voltage_v: f32::from_bits(voltage),
            mode: Mode::from_code(code >> 26),
        }
    }
}

impl Words<17> for DualObservation {
    #[inline]
    fn to_words(self) -> [u32; 17] {
        let [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p] = self.report.to_words();
        [self.at.0, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p]
    }

    fn from_words(words: [u32; 17]) -> Self {
        let [at, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p] = words;
        let report = DualReport::from_words([a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p]);
        Self { at: Instant(at), report }
    }
}

/// Commands down, observations up.
pub struct Mailboxes<C, O, const COMMAND: usize, const OBSERVATION: usize> {
    command: Mailbox<Timed<C>, COMMAND>,
    observed: Seqlock<O, OBSERVATION>,
    /// Control periods until the next slot.
    left: AtomicU32,
}

impl<C, O, const COMMAND: usize, const OBSERVATION: usize> Mailboxes<C, O, COMMAND, OBSERVATION>
where
    C: Default,
    O: Slotted + Words<OBSERVATION>,
    Timed<C>: Words<COMMAND>,
{
    /// Nothing commanded, nothing seen.
    #[cfg(not(loom))]
    pub const fn new() -> Self {
        Self { command: Mailbox::new(), observed: Seqlock::new(), left: AtomicU32::new(0) }
    }

    /// In the control interrupt: what is commanded at `now`; nothing before the first command.
    #[inline]
    pub(super) fn command(&self, now: Instant) -> C {
        match self.command.newest(|timed| now.reached(Instant(timed.word::<FROM>()))) {
            Some(timed) => timed.command,
            None => C::default(),
        }
    }

    /// In the control interrupt: what it did at `now`. The first of every [`SLOT_PERIODS`] begins a slot.
    #[inline]
    pub(super) fn tell(&self, now: Instant, report: &O::Report) {
        let left = self.left.load(Ordering::Relaxed);
        if left > 0 {
            self.left.store(left - 1, Ordering::Relaxed);
            return;
        }
        self.left.store(SLOT_PERIODS - 1, Ordering::Relaxed);
        self.observed.publish(O::of(now, report));
    }

    /// In the idle loop: the newest slot's words; `None` before the first, or when every try was overtaken.
    #[inline(never)]
    pub fn observed(&self) -> Option<O> {
        self.observed.read()
    }

    /// In the idle loop: what is commanded from an instant on, in a slot the next slot's beginning.
    pub fn publish(&self, command: C, from: Instant) {
        self.command.publish(Timed { command, from });
    }
}

#[cfg(not(loom))]
impl<C, O, const COMMAND: usize, const OBSERVATION: usize> Default for Mailboxes<C, O, COMMAND, OBSERVATION>
where
    C: Default,
    O: Slotted + Words<OBSERVATION>,
    Timed<C>: Words<COMMAND>,
{
    fn default() -> Self {
        Self::new()
    }
}

/// The slot after the one that begins at `at`.
pub fn next_slot(at: Instant, clock: &Clock) -> Instant {
    at.after(SLOT_PERIODS.wrapping_mul(clock.control_ticks))
}

/// Slots from the one that began at `done` to the one at `at`, 1 at least.
pub fn slots_between(done: Instant, at: Instant, clock: &Clock) -> u32 {
    let ticks = at.since(done).unsigned_abs();
    (ticks / SLOT_PERIODS.wrapping_mul(clock.control_ticks).max(1)).max(1)
}
