//! The exchange with the rig, over four semihosting files. A real board has none of this: `cargo xtask timing` recognises these functions by their
//! module and does not count them, so they stay out of line and take their data by reference.

mod dual;

pub use dual::{
    ask_dual, command_dual, dead_dual, gates_off, leave_dual, link_ref_dual, open_dual, play_dual,
    power_sample, report_dual, sample_dual, scheme_dual, tell_dual,
};

use super::{RECORDER, stop};
use crate::cell::{Ring, Words};
use crate::control::MtpaStart;
use crate::frames::{Abc, Angle};
use crate::identification::Observation;
use crate::modulation::CarrierHalf;
use crate::operator::{self, Feedback, Status};
use crate::ports::{DriveCommand, Report, Sample};
use crate::protection::SafeState;
use crate::protocol::Frame;
use crate::time::Instant;
use crate::wire::{self, BLOCK_BYTES, Block, Request, Setup};
use core::sync::atomic::{AtomicU32, Ordering};
use cortex_m_semihosting::syscall;

/// File handles of the link: requests, answers to control, answers to PWM, answers to the idle loop.
static FILES: [AtomicU32; 4] = [const { AtomicU32::new(0) }; 4];
const REQUESTS: usize = 0;
const CONTROL_ANSWERS: usize = 1;
/// The answers that the PWM interrupt waits for.
pub const PWM_ANSWERS: usize = 2;
const IDLE_ANSWERS: usize = 3;

/// The words of the rig's command that came with the newest sample.
static COMMAND: [AtomicU32; 4] = [const { AtomicU32::new(0) }; 4];

/// Opens the files and fetches the set-up.
#[inline(never)]
pub fn open() -> Setup {
    open_files();
    let mut block = Request::Hello.to_block();
    exchange(&mut block, CONTROL_ANSWERS);
    wire::setup_from_block(&block)
}

/// The same, with the start of MTPA.
#[inline(never)]
pub fn open_with_start() -> (Setup, MtpaStart) {
    open_files();
    let mut block = Request::Hello.to_block();
    exchange(&mut block, CONTROL_ANSWERS);
    (wire::setup_from_block(&block), wire::start_from_block(&block))
}

fn open_files() {
    const READ: usize = 1;
    const WRITE: usize = 5;
    let files =
        [(c"requests", WRITE), (c"control-answers", READ), (c"pwm-answers", READ), (c"idle-answers", READ)];
    for (file, (name, mode)) in FILES.iter().zip(files) {
        // SAFETY: SYS_OPEN reads a NUL-terminated name of the given length, which lives for the program.
        let handle = unsafe { syscall!(OPEN, name.as_ptr(), mode, name.count_bytes()) };
        if handle == usize::MAX {
            stop(false);
        }
        file.store(handle as u32, Ordering::Relaxed);
    }
}

/// The control timer's conversions; ends the emulation when the rig says so.
#[inline(never)]
pub fn control_sample(now: Instant) -> Sample {
    let mut block = Request::ControlSample(now).to_block();
    exchange(&mut block, CONTROL_ANSWERS);
    let (sample, command, end) = wire::sample_from_block(&block);
    keep(command);
    if end {
        finish(&RECORDER, |record| Request::Recorded(record).to_block());
    }
    sample
}

fn keep<const N: usize>(words: [u32; N]) {
    for (kept, word) in COMMAND.iter().zip(words) {
        kept.store(word, Ordering::Relaxed);
    }
}

/// The rig's command that came with the newest sample.
#[inline(never)]
pub fn command() -> DriveCommand {
    wire::command_from_words(kept())
}

/// The turn that a position sensor without an angle had counted at the newest sample.
#[inline(never)]
pub fn counted() -> Option<Angle> {
    wire::counted_from_words(kept())
}

fn kept() -> [u32; 3] {
    let [torque, flags, angle, _] = COMMAND.each_ref().map(|word| word.load(Ordering::Relaxed));
    [torque, flags, angle]
}

/// The angle where the position sensor began to count.
#[inline(never)]
pub fn align(now: Instant, zero: Angle) {
    send(&Request::Align(now, zero).to_block());
}

/// Sends the contents of a flight recorder, if a fault has frozen it, and ends the emulation.
#[inline(never)]
fn finish<T: Words<N>, const N: usize, const RECORDS: usize>(
    recorder: &Ring<T, N, RECORDS>,
    recorded: fn(T) -> Block,
) -> ! {
    // The rig's time stands still from here on: no interrupt may ask it for samples.
    cortex_m::interrupt::disable();
    for record in (0..).map_while(|index| recorder.read(index)) {
        send(&recorded(record));
    }
    send(&Request::End.to_block());
    stop(true)
}

/// Phase currents at a carrier boundary.
#[inline(never)]
pub fn pwm_sample(now: Instant) -> Abc {
    let mut block = Request::PwmSample(now).to_block();
    exchange(&mut block, PWM_ANSWERS);
    wire::currents_from_block(&block)
}

/// The half that was loaded into the shadow registers.
#[inline(never)]
pub fn play(now: Instant, next: &CarrierHalf) {
    send(&Request::Play(now, *next).to_block());
}

/// The end of a control interrupt, with its report, which is made for the rig.
#[inline(never)]
pub fn report(now: Instant, report: impl FnOnce() -> Report) {
    send(&Request::ControlReport(now, report()).to_block());
}

/// The observation of an identification.
#[inline(never)]
pub fn observed(now: Instant, observation: &Observation) {
    send(&Request::Observed(now, *observation).to_block());
}

/// An order to enter the safe state.
#[inline(never)]
pub fn enter(safe: SafeState, now: Instant) {
    send(&Request::Enter(now, safe).to_block());
}

/// The safe state is left.
#[inline(never)]
pub fn leave(now: Instant) {
    send(&Request::Leave(now).to_block());
}

/// The request to the operator. The idle loop's answers have their own stream: an interrupt may ask while it waits.
#[inline(never)]
pub fn ask(at: Instant) -> (operator::Request, Feedback, Option<Frame>) {
    let mut block = Request::Ask(at).to_block();
    exchange(&mut block, IDLE_ANSWERS);
    wire::asked_from_block(&block)
}

/// The operator's status, and the frame that carries it.
#[inline(never)]
pub fn tell(from: Instant, status: &Status, frame: Option<Frame>) {
    send(&wire::told_to_block(from, status, frame));
}

/// The processor stops, gates off.
#[inline(never)]
pub fn dead() {
    send(&Request::Dead.to_block());
}

/// Names the refused part of the configuration on the emulator's standard error.
#[inline(never)]
pub fn refused(name: &str) {
    const APPEND: usize = 8;
    let console = c":tt";
    // SAFETY: SYS_OPEN reads a NUL-terminated name of the given length, which lives for the program; opened for appending it is
    // the standard error.
    let handle = unsafe { syscall!(OPEN, console.as_ptr(), APPEND, console.count_bytes()) };
    for text in ["configuration refused: ", name, "\n"] {
        // SAFETY: SYS_WRITE reads exactly the text, which outlives the call.
        unsafe { syscall!(WRITE, handle, text.as_ptr(), text.len()) };
    }
}

fn file(index: usize) -> usize {
    match FILES.get(index) {
        Some(handle) => handle.load(Ordering::Relaxed) as usize,
        None => 0,
    }
}

/// Sends a request.
#[inline(never)]
pub fn send(block: &Block) {
    // SAFETY: SYS_WRITE reads exactly the block, which outlives the call.
    let missing = unsafe { syscall!(WRITE, file(REQUESTS), block.as_ptr(), BLOCK_BYTES) };
    if missing != 0 {
        stop(false);
    }
}

/// Sends a request and replaces it by the answer.
#[inline(never)]
pub fn exchange(block: &mut Block, answers: usize) {
    send(block);
    // SAFETY: SYS_READ writes at most the block's bytes, and the block is ours until this returns.
    let missing = unsafe { syscall!(READ, file(answers), block.as_mut_ptr(), BLOCK_BYTES) };
    if missing != 0 {
        stop(false);
    }
}
