//! A firmware with a board of its own: the code that a user of the library writes. It consists of two interrupts, their vector table, a board that
//! implements the ports, and the tables of the machine in `machine/`.
//!
//! The registers in [`board`] are those of an example. What is left to you besides them: the order in which your chip is set up, the break inputs in
//! hardware and their causes (`Sample::hardware`), the commands, which here are two switches, and what `ask` says of the enable input and the encoder,
//! which here are always good.
#![no_std]
#![no_main]

mod board;
mod vectors;

/// The machine's tables, made by the build script.
mod machine {
    include!(concat!(env!("OUT_DIR"), "/machine.rs"));
}

use board::{Board, CLOCK, MIN_PULSE_TICKS};
use core::cell::UnsafeCell;
use machine::{BUILT_IN, BuiltIn};
use tractive::drive::traction::{ControlTask, PwmTask, Settings, Shared};
use tractive::modulation::SwitchLimits;
use tractive::operator::{self, Slot, slot_s};
use tractive::time::Instant;

/// Both tasks' settings: the clock, the switches' limits, the machine's known iron loss, the default gains, an angle without delay.
const SETTINGS: Settings = Settings {
    iron_share: BUILT_IN.ratings.iron_share,
    ..Settings::new(CLOCK, SwitchLimits::new(MIN_PULSE_TICKS, 0, BUILT_IN.ratings.max_switching_hz, &CLOCK))
};

/// If this does not compile, the tables or the settings are refused by name.
const _: () = if let Err(refused) = SETTINGS.check(&BUILT_IN) {
    panic!("{}", refused.name)
};

static SHARED: Shared = Shared::new();

/// A value that only one interrupt uses.
struct Own<T>(UnsafeCell<T>);

// SAFETY: each is touched only by the one interrupt that names it, which does not preempt itself.
unsafe impl<T> Sync for Own<T> {}

static CONTROL: Own<ControlTask<BuiltIn>> =
    Own(UnsafeCell::new(ControlTask::new(BuiltIn, SETTINGS, Instant(CLOCK.control_ticks))));
static PWM: Own<PwmTask<BuiltIn>> =
    Own(UnsafeCell::new(PwmTask::new(BuiltIn, SETTINGS, Instant(SETTINGS.devices.shortest_half_ticks))));

#[cortex_m_rt::entry]
fn main() -> ! {
    board::start();
    let operator = operator::Settings::rated(&BUILT_IN.ratings, slot_s(&CLOCK), None);
    let mut slot = Slot::new();
    loop {
        slot.run(&SHARED.operator, &mut Board, &operator, &CLOCK);
    }
}

/// The control timer's interrupt, of low priority.
#[unsafe(no_mangle)]
extern "C" fn TIM2() {
    // SAFETY: only this interrupt uses it.
    let task = unsafe { &mut *CONTROL.0.get() };
    task.run(&mut Board, &SHARED);
    board::complete_stores();
}

/// The PWM timer's interrupt, of high priority: at each carrier boundary, and when control asks for a revision.
#[unsafe(no_mangle)]
extern "C" fn TIM1_UP() {
    // SAFETY: only this interrupt uses it.
    let task = unsafe { &mut *PWM.0.get() };
    task.run(&mut Board, &SHARED);
    board::complete_stores();
}

/// The last resort: gates off, until a reset.
fn die() -> ! {
    board::gates_off();
    loop {
        core::hint::spin_loop();
    }
}

#[panic_handler]
fn panic(_info: &core::panic::PanicInfo) -> ! {
    die()
}

#[cortex_m_rt::exception]
unsafe fn HardFault(_frame: &cortex_m_rt::ExceptionFrame) -> ! {
    die()
}

/// Interrupts and exceptions that nobody expects.
#[cortex_m_rt::exception]
unsafe fn DefaultHandler(_number: i16) -> ! {
    die()
}
