//! The same for the ZS9.

use super::{CONTROL_ANSWERS, PWM_ANSWERS, open_files, receive, send};
use crate::board::qemu::{saboteur, stop};
use crate::board::{DualSample, PlayedPeriod, PowerSample};
use crate::drive::dual::DualReport;
use crate::link::{self, DualRequest, DualSetup};
use crate::time::Instant;

/// Opens the files and fetches the set-up.
#[inline(never)]
pub fn open_dual() -> DualSetup {
    open_files();
    send(&DualRequest::Hello.to_block());
    link::dual_setup_from_block(&receive(CONTROL_ANSWERS))
}

/// The control timer's conversions; ends the emulation when the rig says so.
#[inline(never)]
pub fn sample_dual(now: Instant) -> DualSample {
    send(&DualRequest::ControlSample(now).to_block());
    let (sample, end) = link::dual_sample_from_block(&receive(CONTROL_ANSWERS));
    if end {
        saboteur::finish();
        stop(true);
    }
    saboteur::sampled();
    sample
}

/// The conversions at a peak of the carrier.
#[inline(never)]
pub fn power_sample(now: Instant) -> PowerSample {
    send(&DualRequest::PowerSample(now).to_block());
    link::power_from_block(&saboteur::completed(receive(PWM_ANSWERS)))
}

/// What was loaded into the shadow registers.
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
    saboteur::gates_off();
    send(&DualRequest::GatesOff(now).to_block());
}

/// The processor stops, gates off.
#[inline(never)]
pub fn dead_dual() {
    send(&DualRequest::Dead.to_block());
}
