//! The ZS9 firmware: two interrupts and an idle loop, nothing else.
#![cfg_attr(target_os = "none", no_std, no_main)]

/// The image runs on a board; on the host there is nothing to do but to say so.
#[cfg(not(target_os = "none"))]
fn main() {
    println!(
        "This is the firmware. `cargo xtask run zs9-cycle` builds it for its board and runs it in QEMU."
    );
}

#[cfg(all(target_os = "none", feature = "board-nucleo-g474re"))]
#[path = "../firmware/zs9_nucleo_g474re.rs"]
mod firmware;

#[cfg(all(target_os = "none", not(feature = "board-nucleo-g474re")))]
mod firmware {
    use core::sync::atomic::{AtomicU32, Ordering};
    use cortex_m_rt::{entry, exception, interrupt};
    use tractive::board::qemu::{self, CLOCK, Interrupt as interrupt};
    use tractive::drive::dual::{ControlTask, PwmTask, Settings, Shared};
    use tractive::machine::zs9::{BUILT_IN, BuiltIn};

    static SHARED: Shared = Shared::new();
    static CARRIER_TICKS: AtomicU32 = AtomicU32::new(0);

    fn settings() -> Settings {
        Settings::new(CLOCK, CARRIER_TICKS.load(Ordering::Relaxed))
    }

    #[entry]
    fn main() -> ! {
        let setup = qemu::connect_dual();
        CARRIER_TICKS.store(setup.carrier_ticks, Ordering::Relaxed);
        let settings_alone = || settings().check_settings(&BUILT_IN.ratings);
        if let Err(refused) = const { BUILT_IN.check() }.and_then(|()| settings_alone()) {
            qemu::refuse(&refused);
        }
        qemu::start_dual(&settings());
        loop {
            qemu::idle();
        }
    }

    /// Deadline: the last peak before the next control interrupt. Missed: fault `control_deadline`, all gates off.
    #[interrupt]
    fn TIMER0() {
        static mut TASK: Option<ControlTask<BuiltIn>> = None;
        let mut board = qemu::Control;
        board.acknowledge();
        TASK.get_or_insert_with(|| ControlTask::new(BuiltIn, settings())).run(&mut board, &SHARED);
    }

    /// Deadline: the next valley, where the shadow registers take over.
    #[interrupt]
    fn DUALTIMER() {
        static mut TASK: Option<PwmTask<BuiltIn>> = None;
        let mut board = qemu::Pwm;
        board.acknowledge();
        TASK.get_or_insert_with(|| PwmTask::new(BuiltIn, settings())).run(&mut board, &SHARED);
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
