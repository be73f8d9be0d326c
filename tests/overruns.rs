//! Late or lost interrupts, in both drives: each side notices, in its first interrupt that can, what the other one misses, and turns
//! the gates off in it. Instants here are real ones; the tasks count their own, and fall behind with every interrupt that they miss.

use tractive::built_in::{traction::BUILT_IN, zs9};
use tractive::control::Demand;
use tractive::drive::dual::{self};
use tractive::drive::traction;
use tractive::frames::{Abc, Angle, Dq};
use tractive::modulation::{CarrierHalf, Mode, SwitchLimits};
use tractive::ports::DualReport;
use tractive::ports::Report;
use tractive::ports::{
    ControlPort, DriveCommand, Dual, DualDriveCommand, DualSample, GateFeedback, MotorDemand, PlayedPeriod,
    PowerSample, PwmPort, Sample,
};
use tractive::protection::{Fault, MaskedFaults, SafeState, Trip};
use tractive::time::{Clock, Instant};

const CLOCK: Clock = Clock::new(25_000_000, 2_500);
/// Electrical, in rad/s: slow enough for an angle of the next period to be no innovation.
const OMEGA: f32 = 84.0;
/// From here on interrupts go astray.
const SETTLED: u32 = 2_000_000;

/// The mishap of the interrupts from [`SETTLED`] on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum InjectedFault {
    None,
    /// So many control ticks are lost.
    ControlLost(u32),
    /// So many PWM ticks are lost: the shadow registers are played once more each.
    PwmLost(u32),
    /// One control interrupt ends so many ticks after its period.
    ControlLate(u32),
    /// PWM interrupts come this much later than they should, in ticks, from now on.
    PwmLate(u32),
}

fn angle(at: u32) -> Angle {
    let turns = f64::from(OMEGA) * f64::from(at) / 25e6 / std::f64::consts::TAU;
    Angle((turns.rem_euclid(1.0) * 4_294_967_296.0) as u64 as u32)
}

fn currents(at: u32, current: Dq) -> Abc {
    let ripple = (at % 7919) as f32 * 1e-4;
    (current + Dq { d: ripple, q: -ripple }).unpark(angle(at).sin_cos()).abc()
}

/// The timers and the gates of either drive.
struct Board {
    now: u32,
    late: u32,
    entered: Option<u32>,
    shadow: CarrierHalf,
    periods: [PlayedPeriod; 2],
    trip: Option<Trip>,
}

impl Board {
    fn new(first: CarrierHalf, off: PlayedPeriod) -> Self {
        Self { now: 0, late: 0, entered: None, shadow: first, periods: [off; 2], trip: None }
    }

    /// None flow before there are pulses.
    fn traction_currents(&self) -> Abc {
        if self.shadow.mode == Mode::Off {
            return Abc::default();
        }
        currents(self.now, Dq { d: -30.0, q: 40.0 })
    }
}

impl ControlPort for Board {
    fn sample(&mut self, _now: Instant) -> Sample {
        Sample {
            currents_a: self.traction_currents(),
            udc_v: 1500.0,
            angle: Some(angle(self.now)),
            may_pulse: true,
            hardware: None,
        }
    }

    fn command(&mut self, _now: Instant, _operator: impl FnOnce() -> DriveCommand) -> DriveCommand {
        let demand = Demand { torque_nm: 200.0, slew_limited: false };
        DriveCommand { enable: true, demand, ..DriveCommand::NONE }
    }

    fn enter(&mut self, _safe: SafeState, _now: Instant) {
        self.entered = self.entered.or(Some(self.now));
    }

    fn overrun_ticks(&mut self, _now: Instant, _deadline_ticks: u32) -> u32 {
        self.late
    }

    fn report(&mut self, _now: Instant, report: impl FnOnce() -> Report) {
        self.trip = report().trip;
    }
}

impl PwmPort for Board {
    fn sample(&mut self, _now: Instant) -> Abc {
        self.traction_currents()
    }

    fn play(&mut self, _now: Instant, next: &CarrierHalf) {
        self.shadow = *next;
    }

    fn enter(&mut self, _safe: SafeState, _now: Instant) {
        self.entered = self.entered.or(Some(self.now));
    }
}

impl ControlPort<Dual> for Board {
    fn sample(&mut self, _now: Instant) -> DualSample {
        DualSample {
            currents_a: [currents(self.now, Dq { d: -5.0, q: 25.0 }); 2],
            angles: [Some(angle(self.now)); 2],
            capacitor_v: 533.5,
            inductor_a: 20.0,
            source_v: 400.0,
            may_pulse: true,
            hardware: None,
        }
    }

    fn command(&mut self, _now: Instant, _operator: impl FnOnce() -> DualDriveCommand) -> DualDriveCommand {
        DualDriveCommand {
            enable: true,
            demands: [MotorDemand::Torque(Demand { torque_nm: 50.0, slew_limited: true }); 2],
            speed_torque_nm: DualDriveCommand::UNLIMITED_NM,
            link_ref_v: 667.0,
            ..DualDriveCommand::NONE
        }
    }

    fn enter(&mut self, _safe: SafeState, _now: Instant) {
        self.entered = self.entered.or(Some(self.now));
    }

    fn overrun_ticks(&mut self, _now: Instant, _deadline_ticks: u32) -> u32 {
        self.late
    }

    fn report(&mut self, _now: Instant, report: impl FnOnce() -> DualReport) {
        self.trip = report().trip;
    }
}

impl PwmPort<Dual> for Board {
    fn sample(&mut self, _now: Instant) -> PowerSample {
        PowerSample {
            currents_a: [currents(self.now, Dq { d: -5.0, q: 25.0 }); 2],
            capacitor_v: 533.5,
            source_v: 400.0,
            gates: GateFeedback::default(),
        }
    }

    fn play(&mut self, _now: Instant, next: &PlayedPeriod) {
        self.periods = [self.periods[1], *next];
    }

    fn enter(&mut self, _safe: SafeState, _now: Instant) {
        self.entered = self.entered.or(Some(self.now));
    }
}

/// The real instants of both timers, and who is served next.
struct Timers {
    control: u32,
    pwm: u32,
    injected: InjectedFault,
    lost: u32,
}

enum Turn {
    Control,
    Pwm,
}

impl Timers {
    /// The next interrupt, whether it is served, and its real instant; the PWM timer's half lasts `half` from there.
    fn next(&mut self, half: impl Fn() -> u32) -> (Turn, bool, u32) {
        let delay = if let InjectedFault::PwmLate(ticks) = self.injected { ticks } else { 0 };
        let delay = if self.pwm >= SETTLED { delay } else { 0 };
        if self.pwm + delay <= self.control {
            let at = self.pwm + delay;
            self.pwm += half();
            let lost =
                matches!(self.injected, InjectedFault::PwmLost(count) if at >= SETTLED && self.lost < count);
            self.lost += u32::from(lost);
            (Turn::Pwm, !lost, at)
        } else {
            let at = self.control;
            self.control += CLOCK.control_ticks;
            let lost = matches!(self.injected, InjectedFault::ControlLost(count) if at >= SETTLED && self.lost < count);
            self.lost += u32::from(lost);
            (Turn::Control, !lost, at)
        }
    }

    fn overrun(&self, at: u32) -> u32 {
        match self.injected {
            InjectedFault::ControlLate(ticks) if (SETTLED..SETTLED + CLOCK.control_ticks).contains(&at) => {
                ticks
            }
            _ => 0,
        }
    }
}

/// The PMaSynRM drive for some time after the injected fault: the trip, when the gates went off, the longest half meanwhile.
fn traction(injected: InjectedFault) -> (Option<Trip>, Option<u32>, u32) {
    let devices = SwitchLimits::new(250, 0, 900.0, &CLOCK);
    let settings = traction::Settings::new(CLOCK, devices);
    let first = devices.shortest_half_ticks;
    let shared = traction::Shared::new();
    let lost = MaskedFaults::of(Fault::AngleLost);
    let mut control =
        traction::ControlTask::new(&BUILT_IN, settings, Instant(CLOCK.control_ticks)).without(lost);
    let mut pwm = traction::PwmTask::new(&BUILT_IN, settings, Instant(first));
    let mut board = Board::new(CarrierHalf::off(first), PlayedPeriod::off(0));
    let mut timers = Timers { control: CLOCK.control_ticks, pwm: first, injected, lost: 0 };
    let mut longest = 0;
    while timers.control < SETTLED + 200_000 {
        let half = board.shadow.period_ticks;
        longest = longest.max(half);
        let (turn, served, at) = timers.next(|| half);
        board.now = at;
        board.late = timers.overrun(at);
        match turn {
            Turn::Control if served => control.run(&mut board, &shared),
            Turn::Pwm if served => {
                pwm.run(&mut board, &shared);
            }
            _ => {}
        }
        assert!(at < SETTLED || board.entered.is_some() || pwm.trip().is_none());
    }
    // A timer without its interrupt plays on; but the gates are in the safe state.
    let plays_on = matches!(injected, InjectedFault::PwmLost(count) if count > 10);
    let pulses = board.shadow.mode != Mode::Off;
    assert_eq!(pulses, board.entered.is_none() || plays_on, "pulses without a fault, none with one");
    (board.trip.or(pwm.trip()), board.entered, longest)
}

/// The same of the ZS9, with a carrier period in ticks.
fn zs9(injected: InjectedFault, carrier_ticks: u32) -> (Option<Trip>, Option<u32>) {
    let settings = dual::Settings::new(CLOCK, carrier_ticks, &zs9::BUILT_IN);
    let shared = dual::Shared::new();
    // The behaviour of gates and currents is not simulated here.
    let [stuck, unexplained] = [Fault::LegStuck, Fault::VoltageUnexplained].map(MaskedFaults::of);
    let mut control = dual::ControlTask::new(&zs9::BUILT_IN, settings).without(unexplained);
    let mut pwm = dual::PwmTask::new(&zs9::BUILT_IN, settings).without(stuck);
    let off = PlayedPeriod::off(settings.half_steps());
    let mut board = Board::new(CarrierHalf::default(), off);
    let first = settings.first_peak_ticks();
    let mut timers = Timers { control: CLOCK.control_ticks, pwm: first, injected, lost: 0 };
    while timers.control < SETTLED + 200_000 {
        let (turn, served, at) = timers.next(|| carrier_ticks);
        board.now = at;
        board.late = timers.overrun(at);
        match turn {
            Turn::Control if served => control.run(&mut board, &shared),
            Turn::Pwm if served => {
                pwm.run(&mut board, &shared);
            }
            _ => {}
        }
    }
    // Control also reports what the PWM interrupt tripped on, if control comes at all.
    let gone = matches!(injected, InjectedFault::ControlLost(count) if count > 10);
    assert!(gone || board.trip.is_some() || pwm.trip().is_none(), "{injected:?} is not reported");
    let plays_on = matches!(injected, InjectedFault::PwmLost(count) if count > 10);
    let pulses = board.periods[1] != off;
    assert_eq!(pulses, board.entered.is_none() || plays_on, "pulses without a fault, none with one");
    (board.trip.or(pwm.trip()), board.entered)
}

/// The injected fault is reported by this name, and the gates are off within this many ticks of its instant.
fn both_trip(injected: InjectedFault, fault: Fault, within: u32) {
    let (trip, entered, longest) = traction(injected);
    assert_eq!(trip.map(|trip| trip.fault), Some(fault), "{injected:?}");
    let entered = entered.unwrap_or_else(|| panic!("{injected:?}: gates are still on"));
    // One carrier period is two halves; the tick that goes astray is the first after SETTLED.
    let carrier = 2 * longest;
    assert!(
        entered - SETTLED <= within.min(carrier) + longest,
        "{injected:?}: after {} ticks",
        entered - SETTLED
    );
    for carrier_ticks in [2_500, 1_250] {
        let (trip, entered) = zs9(injected, carrier_ticks);
        assert_eq!(trip.map(|trip| trip.fault), Some(fault), "ZS9 at {carrier_ticks}: {injected:?}");
        let after = entered.unwrap_or_else(|| panic!("{injected:?}: gates are still on")) - SETTLED;
        assert!(after <= CLOCK.control_ticks + carrier_ticks, "ZS9: {injected:?}: after {after} ticks");
    }
}

#[test]
fn nothing_astray_is_no_fault() {
    let (trip, entered, _) = traction(InjectedFault::None);
    assert_eq!((trip, entered), (None, None));
    for carrier_ticks in [2_500, 1_250] {
        assert_eq!(zs9(InjectedFault::None, carrier_ticks), (None, None));
    }
}

#[test]
fn a_lost_control_tick_is_noticed_by_the_pwm_interrupt() {
    for count in [1, 2, 5, 1_000] {
        both_trip(InjectedFault::ControlLost(count), Fault::StaleCommand, CLOCK.control_ticks);
    }
}

#[test]
fn a_lost_pwm_tick_is_noticed_by_the_control_interrupt() {
    for count in [1, 2, 5, 1_000] {
        both_trip(InjectedFault::PwmLost(count), Fault::PwmDeadline, 2 * CLOCK.control_ticks);
    }
}

#[test]
fn a_late_control_interrupt_notices_itself() {
    for ticks in [1, 100, 2_400] {
        both_trip(InjectedFault::ControlLate(ticks), Fault::ControlDeadline, CLOCK.control_ticks);
    }
}

/// A PWM interrupt has time until the next boundary. If it comes before the next control interrupt, nothing changes; if it is later
/// than a quarter of a control period, with control in between, it counts as lost.
#[test]
fn a_delayed_pwm_interrupt_is_noticed_by_the_control_interrupt() {
    let (trip, entered, _) = traction(InjectedFault::PwmLate(400));
    assert_eq!((trip, entered), (None, None));
    for late in [2_500, 6_000] {
        let (trip, entered, longest) = traction(InjectedFault::PwmLate(late));
        let (trip, entered) = (trip.unwrap(), entered.unwrap());
        assert_eq!(trip.fault, Fault::PwmDeadline);
        assert!(trip.value > trip.limit && trip.value < CLOCK.seconds(2 * 2_500), "{trip:?}");
        assert!(entered - SETTLED <= 2 * longest, "{entered}");
    }
    for (carrier_ticks, harmless, late) in [(2_500, 1_200, 1_300), (1_250, 600, 700)] {
        assert_eq!(zs9(InjectedFault::PwmLate(harmless), carrier_ticks), (None, None));
        let (trip, entered) = zs9(InjectedFault::PwmLate(late), carrier_ticks);
        assert_eq!(trip.map(|trip| trip.fault), Some(Fault::PwmDeadline));
        assert!(entered.unwrap() - SETTLED <= CLOCK.control_ticks + carrier_ticks);
    }
}

/// A board whose control interrupt is once interrupted by the PWM interrupt, after its samples.
struct Landing<'a> {
    board: Board,
    pwm: Option<&'a mut traction::PwmTask>,
    shared: &'a traction::Shared<'a>,
}

impl ControlPort for Landing<'_> {
    fn sample(&mut self, now: Instant) -> Sample {
        if let Some(pwm) = self.pwm.take() {
            pwm.run(&mut self.board, self.shared);
        }
        <Board as ControlPort>::sample(&mut self.board, now)
    }

    fn command(&mut self, now: Instant, operator: impl FnOnce() -> DriveCommand) -> DriveCommand {
        <Board as ControlPort>::command(&mut self.board, now, operator)
    }

    fn enter(&mut self, safe: SafeState, now: Instant) {
        <Board as ControlPort>::enter(&mut self.board, safe, now);
    }

    fn overrun_ticks(&mut self, _now: Instant, _deadline_ticks: u32) -> u32 {
        0
    }

    fn report(&mut self, now: Instant, report: impl FnOnce() -> Report) {
        <Board as ControlPort>::report(&mut self.board, now, report);
    }
}

/// Control judges by its own instant: before the first boundary there was nothing, and so nothing was late.
#[test]
fn the_first_boundary_may_land_in_a_control_interrupt() {
    let devices = SwitchLimits::new(250, 0, 900.0, &CLOCK);
    let settings = traction::Settings::new(CLOCK, devices);
    for first in [CLOCK.control_ticks + 1, 5 * CLOCK.control_ticks + 400] {
        let shared = traction::Shared::new();
        let mut control = traction::ControlTask::new(&BUILT_IN, settings, Instant(CLOCK.control_ticks));
        let mut pwm = traction::PwmTask::new(&BUILT_IN, settings, Instant(first));
        let mut board = Board::new(CarrierHalf::off(first), PlayedPeriod::off(0));
        while control.next_call().0 + CLOCK.control_ticks < first {
            board.now = control.next_call().0;
            control.run(&mut board, &shared);
        }
        board.now = control.next_call().0;
        let mut landing = Landing { board, pwm: Some(&mut pwm), shared: &shared };
        control.run(&mut landing, &shared);
        assert_eq!((landing.board.trip, landing.board.entered), (None, None));
    }
}

/// A drive that has pulsed for a while. During its control interrupt at [`SETTLED`], before it has planned anything, comes the boundary that lies so many
/// ticks after the interrupt's beginning. Returns the trip that control reports in the end, that of the PWM interrupt, and when the gates went off.
fn boundary_within_control(after_ticks: u32) -> (Option<Trip>, Option<Trip>, Option<u32>) {
    let devices = SwitchLimits::new(250, 0, 900.0, &CLOCK);
    let settings = traction::Settings::new(CLOCK, devices);
    let first = (SETTLED + after_ticks) % devices.shortest_half_ticks;
    let shared = traction::Shared::new();
    let mut control = traction::ControlTask::new(&BUILT_IN, settings, Instant(CLOCK.control_ticks));
    let mut pwm = traction::PwmTask::new(&BUILT_IN, settings, Instant(first));
    let mut board = Board::new(CarrierHalf::off(first), PlayedPeriod::off(0));
    while control.next_call().0 < SETTLED {
        board.now = control.next_call().0.min(pwm.next_call().0);
        if control.next_call().reached(pwm.next_call()) {
            pwm.run(&mut board, &shared);
        } else {
            control.run(&mut board, &shared);
        }
    }
    assert_eq!((board.trip, board.entered, board.shadow.mode), (None, None, Mode::Async));
    assert_eq!((control.next_call(), pwm.next_call()), (Instant(SETTLED), Instant(SETTLED + after_ticks)));
    board.now = SETTLED + after_ticks;
    let mut landing = Landing { board, pwm: Some(&mut pwm), shared: &shared };
    control.run(&mut landing, &shared);
    let mut board = landing.board;
    for _ in 0..20 {
        board.now = control.next_call().0.min(pwm.next_call().0);
        if control.next_call().reached(pwm.next_call()) {
            pwm.run(&mut board, &shared);
        } else {
            control.run(&mut board, &shared);
        }
    }
    assert_eq!(board.entered.is_some(), board.shadow.mode == Mode::Off);
    (board.trip, pwm.trip(), board.entered)
}

/// The half for a boundary is planned a control period ahead. If control begins in time but lasts until that boundary, the PWM
/// interrupt finds no half for it: it says so by name, and the gates are off at once.
#[test]
fn a_half_that_is_not_there_at_its_boundary_is_a_fault() {
    let period = CLOCK.control_ticks;
    for after in [0, 1, period / 2, period - 1] {
        assert_eq!(boundary_within_control(after), (None, None, None), "{after}");
    }
    for after in [period, period + 1, period + period / 16] {
        let (told, found, entered) = boundary_within_control(after);
        let trip = found.unwrap_or_else(|| panic!("nothing is planned for {after}, and it is not noticed"));
        assert_eq!((trip.fault, trip.at), (Fault::StaleCommand, Instant(SETTLED + after)));
        assert!(trip.value > 0.0 && trip.limit == 0.0, "{trip:?}");
        assert_eq!((told, entered), (Some(trip), Some(SETTLED + after)));
    }
}
