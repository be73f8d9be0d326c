//! What only the chip has, for the ZS9: starting its interrupts, the log.
#![allow(unsafe_code)]

use super::sampling::Zeros;
use super::{CLOCK, RATINGS, TIMES, pins, settings, start};
use crate::board::nucleo_g474re::can::Can;
use crate::board::nucleo_g474re::registers::Registers;
use crate::board::nucleo_g474re::serve::DualServe;
use crate::board::nucleo_g474re::start::StartError;
use crate::board::nucleo_g474re::{Cycles, Interrupt, PULSE, join_bus, unmask};
use crate::machine::zs9::BUILT_IN;
use crate::operator::{self, DualDesk, DualSlot, Line, slot_s};
use crate::protocol::{TO_ZS9, Zs9Station};
use crate::recorder::{DualRecord, DualRecorder};

/// Between the drive's operator and its control.
pub static DESK: DualDesk = DualDesk::new();

/// The drive's flight recorder.
pub static RECORDER: DualRecorder = DualRecorder::new();

/// Configures everything, gates off. Call it once.
pub fn prepare() -> Result<Zeros, StartError> {
    let found = start::prepare(&Registers::CHIP, &mut Cycles);
    if let Err(error) = &found {
        defmt::error!("no start: {}", error);
    }
    join_bus(&TO_ZS9, &pins::PINS);
    found
}

/// Starts the timers and unmasks their interrupts: PWM preempts control.
pub fn run() {
    unmask(Interrupt::TIM1_UP_TIM16, Interrupt::TIM2);
    start::run(&Registers::CHIP);
    defmt::info!("running");
}

/// The idle loop, forever: serves the bus and the operator, feeds the watchdog, tells what has changed, and after a fault what the
/// flight recorder holds.
pub fn idle() -> ! {
    let (mut told, mut records_told) = (None, 0);
    let line = Line::rated(&RATINGS, TIMES.precharge_s, TIMES.discharge_s).without_chopper();
    let rated = operator::Settings::rated(&RATINGS, slot_s(&CLOCK), Some(line));
    let configuration = settings().check(&BUILT_IN).into();
    let station = Zs9Station::new(&RATINGS);
    let mut serve = DualServe::new(Registers::CHIP, Can::CHIP, station, &DESK, configuration);
    let mut slot = DualSlot::new();
    loop {
        let settings = serve.station.settings(&rated);
        slot.run(&DESK, &mut serve, &settings, &CLOCK);
        // One record a meal: a log that nobody hurries to read holds few.
        if PULSE.feed_if_both_ran(&Registers::CHIP) {
            match RECORDER.read(records_told) {
                Some(record) => {
                    tell(&record);
                    records_told += 1;
                }
                None if !RECORDER.is_frozen() => records_told = 0,
                None => {}
            }
        }
        let trip = DESK.observed().and_then(|observed| observed.report.trip);
        if trip != told {
            match trip {
                Some(trip) => {
                    defmt::error!("fault {}: {} beyond {}", trip.fault.name(), trip.value, trip.limit);
                }
                None => defmt::info!("fault acknowledged"),
            }
            told = trip;
        }
    }
}

fn tell(record: &DualRecord) {
    let DualRecord { at, currents_a: [upper, lower], angles: [first, second], .. } = *record;
    defmt::info!(
        "{} ticks: {} {} {} A, {} {} {} A, angles {=u32:#x} {=u32:#x}; {} V {} V {} A; wanted {} {} N·m; {} {}",
        at.0,
        upper.a,
        upper.b,
        upper.c,
        lower.a,
        lower.b,
        lower.c,
        first.0,
        second.0,
        record.capacitor_v,
        record.source_v,
        record.inductor_a,
        record.torque_nm[0],
        record.torque_nm[1],
        record.state.scheme.name(),
        record.state.fault.map_or("", |fault| fault.name()),
    );
}
