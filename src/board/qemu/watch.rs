//! The watch over the ZS9's carrier periods: the next period's pulses must be written before the valley where they take over; otherwise the gates go
//! off, whatever the state of the tasks. A watchdog of the board counts from each write to that valley; its interrupt cannot be masked.

use super::{PWM_TIMER, exchange, read_register, write_register};
use crate::ports::HardwareBreak;
use crate::protection::Fault;
use crate::time::Instant;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering::Relaxed};

/// The CMSDK watchdog; it counts down from the written value, in the timers' ticks.
const LOAD: usize = 0x4000_8000;
const CONTROL: usize = LOAD + 8;
const CLEAR: usize = LOAD + 0xC;
const INTERRUPT: u32 = 1;

/// Half a carrier period.
static HALF_TICKS: AtomicU32 = AtomicU32::new(0);
/// Instant of the peak whose interrupt wrote last.
static WRITTEN_AT: AtomicU32 = AtomicU32::new(0);
/// `true` once the watch has turned the gates off.
static ENDED: AtomicBool = AtomicBool::new(false);

/// Starts the watch, with the first peak half a carrier period ahead.
pub fn start(half_ticks: u32) {
    HALF_TICKS.store(half_ticks, Relaxed);
    write_register(LOAD, 2 * half_ticks);
    write_register(CONTROL, INTERRUPT);
}

/// Ends the watch for good.
pub fn stop() {
    write_register(CONTROL, 0);
}

/// The period from the next valley on is written: the one after it must be written by the valley after the next peak.
#[inline]
pub fn written(now: Instant) {
    WRITTEN_AT.store(now.0, Relaxed);
    write_register(LOAD, read_register(PWM_TIMER + 4) + HALF_TICKS.load(Relaxed));
}

/// The watchdog's interrupt: the valley has come and nothing was written.
pub fn ends() {
    write_register(CLEAR, 1);
    if !ENDED.swap(true, Relaxed) {
        let valley = Instant(WRITTEN_AT.load(Relaxed)).after(3 * HALF_TICKS.load(Relaxed));
        // The bench identifies control's orders by their instants, and this one comes a moment after the valley.
        exchange::gates_off(valley.after(1));
    }
}

/// The break that the watch found; it holds until the gates are released.
#[inline]
pub fn found() -> Option<HardwareBreak> {
    ENDED.load(Relaxed).then_some(HardwareBreak { fault: Fault::PwmDeadline, seen: 1 })
}

/// Notes that the gates are released.
pub fn forget() {
    ENDED.store(false, Relaxed);
}
