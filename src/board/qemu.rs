//! The emulated board: QEMU's `mps2-an386`, a Cortex-M4F at a deterministic instruction rate, with the rig at the other
//! end of four semihosting files.
//!
//! * Control timer: CMSDK timer 0. Its count gives the age of the running control period.
//! * PWM timer: CMSDK dual timer, 32 bits; BGLOAD is its shadow register: what is written takes over at the next zero.
//! * Both count 40 ns ticks, and a period is the load + 1 ticks. The PWM timer is started first, so at equal nominal
//!   instants its interrupt is pending first; it also has the higher priority.
#![allow(unsafe_code)]

mod dual;
pub mod exchange;
mod watch;

pub use dual::{DUAL_RECORDER, DualIdle, connect_dual, die_dual, start_dual};
pub use watch::ends as watch_ends;

use crate::configuration::Refused;
use crate::control::MtpaStart;
use crate::frames::{Abc, Angle};
use crate::modulation::CarrierHalf;
use crate::operator::{self, Feedback, OperatorPort, Status};
use crate::ports::{ControlPort, DriveCommand, PwmPort, Report, Sample};
use crate::protection::SafeState;
use crate::protocol::CanEndpoint;
use crate::recorder::Recorder;
use crate::time::{Clock, Instant};
use crate::wire::Setup;
use core::sync::atomic::{AtomicBool, Ordering};
use cortex_m::peripheral::NVIC;
use cortex_m_semihosting::debug;

/// 25 MHz ticks; control at 10 kHz.
pub const CLOCK: Clock = Clock::new(TICKS_HZ, 2_500);

/// The rate of both timers' counts, in Hz.
pub const TICKS_HZ: u32 = 25_000_000;

/// The PMaSynRM drive's flight recorder. The rig reads it when the run is over.
pub static RECORDER: Recorder = Recorder::new();

const CONTROL_TIMER: usize = 0x4000_0000;
const PWM_TIMER: usize = 0x4000_2000;

/// The interrupts that this image uses, by their numbers on the board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u16)]
#[allow(
    non_camel_case_types,
    clippy::upper_case_acronyms,
    reason = "names of interrupts, as vendors write them"
)]
pub enum Interrupt {
    /// CMSDK timer 0: control.
    TIMER0 = 8,
    /// CMSDK dual timer: PWM.
    DUALTIMER = 10,
}

// SAFETY: the numbers are the board's, and no two variants share one.
unsafe impl cortex_m::interrupt::InterruptNumber for Interrupt {
    fn number(self) -> u16 {
        self as u16
    }
}

/// An entry of the vector table.
#[repr(C)]
pub union Vector {
    handler: unsafe extern "C" fn(),
    reserved: usize,
}

unsafe extern "C" {
    fn TIMER0();
    fn DUALTIMER();
}

/// The vector table's device part.
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
pub static __INTERRUPTS: [Vector; 11] = {
    const NONE: Vector = Vector { reserved: 0 };
    let mut table = [NONE; 11];
    table[Interrupt::TIMER0 as usize] = Vector { handler: TIMER0 };
    table[Interrupt::DUALTIMER as usize] = Vector { handler: DUALTIMER };
    table
};

fn write_register(address: usize, value: u32) {
    // SAFETY: called with the addresses of timer registers of this board, which are always mapped and word-wide.
    unsafe { core::ptr::write_volatile(address as *mut u32, value) }
}

fn read_register(address: usize) -> u32 {
    // SAFETY: as in `write_register`; reading these registers has no side effect.
    unsafe { core::ptr::read_volatile(address as *const u32) }
}

/// `true` if there is an operator; without one the rig commands the drive, along with its samples.
static OPERATED: AtomicBool = AtomicBool::new(false);

/// Opens the link and fetches the set-up. To be called once, before [`start`].
pub fn connect() -> Setup {
    let setup = exchange::open();
    OPERATED.store(setup.line.is_some() || setup.over_protocol, Ordering::Relaxed);
    setup
}

/// The same, with the start of the MTPA of the papers' ordinary law.
pub fn connect_with_start() -> (Setup, MtpaStart) {
    let (setup, start) = exchange::open_with_start();
    OPERATED.store(setup.line.is_some() || setup.over_protocol, Ordering::Relaxed);
    (setup, start)
}

/// Starts both timers; the first PWM interrupt comes after `first_half_ticks`, the first control interrupt after one
/// control period.
pub fn start(first_half_ticks: u32, control_ticks: u32) {
    enable_interrupts();
    write_register(PWM_TIMER, first_half_ticks - 1);
    write_register(CONTROL_TIMER + 8, control_ticks - 1);
    start_timers();
}

fn enable_interrupts() {
    // SAFETY: the only use of the core peripherals, before any interrupt is unmasked.
    let mut core = unsafe { cortex_m::Peripherals::steal() };
    // SAFETY: priorities are changed while both interrupts are masked; no code relies on a priority ceiling. After that
    // both may come: their handlers share nothing but the cells.
    unsafe {
        core.NVIC.set_priority(Interrupt::DUALTIMER, 0x40);
        core.NVIC.set_priority(Interrupt::TIMER0, 0x80);
        NVIC::unmask(Interrupt::DUALTIMER);
        NVIC::unmask(Interrupt::TIMER0);
    }
}

fn start_timers() {
    const ENABLE_PERIODIC_INTERRUPT_32_BIT: u32 = 0b1110_0010;
    const ENABLE_INTERRUPT: u32 = 0b1001;
    write_register(PWM_TIMER + 8, ENABLE_PERIODIC_INTERRUPT_32_BIT);
    write_register(CONTROL_TIMER, ENABLE_INTERRUPT);
}

/// Waits for a while, in instructions that do nothing. Not `wfi`: with `sleep=off` QEMU 7.2 skips timer periods while the processor sleeps. Not a
/// short loop: leaving a translated block costs more than a thousand idle instructions. Out of line: otherwise a caller's constants would lie after
/// all of them, out of reach.
#[inline(never)]
pub fn idle() {
    // SAFETY: the instructions read and write nothing.
    unsafe { core::arch::asm!(".rept 500", "nop", ".endr", options(nomem, nostack, preserves_flags)) }
}

/// Ends the emulation.
pub fn stop(success: bool) -> ! {
    debug::exit(if success { debug::EXIT_SUCCESS } else { debug::EXIT_FAILURE });
    loop {
        cortex_m::asm::wfi();
    }
}

/// Refuses to start: names what is refused and ends the emulation. No interrupt is unmasked, and the gates are off.
pub fn refuse(refused: &Refused) -> ! {
    exchange::refused(refused.name);
    stop(false)
}

/// Turns the gates off, whatever state the program is in, and ends: for panics and HardFaults.
pub fn die() -> ! {
    exchange::dead();
    stop(false)
}

/// The control interrupt's side of the board.
pub struct Control;

/// The PWM interrupt's side of the board.
pub struct Pwm;

impl Control {
    /// Takes the timer's flag back.
    pub fn acknowledge(&mut self) {
        write_register(CONTROL_TIMER + 0xC, 1);
    }
}

impl Pwm {
    /// The timer's flag, which says that the interrupt comes for a carrier boundary.
    pub fn is_boundary(&self) -> bool {
        read_register(PWM_TIMER + 0x10) & 1 != 0
    }

    /// Takes that flag back.
    pub fn acknowledge(&mut self) {
        write_register(PWM_TIMER + 0xC, 1);
    }
}

impl ControlPort for Control {
    fn begin(&mut self, revises: bool) {
        self.acknowledge();
        if revises {
            NVIC::pend(Interrupt::DUALTIMER);
            // It has run before anything else is done.
            cortex_m::asm::dsb();
            cortex_m::asm::isb();
        }
    }

    fn sample(&mut self, now: Instant) -> Sample {
        exchange::control_sample(now)
    }

    fn command(&mut self, _now: Instant, operator: impl FnOnce() -> DriveCommand) -> DriveCommand {
        if OPERATED.load(Ordering::Relaxed) { operator() } else { exchange::command() }
    }

    fn enter(&mut self, safe: SafeState, now: Instant) {
        exchange::enter(safe, now);
    }

    fn overrun_ticks(&mut self, _now: Instant, _deadline_ticks: u32) -> u32 {
        // The interrupt was acknowledged on entry: if it is pending again, the period is over.
        if read_register(CONTROL_TIMER + 0xC) & 1 == 0 {
            return 0;
        }
        read_register(CONTROL_TIMER + 8).saturating_sub(read_register(CONTROL_TIMER + 4)).saturating_add(1)
    }

    fn report(&mut self, now: Instant, report: impl FnOnce() -> Report) {
        exchange::report(now, report);
    }

    fn turned(&mut self) -> Option<Angle> {
        exchange::counted()
    }

    fn align(&mut self, now: Instant, zero: Angle) {
        exchange::align(now, zero);
    }
}

impl PwmPort for Pwm {
    fn begin(&mut self) -> bool {
        let boundary = self.is_boundary();
        if boundary {
            self.acknowledge();
        }
        boundary
    }

    fn sample(&mut self, now: Instant) -> Abc {
        exchange::pwm_sample(now)
    }

    fn play(&mut self, now: Instant, next: &CarrierHalf) {
        write_register(PWM_TIMER + 0x18, next.period_ticks.saturating_sub(1));
        exchange::play(now, next);
    }

    fn enter(&mut self, safe: SafeState, now: Instant) {
        exchange::enter(safe, now);
    }

    fn leave(&mut self, now: Instant) -> bool {
        exchange::leave(now);
        true
    }
}

/// The idle loop's side of the board.
pub struct Idle {
    /// The protocol, if the operator's request comes over it; `None`: the rig's request comes in words.
    pub station: Option<&'static mut CanEndpoint>,
}

impl Idle {
    /// The state at power-up.
    pub const fn new(station: Option<&'static mut CanEndpoint>) -> Self {
        Self { station }
    }
}

impl OperatorPort for Idle {
    fn ask(&mut self, at: Instant, slots: u32) -> (operator::Request, Feedback) {
        let (request, feedback, frame) = exchange::ask(at);
        let request = match &mut self.station {
            Some(station) => station.listen(slots, frame.as_ref()),
            None => request,
        };
        (request, feedback)
    }

    fn tell(&mut self, from: Instant, status: &Status, report: Option<&Report>) {
        let frame = self.station.as_mut().and_then(|station| station.tell(status, report));
        exchange::tell(from, status, frame);
    }
}
