//! The mailboxes between the operator in the idle loop and the control interrupt. Words carry instants, so that a given control period sees the same
//! command wherever the idle loop was at the time.

use crate::cell::{Mailbox, Seqlock, Words};
use crate::control::{Demand, LinkWindow, Warmth};
use crate::nine_switch::Scheme;
use crate::ports::{DriveCommand, DualDriveCommand, DualReport, MotorDemand, Report};
use crate::time::{Clock, Instant};

/// Between the PMaSynRM drive's operator and its control interrupt.
pub type OperatorMailboxes = Mailboxes<DriveCommand, Report, 7, 16>;
/// Between the ZS9's operator and its control interrupt.
pub type DualOperatorMailboxes = Mailboxes<DualDriveCommand, DualReport, 7, 19>;

/// The drive's observation of itself: the report of the control interrupt that began a slot.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Observation<R = Report> {
    /// The control instant.
    pub at: Instant,
    /// The report.
    pub report: R,
}

/// A command and the instant from which it holds; the instant is the first word.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timed<C> {
    command: C,
    from: Instant,
}

/// The word of [`Timed`] that says from when the command holds.
const FROM: usize = 0;

impl Words<7> for Timed<DriveCommand> {
    fn to_words(self) -> [u32; 7] {
        let DriveCommand { enable, demand, window, acknowledge, warmth, calibrate } = self.command;
        let flags = u32::from(enable) | u32::from(demand.slew_limited) << 1 | u32::from(calibrate) << 2;
        let flags = flags | u32::from(acknowledge) << 8 | u32::from(warmth.word()) << 16;
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
                warmth: Warmth::from_word((flags >> 16) as u16),
                calibrate: flags & 4 != 0,
            },
            from: Instant(from),
        }
    }
}

impl Words<7> for Timed<DualDriveCommand> {
    fn to_words(self) -> [u32; 7] {
        let DualDriveCommand { enable, demands, speed_torque_nm, link_ref_v, scheme, acknowledge, calibrate } =
            self.command;
        let word = |demand| match demand {
            MotorDemand::Torque(Demand { torque_nm, .. }) => (0, torque_nm.to_bits()),
            MotorDemand::Speed(speed) => (1, speed.to_bits()),
        };
        let [(kind1, d1), (kind2, d2)] = demands.map(word);
        let [l1, l2] = speed_torque_nm.map(f32::to_bits);
        let flags = u32::from(enable) | kind1 << 1 | kind2 << 2 | u32::from(acknowledge) << 8;
        let flags = flags | u32::from(calibrate) << 3 | (scheme as u32) << 16;
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
                calibrate: flags & 8 != 0,
            },
            from: Instant(from),
        }
    }
}

impl Words<16> for Observation<Report> {
    #[inline]
    fn to_words(self) -> [u32; 16] {
        let [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o] = self.report.to_words();
        [self.at.0, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o]
    }

    fn from_words(words: [u32; 16]) -> Self {
        let [at, report @ ..] = words;
        let report = Report::from_words(report);
        Self { at: Instant(at), report }
    }
}

impl Words<19> for Observation<DualReport> {
    #[inline]
    fn to_words(self) -> [u32; 19] {
        let [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r] = self.report.to_words();
        [self.at.0, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r]
    }

    fn from_words(words: [u32; 19]) -> Self {
        let [at, report @ ..] = words;
        let report = DualReport::from_words(report);
        Self { at: Instant(at), report }
    }
}

/// Commands down, observations up.
pub struct Mailboxes<C, R, const COMMAND: usize, const OBSERVATION: usize> {
    command: Mailbox<Timed<C>, COMMAND>,
    observed: Seqlock<Observation<R>, OBSERVATION>,
}

impl<C, R, const COMMAND: usize, const OBSERVATION: usize> Mailboxes<C, R, COMMAND, OBSERVATION>
where
    C: Default,
    R: Copy,
    Observation<R>: Words<OBSERVATION>,
    Timed<C>: Words<COMMAND>,
{
    /// Control's side: `true` if the period that began at the instant has reported, as the first of a slot does.
    pub fn has_told(&self, at: Instant) -> bool {
        self.observed().is_some_and(|observed| observed.at == at)
    }

    /// Nothing commanded, nothing seen.
    #[cfg(not(loom))]
    pub const fn new() -> Self {
        Self { command: Mailbox::new(), observed: Seqlock::new() }
    }

    /// In the control interrupt: the command that holds at `now`; no command before the first one.
    #[inline]
    pub(super) fn command(&self, now: Instant) -> C {
        match self.command.newest(|timed| now.reached(Instant(timed.word::<FROM>()))) {
            Some(timed) => timed.command,
            None => C::default(),
        }
    }

    /// In the control interrupt that begins a slot: what it did at `now`.
    #[inline]
    pub(super) fn tell(&self, now: Instant, report: &R) {
        self.observed.publish(Observation { at: now, report: *report });
    }

    /// In the idle loop: the newest slot's words; `None` before the first slot, or when every attempt to read was overtaken.
    #[inline(never)]
    pub fn observed(&self) -> Option<Observation<R>> {
        self.observed.read()
    }

    /// In the idle loop: publishes a command that holds from an instant on; within a slot that instant is the beginning of the next slot.
    pub fn publish(&self, command: C, from: Instant) {
        self.command.publish(Timed { command, from });
    }
}

/// Time between two reports to the operator, in s.
pub(super) const SLOT_S: f32 = 1e-3;

/// The control interrupt's counter of the periods in a slot, the operator's step: a millisecond.
#[derive(Clone, Copy, Debug)]
pub(super) struct SlotTimer {
    periods: u32,
    /// Periods until the next slot, 1 at least.
    left: u32,
}

impl SlotTimer {
    /// The first period begins a slot.
    pub(super) const fn new(clock: &Clock) -> Self {
        Self { periods: clock.millisecond_periods(), left: 1 }
    }

    /// Counts a period; `true` if it begins a slot.
    #[inline]
    pub(super) fn begins(&mut self) -> bool {
        self.left = self.left.wrapping_sub(1);
        if self.left != 0 {
            return false;
        }
        self.left = self.periods;
        true
    }
}

/// The slot after the one that begins at `at`.
pub fn next_slot(at: Instant, clock: &Clock) -> Instant {
    at.after(slot_ticks(clock))
}

/// Slots from the one that began at `done` to the one at `at`, 1 at least.
pub fn slots_between(done: Instant, at: Instant, clock: &Clock) -> u32 {
    let ticks = at.0.wrapping_sub(done.0);
    (ticks / slot_ticks(clock).max(1)).max(1)
}

/// Length of a slot, in ticks.
#[inline(never)]
fn slot_ticks(clock: &Clock) -> u32 {
    clock.millisecond_periods().wrapping_mul(clock.control_ticks)
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;
    use crate::frames::Angle;

    #[test]
    fn a_slot_is_a_millisecond_at_every_control_rate() {
        for (control_hz, periods) in [(10_000, 10), (20_000, 20), (12_500, 13), (5_000, 5), (1_000, 1)] {
            let clock = Clock::new(25_000_000, 25_000_000 / control_hz);
            let mut slots = SlotTimer::new(&clock);
            let begun = (0..10 * periods).filter(|_| slots.begins()).count();
            assert_eq!(begun, 10, "{control_hz} Hz");
            let (done, passed) = (Instant(u32::MAX - 7), 10 * periods * clock.control_ticks);
            assert_eq!(slots_between(done, done.after(passed), &clock), 10, "{control_hz} Hz");
            assert_eq!(next_slot(done, &clock), done.after(periods * clock.control_ticks));
        }
    }

    const INSTANT: Instant = Instant(0x8765_4321);

    /// Both values of eight flags, in all their combinations.
    fn flags() -> impl Iterator<Item = [bool; 8]> {
        (0..=u8::MAX).map(|number| core::array::from_fn(|bit| number >> bit & 1 != 0))
    }

    #[test]
    fn a_command_of_the_drive_comes_back_word_for_word() {
        for [enable, slew_limited, a, b, c, calibrate, ..] in flags() {
            let acknowledge = u8::from(a) | u8::from(b) << 7 | u8::from(c) << 3;
            let command = DriveCommand {
                enable,
                demand: Demand { torque_nm: -1.5, slew_limited },
                window: LinkWindow {
                    motoring_none_v: 1.0,
                    motoring_full_v: 2.0,
                    braking_full_v: 3.0,
                    braking_none_v: 4.0,
                },
                acknowledge,
                warmth: Warmth::from_word(if a { 0xA5C3 } else { 0x5A3C }),
                calibrate,
            };
            let timed = Timed { command, from: INSTANT };
            assert_eq!(Timed::<DriveCommand>::from_words(timed.to_words()), timed);
            assert_eq!(timed.to_words()[FROM], INSTANT.0);
        }
    }

    #[test]
    fn a_command_of_the_zs9_comes_back_word_for_word() {
        let demand = |is_speed: bool, value| match is_speed {
            true => MotorDemand::Speed(value),
            false => MotorDemand::Torque(Demand { torque_nm: value, slew_limited: true }),
        };
        for [enable, first, second, a, b, calibrate, ..] in flags() {
            for scheme in (0..8).map(Scheme::from_code) {
                let command = DualDriveCommand {
                    enable,
                    demands: [demand(first, -1.0), demand(second, 2.0)],
                    speed_torque_nm: [3.0, 4.0],
                    link_ref_v: 5.0,
                    scheme,
                    acknowledge: u8::from(a) | u8::from(b) << 7,
                    calibrate,
                };
                let timed = Timed { command, from: INSTANT };
                assert_eq!(Timed::<DualDriveCommand>::from_words(timed.to_words()), timed);
            }
        }
    }

    #[test]
    fn an_observation_comes_back_word_for_word() {
        for [speed_known, a, b, first, second, calibrating, ..] in flags() {
            let acknowledged = u8::from(a) | u8::from(b) << 7;
            for code in 0..8 {
                let [torque_nm, id_a, iq_a, voltage_v, omega] = [1.0, -2.0, 3.0, 4.0, -5.0];
                let [map_error, udc_v, current_a, squares_a2, flowing_nm] = [6.0, 7.0, 8.0, 64.0, 9.0];
                let mode = crate::modulation::Mode::from_code(code);
                let report = Report {
                    torque_nm,
                    id_a,
                    iq_a,
                    voltage_v,
                    omega,
                    map_error,
                    trip: None,
                    udc_v,
                    current_a,
                    squares_a2,
                    flowing_nm,
                    speed_known,
                    acknowledged,
                    mode,
                    angle_zero: Angle(0x8123_4567),
                    calibrating,
                };
                let observed = Observation { at: INSTANT, report };
                assert_eq!(Observation::<Report>::from_words(observed.to_words()), observed);
                let report = DualReport {
                    torque_nm: [1.0, 2.0],
                    voltage_v: [3.0, 4.0],
                    weakening: [first, second],
                    duty: 5.0,
                    inductor_ref_a: 6.0,
                    scheme: Scheme::from_code(code),
                    trip: None,
                    omega: [7.0, 8.0],
                    current_a: [9.0, 10.0],
                    capacitor_v: 11.0,
                    source_v: 12.0,
                    speed_known,
                    acknowledged,
                    angle_zeros: [Angle(0x8123_4567), Angle(0x0000_FFFF)],
                    calibrating: [calibrating, first],
                };
                let observed = Observation { at: INSTANT, report };
                assert_eq!(Observation::<DualReport>::from_words(observed.to_words()), observed);
            }
        }
    }

    #[test]
    fn a_period_has_told_of_itself_and_no_other() {
        let mailboxes = DualOperatorMailboxes::new();
        assert!(!mailboxes.has_told(INSTANT), "nobody has");
        mailboxes.tell(INSTANT, &DualReport::default());
        assert!(mailboxes.has_told(INSTANT) && !mailboxes.has_told(INSTANT.after(1)));
    }
}
