//! The two interrupts.
#![allow(unsafe_code)]

use crate::subject::{BURST_SUBJECTS, SUBJECTS, Subject};
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering::SeqCst};
use cortex_m_rt::{entry, exception, interrupt};
use cortex_m_semihosting::hprintln;
use tractive::board::qemu::{self, Interrupt as interrupt};
use tractive::ports::ControlPort;
use tractive::time::Instant;

/// Control timer's period: room for the longest control interrupt and four PWM interrupts, and a whole number of instructions (of 1.6 ticks each), so
/// that the sweep skips none.
const CONTROL_TICKS: u32 = 3_496;
/// PWM timer's period.
const PWM_TICKS: u32 = CONTROL_TICKS + 1;

/// First part: one PWM interrupt in each control period. The number of control interrupts lets each subject meet each phase, because the number of
/// subjects and the PWM timer's period have no common divisor.
const SINGLE_ROUNDS: u32 = PWM_TICKS * SUBJECTS.len() as u32;
const _: () = assert!(!PWM_TICKS.is_multiple_of(SUBJECTS.len() as u32));
/// Second part: four PWM interrupts in a row, so that a reader is hit in every try, also when it gives up. One subject after the other, with a sweep
/// for each of these times from one interrupt's end to the next: any part of a try.
const BURST: u32 = 4;
const PAUSES_TICKS: [u32; 33] = [
    12, 14, 16, 18, 20, 22, 24, 26, 28, 30, 32, 34, 36, 38, 40, 42, 44, 47, 51, 55, 60, 65, 70, 75, 80, 85,
    90, 97, 105, 120, 135, 150, 170,
];
const PAUSES: usize = PAUSES_TICKS.len();
const ROUNDS: u32 = SINGLE_ROUNDS + (PAUSES * BURST_SUBJECTS.len()) as u32 * PWM_TICKS;

static ROUND: AtomicU32 = AtomicU32::new(0);
static LATE: AtomicU32 = AtomicU32::new(0);
/// PWM interrupts of the present burst.
static HITS: AtomicU32 = AtomicU32::new(0);
static DONE: AtomicBool = AtomicBool::new(false);

/// A bit for each half-word of code that a PWM interrupt landed on.
static LANDED: [AtomicU32; LANDED_WORDS] = [const { AtomicU32::new(0) }; LANDED_WORDS];
/// For 64 KiB of code.
const LANDED_WORDS: usize = 1024;

/// Number of the sweep in the second part, from 0; `None` in the first.
fn burst_sweep(round: u32) -> Option<usize> {
    round.checked_sub(SINGLE_ROUNDS).map(|bursts| (bursts / PWM_TICKS) as usize)
}

fn subject() -> Option<&'static Subject> {
    let round = ROUND.load(SeqCst);
    match burst_sweep(round) {
        None => SUBJECTS.get(round as usize % SUBJECTS.len()),
        Some(sweep) => BURST_SUBJECTS.get(sweep / PAUSES),
    }
}

/// From the end of this PWM interrupt, the burst's `hits`-th, to the next one; `None` after the last.
fn pause_ticks(hits: u32) -> Option<u32> {
    let sweep = burst_sweep(ROUND.load(SeqCst)).filter(|_| hits < BURST)?;
    PAUSES_TICKS.get(sweep % PAUSES).copied()
}

/// The PWM timer's masked interrupt status.
const PWM_STATUS: usize = 0x4000_2014;
/// The second timer behind the PWM timer's interrupt: load, control, interrupt clear.
const BURST_TIMER: [usize; 3] = [0x4000_2020, 0x4000_2028, 0x4000_202C];
const ONE_SHOT_INTERRUPT_32_BIT: u32 = 0b1010_0011;

fn write_register(address: usize, value: u32) {
    // SAFETY: called with the addresses of this board's timer registers.
    unsafe { core::ptr::write_volatile(address as *mut u32, value) }
}

fn read_register(address: usize) -> u32 {
    // SAFETY: as above.
    unsafe { core::ptr::read_volatile(address as *const u32) }
}

#[entry]
fn main() -> ! {
    qemu::start(PWM_TICKS, CONTROL_TICKS);
    while !DONE.load(SeqCst) {
        qemu::idle();
    }
    report();
    qemu::stop(true)
}

#[interrupt]
fn TIMER0() {
    let mut board = qemu::Control;
    board.acknowledge();
    if DONE.load(SeqCst) {
        return;
    }
    if let Some(subject) = subject() {
        (subject.low)(&subject.counts);
    }
    if <qemu::Control as ControlPort>::overrun_ticks(&mut board, Instant(0), CONTROL_TICKS) > 0 {
        LATE.store(LATE.load(SeqCst) + 1, SeqCst);
    }
    let round = ROUND.load(SeqCst) + 1;
    ROUND.store(round, SeqCst);
    DONE.store(round == ROUNDS, SeqCst);
}

/// The vector table's entry: hands on the exception frame, which begins where the stack pointer is.
#[unsafe(no_mangle)]
#[unsafe(naked)]
unsafe extern "C" fn DUALTIMER() {
    core::arch::naked_asm!("mov r0, sp", "b.w {body}", body = sym landed)
}

/// The frame: r0 to r3, r12, lr, the return address, the status.
unsafe extern "C" fn landed(frame: &[u32; 8]) {
    let [load, control, clear] = BURST_TIMER;
    let hits = if read_register(PWM_STATUS) & 1 == 1 { 1 } else { HITS.load(SeqCst) + 1 };
    HITS.store(hits, SeqCst);
    qemu::Pwm.acknowledge();
    write_register(clear, 1);
    if DONE.load(SeqCst) {
        return;
    }
    let [.., address, _] = *frame;
    let half_word = address / 2;
    if let Some(word) = LANDED.get(half_word as usize / 32) {
        word.store(word.load(SeqCst) | 1 << (half_word % 32), SeqCst);
    }
    if let Some(subject) = subject() {
        (subject.high)(&subject.counts);
    }
    if let Some(ticks) = pause_ticks(hits) {
        write_register(load, ticks);
        write_register(control, ONE_SHOT_INTERRUPT_32_BIT);
    }
}

/// The findings, a line each, for `cargo xtask test`.
fn report() {
    hprintln!("rounds {} late {}", ROUND.load(SeqCst), LATE.load(SeqCst));
    for Subject { name, counts, .. } in SUBJECTS.iter().chain(&BURST_SUBJECTS) {
        let [reads, torn, stale, missing] =
            [&counts.reads, &counts.torn, &counts.stale, &counts.missing].map(|count| count.load(SeqCst));
        hprintln!("cell {} {} {} {} {}", name, reads, torn, stale, missing);
    }
    for (index, word) in LANDED.iter().enumerate() {
        for bit in 0..32 {
            if word.load(SeqCst) >> bit & 1 == 1 {
                hprintln!("landed {:x}", (index * 32 + bit) * 2);
            }
        }
    }
}

#[exception]
unsafe fn HardFault(_frame: &cortex_m_rt::ExceptionFrame) -> ! {
    qemu::stop(false)
}

#[panic_handler]
fn panic(_info: &core::panic::PanicInfo) -> ! {
    qemu::stop(false)
}
