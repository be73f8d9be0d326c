//! What only the chip has, for the ZS9: starting its interrupts, the idle loop.
#![allow(unsafe_code)]

use super::sampling::Zeros;
use super::{CLOCK, RATINGS, TIMES, pins, settings, start};
use crate::board::nucleo_g474re::can::Can;
use crate::board::nucleo_g474re::log::Log;
use crate::board::nucleo_g474re::operator::DualOperator;
use crate::board::nucleo_g474re::registers::Registers;
use crate::board::nucleo_g474re::serve::DualServe;
use crate::board::nucleo_g474re::start::StartError;
use crate::board::nucleo_g474re::{Cycles, Interrupt, PULSE, join_bus, pause_a_slot, refuse_on, run_with};
use crate::built_in::zs9::BUILT_IN;
use crate::configuration::Refused;
use crate::operator::{self, DualDesk, DualSlot, Line, slot_s};
use crate::protection::Violation;
use crate::protocol::{TO_ZS9, Zs9Station};
use crate::recorder::DualRecorder;

/// The drive's operator.
pub static OPERATOR: DualOperator = DualOperator::new(DualDesk::new());

/// The drive's flight recorder.
pub static RECORDER: DualRecorder = DualRecorder::new();

/// Configures everything, gates off. Call it once.
pub fn prepare() -> Result<Zeros, StartError> {
    let found = start::prepare(&Registers::CHIP, &mut Cycles);
    join_bus(found, &TO_ZS9, &pins::PINS)
}

/// As the PMaSynRM's [`refuse`](crate::board::nucleo_g474re::refuse).
pub fn refuse(refused: &Refused) -> Violation {
    refuse_on(refused, &TO_ZS9, &pins::PINS)
}

/// Starts the timers and unmasks their interrupts: PWM preempts control.
pub fn run() {
    run_with(Interrupt::TIM1_UP_TIM16, Interrupt::TIM2, start::run);
}

/// The idle loop, forever: serves the bus and the operator, feeds the watchdog, tells what has changed, and after a fault what the
/// flight recorder holds. Where the start was `refused` it says why to whoever asks on the bus.
pub fn idle(refused: Option<Violation>) -> ! {
    let line = Line::rated(&RATINGS, TIMES.precharge_s, TIMES.discharge_s).without_chopper();
    let rated = operator::Settings::rated(&RATINGS, slot_s(&CLOCK), Some(line));
    let configuration = settings().check(&BUILT_IN).into();
    let station = Zs9Station::new(&RATINGS);
    let mut serve = DualServe::new(Registers::CHIP, Can::CHIP, station, &OPERATOR, configuration);
    let (mut slot, mut log) = (DualSlot::new(), Log::new());
    while let Some(why) = refused {
        pause_a_slot();
        serve.refuse(&mut slot, why, &rated);
    }
    loop {
        serve.pass(&mut slot, &rated);
        if PULSE.feed_if_both_ran(&Registers::CHIP) {
            log.record(&RECORDER);
        }
        log.trip(OPERATOR.desk.observed().and_then(|observed| observed.report.trip));
    }
}
