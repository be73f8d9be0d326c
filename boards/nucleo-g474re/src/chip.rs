//! The parts that only the chip has: the vector table, the interrupt controller, waiting, the idle loop.
#![allow(unsafe_code)]

use super::can::Can;
use super::log::Log;
use super::pins::{self, Pin};
use super::position::PositionState;
use super::power_stage::{CORE_HZ, POWER_STAGE, THERMAL};
use super::registers::Registers;
use super::serve::{Serve, Station};
use super::start::{self, Found, StartError, Timeout, Wait};
use super::watchdog::Pulse;
use super::{CLOCK, clock};
use crate::built_in::traction::BUILT_IN;
use cortex_m::peripheral::NVIC;
use defmt_rtt as _;
pub use stm32_metapac::Interrupt;
use stm32_metapac::rcc::vals::Sw;
use tractive::drive::traction::Shared;
use tractive::modulation::SwitchLimits;
use tractive::operator::{self, Configuration, Line, Slot, slot_s};
use tractive::protection::FailedCheck;
use tractive::protocol::{CanEndpoint, Message, TO_DRIVE};
use tractive::recorder::Recorder;

/// The drive's flight recorder.
pub static RECORDER: Recorder = Recorder::new();

/// The cells of the drive's two interrupts and of its operator.
pub static SHARED: Shared = Shared::recorded_by(&RECORDER);

/// The position sensors' state.
pub static POSITION: PositionState = PositionState::new();

/// The signs of life that the interrupts give the watchdog.
pub static PULSE: Pulse = Pulse::new();

unsafe extern "C" {
    fn TIM1_UP_TIM16();
    fn TIM2();
    fn TIM3();
    fn DefaultHandler();
}

/// The device part of the vector table. Every entry has a target; those that a firmware does not define, and all others, lead to the default handler.
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
pub static __INTERRUPTS: [unsafe extern "C" fn(); 102] = {
    let mut table: [unsafe extern "C" fn(); 102] = [DefaultHandler; 102];
    table[Interrupt::TIM1_UP_TIM16 as usize] = TIM1_UP_TIM16;
    table[Interrupt::TIM2 as usize] = TIM2;
    table[Interrupt::TIM3 as usize] = TIM3;
    table
};

struct Unlocked;
critical_section::set_impl!(Unlocked);

// SAFETY: only the log takes critical sections, and only the idle loop logs, so there is never a second one to keep out. Therefore nothing is masked,
// and no interrupt is ever delayed by a message.
unsafe impl critical_section::Impl for Unlocked {
    unsafe fn acquire() -> critical_section::RawRestoreState {}
    unsafe fn release(_: critical_section::RawRestoreState) {}
}

/// Waits by counting cycles.
pub(super) struct Cycles;

impl Wait for Cycles {
    fn until(&mut self, done: &mut dyn FnMut() -> bool) -> Result<(), Timeout> {
        // 100 ms and more: the crystal takes a few ms.
        for _ in 0..10_000 {
            if done() {
                return Ok(());
            }
            self.microseconds(10);
        }
        Err(Timeout)
    }

    fn microseconds(&mut self, us: u32) {
        cortex_m::asm::delay(us.saturating_mul(CORE_HZ / 1_000_000));
    }
}

/// Frequency of the internal oscillator, which clocks the core from a reset until the switch to the PLL, in Hz.
const RESET_HZ: u32 = 16_000_000;

/// Waits for the time of a slot when no interrupt sets the beat, whatever clock the start has left the core on.
pub(super) fn pause_a_slot() {
    let core_hz = match Registers::CHIP.rcc.cfgr().read().sws() {
        Sw::PLL1_R => CORE_HZ,
        _ => RESET_HZ,
    };
    cortex_m::asm::delay(core_hz / 1_000);
}

/// Configures everything with the gates off. Call it once.
pub fn prepare(devices: SwitchLimits) -> Result<Found, StartError> {
    let found = start::prepare(&Registers::CHIP, &mut Cycles, devices);
    join_bus(found, &TO_DRIVE, &pins::PINS)
}

/// Joins the bus for these messages even if the start failed: the bus then reports the reason.
pub(super) fn join_bus<T>(
    found: Result<T, StartError>,
    messages: &[&Message],
    of: &[Pin],
) -> Result<T, StartError> {
    if let Err(error) = &found {
        defmt::error!("no start: {}", error);
    }
    let registers = Registers::CHIP;
    // This includes the ports of the bus's pins: the start may have failed before enabling them.
    clock::enable_peripherals(&registers, &mut Cycles);
    match Can::CHIP.configure(messages, &registers.rcc, &mut Cycles) {
        Ok(()) => pins::configure_bus(&registers, of),
        // Nobody can command the drive then; it stays at rest. If its watchdog runs already, that starts the chip anew.
        Err(error) => defmt::error!("no bus: {}", error),
    }
    found
}

/// Starts both timers and unmasks their interrupts: PWM preempts control.
pub fn run() {
    run_with(Interrupt::TIM1_UP_TIM16, Interrupt::TIM3, start::run);
}

/// The PWM interrupt's priority in the interrupt controller: the lower number preempts. The chip implements the upper four bits.
const PWM_PRIORITY: u8 = 0x40;
/// The control interrupt's.
const CONTROL_PRIORITY: u8 = 0x80;
const _: () = assert!(PWM_PRIORITY >> 4 < CONTROL_PRIORITY >> 4, "PWM preempts control");

/// Enables both interrupts and starts their timers. Call it once.
pub(super) fn run_with(pwm: Interrupt, control: Interrupt, start: fn(&Registers, &mut dyn Wait)) {
    // SAFETY: the only use of the core peripherals, before any interrupt is unmasked.
    let mut core = unsafe { cortex_m::Peripherals::steal() };
    // SAFETY: priorities are changed while both interrupts are masked; no code relies on a priority ceiling. After that both may come: their handlers
    // share only cells and registers, which each writes as the modules say.
    unsafe {
        core.NVIC.set_priority(pwm, PWM_PRIORITY);
        core.NVIC.set_priority(control, CONTROL_PRIORITY);
        NVIC::unmask(pwm);
        NVIC::unmask(control);
    }
    start(&Registers::CHIP, &mut Cycles);
    defmt::info!("running");
}

/// Triggers the PWM interrupt at once, between two boundaries.
pub fn revise_pulses() {
    NVIC::pend(Interrupt::TIM1_UP_TIM16);
    // It has run before anything else is done.
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
}

/// The last step in an interrupt: completes its stores before it returns. A store that is still under way while a handler returns and another
/// interrupt changes what comes next can make the core fetch the wrong vector (Cortex-M4 erratum 838869).
#[inline(always)]
pub fn complete_stores() {
    cortex_m::asm::dsb();
}

/// The idle loop, which never ends: serves the bus and the operator, feeds the watchdog, logs changes, and after a fault logs the records of the
/// flight recorder. If the start was `refused`, it reports the reason to whoever asks on the bus.
pub fn idle(refused: Option<FailedCheck>) -> ! {
    idle_over(CanEndpoint::new(&BUILT_IN.ratings), refused)
}

/// The same over another end of the protocol.
pub fn idle_over(station: impl Station, refused: Option<FailedCheck>) -> ! {
    let line = Line::rated(&BUILT_IN.ratings, POWER_STAGE.line.precharge_s, POWER_STAGE.line.discharge_s);
    let mut rated = operator::Settings::rated(&BUILT_IN.ratings, slot_s(&CLOCK), Some(line));
    rated.thermal = THERMAL.as_ref();
    let mut serve = Serve::new(Registers::CHIP, Can::CHIP, station, &POSITION, Configuration::Good);
    let (mut slot, mut log) = (Slot::new(), Log::new());
    while let Some(why) = refused {
        pause_a_slot();
        serve.refuse(&mut slot, why, &rated);
    }
    loop {
        serve.pass(&mut slot, &SHARED.operator, &rated);
        if PULSE.feed_if_both_ran(&Registers::CHIP) {
            log.record(&RECORDER);
        }
        log.trip(SHARED.operator.observed().and_then(|observed| observed.report.trip));
    }
}

/// Turns all outputs off for good, whatever state the program is in, then does nothing more; the watchdog resets the chip if it runs.
pub fn die() -> ! {
    die_on(&pins::PINS)
}

/// The same for the pins of a system.
pub(super) fn die_on(of: &[Pin]) -> ! {
    start::switch_off(&Registers::CHIP, of);
    loop {
        cortex_m::asm::nop();
    }
}

/// The handlers of a firmware for conditions that no drive survives: each ends in the given function, which turns all outputs off.
#[macro_export]
macro_rules! last_resorts {
    ($die:path) => {
        #[cortex_m_rt::exception]
        unsafe fn HardFault(_frame: &cortex_m_rt::ExceptionFrame) -> ! {
            $die()
        }

        /// Any other exception or interrupt: the drive survives none of them (the clock security system's is one).
        #[cortex_m_rt::exception]
        unsafe fn DefaultHandler(_number: i16) -> ! {
            $die()
        }

        #[panic_handler]
        fn panic(_info: &core::panic::PanicInfo) -> ! {
            $die()
        }
    };
}
