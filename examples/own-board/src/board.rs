//! The board: registers on one side, the library's ports on the other, two for the interrupts and one for the idle loop. The addresses are
//! placeholders for your chip's.

use crate::machine::BUILT_IN;
use tractive::frames::{Abc, Angle};
use tractive::modulation::CarrierHalf;
use tractive::operator::{Configuration, Feedback, OperatorPort, Request, Status};
use tractive::ports::{ControlPort, PwmPort, Report, Sample};
use tractive::protection::SafeState;
use tractive::time::{Clock, Instant};

/// 21 MHz ticks; control at 10 kHz.
pub const CLOCK: Clock = Clock::new(21_000_000, 2_100);
/// The shortest pulse of the switches, 3 µs.
pub const MIN_PULSE_TICKS: u32 = 63;

/// Amperes per converter code, and the code at zero current.
const AMPERE_PER_CODE: f32 = 0.05;
const ZERO_CODE: i32 = 2_048;
/// Volts of the DC link per converter code.
const VOLT_PER_CODE: f32 = 0.2;
/// Counts per turn of the encoder, electrical.
const COUNTS: u32 = 4_096;

/// Data registers of the converters, the encoder's count, three compare registers, the gates' enable.
const CONVERTERS: *const u32 = 0x4001_2000 as *const u32;
const ENCODER: *const u32 = 0x4000_0824 as *const u32;
const COMPARES: *mut u32 = 0x4001_0034 as *mut u32;
const RELOAD: *mut u32 = 0x4001_002C as *mut u32;
const STATUS: *mut u32 = 0x4001_0010 as *mut u32;
const GATES: *mut u32 = 0x4001_0044 as *mut u32;
const PEND: *mut u32 = 0xE000_E200 as *mut u32;
const CONTROL_STATUS: *mut u32 = 0x4000_0010 as *mut u32;
/// Levels of the operator's switches: enable, acknowledge.
const SWITCHES: *const u32 = 0x4002_0010 as *const u32;

fn read(register: *const u32) -> u32 {
    // SAFETY: one of the addresses above, which the chip maps to a register that may be read at any time.
    unsafe { register.read_volatile() }
}

fn write(register: *mut u32, value: u32) {
    // SAFETY: one of the addresses above, which the chip maps to a register that may be written at any time.
    unsafe { register.write_volatile(value) }
}

/// The phase currents that a converter holds, in A.
fn currents_a(converter: usize) -> Abc {
    let phase = |channel: usize| {
        let code = read(CONVERTERS.wrapping_add(8 * converter + channel)) as i32;
        (code - ZERO_CODE) as f32 * AMPERE_PER_CODE
    };
    Abc { a: phase(0), b: phase(1), c: phase(2) }
}

/// Turns the gates off.
pub fn gates_off() {
    write(GATES, 0);
}

/// Sets up clocks, pins, converters and timers, in the order that your chip requires, with the gates off.
pub fn start() {
    gates_off();
}

/// The board as both tasks and the operator see it.
pub struct Board;

impl ControlPort for Board {
    fn begin(&mut self, revises: bool) {
        write(CONTROL_STATUS, 0);
        if revises {
            write(PEND, 1 << 25);
        }
    }

    fn sample(&mut self, _now: Instant) -> Sample {
        let count = read(ENCODER) % COUNTS;
        Sample {
            currents_a: currents_a(0),
            udc_v: read(CONVERTERS.wrapping_add(3)) as f32 * VOLT_PER_CODE,
            angle: Some(Angle(count * (u32::MAX / COUNTS + 1))),
            may_pulse: true,
            hardware: None,
        }
    }

    fn enter(&mut self, _safe: SafeState, _now: Instant) {
        gates_off();
    }

    fn overrun_ticks(&mut self, _now: Instant, _deadline_ticks: u32) -> u32 {
        0
    }

    fn report(&mut self, _now: Instant, _report: impl FnOnce() -> Report) {}
}

impl PwmPort for Board {
    fn begin(&mut self) -> bool {
        let boundary = read(STATUS) & 1 != 0;
        write(STATUS, 0);
        boundary
    }

    fn sample(&mut self, _now: Instant) -> Abc {
        currents_a(1)
    }

    fn play(&mut self, _now: Instant, next: &CarrierHalf) {
        write(RELOAD, next.period_ticks);
        for (leg, ticks) in next.compare_ticks.iter().enumerate() {
            write(COMPARES.wrapping_add(leg), *ticks);
        }
    }

    fn enter(&mut self, _safe: SafeState, _now: Instant) {
        gates_off();
    }
}

impl OperatorPort for Board {
    fn ask(&mut self, _at: Instant, _slots: u32) -> (Request, Feedback) {
        let levels = read(SWITCHES);
        let (enable, acknowledge) = (levels & 1 != 0, levels & 2 != 0);
        let feedback = Feedback {
            driver_ready: true,
            enable_input: true,
            sensor_alive: true,
            position_known: true,
            configuration: Configuration::Good,
            ..Feedback::default()
        };
        (Request { enable, acknowledge, ..Request::idle(&BUILT_IN.ratings) }, feedback)
    }

    fn tell(&mut self, _from: Instant, _status: &Status, _report: Option<&Report>) {}
}
