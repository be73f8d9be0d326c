//! With the feature `saboteur`: interrupts that are late, lost or slow, and control's that begin later, so that the PWM interrupt
//! lands in them where it is wanted.
//!
//! The firmware and its interrupts are the ordinary ones. Their entries in the vector table lead through here, and the exchange tells
//! what it does. What is to go wrong stands on the emulator's command line, `-append "KIND AT AMOUNT FILE"`; what came of it is written
//! into the file. Instants here are real ones, of a counter that nobody else knows: the tasks' nominal ones fall behind with every
//! interrupt that they miss.

use super::exchange::file::File;
use super::{Control, DUALTIMER, Interrupt, PWM_TIMER, Pwm, TIMER0, read_register, write_register};
use crate::time::Instant;
use crate::wire::{BLOCK_WORDS, Block};
use core::fmt::Write;
use core::sync::atomic::{AtomicBool, AtomicU16, AtomicU32, Ordering::Relaxed};
use cortex_m::peripheral::NVIC;

/// What is done to the interrupts.
#[derive(Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
enum Kind {
    /// Nothing.
    None,
    /// One control interrupt takes `amount` ticks longer.
    ControlSlow,
    /// `amount` control ticks pass without their interrupt.
    ControlLost,
    /// One PWM interrupt comes `amount` ticks after its tick; control goes on meanwhile.
    PwmLate,
    /// `amount` PWM ticks pass without their interrupt: the shadow registers are played once more.
    PwmLost,
    /// Each control interrupt begins later by as many instructions as the file says that then takes what came of it.
    Landing,
}

const KINDS: [(&str, Kind); 6] = [
    ("none", Kind::None),
    ("control-slow", Kind::ControlSlow),
    ("control-lost", Kind::ControlLost),
    ("pwm-late", Kind::PwmLate),
    ("pwm-lost", Kind::PwmLost),
    ("landing", Kind::Landing),
];

static KIND: AtomicU32 = AtomicU32::new(Kind::None as u32);
/// The mishap comes with the first interrupt of its kind from this tick on.
static AT: AtomicU32 = AtomicU32::new(0);
static AMOUNT: AtomicU32 = AtomicU32::new(0);
/// How many interrupts something was done to.
static STRUCK: AtomicU32 = AtomicU32::new(0);
/// When the first of them was due, and when the gates were turned off.
static STRUCK_AT: AtomicU32 = AtomicU32::new(0);
/// Length of the half, or of the ZS9's carrier period, that the PWM timer would play next then.
static LOADED: AtomicU32 = AtomicU32::new(0);
static SAFE: AtomicBool = AtomicBool::new(false);
/// What the ZS9's gates have shown since the PWM interrupt last asked, beyond what the rig will tell it.
static LATCHED: AtomicU32 = AtomicU32::new(0);
/// The word of a power sample that tells the gates.
const GATES: usize = 8;
/// Number of the present control interrupt, from 0.
static CALL: AtomicU32 = AtomicU32::new(0);
/// For each control interrupt, by how many instructions later than it comes it begins.
static DELAYS: [AtomicU16; CALLS] = [const { AtomicU16::new(0) }; CALLS];
/// For each control interrupt, how many ticks before the next carrier boundary it came.
static LEFT: [AtomicU16; CALLS] = [const { AtomicU16::new(u16::MAX) }; CALLS];
/// For each control interrupt, where one landed in it; 0: none did.
static LANDED: [AtomicU32; CALLS] = [const { AtomicU32::new(0) }; CALLS];
const CALLS: usize = 10_240;
/// The newest half, as it went to the rig.
static PLAYED: [AtomicU32; BLOCK_WORDS] = [const { AtomicU32::new(0) }; BLOCK_WORDS];
static FOUND: File = File::closed();

/// The second timer of the PWM timer's pair: value, control. It counts real time.
const COUNTER: [usize; 2] = [PWM_TIMER + 0x24, PWM_TIMER + 0x28];
const FREE_RUNNING_32_BIT: u32 = 0b1000_0010;
/// CMSDK timer 1, which ends a delay, and its interrupt.
const DELAY_TIMER: usize = 0x4000_1000;

/// Reads the orders.
pub fn connect() {
    let mut line = [0; 256];
    let line = super::exchange::file::command_line(&mut line);
    let mut words = line.rsplit(' ');
    let (Some(file), Some(amount), Some(at), Some(kind)) =
        (words.next(), words.next(), words.next(), words.next())
    else {
        return;
    };
    let Some((_, kind)) = KINDS.iter().find(|(name, _)| *name == kind) else { return };
    KIND.store(*kind as u32, Relaxed);
    AT.store(at.parse().unwrap_or(0), Relaxed);
    AMOUNT.store(amount.parse().unwrap_or(0), Relaxed);
    if is(Kind::Landing) {
        super::exchange::file::read_half_words(file, &DELAYS);
    }
    FOUND.create(file);
}

/// Starts the counter of real time; call it with the timers.
pub fn start() {
    let [_, control] = COUNTER;
    write_register(control, FREE_RUNNING_32_BIT);
    // SAFETY: its handler shares nothing with the others but atomics.
    unsafe {
        let mut core = cortex_m::Peripherals::steal();
        core.NVIC.set_priority(Interrupt::TIMER1, 0);
        NVIC::unmask(Interrupt::TIMER1);
    }
}

/// Ticks since the start.
fn now() -> u32 {
    let [value, _] = COUNTER;
    !read_register(value)
}

fn is(kind: Kind) -> bool {
    KIND.load(Relaxed) == kind as u32
}

/// Whether this interrupt is one that the mishap is for, the first ones from its instant on.
fn strikes(kind: Kind, most: u32) -> bool {
    let (now, struck) = (now(), STRUCK.load(Relaxed));
    if !is(kind) || now < AT.load(Relaxed) || struck >= most {
        return false;
    }
    STRUCK.store(struck + 1, Relaxed);
    if struck == 0 {
        STRUCK_AT.store(now, Relaxed);
        LOADED.store(read_register(PWM_TIMER + 0x18) + 1, Relaxed);
    }
    true
}

/// The vector table's entry for control.
pub unsafe extern "C" fn control() {
    if strikes(Kind::ControlLost, AMOUNT.load(Relaxed)) {
        Control.acknowledge();
        return;
    }
    if is(Kind::Landing) {
        wait_before_control();
    }
    // SAFETY: called as the vector table would have it.
    unsafe { TIMER0() }
    CALL.store(CALL.load(Relaxed) + 1, Relaxed);
}

/// The vector table's entry for PWM: hands on the exception frame, which begins where the stack pointer is.
#[unsafe(naked)]
pub unsafe extern "C" fn pwm() {
    core::arch::naked_asm!(
        "mov r0, sp", "push {{r3, lr}}", "bl {body}", "pop {{r3, lr}}",
        "cmp r0, #0", "beq 1f", "b.w {handler}", "1: bx lr",
        body = sym pwm_comes, handler = sym DUALTIMER,
    )
}

/// Whether the PWM interrupt is served. The frame: r0 to r3, r12, lr, the return address, the status.
unsafe extern "C" fn pwm_comes(frame: &[u32; 8]) -> bool {
    land(frame);
    if !Pwm.is_boundary() {
        return true;
    }
    let amount = AMOUNT.load(Relaxed);
    let (lost, late) = (strikes(Kind::PwmLost, amount), strikes(Kind::PwmLate, 1));
    let behind = STRUCK.load(Relaxed) > 0 && (is(Kind::PwmLost) || is(Kind::PwmLate));
    if behind {
        // Otherwise the next half would take the place of the one that is played once more.
        let block = super::exchange::catch_up(Instant(now()));
        latch(block.get(GATES).copied().unwrap_or(0));
    }
    if lost || late {
        super::exchange::play_again();
    }
    if lost {
        Pwm.acknowledge();
    }
    if late {
        NVIC::mask(Interrupt::DUALTIMER);
        write_register(DELAY_TIMER + 8, amount);
        write_register(DELAY_TIMER + 4, amount);
        write_register(DELAY_TIMER, 0b1001);
    }
    !(lost || late)
}

/// The end of a delay.
pub unsafe extern "C" fn delay_ends() {
    write_register(DELAY_TIMER, 0);
    write_register(DELAY_TIMER + 0xC, 1);
    // SAFETY: it was unmasked before it was masked.
    unsafe { NVIC::unmask(Interrupt::DUALTIMER) }
}

/// Notes the instruction of the control interrupt that comes next, if it is one.
fn land(frame: &[u32; 8]) {
    const CONTROL: u32 = 16 + Interrupt::TIMER0 as u32;
    let [.., address, status] = *frame;
    if status & 0x1FF != CONTROL {
        return;
    }
    if let Some(landed) = LANDED.get(CALL.load(Relaxed) as usize) {
        landed.store(address, Relaxed);
    }
}

/// Notes how far the next carrier boundary is, and waits for as many instructions as the present control interrupt is to be late by.
fn wait_before_control() {
    let call = CALL.load(Relaxed) as usize;
    let (Some(left), Some(delay)) = (LEFT.get(call), DELAYS.get(call)) else { return };
    left.store(u16::try_from(read_register(PWM_TIMER + 4)).unwrap_or(u16::MAX), Relaxed);
    spend(delay.load(Relaxed).into());
}

/// Executes exactly so many instructions more than with 0. A loop that asks a timer would do so once in several instructions only.
#[inline(never)]
fn spend(instructions: u32) {
    // SAFETY: the instructions read and write nothing but a register of their own and the flags.
    unsafe {
        core::arch::asm!(
            "lsrs {pairs}, {pairs}, #1", "bcc 2f", "nop",
            "2: cmp {pairs}, #0", "beq 4f",
            "3: subs {pairs}, {pairs}, #1", "bne 3b",
            "4:",
            pairs = inout(reg) instructions => _,
            options(nomem, nostack)
        )
    }
}

/// Control has its samples.
pub fn sampled() {
    if strikes(Kind::ControlSlow, 1) {
        let begun = now();
        while now().wrapping_sub(begun) < AMOUNT.load(Relaxed) {}
    }
}

/// A block went to the rig.
pub fn sent(block: &Block) {
    const PLAY: u32 = 5;
    if block.first() == Some(&PLAY) {
        for (kept, word) in PLAYED.iter().zip(block) {
            kept.store(*word, Relaxed);
        }
    }
}

fn latch(gates: u32) {
    LATCHED.store(LATCHED.load(Relaxed) | gates, Relaxed);
}

/// Adds to a power sample all that the gates have shown.
pub fn complete(block: &mut Block) {
    if let Some(gates) = block.get_mut(GATES) {
        *gates |= LATCHED.swap(0, Relaxed);
    }
}

/// The newest half.
pub fn played() -> Block {
    PLAYED.each_ref().map(|word| word.load(Relaxed))
}

/// The gates are turned off.
pub fn gates_off() {
    if !SAFE.swap(true, Relaxed) {
        let after = now().wrapping_sub(STRUCK_AT.load(Relaxed));
        let (struck, loaded) = (STRUCK.load(Relaxed), LOADED.load(Relaxed));
        let call = CALL.load(Relaxed);
        let _ = writeln!(&FOUND, "struck {struck} loaded {loaded} safe-after {after} in {call}");
    }
}

/// The run is over.
pub fn finish() {
    cortex_m::interrupt::disable();
    for (call, (left, landed)) in LEFT.iter().zip(&LANDED).enumerate() {
        let (left, landed) = (left.load(Relaxed), landed.load(Relaxed));
        if left != u16::MAX {
            let _ = writeln!(&FOUND, "call {call} left {left} landed {landed:x}");
        }
    }
    let _ = writeln!(&FOUND, "end");
}
