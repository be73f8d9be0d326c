//! The same for the ZS9.

use super::{CONTROL_ANSWERS, IDLE_ANSWERS, PWM_ANSWERS, exchange, finish, open_files, send};
use crate::board::qemu::{DUAL_RECORDER, watch};
use crate::operator::{DualStatus, Feedback};
use crate::ports::DualReport;
use crate::ports::{DualSample, PlayedPeriod, PowerSample};
use crate::protocol::Frame;
use crate::time::Instant;
use crate::wire::{self, DualRequest, DualSetup};

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
    let (sample, end) = wire::dual_sample_from_block(&block);
    if end {
        watch::stop();
        finish(&DUAL_RECORDER, |record| DualRequest::Recorded(record).to_block());
    }
    sample
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
pub fn report_dual(now: Instant, report: &DualReport) {
    send(&DualRequest::ControlReport(now, *report).to_block());
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

/// The frame that has come, and what the board says.
#[inline(never)]
pub fn ask_dual(at: Instant) -> (Feedback, Option<Frame>) {
    let mut block = DualRequest::Ask(at).to_block();
    exchange(&mut block, IDLE_ANSWERS);
    wire::dual_asked_from_block(&block)
}

/// The operator's status, and the frame that carries it.
#[inline(never)]
pub fn tell_dual(from: Instant, status: &DualStatus, frame: Option<Frame>) {
    send(&DualRequest::Tell(from, *status, frame).to_block());
}

/// The processor stops, gates off.
#[inline(never)]
pub fn dead_dual() {
    send(&DualRequest::Dead.to_block());
}
