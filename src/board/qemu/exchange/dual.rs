//! The exchange with the rig for the ZS9.

use super::{COMMAND, CONTROL_ANSWERS, IDLE_ANSWERS, PWM_ANSWERS, exchange, finish, keep, open_files, send};
use crate::board::qemu::{DUAL_RECORDER, watch};
use crate::nine_switch::Scheme;
use crate::operator::{DualStatus, Feedback};
use crate::ports::{DualDriveCommand, DualReport, DualSample, PlayedPeriod, PowerSample};
use crate::protocol::Frame;
use crate::time::Instant;
use crate::wire::{self, DualRequest, DualSetup};
use core::sync::atomic::Ordering;

/// Opens the files and fetches the set-up.
#[inline(never)]
pub fn open_dual() -> DualSetup {
    open_files();
    let mut block = DualRequest::Hello.to_block();
    exchange(&mut block, CONTROL_ANSWERS);
    wire::dual_setup_from_block(&block)
}

/// The control timer's conversions; ends the emulation when the rig says so.
#[inline(never)]
pub fn sample_dual(now: Instant) -> DualSample {
    let mut block = DualRequest::ControlSample(now).to_block();
    exchange(&mut block, CONTROL_ANSWERS);
    let (sample, command, end) = wire::dual_sample_from_block(&block);
    keep(command);
    if end {
        watch::stop();
        finish(&DUAL_RECORDER, |record| DualRequest::Recorded(record).to_block());
    }
    sample
}

/// The rig's command that came with the newest sample.
#[inline(never)]
pub fn command_dual() -> DualDriveCommand {
    wire::dual_command_from_words(COMMAND.each_ref().map(|word| word.load(Ordering::Relaxed)))
}

/// The place of the zero vectors in that command.
#[inline(never)]
pub fn scheme_dual() -> Scheme {
    command_dual().scheme
}

/// The link voltage of that command, in V.
#[inline(never)]
pub fn link_ref_dual() -> f32 {
    command_dual().link_ref_v
}

/// The conversions at a peak of the carrier.
#[inline(never)]
pub fn power_sample(now: Instant) -> PowerSample {
    let mut block = DualRequest::PowerSample(now).to_block();
    exchange(&mut block, PWM_ANSWERS);
    wire::power_from_block(&block)
}

/// The period that was loaded into the shadow registers.
#[inline(never)]
pub fn play_dual(now: Instant, next: &PlayedPeriod) {
    send(&DualRequest::Play(now, *next).to_block());
}

/// The end of a control interrupt.
#[inline(never)]
pub fn report_dual(now: Instant, report: impl FnOnce() -> DualReport) {
    send(&DualRequest::ControlReport(now, report()).to_block());
}

/// An order to turn all gates off.
#[inline(never)]
pub fn gates_off(now: Instant) {
    send(&DualRequest::GatesOff(now).to_block());
}

/// The gates may be played again.
#[inline(never)]
pub fn leave_dual(now: Instant) {
    send(&DualRequest::Leave(now).to_block());
}

/// The received frame and the board's feedback.
#[inline(never)]
pub fn ask_dual(at: Instant) -> (Feedback, Option<Frame>) {
    let mut block = DualRequest::Ask(at).to_block();
    exchange(&mut block, IDLE_ANSWERS);
    wire::dual_asked_from_block(&block)
}

/// The operator's status, and the frame that carries it.
#[inline(never)]
pub fn tell_dual(from: Instant, status: &DualStatus, frame: Option<Frame>) {
    send(&wire::told_to_block(from, status, frame));
}

/// The processor stops, gates off.
#[inline(never)]
pub fn dead_dual() {
    send(&DualRequest::Dead.to_block());
}
