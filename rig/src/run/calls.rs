//! The list of the interrupts, in the order in which they ended, with a line `interrupt,mode,direction,frequency` for each.

use anyhow::{Context, Result};
use std::fmt::Write as _;
use std::path::Path;
use tractive::modulation::Mode;
use tractive::ports::Report;

/// The lines so far.
pub(crate) struct Calls {
    /// The mode of the present interrupts.
    pub(crate) mode: String,
    direction: &'static str,
    lines: String,
}

impl Calls {
    /// None yet.
    pub(crate) fn new(mode: &str) -> Self {
        Self { mode: mode.to_owned(), direction: "", lines: String::new() }
    }

    /// A control interrupt of the first system: the direction is its own and that of the PWM interrupts behind it.
    pub(crate) fn traction(&mut self, report: &Report) {
        self.direction = direction(report, self.direction);
        self.line("control", &(report.omega / std::f32::consts::TAU).to_string());
    }

    /// A control interrupt that is fully described by its mode.
    pub(crate) fn control(&mut self) {
        self.line("control", "");
    }

    /// A PWM interrupt.
    pub(crate) fn pwm(&mut self) {
        self.line("pwm", "");
    }

    /// Without pulses there is no direction.
    fn line(&mut self, interrupt: &str, frequency_hz: &str) {
        let direction = if self.mode == Mode::Off.name() { "" } else { self.direction };
        let _ = writeln!(self.lines, "{interrupt},{},{direction},{frequency_hz}", self.mode);
    }

    /// Writes the lines if a path is given.
    pub(crate) fn write(&self, path: Option<&Path>) -> Result<()> {
        match path {
            Some(path) => std::fs::write(path, &self.lines).with_context(|| path.display().to_string()),
            None => Ok(()),
        }
    }
}

/// Direction by the sign of the mechanical power, torque times speed. If there is no power (no torque, standstill, a fault), the direction
/// before is kept; at first it is motoring.
fn direction(report: &Report, before: &'static str) -> &'static str {
    let power = report.torque_nm * report.omega;
    match before {
        _ if power > 0.0 => "motoring",
        _ if power < 0.0 => "braking",
        "" => "motoring",
        _ => before,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_direction_is_that_of_the_power_and_stays_where_there_is_none() {
        let mut calls = Calls::new("async");
        for (torque_nm, hertz) in [(0.0, 0.0), (9.0, -1.0), (f32::NAN, -1.0), (-9.0, -1.0), (9.0, 0.0)] {
            let omega = hertz * std::f32::consts::TAU;
            calls.traction(&Report { torque_nm, omega, ..Report::default() });
        }
        calls.pwm();
        calls.mode = Mode::Off.name().to_owned();
        calls.pwm();
        assert_eq!(
            calls.lines,
            "control,async,motoring,0\ncontrol,async,braking,-1\ncontrol,async,braking,-1\n\
             control,async,motoring,-1\ncontrol,async,motoring,0\npwm,async,motoring,\npwm,off,,\n"
        );
    }
}
