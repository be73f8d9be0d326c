//! The PMaSynRM's two interrupts and its idle loop. The image's root names the `qemu` (the board, or the board with faults injected), by its `law`
//! the control law, and by its `patterns` the pulse patterns.

use crate::law::{self, Law};
use crate::patterns;
use crate::qemu::{self, CLOCK, Interrupt as interrupt};
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use cortex_m_rt::{entry, exception, interrupt};
use tractive::built_in::traction::{BUILT_IN, BuiltIn};
use tractive::control::Gains;
use tractive::drive::traction::{ControlTask, Drops, PwmTask, Settings, Shared};
use tractive::modulation::SwitchLimits;
use tractive::operator::{self, Line, Slot, slot_s};
use tractive::protocol::CanEndpoint;
use tractive::time::{Clock, Instant};

static SHARED: Shared = Shared::recorded_by(&qemu::RECORDER);
static CONTROL_TICKS: AtomicU32 = AtomicU32::new(CLOCK.control_ticks);
static MIN_PULSE_TICKS: AtomicU32 = AtomicU32::new(0);
static DEAD_TIME_TICKS: AtomicU32 = AtomicU32::new(0);
static FIRST_HALF_TICKS: AtomicU32 = AtomicU32::new(0);
static UNCOMPENSATED: AtomicBool = AtomicBool::new(false);
static BEHIND_LINE_FILTER: AtomicBool = AtomicBool::new(false);
/// Age of the angle when it is sampled, in s, as bits.
static ANGLE_LATE: AtomicU32 = AtomicU32::new(0);
/// Step of a count of the angle, in rad, as bits.
static ANGLE_STEP: AtomicU32 = AtomicU32::new(0);
/// Time constant of the current sensors, in ticks, and threshold and slope of the devices, in V and ohm, as bits.
static CURRENT_FILTER: AtomicU32 = AtomicU32::new(0);
static THRESHOLD: AtomicU32 = AtomicU32::new(0);
static SLOPE: AtomicU32 = AtomicU32::new(0);
static IRON_SHARE: AtomicU32 = AtomicU32::new(0);

/// Highest frequency of the free carrier, in Hz.
const MAX_CARRIER_HZ: f32 = patterns::FREE_CARRIER_SHARE * BUILT_IN.ratings.max_switching_hz;

/// The settings until the host has sent its own.
const DEFAULTS: Settings = Settings::new(CLOCK, SwitchLimits::new(0, 0, MAX_CARRIER_HZ, &CLOCK));

fn settings() -> Settings {
    let clock = Clock::new(qemu::TICKS_HZ, CONTROL_TICKS.load(Ordering::Relaxed));
    Settings {
        clock,
        devices: SwitchLimits::new(
            MIN_PULSE_TICKS.load(Ordering::Relaxed),
            DEAD_TIME_TICKS.load(Ordering::Relaxed),
            MAX_CARRIER_HZ,
            &clock,
        ),
        gains: Gains::of(UNCOMPENSATED.load(Ordering::Relaxed), BEHIND_LINE_FILTER.load(Ordering::Relaxed)),
        angle_late_s: f32::from_bits(ANGLE_LATE.load(Ordering::Relaxed)),
        angle_step_rad: f32::from_bits(ANGLE_STEP.load(Ordering::Relaxed)),
        current_filter_ticks: CURRENT_FILTER.load(Ordering::Relaxed),
        drops: Drops {
            threshold_v: f32::from_bits(THRESHOLD.load(Ordering::Relaxed)),
            slope_ohm: f32::from_bits(SLOPE.load(Ordering::Relaxed)),
        },
        iron_share: f32::from_bits(IRON_SHARE.load(Ordering::Relaxed)),
    }
}

#[entry]
fn main() -> ! {
    static mut STATION: CanEndpoint = CanEndpoint::new(&BUILT_IN.ratings);
    let setup = law::connect();
    CONTROL_TICKS.store(setup.control_ticks, Ordering::Relaxed);
    MIN_PULSE_TICKS.store(setup.min_pulse_ticks, Ordering::Relaxed);
    DEAD_TIME_TICKS.store(setup.dead_time_ticks, Ordering::Relaxed);
    UNCOMPENSATED.store(setup.uncompensated, Ordering::Relaxed);
    BEHIND_LINE_FILTER.store(setup.behind_line_filter, Ordering::Relaxed);
    ANGLE_LATE.store(setup.angle_late_s.to_bits(), Ordering::Relaxed);
    ANGLE_STEP.store(setup.angle_step_rad.to_bits(), Ordering::Relaxed);
    CURRENT_FILTER.store(setup.current_filter_ticks, Ordering::Relaxed);
    let Drops { threshold_v, slope_ohm } = setup.drops();
    THRESHOLD.store(threshold_v.to_bits(), Ordering::Relaxed);
    SLOPE.store(slope_ohm.to_bits(), Ordering::Relaxed);
    IRON_SHARE.store(setup.iron_share().to_bits(), Ordering::Relaxed);
    if let Err(refused) = const { BUILT_IN.check() }.and_then(|()| settings().check_settings()) {
        qemu::refuse(&refused);
    }
    let Settings { clock, devices, .. } = settings();
    let first_half_ticks = devices.shortest_half_ticks.saturating_add(setup.pwm_delay_ticks);
    FIRST_HALF_TICKS.store(first_half_ticks, Ordering::Relaxed);
    let line = setup.line.map(|times| Line::rated(&BUILT_IN.ratings, times.precharge_s, times.discharge_s));
    let mut operator = operator::Settings::rated(&BUILT_IN.ratings, slot_s(&clock), line);
    operator.train = setup.train;
    let station = setup.over_protocol.then_some(STATION);
    let (mut slot, mut idle) = (Slot::new(), law::Idle::new(station));
    qemu::start(first_half_ticks, clock.control_ticks);
    loop {
        if line.is_some() || setup.over_protocol {
            let settings = match &idle.station {
                Some(station) => station.settings(&operator),
                None => operator,
            };
            slot.run(&SHARED.operator, &mut idle, &settings, &clock);
        }
        qemu::idle();
    }
}

/// Deadline: the next control interrupt. If missed: fault `control_deadline`, gates into the safe state.
#[interrupt]
fn TIMER0() {
    static mut TASK: ControlTask<BuiltIn, Law> =
        ControlTask::with_law(BuiltIn, DEFAULTS, Instant(CLOCK.control_ticks), law::AT_REST);
    static mut IS_SET_UP: bool = false;
    let mut board = qemu::Control;
    if !*IS_SET_UP {
        let settings = settings();
        TASK.set_up(settings, Instant(settings.clock.control_ticks));
        if let Some(schedule) = patterns::SCHEDULE {
            TASK.set_schedule(schedule(&settings.clock));
        }
        if let Some(set_up) = law::SET_UP {
            set_up(TASK);
        }
        *IS_SET_UP = true;
    }
    let now = TASK.next_call();
    TASK.run(&mut board, &SHARED);
    law::tell(TASK, &SHARED, now);
}

/// Deadline: the next carrier boundary, where the shadow registers take over.
#[interrupt]
fn DUALTIMER() {
    static mut TASK: Option<PwmTask<BuiltIn>> = None;
    let mut board = qemu::Pwm;
    let task = TASK.get_or_insert_with(|| {
        let first = Instant(FIRST_HALF_TICKS.load(Ordering::Relaxed));
        PwmTask::new(BuiltIn, settings(), first).after_halves_of(first.0)
    });
    task.run(&mut board, &SHARED);
}

#[exception]
unsafe fn HardFault(_frame: &cortex_m_rt::ExceptionFrame) -> ! {
    qemu::die()
}

#[panic_handler]
fn panic(_info: &core::panic::PanicInfo) -> ! {
    qemu::die()
}
