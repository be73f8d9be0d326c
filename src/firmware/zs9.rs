//! The ZS9's two interrupts and its idle loop. The image's root names the `qemu` (the board, or the board with faults injected) and, by its `law`,
//! the control law.

use crate::law::{self, Law};
use crate::qemu::{self, CLOCK, Interrupt as interrupt};
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use cortex_m_rt::{entry, exception, interrupt};
use tractive::built_in::zs9::{BUILT_IN, BuiltIn};
use tractive::drive::dual::{ControlTask, PwmTask, Settings, Shared};
use tractive::machine::Ratings;
use tractive::operator::{self, DualSlot, Line, slot_s};
use tractive::protocol::Zs9CanEndpoint;

static SHARED: Shared = Shared::recorded_by(&qemu::DUAL_RECORDER);
/// The settings until the host has sent its carrier and its dead time.
const DEFAULTS: Settings = Settings::new(CLOCK, CLOCK.control_ticks, &BUILT_IN);
/// The ratings as the operator uses them.
static RATINGS: Ratings = Settings::operator_ratings(&BUILT_IN.ratings);
static CARRIER_TICKS: AtomicU32 = AtomicU32::new(0);
static DEAD_TIME_TICKS: AtomicU32 = AtomicU32::new(0);
static BEHIND_LINE_FILTER: AtomicBool = AtomicBool::new(false);

fn settings() -> Settings {
    Settings {
        carrier_ticks: CARRIER_TICKS.load(Ordering::Relaxed),
        dead_time_ticks: DEAD_TIME_TICKS.load(Ordering::Relaxed),
        ..DEFAULTS
    }
    .behind_line_filter(BEHIND_LINE_FILTER.load(Ordering::Relaxed), &BUILT_IN)
}

#[entry]
fn main() -> ! {
    static mut STATION: Zs9CanEndpoint = Zs9CanEndpoint::new(&RATINGS);
    let setup = qemu::connect_dual();
    CARRIER_TICKS.store(setup.carrier_ticks, Ordering::Relaxed);
    DEAD_TIME_TICKS.store(setup.dead_time_ticks, Ordering::Relaxed);
    BEHIND_LINE_FILTER.store(setup.behind_line_filter, Ordering::Relaxed);
    // All but carrier, dead time and damping are constants of the image.
    let constants = const { DEFAULTS.check(&BUILT_IN) };
    if let Err(refused) = constants.and_then(|()| settings().check_carrier()) {
        qemu::refuse(&refused);
    }
    let line =
        setup.line.map(|times| Line::rated(&RATINGS, times.precharge_s, times.discharge_s).without_chopper());
    let rated = operator::Settings::rated(&RATINGS, slot_s(&CLOCK), line);
    let (mut slot, mut idle) = (DualSlot::new(), qemu::DualIdle { station: STATION });
    qemu::start_dual(&settings());
    loop {
        if line.is_some() {
            let settings = idle.station.settings(&rated);
            slot.run(&SHARED.operator, &mut idle, &settings, &CLOCK);
        }
        qemu::idle();
    }
}

/// Deadline: the last peak before the next control interrupt. If missed: fault `control_deadline`, all gates off.
#[interrupt]
fn TIMER0() {
    static mut TASK: ControlTask<BuiltIn, Law> =
        ControlTask::with_laws(BuiltIn, DEFAULTS, law::AT_REST, law::AT_REST);
    static mut IS_SET_UP: bool = false;
    let mut board = qemu::Control;
    if !*IS_SET_UP {
        TASK.set_up(settings());
        *IS_SET_UP = true;
    }
    TASK.run(&mut board, &SHARED);
}

/// Deadline: the next valley, where the shadow registers take over. If missed: left to the watch.
#[interrupt]
fn DUALTIMER() {
    static mut TASK: PwmTask<BuiltIn> = PwmTask::new(BuiltIn, DEFAULTS);
    static mut IS_SET_UP: bool = false;
    let mut board = qemu::Pwm;
    if !*IS_SET_UP {
        TASK.set_up(settings());
        *IS_SET_UP = true;
    }
    TASK.run(&mut board, &SHARED);
}

/// The watch over the carrier periods: one was not written in time. Fault `pwm_deadline`, all gates off.
#[exception]
unsafe fn NonMaskableInt() {
    qemu::watch_ends();
}

#[exception]
unsafe fn HardFault(_frame: &cortex_m_rt::ExceptionFrame) -> ! {
    qemu::die_dual()
}

#[panic_handler]
fn panic(_info: &core::panic::PanicInfo) -> ! {
    qemu::die_dual()
}
