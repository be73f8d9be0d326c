//! The board: registers on one side, the library's ports on the other, two for the interrupts and one for the idle loop. The registers and their
//! addresses are those of no real chip. Replace them by your chip's, and keep what each of these functions does.

use crate::machine::BUILT_IN;
use crate::vectors::Interrupt;
use cortex_m::peripheral::NVIC;
use tractive::frames::{Abc, Angle};
use tractive::modulation::{CarrierHalf, Mode};
use tractive::operator::{Configuration, Feedback, OperatorPort, Request, Status};
use tractive::ports::{ControlPort, PwmPort, Report, Sample};
use tractive::protection::SafeState;
use tractive::time::{Clock, Instant};

/// 21 MHz ticks; control at 10 kHz.
pub const CLOCK: Clock = Clock::new(21_000_000, 2_100);
/// The shortest pulse of the switches, 3 µs.
pub const MIN_PULSE_TICKS: u32 = 63;

/// Amperes per converter code, and the code at zero current.
const AMPERE_PER_CODE: f32 = 0.05;
const ZERO_CODE: i32 = 2_048;
/// Volts of the DC link per converter code.
const VOLT_PER_CODE: f32 = 0.2;
/// Counts per turn of the encoder, electrical.
const COUNTS: u32 = 4_096;

/// Data registers of the converters and the encoder's count.
const CONVERTERS: *const u32 = 0x4001_2000 as *const u32;
const ENCODER: *const u32 = 0x4000_0824 as *const u32;
/// Shadow registers, which take effect together when a half ends: its length, two compares for each leg (the upper device is on below the first one
/// and from the second one on), and whether the legs are driven at all.
const RELOAD: *mut u32 = 0x4001_002C as *mut u32;
const COMPARES: *mut u32 = 0x4001_0034 as *mut u32;
const DRIVEN: *mut u32 = 0x4001_004C as *mut u32;
/// What the legs do instead, at once and until it is taken back: see [`Force`].
const FORCE: *mut u32 = 0x4001_0044 as *mut u32;
/// Flags of the timers' updates, and the control timer's count since its update.
const STATUS: *mut u32 = 0x4001_0010 as *mut u32;
const CONTROL_STATUS: *mut u32 = 0x4000_0010 as *mut u32;
const CONTROL_COUNT: *const u32 = 0x4000_0024 as *const u32;
/// Levels of the operator's switches: enable, acknowledge; and of the gate drivers' common ready wire.
const SWITCHES: *const u32 = 0x4002_0010 as *const u32;
const READY: *const u32 = 0x4002_0014 as *const u32;
/// A compare value that is never reached.
const NEVER: u32 = u32::MAX;

/// Values of [`FORCE`].
#[derive(Clone, Copy)]
enum Force {
    /// The pulses.
    Nothing = 0,
    /// All gates off.
    Off = 1,
    /// The three lower devices on.
    Lower = 2,
    /// The three upper devices on.
    Upper = 3,
}

fn read(register: *const u32) -> u32 {
    // SAFETY: one of the addresses above, which the chip maps to a register that may be read at any time.
    unsafe { register.read_volatile() }
}

fn write(register: *mut u32, value: u32) {
    // SAFETY: one of the addresses above, which the chip maps to a register that may be written at any time.
    unsafe { register.write_volatile(value) }
}

/// The phase currents that a converter holds, in A.
fn currents_a(converter: usize) -> Abc {
    let phase = |channel: usize| {
        let code = read(CONVERTERS.wrapping_add(8 * converter + channel)) as i32;
        (code - ZERO_CODE) as f32 * AMPERE_PER_CODE
    };
    Abc { a: phase(0), b: phase(1), c: phase(2) }
}

/// Turns the gates off: for the start, panics, and exceptions that nobody expects.
pub fn gates_off() {
    write(FORCE, Force::Off as u32);
}

/// The safe state at once. A short circuit remains one: gates off would let the machine charge the link through the diodes.
fn enter(safe: SafeState) {
    match safe {
        SafeState::GatesOff if read(FORCE) <= Force::Off as u32 => gates_off(),
        SafeState::GatesOff => {}
        SafeState::ShortCircuit => write(FORCE, Force::Lower as u32),
        SafeState::UpperShortCircuit => write(FORCE, Force::Upper as u32),
    }
}

/// Completes an interrupt's stores before it returns: without it, Cortex-M4 cores may fetch a wrong vector (erratum 838869).
pub fn complete_stores() {
    cortex_m::asm::dsb();
}

/// Priorities of the two interrupts in the interrupt controller: the lower number preempts. Most chips implement the upper four bits.
const PWM_PRIORITY: u8 = 0x40;
const CONTROL_PRIORITY: u8 = 0x80;

/// Sets up clocks, pins, converters, break inputs and timers, in the order that your chip requires, then both interrupts. The gates stay off until a half
/// that pulses.
pub fn start() {
    gates_off();
    write(DRIVEN, 0);
    write(FORCE, Force::Nothing as u32);
    // SAFETY: nothing else uses the core's peripherals.
    let mut core = unsafe { cortex_m::Peripherals::steal() };
    // SAFETY: both are masked until here, and no code relies on a priority ceiling. Their handlers share only the library's cells and registers.
    unsafe {
        core.NVIC.set_priority(Interrupt::Pwm, PWM_PRIORITY);
        core.NVIC.set_priority(Interrupt::Control, CONTROL_PRIORITY);
        NVIC::unmask(Interrupt::Pwm);
        NVIC::unmask(Interrupt::Control);
    }
}

/// `true` while all gate drivers are ready.
fn is_ready() -> bool {
    read(READY) & 1 != 0
}

/// The board as both tasks and the operator see it.
pub struct Board;

impl ControlPort for Board {
    fn begin(&mut self, revises: bool) {
        write(CONTROL_STATUS, 0);
        if revises {
            NVIC::pend(Interrupt::Pwm);
            // It has run before anything else is done.
            cortex_m::asm::dsb();
            cortex_m::asm::isb();
        }
    }

    fn sample(&mut self, _now: Instant) -> Sample {
        let count = read(ENCODER) % COUNTS;
        Sample {
            currents_a: currents_a(0),
            udc_v: read(CONVERTERS.wrapping_add(3)) as f32 * VOLT_PER_CODE,
            // The middle of the count, not its beginning.
            angle: Some(Angle((2 * count + 1) * (u32::MAX / COUNTS / 2 + 1))),
            may_pulse: is_ready(),
            hardware: None,
        }
    }

    fn enter(&mut self, safe: SafeState, _now: Instant) {
        enter(safe);
    }

    fn overrun_ticks(&mut self, _now: Instant, deadline_ticks: u32) -> u32 {
        let count = read(CONTROL_COUNT);
        // The flag was taken back at the beginning: if it is set again, the period is over.
        let is_over = read(CONTROL_STATUS) & 1 != 0;
        let ticks = if is_over { CLOCK.control_ticks + count } else { count };
        ticks.saturating_sub(deadline_ticks)
    }

    fn report(&mut self, _now: Instant, _report: impl FnOnce() -> Report) {}
}

impl PwmPort for Board {
    fn begin(&mut self) -> bool {
        let boundary = read(STATUS) & 1 != 0;
        // Only what has been seen is taken back: a boundary may come between the two accesses.
        if boundary {
            write(STATUS, !1);
        }
        boundary
    }

    fn sample(&mut self, _now: Instant) -> Abc {
        currents_a(1)
    }

    fn play(&mut self, _now: Instant, next: &CarrierHalf) {
        write(RELOAD, next.period_ticks);
        for (leg, (starts, ticks)) in next.start_levels.into_iter().zip(next.compare_ticks).enumerate() {
            let toggle = if ticks < next.period_ticks { ticks } else { NEVER };
            let compares = if starts { [toggle, NEVER] } else { [0, toggle] };
            for (number, compare) in compares.into_iter().enumerate() {
                write(COMPARES.wrapping_add(2 * leg + number), compare);
            }
        }
        write(DRIVEN, u32::from(next.mode != Mode::Off));
    }

    fn is_late(&mut self) -> bool {
        // The flag was taken back at the beginning: if it is set again, the half had ended before its successor was loaded.
        let is_late = read(STATUS) & 1 != 0;
        if is_late {
            enter(SafeState::GatesOff);
        }
        is_late
    }

    fn enter(&mut self, safe: SafeState, _now: Instant) {
        enter(safe);
    }

    fn leave(&mut self, _now: Instant) -> bool {
        write(FORCE, Force::Nothing as u32);
        is_ready()
    }
}

impl OperatorPort for Board {
    fn ask(&mut self, _at: Instant, _slots: u32) -> (Request, Feedback) {
        let levels = read(SWITCHES);
        let (enable, acknowledge) = (levels & 1 != 0, levels & 2 != 0);
        let feedback = Feedback {
            driver_ready: is_ready(),
            enable_input: true,
            sensor_alive: true,
            position_known: true,
            configuration: Configuration::Good,
            ..Feedback::default()
        };
        (Request { enable, acknowledge, ..Request::idle(&BUILT_IN.ratings) }, feedback)
    }

    fn tell(&mut self, _from: Instant, _status: &Status, _report: Option<&Report>) {}
}
