//! The ZS9 firmware: two interrupts and an idle loop, nothing else.
#![cfg_attr(target_os = "none", no_std, no_main)]

/// The image runs on a board; on the host there is nothing to do but to say so.
#[cfg(not(target_os = "none"))]
fn main() {
    println!(
        "This is the firmware. `cargo xtask run zs9-cycle` builds it for its board and runs it in QEMU."
    );
}

#[cfg(all(target_os = "none", not(any(feature = "qemu", feature = "board-nucleo-g474re"))))]
compile_error!("the reference images need the feature `qemu`");

#[cfg(all(target_os = "none", feature = "board-nucleo-g474re"))]
#[path = "../firmware/zs9_nucleo_g474re.rs"]
mod firmware;

#[cfg(all(target_os = "none", feature = "qemu", not(feature = "board-nucleo-g474re")))]
mod firmware {
    use core::sync::atomic::{AtomicU32, Ordering};
    use cortex_m_rt::{entry, exception, interrupt};
    use tractive::board::qemu::{self, CLOCK, Interrupt as interrupt};
    use tractive::built_in::zs9::{BUILT_IN, BuiltIn};
    use tractive::drive::dual::{ControlTask, PwmTask, Settings, Shared};
    use tractive::machine::Ratings;
    use tractive::operator::{self, DualSlot, Line, slot_s};
    use tractive::protocol::Zs9Station;

    static SHARED: Shared = Shared::recorded_by(&qemu::DUAL_RECORDER);
    /// Until the host has told its carrier.
    const DEFAULTS: Settings = Settings::new(CLOCK, CLOCK.control_ticks);
    /// As the operator looks at them.
    static RATINGS: Ratings = DEFAULTS.operator_ratings(&BUILT_IN.ratings);
    static CARRIER_TICKS: AtomicU32 = AtomicU32::new(0);

    fn settings() -> Settings {
        Settings::new(CLOCK, CARRIER_TICKS.load(Ordering::Relaxed))
    }

    #[entry]
    fn main() -> ! {
        let setup = qemu::connect_dual();
        CARRIER_TICKS.store(setup.carrier_ticks, Ordering::Relaxed);
        // All but the carrier are constants of the image.
        let constants = const { DEFAULTS.check(&BUILT_IN) };
        if let Err(refused) = constants.and_then(|()| settings().check_carrier()) {
            qemu::refuse(&refused);
        }
        let line = setup
            .line
            .map(|times| Line::rated(&RATINGS, times.precharge_s, times.discharge_s).without_chopper());
        let rated = operator::Settings::rated(&RATINGS, slot_s(&CLOCK), line);
        let (mut slot, mut idle) = (DualSlot::new(), qemu::DualIdle { station: Zs9Station::new(&RATINGS) });
        qemu::start_dual(&settings());
        loop {
            if line.is_some() {
                let settings = idle.station.settings(&rated);
                slot.run(&qemu::DUAL_DESK, &mut idle, &settings, &CLOCK);
            }
            qemu::idle();
        }
    }

    /// Deadline: the last peak before the next control interrupt. Missed: fault `control_deadline`, all gates off.
    #[interrupt]
    fn TIMER0() {
        static mut TASK: ControlTask<BuiltIn> = ControlTask::new(BuiltIn, DEFAULTS);
        static mut IS_SET_UP: bool = false;
        let mut board = qemu::Control;
        board.acknowledge();
        if !*IS_SET_UP {
            TASK.set_carrier(CARRIER_TICKS.load(Ordering::Relaxed));
            *IS_SET_UP = true;
        }
        TASK.run(&mut board, &SHARED);
    }

    /// Deadline: the next valley, where the shadow registers take over. Missed: the watch's.
    #[interrupt]
    fn DUALTIMER() {
        static mut TASK: PwmTask<BuiltIn> = PwmTask::new(BuiltIn, DEFAULTS);
        static mut IS_SET_UP: bool = false;
        let mut board = qemu::Pwm;
        board.acknowledge();
        if !*IS_SET_UP {
            TASK.set_carrier(CARRIER_TICKS.load(Ordering::Relaxed));
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
}
