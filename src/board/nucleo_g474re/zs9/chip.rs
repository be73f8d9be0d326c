//! What only the chip has, for the ZS9: starting its interrupts, the log.
#![allow(unsafe_code)]

use super::operator::Operator;
use super::sampling::Zeros;
use super::stage::STAGE;
use super::start;
use crate::board::nucleo_g474re::registers::Registers;
use crate::board::nucleo_g474re::start::StartError;
use crate::board::nucleo_g474re::{Cycles, Interrupt, PULSE, unmask};

/// The drive's operator.
pub static OPERATOR: Operator = Operator::new(STAGE.link_ref_v);

/// Configures everything, gates off. Call it once.
pub fn prepare() -> Result<Zeros, StartError> {
    let found = start::prepare(&Registers::CHIP, &mut Cycles);
    if let Err(error) = &found {
        defmt::error!("no start: {}", error);
    }
    found
}

/// Starts the timers and unmasks their interrupts: PWM preempts control.
pub fn run() {
    unmask(Interrupt::TIM1_UP_TIM16, Interrupt::TIM2);
    start::run(&Registers::CHIP);
    defmt::info!("running");
}

/// The idle loop, forever: feeds the watchdog, tells what has changed.
pub fn idle() -> ! {
    let (mut told, mut broken) = (false, false);
    loop {
        PULSE.feed_if_both_ran(&Registers::CHIP);
        if !broken && start::bridge(&Registers::CHIP).outputs().is_tripped() {
            broken = true;
            defmt::error!("gates off by a break: hardware, or the fault that follows");
        }
        if !told && let Some(trip) = OPERATOR.report().and_then(|report| report.trip) {
            told = true;
            defmt::error!("fault {}: {} beyond {}", trip.fault.name(), trip.value, trip.limit);
        }
    }
}
