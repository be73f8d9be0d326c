//! QEMU's board with the injector around its interrupts and ports. Anything not named here is the board's own.

use crate::injector;
use tractive::board::qemu;
pub use tractive::board::qemu::{
    CLOCK, DUAL_RECORDER, DualIdle, Idle, Interrupt, RECORDER, TICKS_HZ, die, die_dual, idle, refuse,
};
use tractive::drive::dual::Settings;
use tractive::frames::Abc;
use tractive::modulation::CarrierHalf;
use tractive::ports::{
    ControlPort, DriveCommand, Dual, DualDriveCommand, DualReport, DualSample, PlayedPeriod, PowerSample,
    PwmPort, Report, Sample,
};
use tractive::protection::SafeState;
use tractive::time::Instant;
use tractive::wire::{DualRequest, DualSetup, Request, Setup};

/// As the board's, and the injector reads its orders.
pub fn connect() -> Setup {
    injector::connect();
    qemu::connect()
}

/// As the board's, and the injector reads its orders.
pub fn connect_dual() -> DualSetup {
    injector::connect();
    qemu::connect_dual()
}

/// As the board's, and the injector takes the interrupts over.
pub fn start(first_half_ticks: u32, control_ticks: u32) {
    injector::start();
    qemu::start(first_half_ticks, control_ticks);
}

/// As the board's, and the injector takes the interrupts over.
pub fn start_dual(settings: &Settings) {
    injector::start();
    qemu::start_dual(settings);
}

/// As the board's.
pub fn watch_ends() {
    injector::gates_off();
    qemu::watch_ends();
}

/// Out of line, as the board's: the interrupts' own code is that of the reference images.
#[inline(never)]
fn enter(safe: SafeState, now: Instant) {
    injector::gates_off();
    <qemu::Control as ControlPort>::enter(&mut qemu::Control, safe, now);
}

/// Out of line, as [`enter`].
#[inline(never)]
fn gates_off(now: Instant) {
    injector::gates_off();
    <qemu::Control as ControlPort<Dual>>::enter(&mut qemu::Control, SafeState::GatesOff, now);
}

/// The control interrupt's side.
pub struct Control;

/// The PWM interrupt's side.
pub struct Pwm;

impl ControlPort for Control {
    fn begin(&mut self, revises: bool) {
        <qemu::Control as ControlPort>::begin(&mut qemu::Control, revises);
    }

    fn sample(&mut self, now: Instant) -> Sample {
        <qemu::Control as ControlPort>::sample(&mut qemu::Control, now)
    }

    fn command(&mut self, now: Instant, operator: impl FnOnce() -> DriveCommand) -> DriveCommand {
        <qemu::Control as ControlPort>::command(&mut qemu::Control, now, operator)
    }

    fn enter(&mut self, safe: SafeState, now: Instant) {
        enter(safe, now);
    }

    fn overrun_ticks(&mut self, now: Instant, deadline_ticks: u32) -> u32 {
        <qemu::Control as ControlPort>::overrun_ticks(&mut qemu::Control, now, deadline_ticks)
    }

    fn report(&mut self, now: Instant, report: impl FnOnce() -> Report) {
        <qemu::Control as ControlPort>::report(&mut qemu::Control, now, report);
    }
}

impl PwmPort for Pwm {
    fn begin(&mut self) -> bool {
        <qemu::Pwm as PwmPort>::begin(&mut qemu::Pwm)
    }

    fn sample(&mut self, now: Instant) -> Abc {
        <qemu::Pwm as PwmPort>::sample(&mut qemu::Pwm, now)
    }

    fn play(&mut self, now: Instant, next: &CarrierHalf) {
        injector::played(&Request::Play(now, *next).to_block());
        <qemu::Pwm as PwmPort>::play(&mut qemu::Pwm, now, next);
    }

    fn enter(&mut self, safe: SafeState, now: Instant) {
        enter(safe, now);
    }

    fn leave(&mut self, now: Instant) -> bool {
        <qemu::Pwm as PwmPort>::leave(&mut qemu::Pwm, now)
    }
}

impl ControlPort<Dual> for Control {
    fn begin(&mut self, revises: bool) {
        <qemu::Control as ControlPort<Dual>>::begin(&mut qemu::Control, revises);
    }

    fn sample(&mut self, now: Instant) -> DualSample {
        <qemu::Control as ControlPort<Dual>>::sample(&mut qemu::Control, now)
    }

    fn command(&mut self, now: Instant, operator: impl FnOnce() -> DualDriveCommand) -> DualDriveCommand {
        <qemu::Control as ControlPort<Dual>>::command(&mut qemu::Control, now, operator)
    }

    fn enter(&mut self, _safe: SafeState, now: Instant) {
        gates_off(now);
    }

    fn overrun_ticks(&mut self, now: Instant, deadline_ticks: u32) -> u32 {
        <qemu::Control as ControlPort<Dual>>::overrun_ticks(&mut qemu::Control, now, deadline_ticks)
    }

    fn report(&mut self, now: Instant, report: impl FnOnce() -> DualReport) {
        <qemu::Control as ControlPort<Dual>>::report(&mut qemu::Control, now, report);
    }
}

impl PwmPort<Dual> for Pwm {
    fn begin(&mut self) -> bool {
        <qemu::Pwm as PwmPort<Dual>>::begin(&mut qemu::Pwm)
    }

    fn sample(&mut self, now: Instant) -> PowerSample {
        injector::complete(<qemu::Pwm as PwmPort<Dual>>::sample(&mut qemu::Pwm, now))
    }

    fn play(&mut self, now: Instant, next: &PlayedPeriod) {
        injector::played(&DualRequest::Play(now, *next).to_block());
        <qemu::Pwm as PwmPort<Dual>>::play(&mut qemu::Pwm, now, next);
    }

    fn enter(&mut self, _safe: SafeState, now: Instant) {
        gates_off(now);
    }

    fn leave(&mut self, now: Instant) -> bool {
        <qemu::Pwm as PwmPort<Dual>>::leave(&mut qemu::Pwm, now)
    }
}
