//! The pulses: the modulator's steps, made at control's priority for the boundaries at which they will be loaded, and their outcome.

use super::Settings;
use crate::cell::{History, Mailbox, Place};
use crate::drive::messages::{LOADED_WORDS, LoadedRecord, PLANNED_WORDS, PlannedHalf, volt_ticks};
use crate::frames::{Abc, AlphaBeta};
use crate::modulation::{CarrierHalf, Mode, Modulator, Reference, Schedule};
use crate::protection::{FailedCheck, Fault};
use crate::time::{Clock, Instant};

/// Part of a control period by which the PWM interrupt may be late before control considers it lost: more than it takes to enter it.
const PWM_LATE_PART: u32 = 4;

/// Newest records, one of which belongs to the newest boundary at a control interrupt's instant: two may have come since.
const LATEST: u32 = 3;

/// Halves that a control period may plan: five for a locked carrier of a machine that switches once a control period, and one more if it is turned
/// on; eleven of the optimised patterns' short halves.
pub(super) const MOST_PLANNED: u32 = if cfg!(feature = "optimal") { 12 } else { 6 };

/// Halves that the cell to the PWM interrupt holds: those for a period's boundaries, and those planned meanwhile for the next period's.
pub const PLANNED_SLOTS: usize = if cfg!(feature = "optimal") { 32 } else { 16 };

/// Halves that are remembered: those of a period that ended, three that are running or loaded, and those planned ahead.
const REMEMBERED: usize = PLANNED_SLOTS;
const _: () = assert!(2 * MOST_PLANNED as usize + 3 <= REMEMBERED);

/// The halves that control has planned, for the PWM interrupt.
pub type Planned = Mailbox<PlannedHalf, PLANNED_WORDS, PLANNED_SLOTS>;

/// A half that is planned or loaded.
#[derive(Clone, Copy)]
pub(super) struct Half {
    /// The boundary at which it is loaded.
    pub at: Instant,
    /// The next boundary, at which it begins.
    pub begins: Instant,
    pub half: CarrierHalf,
    /// `true` if the modulator saw the machine mirrored (turning backward).
    pub mirrored: bool,
    /// The volt-ticks of the whole half, in ticks; see [`volt_ticks`].
    pub volt_ticks: AlphaBeta,
}

impl Half {
    /// None yet.
    const NONE: Self = Self {
        at: Instant(0),
        begins: Instant(0),
        half: CarrierHalf {
            period_ticks: 0,
            compare_ticks: [0; 3],
            start_levels: [false; 3],
            mode: Mode::Off,
            half: 0,
            ahead: [Mode::Off; 2],
        },
        mirrored: false,
        volt_ticks: AlphaBeta { alpha: 0.0, beta: 0.0 },
    };

    /// Gates off.
    const fn off(at: Instant, begins: Instant, period_ticks: u32) -> Self {
        Self { at, begins, half: CarrierHalf::off(period_ticks), ..Self::NONE }
    }

    /// `true` if the gates are off in this half.
    #[inline]
    pub fn is_off(&self) -> bool {
        self.half.mode == Mode::Off
    }

    /// The volt-ticks of the rest of the half, from `elapsed` ticks after its beginning, in ticks.
    #[inline]
    pub fn volt_ticks_from(&self, elapsed: u32) -> AlphaBeta {
        volt_ticks(self.half.on_ticks(elapsed))
    }

    /// The volt-ticks of the last ticks of the half, at most all of it, in ticks.
    #[inline]
    pub fn last_volt_ticks(&self, last: u32) -> AlphaBeta {
        self.volt_ticks_from(self.half.period_ticks.saturating_sub(last))
    }

    /// The failed check of a PWM interrupt that should have come by `now`, since the half begins there, and has not; with its delay, in s.
    #[inline]
    pub fn overdue(&self, now: Instant, clock: &Clock) -> Option<FailedCheck> {
        let late = now.since(self.begins);
        let limit = (clock.control_ticks / PWM_LATE_PART) as i32;
        (late > limit).then(|| (Fault::PwmDeadline, clock.seconds(late), clock.seconds(limit)))
    }

    #[inline]
    pub fn ends(&self) -> Instant {
        self.begins.after(self.half.period_ticks)
    }
}

/// The PWM interrupt's report of itself at the newest boundary.
#[derive(Clone, Copy)]
pub(super) struct PwmStatus {
    /// `true` once it has found a fault.
    pub tripped: bool,
    /// Number of the release that it had carried out.
    pub released: u8,
    /// Mode of the half that runs from that boundary on.
    pub mode: Mode,
}

/// The order by which the halves of a control period are made.
pub(super) struct Order<'a> {
    /// Pulses, or none.
    pub pulses: bool,
    pub reference: &'a Reference,
    /// Number of the last release.
    pub release: u8,
}

/// The modulator, and the halves that it has made. The order in memory is as in [`ControlTask`](super::ControlTask).
#[repr(C)]
pub(super) struct Pulses {
    modulator: Modulator,
    /// Length of a half without pulses, in ticks.
    off_ticks: u32,
    /// Number of the half planned last, and the boundary after its own, for which nothing is planned yet.
    planned: u32,
    unplanned: Instant,
    /// Number of the half loaded at the newest boundary, and the PWM interrupt's report there; `None` before that interrupt has come.
    loaded: u32,
    told: Option<(Place, PwmStatus)>,
    /// Half number n is in place `n % REMEMBERED`.
    halves: [Half; REMEMBERED],
}

impl Pulses {
    /// The state before anything is known of the PWM timer.
    pub(super) const fn new(settings: &Settings, schedule: Schedule) -> Self {
        let off_ticks = settings.devices.shortest_half_ticks;
        Self {
            modulator: Modulator::new(settings.devices, schedule),
            off_ticks,
            halves: [Half::NONE; REMEMBERED],
            planned: 0,
            unplanned: Instant(0),
            loaded: 0,
            told: None,
        }
    }

    #[inline(always)]
    fn half(&self, number: u32) -> &Half {
        &self.halves[number as usize % REMEMBERED]
    }

    /// The half that was loaded at the newest boundary, `None` before there was one.
    #[inline(always)]
    pub(super) fn newest(&self) -> Option<&Half> {
        self.told.map(|_| self.half(self.loaded))
    }

    /// The half planned last (nothing is planned for the boundary at which it begins); `None` before there was a boundary.
    #[inline(always)]
    pub(super) fn last(&self) -> Option<&Half> {
        self.told.map(|_| self.half(self.planned))
    }

    /// Halves that are planned and not loaded yet.
    #[inline(always)]
    pub(super) fn unloaded(&self) -> u32 {
        self.planned.wrapping_sub(self.loaded)
    }

    /// The sum of their volt-ticks, in ticks; `None` if the gates are off in one of them.
    #[inline(always)]
    pub(super) fn unloaded_volt_ticks(&self) -> Option<AlphaBeta> {
        let mut sum = AlphaBeta::default();
        for ahead in 1..=self.unloaded().min(MOST_PLANNED) {
            let half = self.half(self.loaded.wrapping_add(ahead));
            if half.is_off() {
                return None;
            }
            sum = sum + half.volt_ticks;
        }
        Some(sum)
    }

    /// The volt-ticks from the newest boundary on of all halves that are loaded and planned, in ticks.
    pub(super) fn committed_volt_ticks(&self) -> AlphaBeta {
        let loaded = self.before(1).volt_ticks + self.before(0).volt_ticks;
        loaded + self.unloaded_volt_ticks().unwrap_or_default()
    }

    /// The half that was loaded this many boundaries before the newest one.
    #[inline(always)]
    pub(super) fn before(&self, boundaries: u32) -> &Half {
        self.half(self.loaded.wrapping_sub(boundaries))
    }

    /// Phase currents at the newest boundary, in A.
    #[inline]
    pub(super) fn currents_a(&self, loaded: &History<LOADED_WORDS>) -> Option<Abc> {
        let (place, _) = self.told?;
        loaded.read(place, |[newest]: [_; 1]| LoadedRecord(newest).currents_a())
    }

    /// Looks at the boundary that was newest at `now`, even if the PWM interrupt has come since (it comes twice in a control period if a carrier
    /// lasts one); `None` before it has come at all. Pulses planned in this period are for boundaries from `valid` on.
    #[inline]
    pub(super) fn look(
        &mut self,
        loaded: &History<LOADED_WORDS>,
        now: Instant,
        valid: Instant,
    ) -> Option<PwmStatus> {
        if !self.told.is_some_and(|(place, _)| loaded.is_newest(place)) {
            self.told = self.look_anew(loaded, now, valid).or(self.told);
        }
        self.told.map(|(_, told)| told)
    }

    /// The same after a new boundary.
    #[inline(never)]
    fn look_anew(
        &mut self,
        loaded: &History<LOADED_WORDS>,
        now: Instant,
        valid: Instant,
    ) -> Option<(Place, PwmStatus)> {
        let place = loaded.find(LATEST, |record| {
            let record = LoadedRecord(record);
            // In a record that was written, a half lies between its boundary and the next one.
            record.begins() != record.at() && now.reached(record.at())
        })?;
        let (at, begins, (tripped, released)) = loaded.read(place, |[newest]: [_; 1]| {
            let newest = LoadedRecord(newest);
            (newest.at(), newest.begins(), newest.tripped_and_released())
        })?;
        let as_planned = |number: &u32| {
            let half = self.half(*number);
            half.at == at && half.begins == begins && (half.is_off() || !tripped)
        };
        match (0..=MOST_PLANNED).map(|ahead| self.loaded.wrapping_add(ahead)).find(as_planned) {
            Some(number) => self.loaded = number,
            None => self.begin_anew(at, begins, valid),
        }
        Some((place, PwmStatus { tripped, released, mode: self.before(1).half.mode }))
    }

    /// Continues from the halves without pulses that the PWM interrupt loaded by itself: at the boundary `at`, and at those after it that come before
    /// `valid`.
    #[cold]
    #[inline(never)]
    fn begin_anew(&mut self, at: Instant, begins: Instant, valid: Instant) {
        self.halves = [Half::NONE; REMEMBERED];
        self.halves[0] = Half::off(at, begins, self.off_ticks);
        (self.loaded, self.planned) = (0, 0);
        self.unplanned = begins;
        for _ in 0..MOST_PLANNED {
            if self.unplanned.reached(valid) {
                return;
            }
            let newest = *self.half(self.planned);
            self.planned = self.planned.wrapping_add(1);
            let next = Half::off(newest.begins, newest.ends(), self.off_ticks);
            self.halves[self.planned as usize % REMEMBERED] = next;
            self.unplanned = next.begins;
        }
    }

    /// `true` if a boundary that comes before `until` has no half yet, and at least one boundary is known.
    #[inline(always)]
    pub(super) fn lack(&self, until: Instant) -> bool {
        !self.unplanned.reached(until) && self.told.is_some()
    }

    /// Plans a half for each boundary that comes before `until`; to be called when there are such boundaries.
    #[inline(always)]
    pub(super) fn plan(&mut self, until: Instant, order: &Order, cell: &Planned) {
        for _ in 0..MOST_PLANNED {
            if self.unplanned.reached(until) {
                return;
            }
            self.plan_next(order, cell);
        }
    }

    /// Plans one half. Out of line: otherwise values that a loop prepares for all of its rounds would be prepared for a single one.
    #[inline(never)]
    fn plan_next(&mut self, order: &Order, cell: &Planned) {
        let (at, begins) = (self.unplanned, self.half(self.planned).ends());
        self.planned = self.planned.wrapping_add(1);
        let next = &mut self.halves[self.planned as usize % REMEMBERED];
        // Field by field: the half is written in place.
        (next.at, next.begins) = (at, begins);
        if order.pulses {
            next.half = self.modulator.step(begins, Some(order.reference));
        } else {
            next.half = self.modulator.rest(begins, Some(order.reference));
        }
        next.mirrored = self.modulator.is_mirrored();
        next.volt_ticks = volt_ticks(next.half.on_ticks(0));
        self.unplanned = begins;
        tell(next, order, cell);
    }

    /// Revises the half that was loaded at the newest boundary, in the control period after the command that asks for it.
    #[inline(never)]
    pub(super) fn revise(&mut self, order: &Order, cell: &Planned) {
        let newest = &mut self.halves[self.loaded as usize % REMEMBERED];
        newest.half = self.modulator.revised(&newest.half, newest.begins, order.reference);
        newest.volt_ticks = volt_ticks(newest.half.on_ticks(0));
        tell(newest, order, cell);
    }
}

/// Puts a half into the cell to the PWM interrupt.
#[inline(always)]
fn tell(planned: &Half, order: &Order, cell: &Planned) {
    let Half { at, half, .. } = *planned;
    let &Order { reference: &Reference { rate, udc_v, .. }, release, .. } = order;
    cell.publish(PlannedHalf { at, half, release, rate, udc_v });
}

#[cfg(all(test, not(loom)))]
mod tests {
    use super::*;
    use crate::drive::messages::Loaded;
    use crate::modulation::SwitchLimits;

    const CLOCK: Clock = Clock::new(25_000_000, 2_500);

    fn pulses(max_hz: f32) -> (Pulses, u32) {
        let devices = SwitchLimits::new(250, 0, max_hz, &CLOCK);
        let settings = Settings::new(CLOCK, devices);
        (Pulses::new(&settings, Schedule::new(&CLOCK)), devices.shortest_half_ticks)
    }

    fn loaded(at: Instant, begins: Instant) -> [u32; LOADED_WORDS] {
        Loaded { at, begins, currents_a: Abc::default(), tripped: false, released: 0 }.to_words()
    }

    #[test]
    fn what_stood_at_an_instant_stands_whatever_the_pwm_interrupt_has_told_since() {
        let history = History::new();
        let (mut pulses, half_ticks) = pulses(20_000.0);
        let now = Instant(10 * half_ticks + 1);
        for boundary in 0..=12 {
            let at = Instant(boundary * half_ticks);
            history.publish(loaded(at, at.after(half_ticks)));
            let newest = boundary.min(10) * half_ticks;
            assert!(pulses.look(&history, now, now.after(2_500)).is_some());
            assert_eq!(pulses.newest().map(|newest| newest.at), Some(Instant(newest)), "{boundary}");
        }
    }

    /// Before the first boundary nobody knows for which boundaries halves are lacking; a half that is planned is not planned again.
    #[test]
    fn halves_are_lacking_from_the_first_boundary_on_until_they_are_planned() {
        let (history, cell) = (History::new(), Planned::new());
        let (mut pulses, half_ticks) = pulses(10_000.0);
        let (at, until) = (Instant(half_ticks), Instant(3 * half_ticks));
        assert!(!pulses.lack(until), "no boundary yet");
        history.publish(loaded(at, at.after(half_ticks)));
        pulses.look(&history, at, at.after(1)).unwrap();
        assert!(pulses.lack(until));
        pulses.plan(until, &Order { pulses: false, reference: &Reference::NONE, release: 0 }, &cell);
        assert!(!pulses.lack(until) && pulses.lack(until.after(1)));
    }

    /// A boundary is known by its own instant and that of the next one: nothing is known of a timer that does not end its half as planned.
    #[test]
    fn a_boundary_that_is_not_as_planned_begins_anew() {
        for (late, early) in [(0, 0), (0, 7), (7, 0)] {
            let (history, cell) = (History::new(), Planned::new());
            let (mut pulses, half_ticks) = pulses(10_000.0);
            let [first, second, third, fourth] = [1, 2, 3, 4].map(|half| Instant(half * half_ticks));
            history.publish(loaded(first, second));
            pulses.look(&history, first, first.after(1)).unwrap();
            let reference = Reference::turning(100.0, crate::frames::Angle::ZERO, 0.0, first, 1_500.0);
            pulses.plan(fourth, &Order { pulses: true, reference: &reference, release: 0 }, &cell);
            history.publish(loaded(second.after(late), third.before(early)));
            let mode = pulses.look(&history, third, third.after(1)).unwrap().mode;
            let newest = pulses.newest().unwrap();
            assert_eq!((newest.at, newest.begins), (second.after(late), third.before(early)));
            assert_eq!((mode, newest.is_off()), (Mode::Off, (late, early) != (0, 0)), "{late} {early}");
        }
    }

    /// The boundaries of a PWM timer against control, over this many periods: each finds its half, and control recognises it. Returns their number.
    fn drive(mut pulses: Pulses, half_ticks: u32, rate: f32) -> u32 {
        let (history, planned) = (History::new(), Planned::new());
        let mut boundary = (Instant(half_ticks), Instant(2 * half_ticks));
        let (mut found, mut boundaries) = (0, 0);
        for period in 1..400 {
            let now = Instant(period * 2_500);
            while now.reached(boundary.0) {
                let (at, begins) = boundary;
                let next = planned.newest(|half| half.word::<0>() == at.0);
                found += u32::from(next.is_some());
                assert!(next.is_some() || found == 0, "nothing for {at:?}");
                boundaries += 1;
                let running = next.map_or(half_ticks, |next| next.half.period_ticks);
                history.publish(loaded(at, begins));
                boundary = (begins, begins.after(running));
            }
            let valid = now.after(2_500);
            if pulses.look(&history, now, valid).is_some() {
                assert_eq!(pulses.newest().map(|newest| newest.ends()), Some(boundary.1));
            }
            let angle = crate::frames::Angle((f64::from(rate) * f64::from(now.0)) as u64 as u32);
            let reference = Reference::turning(100.0, angle, rate, now, 1_500.0);
            let order = Order { pulses: period > 50, reference: &reference, release: 0 };
            if pulses.lack(valid.after(2_500)) {
                pulses.plan(valid.after(2_500), &order, &planned);
            }
        }
        // Nothing is planned before control has seen a boundary.
        assert!(found > 20 && found + 10 > boundaries, "{found} of {boundaries}");
        assert!(!pulses.before(0).is_off());
        boundaries
    }

    /// A carrier from two halves per control period to many periods per half, with a modulator at rest and pulsing.
    #[test]
    fn every_boundary_finds_the_half_that_was_planned_for_it() {
        for max_hz in [10_000.0, 9_000.0, 5_000.0, 2_400.0, 900.0] {
            let (pulses, half_ticks) = pulses(max_hz);
            assert!(drive(pulses, half_ticks, 20_000.0) > 60, "{max_hz} Hz");
        }
    }

    /// A locked carrier of a machine that switches once a control period has up to five halves in a period.
    #[test]
    fn every_boundary_of_a_locked_carrier_finds_its_half() {
        let (ordinary, half_ticks) = pulses(10_000.0);
        let schedule = Schedule::fixed(Mode::Mid7, &CLOCK);
        let pulses = Pulses {
            modulator: Modulator::new(SwitchLimits::new(50, 0, 10_000.0, &CLOCK), schedule),
            ..ordinary
        };
        let rate = (1_260.0 * 4_294_967_296.0 / 25e6) as f32;
        let boundaries = drive(pulses, half_ticks, rate);
        assert!(boundaries > 4 * 300, "{boundaries}");
    }

    /// A quarter of a control period is not late yet.
    #[test]
    fn an_interrupt_is_overdue_after_a_quarter_of_a_period() {
        let half = Half::off(Instant(0), Instant(1_000), 10_000);
        let overdue = |late: u32| half.overdue(Instant(1_000 + late), &CLOCK);
        assert_eq!([overdue(625).is_some(), overdue(626).is_some()], [false, true]);
    }
}
