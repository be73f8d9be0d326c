//! The emulated board for the ZS9. The compare registers of the nine gates are words on the link: the emulator has none.
//!
//! The PWM timer comes at the carrier's peaks, the control timer at its valleys. A carrier period that is not written in time turns the
//! gates off ([`watch`]).

use super::{
    CLOCK, CONTROL_TIMER, Control, OPERATED, PWM_TIMER, Pwm, enable_interrupts, exchange, read_register,
    start_timers, stop, watch, write_register,
};
use crate::drive::dual::Settings;
use crate::operator::{DualDemands, DualRequest, DualStatus, Feedback, OperatorPort};
use crate::ports::{
    ControlPort, Dual, DualDriveCommand, DualReport, DualSample, PlayedPeriod, PowerSample, PwmPort,
};
use crate::protection::SafeState;
use crate::protocol::Zs9CanEndpoint;
use crate::recorder::DualRecorder;
use crate::time::Instant;
use crate::wire::DualSetup;
use core::sync::atomic::Ordering;

/// The ZS9's flight recorder. The rig reads it when the run is over.
pub static DUAL_RECORDER: DualRecorder = DualRecorder::new();

/// Opens the link and fetches the set-up. To be called once, before [`start_dual`].
pub fn connect_dual() -> DualSetup {
    let setup = exchange::open_dual();
    OPERATED.store(setup.line.is_some(), Ordering::Relaxed);
    setup
}

/// Starts both timers: the first PWM interrupt comes at the first peak, the first control interrupt after one control period.
pub fn start_dual(settings: &Settings) {
    enable_interrupts();
    write_register(PWM_TIMER, settings.first_peak_ticks().saturating_sub(1));
    write_register(CONTROL_TIMER + 8, CLOCK.control_ticks - 1);
    start_timers();
    watch::start(settings.first_peak_ticks());
    // The shadow register takes over at the first peak.
    write_register(PWM_TIMER + 0x18, settings.carrier_ticks.saturating_sub(1));
}

impl ControlPort<Dual> for Control {
    fn begin(&mut self, _revises: bool) {
        self.acknowledge();
    }

    fn sample(&mut self, now: Instant) -> DualSample {
        let mut sample = exchange::sample_dual(now);
        sample.hardware = sample.hardware.or(watch::found());
        sample
    }

    /// The scheme is always the rig's, and so is the link's voltage until the operator gives one.
    fn command(&mut self, _now: Instant, operator: impl FnOnce() -> DualDriveCommand) -> DualDriveCommand {
        if !OPERATED.load(Ordering::Relaxed) {
            return exchange::command_dual();
        }
        let mut command = operator();
        command.scheme = exchange::scheme_dual();
        if command.link_ref_v > 0.0 { command } else { command.with_link(exchange::link_ref_dual()) }
    }

    fn enter(&mut self, _safe: SafeState, now: Instant) {
        exchange::gates_off(now);
    }

    fn overrun_ticks(&mut self, _now: Instant, deadline_ticks: u32) -> u32 {
        let age = CLOCK.control_ticks.saturating_sub(read_register(CONTROL_TIMER + 4));
        // The interrupt was acknowledged on entry: if it is pending again, the period is over.
        let pending = read_register(CONTROL_TIMER + 0xC) & 1 != 0;
        let age = if pending { age + CLOCK.control_ticks } else { age };
        age.saturating_sub(deadline_ticks)
    }

    fn report(&mut self, now: Instant, report: impl FnOnce() -> DualReport) {
        exchange::report_dual(now, report);
    }
}

impl PwmPort<Dual> for Pwm {
    fn begin(&mut self) -> bool {
        self.acknowledge();
        true
    }

    fn sample(&mut self, now: Instant) -> PowerSample {
        exchange::power_sample(now)
    }

    fn play(&mut self, now: Instant, next: &PlayedPeriod) {
        watch::written(now);
        exchange::play_dual(now, next);
    }

    fn enter(&mut self, _safe: SafeState, now: Instant) {
        exchange::gates_off(now);
    }

    fn leave(&mut self, now: Instant) -> bool {
        watch::forget();
        exchange::leave_dual(now);
        true
    }
}

/// The idle loop's side of the board, for the ZS9.
pub struct DualIdle {
    /// The protocol.
    pub station: &'static mut Zs9CanEndpoint,
}

impl OperatorPort<DualDemands> for DualIdle {
    fn ask(&mut self, at: Instant, slots: u32) -> (DualRequest, Feedback) {
        let (feedback, frame) = exchange::ask_dual(at);
        (self.station.listen(slots, frame.as_ref()), feedback)
    }

    fn tell(&mut self, from: Instant, status: &DualStatus, report: Option<&DualReport>) {
        let frame = self.station.tell(status, report);
        exchange::tell_dual(from, status, frame);
    }
}

/// Turns the gates off, whatever state the program is in, and ends: for panics and HardFaults.
pub fn die_dual() -> ! {
    exchange::dead_dual();
    stop(false)
}
