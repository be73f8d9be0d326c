//! The PMaSynRM firmware: two interrupts and an idle loop, nothing else.
#![cfg_attr(target_os = "none", no_std, no_main)]

/// The image runs on a board; on the host it names the commands that run it.
#[cfg(not(target_os = "none"))]
fn main() {
    println!(
        "This is the firmware of a traction inverter. It runs on its board, or in QEMU against a simulated motor:\n\n  \
         cargo xtask run [SCENARIO]   set up what is missing, build, run a scenario [default: sweep]\n  \
         cargo xtask talk [SCRIPT]    the same, and command the drive over its protocol\n  \
         cargo xtask flash            build a board's image and flash it\n  \
         cargo xtask timing           instructions of each interrupt against their budgets\n  \
         cargo xtask test             run every check\n  \
         cargo rig --help             the firmware's code on this machine: scenarios, operating points, patterns, campaigns"
    );
}

#[cfg(all(target_os = "none", not(any(feature = "qemu", feature = "board-nucleo-g474re"))))]
compile_error!("the reference images need the feature `qemu`");

#[cfg(all(target_os = "none", feature = "board-nucleo-g474re"))]
#[path = "firmware/nucleo_g474re.rs"]
mod firmware;

#[cfg(all(target_os = "none", feature = "qemu", not(feature = "board-nucleo-g474re")))]
mod firmware {
    use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};
    use cortex_m_rt::{entry, exception, interrupt};
    use tractive::board::qemu::{self, CLOCK, Interrupt as interrupt};
    use tractive::built_in::traction::{BUILT_IN, BuiltIn};
    use tractive::control::Gains;
    use tractive::drive::traction::{ControlTask, PwmTask, Settings, Shared};
    use tractive::modulation::Devices;
    use tractive::operator::{self, Line, Slot, slot_s};
    use tractive::protocol::Station;
    use tractive::time::Instant;

    static SHARED: Shared = Shared::recorded_by(&qemu::RECORDER);
    static MIN_PULSE_TICKS: AtomicU32 = AtomicU32::new(0);
    static DEAD_TIME_TICKS: AtomicU32 = AtomicU32::new(0);
    static FIRST_HALF_TICKS: AtomicU32 = AtomicU32::new(0);
    static UNCOMPENSATED: AtomicBool = AtomicBool::new(false);

    /// Until the host has told its own.
    const DEFAULTS: Settings = Settings {
        clock: CLOCK,
        devices: Devices::new(0, 0, BUILT_IN.ratings.max_switching_hz, &CLOCK),
        gains: Gains::DEFAULT,
    };

    fn settings() -> Settings {
        Settings {
            clock: CLOCK,
            devices: Devices::new(
                MIN_PULSE_TICKS.load(Ordering::Relaxed),
                DEAD_TIME_TICKS.load(Ordering::Relaxed),
                BUILT_IN.ratings.max_switching_hz,
                &CLOCK,
            ),
            gains: if UNCOMPENSATED.load(Ordering::Relaxed) { Gains::WITHOUT_SIXTH } else { Gains::DEFAULT },
        }
    }

    #[entry]
    fn main() -> ! {
        let setup = qemu::connect();
        MIN_PULSE_TICKS.store(setup.min_pulse_ticks, Ordering::Relaxed);
        DEAD_TIME_TICKS.store(setup.dead_time_ticks, Ordering::Relaxed);
        UNCOMPENSATED.store(setup.uncompensated, Ordering::Relaxed);
        if let Err(refused) = const { BUILT_IN.check() }.and_then(|()| settings().check_settings()) {
            qemu::refuse(&refused);
        }
        let first_half_ticks = settings().devices.shortest_half_ticks.saturating_add(setup.pwm_delay_ticks);
        FIRST_HALF_TICKS.store(first_half_ticks, Ordering::Relaxed);
        let line =
            setup.line.map(|times| Line::rated(&BUILT_IN.ratings, times.precharge_s, times.discharge_s));
        let operator = operator::Settings::rated(&BUILT_IN.ratings, slot_s(&CLOCK), line);
        let station = setup.over_protocol.then(|| Station::new(&BUILT_IN.ratings));
        let (mut slot, mut idle) = (Slot::new(), qemu::Idle { station });
        qemu::start(first_half_ticks);
        loop {
            if line.is_some() || setup.over_protocol {
                let settings = match &idle.station {
                    Some(station) => station.settings(&operator),
                    None => operator,
                };
                slot.run(&qemu::DESK, &mut idle, &settings, &CLOCK);
            }
            qemu::idle();
        }
    }

    /// Deadline: the next control interrupt. Missed: fault `control_deadline`, gates into the safe state.
    #[interrupt]
    fn TIMER0() {
        static mut TASK: ControlTask<BuiltIn> =
            ControlTask::new(BuiltIn, DEFAULTS, Instant(CLOCK.control_ticks));
        static mut IS_SET_UP: bool = false;
        let mut board = qemu::Control;
        board.acknowledge();
        if !*IS_SET_UP {
            TASK.set_up(settings());
            *IS_SET_UP = true;
        }
        if TASK.wants_revision() {
            board.revise_pulses();
        }
        TASK.run(&mut board, &SHARED);
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
        if board.is_boundary() {
            board.acknowledge();
            task.run(&mut board, &SHARED);
        } else {
            task.revise(&mut board, &SHARED);
        }
    }

    #[exception]
    unsafe fn HardFault(_frame: &cortex_m_rt::ExceptionFrame) -> ! {
        qemu::die()
    }

    #[panic_handler]
    fn panic(_info: &core::panic::PanicInfo) -> ! {
        qemu::die()
    }
}
