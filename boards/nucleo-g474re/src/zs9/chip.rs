//! The parts that only the chip has, for the ZS9: starting its interrupts, the idle loop.
#![allow(unsafe_code)]

use super::sampling::Zeros;
use super::serve::DualServe;
use super::stage::STAGE;
use super::{CLOCK, RATINGS, pins, start};
use crate::can::Can;
use crate::log::Log;
use crate::position::PositionState;
use crate::registers::Registers;
use crate::start::StartError;
use crate::{Cycles, Interrupt, PULSE, die_on, join_bus, pause_a_slot, run_with};
use tractive::drive::dual::Shared;
use tractive::operator::{self, Configuration, DualSlot, Line, slot_s};
use tractive::protection::FailedCheck;
use tractive::protocol::{TO_ZS9, Zs9CanEndpoint};
use tractive::recorder::DualRecorder;

/// The drive's flight recorder.
pub static RECORDER: DualRecorder = DualRecorder::new();

/// The cells of the drive's two interrupts and of its operator.
pub static SHARED: Shared = Shared::recorded_by(&RECORDER);

/// The position sensors' state.
pub static POSITION: PositionState = PositionState::new();

/// Configures everything with the gates off. Call it once.
pub fn prepare() -> Result<Zeros, StartError> {
    let found = start::prepare(&Registers::CHIP, &mut Cycles);
    join_bus(found, &TO_ZS9, &pins::PINS)
}

/// Starts the timers and unmasks their interrupts: PWM preempts control.
pub fn run() {
    run_with(Interrupt::TIM1_UP_TIM16, Interrupt::TIM2, start::run);
}

/// The idle loop, which never ends: serves the bus and the operator, feeds the watchdog, logs changes, and after a fault logs the records of the
/// flight recorder. If the start was `refused`, it reports the reason to whoever asks on the bus.
pub fn idle(refused: Option<FailedCheck>) -> ! {
    let line =
        Line::rated(&RATINGS, STAGE.common.line.precharge_s, STAGE.common.line.discharge_s).without_chopper();
    let rated = operator::Settings::rated(&RATINGS, slot_s(&CLOCK), Some(line));
    let station = Zs9CanEndpoint::new(&RATINGS);
    let mut serve = DualServe::new(Registers::CHIP, Can::CHIP, station, &POSITION, Configuration::Good);
    let (mut slot, mut log) = (DualSlot::new(), Log::new());
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
