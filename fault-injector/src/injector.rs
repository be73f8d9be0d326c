//! The fault injector: interrupts that are late, lost or slow, and control interrupts that begin later, so that the PWM interrupt lands in them at the
//! wanted place.
//!
//! The firmware and its interrupts are the ordinary ones. Once the timers are to start, the vector table is a copy in RAM whose entries lead through
//! here, and the ports report what passes through them. The fault to be injected is given on the emulator's command line,
//! `-append "KIND AT AMOUNT FILE"`; the outcome is written into the file, as records of five words. Instants here are real ones, of a counter that
//! nothing else uses: the tasks' nominal instants fall behind with every interrupt that they miss.
#![allow(unsafe_code)]

use crate::file::{self, File};
use core::sync::atomic::{AtomicBool, AtomicU16, AtomicU32, Ordering::Relaxed};
use cortex_m::interrupt::InterruptNumber;
use cortex_m::peripheral::NVIC;
use tractive::board::qemu::exchange::{PWM_ANSWERS, exchange, send};
use tractive::board::qemu::{Control, Interrupt, Pwm};
use tractive::ports::{GateFeedback, PowerSample};
use tractive::time::Instant;
use tractive::wire::{BLOCK_WORDS, Block, Request};

/// The faults.
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
    /// Each control interrupt begins later by as many instructions as the file says; the same file then takes the outcome.
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
/// The fault comes with the first interrupt of its kind from this tick on.
static AT: AtomicU32 = AtomicU32::new(0);
static AMOUNT: AtomicU32 = AtomicU32::new(0);
/// Number of interrupts into which a fault was injected.
static INJECTED: AtomicU32 = AtomicU32::new(0);
/// Instants at which the first of them was due, and at which the gates were turned off.
static INJECTED_AT: AtomicU32 = AtomicU32::new(0);
/// Length of the half, or of the ZS9's carrier period, that the PWM timer would play next then.
static LOADED: AtomicU32 = AtomicU32::new(0);
static SAFE: AtomicBool = AtomicBool::new(false);
/// The ZS9's gates, as they have shown themselves since the PWM interrupt last asked, beyond what the rig will tell it.
static LATCHED: AtomicU32 = AtomicU32::new(0);
/// The word of a power sample that holds the gates' feedback.
const GATES: usize = 8;
/// First word of a record: that the gates were turned off, or a control interrupt.
const GATES_OFF: u32 = 1;
const CONTROL: u32 = 2;
/// Number of the present control interrupt, from 0.
static CALL: AtomicU32 = AtomicU32::new(0);
/// For each control interrupt, the number of instructions by which it begins later than it comes.
static DELAYS: [AtomicU16; CALLS] = [const { AtomicU16::new(0) }; CALLS];
/// Ticks before the next carrier boundary at which the present control interrupt came.
static LEFT: AtomicU32 = AtomicU32::new(0);
/// Address at which a PWM interrupt landed in it; 0: none did.
static LANDED: AtomicU32 = AtomicU32::new(0);
const CALLS: usize = 20_480;
/// The newest half, as it went to the rig.
static PLAYED: [AtomicU32; BLOCK_WORDS] = [const { AtomicU32::new(0) }; BLOCK_WORDS];
static FOUND: File = File::closed();

/// The PWM timer of the emulated board: its value, its shadow register.
const PWM_VALUE: usize = 0x4000_2004;
const PWM_SHADOW: usize = 0x4000_2018;
/// The second timer of the PWM timer's pair: value, control. It counts real time.
const COUNTER: [usize; 2] = [0x4000_2024, 0x4000_2028];
const FREE_RUNNING_32_BIT: u32 = 0b1000_0010;
/// CMSDK timer 1, which ends a delay.
const DELAY_TIMER: usize = 0x4000_1000;
/// From the arrival of a control interrupt, in ticks: by then it has taken its samples, and is far from its end.
const BEHIND_SAMPLES: u32 = 100;

/// CMSDK timer 1's interrupt, which ends a delay.
#[derive(Clone, Copy)]
struct DelayEnds;

// SAFETY: the number is the board's.
unsafe impl InterruptNumber for DelayEnds {
    fn number(self) -> u16 {
        9
    }
}

/// Entries of the vector table: the core's, and the board's up to the PWM timer's.
const VECTORS: usize = 16 + 11;

/// The vector table in RAM, aligned to the power of two above its length, as the core wants it.
#[repr(align(128))]
struct Vectors([AtomicU32; VECTORS]);

static TABLE: Vectors = Vectors([const { AtomicU32::new(0) }; VECTORS]);

unsafe extern "C" {
    fn TIMER0();
    fn DUALTIMER();
    /// The linker's: the image's own vector table.
    static __vector_table: [u32; VECTORS];
}

fn write_register(address: usize, value: u32) {
    // SAFETY: called with the addresses of timer registers of this board, which are always mapped and word-wide.
    unsafe { core::ptr::write_volatile(address as *mut u32, value) }
}

fn read_register(address: usize) -> u32 {
    // SAFETY: as in `write_register`; reading these registers has no side effect.
    unsafe { core::ptr::read_volatile(address as *const u32) }
}

/// Reads the orders.
pub fn connect() {
    let mut line = [0; 256];
    let line = file::command_line(&mut line);
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
        file::read_half_words(file, &DELAYS);
    }
    FOUND.create(file);
}

/// Takes the interrupts over and starts the counter of real time; call it with the timers.
pub fn start() {
    let own = (&raw const __vector_table).cast::<u32>();
    for (number, entry) in TABLE.0.iter().enumerate() {
        // SAFETY: within the table.
        entry.store(unsafe { own.add(number).read_volatile() }, Relaxed);
    }
    let taken: [(u16, unsafe extern "C" fn()); 3] = [
        (Interrupt::TIMER0.number(), control),
        (DelayEnds.number(), delay_ends),
        (Interrupt::DUALTIMER.number(), pwm),
    ];
    for (number, handler) in taken {
        if let Some(entry) = TABLE.0.get(16 + usize::from(number)) {
            entry.store(handler as usize as u32, Relaxed);
        }
    }
    // SAFETY: the table is whole, aligned, and never moves; the handlers share nothing with the others but atomics.
    unsafe {
        let mut core = cortex_m::Peripherals::steal();
        core.SCB.vtor.write(&raw const TABLE as u32);
        // Above control, below the PWM interrupt.
        core.NVIC.set_priority(DelayEnds, 0x60);
        NVIC::unmask(DelayEnds);
    }
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
    let [_, control] = COUNTER;
    write_register(control, FREE_RUNNING_32_BIT);
}

/// Ticks since the start.
fn now() -> u32 {
    let [value, _] = COUNTER;
    !read_register(value)
}

fn is(kind: Kind) -> bool {
    KIND.load(Relaxed) == kind as u32
}

/// True for an interrupt that the fault affects: the first ones from its instant on.
fn is_injected(kind: Kind, most: u32) -> bool {
    let (now, injected) = (now(), INJECTED.load(Relaxed));
    if !is(kind) || now < AT.load(Relaxed) || injected >= most {
        return false;
    }
    INJECTED.store(injected + 1, Relaxed);
    if injected == 0 {
        INJECTED_AT.store(now, Relaxed);
        LOADED.store(read_register(PWM_SHADOW) + 1, Relaxed);
    }
    true
}

/// The vector table's entry for control.
unsafe extern "C" fn control() {
    if is_injected(Kind::ControlLost, AMOUNT.load(Relaxed)) {
        Control.acknowledge();
        return;
    }
    if is_injected(Kind::ControlSlow, 1) {
        delay(BEHIND_SAMPLES);
    }
    let call = CALL.load(Relaxed);
    if is(Kind::Landing) {
        LANDED.store(0, Relaxed);
        wait_before_control(call);
    }
    // SAFETY: called as the vector table would have it.
    unsafe { TIMER0() }
    if is(Kind::Landing) {
        FOUND.write(&[CONTROL, call, LEFT.load(Relaxed), LANDED.load(Relaxed), 0]);
    }
    CALL.store(call + 1, Relaxed);
}

/// The vector table's entry for PWM: hands on the exception frame, which begins where the stack pointer is.
#[unsafe(naked)]
unsafe extern "C" fn pwm() {
    core::arch::naked_asm!(
        "mov r0, sp", "push {{r3, lr}}", "bl {body}", "pop {{r3, lr}}",
        "cmp r0, #0", "beq 1f", "b.w {handler}", "1: bx lr",
        body = sym pwm_comes, handler = sym DUALTIMER,
    )
}

/// Says if the PWM interrupt is served. The frame: r0 to r3, r12, lr, the return address, the status.
unsafe extern "C" fn pwm_comes(frame: &[u32; 8]) -> bool {
    land(frame);
    let mut board = Pwm;
    if !board.is_boundary() {
        return true;
    }
    let amount = AMOUNT.load(Relaxed);
    let (lost, late) = (is_injected(Kind::PwmLost, amount), is_injected(Kind::PwmLate, 1));
    let behind = INJECTED.load(Relaxed) > 0 && (is(Kind::PwmLost) || is(Kind::PwmLate));
    if behind {
        // Otherwise the next half would replace the one that is played once more.
        let mut block = Request::PwmSample(Instant(now())).to_block();
        exchange(&mut block, PWM_ANSWERS);
        latch(block.get(GATES).copied().unwrap_or(0));
    }
    if lost || late {
        send(&PLAYED.each_ref().map(|word| word.load(Relaxed)));
    }
    if lost {
        board.acknowledge();
    }
    if late {
        NVIC::mask(Interrupt::DUALTIMER);
        delay(amount);
    }
    !(lost || late)
}

/// Begins a delay of so many ticks.
fn delay(ticks: u32) {
    write_register(DELAY_TIMER + 8, ticks);
    write_register(DELAY_TIMER + 4, ticks);
    write_register(DELAY_TIMER, 0b1001);
}

/// The end of a delay: the PWM interrupt comes at last, or control is held up.
unsafe extern "C" fn delay_ends() {
    write_register(DELAY_TIMER, 0);
    write_register(DELAY_TIMER + 0xC, 1);
    if is(Kind::ControlSlow) {
        let begun = now();
        while now().wrapping_sub(begun) < AMOUNT.load(Relaxed) {}
        return;
    }
    // SAFETY: it was unmasked before it was masked.
    unsafe { NVIC::unmask(Interrupt::DUALTIMER) }
}

/// Notes the instruction of the control interrupt that would be executed next, if a control interrupt was hit.
fn land(frame: &[u32; 8]) {
    let [.., address, status] = *frame;
    if status & 0x1FF == 16 + Interrupt::TIMER0 as u32 {
        LANDED.store(address, Relaxed);
    }
}

/// Notes how far away the next carrier boundary is, and waits for the number of instructions by which the present control interrupt is to be late.
fn wait_before_control(call: u32) {
    let delay = DELAYS.get(call as usize).map_or(0, |delay| delay.load(Relaxed));
    LEFT.store(read_register(PWM_VALUE), Relaxed);
    spend(delay.into());
}

/// Executes exactly so many instructions more than with 0. A loop that polls a timer would have a resolution of several instructions only.
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

/// The newest half went to the rig.
pub fn played(block: &Block) {
    for (kept, word) in PLAYED.iter().zip(block) {
        kept.store(*word, Relaxed);
    }
}

fn latch(gates: u32) {
    LATCHED.store(LATCHED.load(Relaxed) | gates, Relaxed);
}

/// A power sample with all that the gates have shown.
pub fn complete(sample: PowerSample) -> PowerSample {
    let latched = LATCHED.swap(0, Relaxed);
    let GateFeedback { on, off } = sample.gates;
    PowerSample {
        gates: GateFeedback { on: on | latched as u16, off: off | (latched >> 16) as u16 },
        ..sample
    }
}

/// The gates are turned off.
pub fn gates_off() {
    if !SAFE.swap(true, Relaxed) {
        let after = now().wrapping_sub(INJECTED_AT.load(Relaxed));
        FOUND.write(&[GATES_OFF, INJECTED.load(Relaxed), LOADED.load(Relaxed), after, CALL.load(Relaxed)]);
    }
}
