//! The emulated board for the ZS9. The nine gates' compare registers are words on the link: the emulator has none.
//!
//! The PWM timer comes at the carrier's peaks, the control timer at its valleys.

use super::{
    CLOCK, CONTROL_ANSWERS, CONTROL_TIMER, Control, PWM_ANSWERS, PWM_TIMER, Pwm, enable_interrupts,
    open_files, read_register, receive, send, start_timers, stop, write_register,
};
use crate::board::{DualControlPort, DualPwmPort, DualSample, PlayedPeriod, PowerSample};
use crate::drive::dual::{DualReport, Settings};
use crate::link::{self, DualRequest, DualSetup};
use crate::time::Instant;

/// Opens the link and fetches the set-up. Call once, before [`start_dual`].
pub fn connect_dual() -> DualSetup {
    open_files();
    send(&DualRequest::Hello.to_block());
    link::dual_setup_from_block(&receive(CONTROL_ANSWERS))
}

/// Starts both timers: the first PWM interrupt comes at the first peak, the first control interrupt after one control period.
pub fn start_dual(settings: &Settings) {
    enable_interrupts();
    write_register(PWM_TIMER, settings.first_peak_ticks().saturating_sub(1));
    write_register(CONTROL_TIMER + 8, CLOCK.control_ticks - 1);
    start_timers();
    // The shadow register takes over at the first peak.
    write_register(PWM_TIMER + 0x18, settings.carrier_ticks.saturating_sub(1));
}

impl DualControlPort for Control {
    fn sample(&mut self, now: Instant) -> DualSample {
        send(&DualRequest::ControlSample(now).to_block());
        let (sample, end) = link::dual_sample_from_block(&receive(CONTROL_ANSWERS));
        if end {
            stop(true);
        }
        sample
    }

    fn gates_off(&mut self, now: Instant) {
        send(&DualRequest::GatesOff(now).to_block());
    }

    fn overrun_ticks(&mut self, _now: Instant, deadline_ticks: u32) -> u32 {
        let age = CLOCK.control_ticks.saturating_sub(read_register(CONTROL_TIMER + 4));
        // The interrupt was acknowledged on entry: if it is pending again, the period is over.
        let pending = read_register(CONTROL_TIMER + 0xC) & 1 != 0;
        let age = if pending { age + CLOCK.control_ticks } else { age };
        age.saturating_sub(deadline_ticks)
    }

    fn report(&mut self, now: Instant, report: &DualReport) {
        send(&DualRequest::ControlReport(now, *report).to_block());
    }
}

impl DualPwmPort for Pwm {
    fn sample(&mut self, now: Instant) -> PowerSample {
        send(&DualRequest::PowerSample(now).to_block());
        link::power_from_block(&receive(PWM_ANSWERS))
    }

    fn play(&mut self, now: Instant, next: &PlayedPeriod) {
        send(&DualRequest::Play(now, *next).to_block());
    }

    fn gates_off(&mut self, now: Instant) {
        send(&DualRequest::GatesOff(now).to_block());
    }
}

/// Gates off, whatever state the program is in, then the end: for panics and HardFaults.
pub fn die_dual() -> ! {
    send(&DualRequest::Dead.to_block());
    stop(false)
}
