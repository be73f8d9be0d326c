//! The samples for the drive's interrupts, and the reports of control.

use super::{Bench, BenchError};
use crate::bench::Held;
use crate::inject::zs9::Kind;
use crate::steps::held;
use tractive::frames::Abc;
use tractive::ports::{DualDriveCommand, DualReport, DualSample, HardwareBreak, PowerSample};
use tractive::thermal::Ratios;
use tractive::time::Instant;

/// The error of a current's reading up to which it counts as making no difference, over a machine's largest current.
const MUCH: f64 = 0.1;

impl Bench {
    /// The conversions that the control timer triggered at `instant`, and what the bench commands.
    pub fn control_sample(&mut self, instant: Instant) -> Result<(DualSample, DualDriveCommand), BenchError> {
        let at = self.time.widen(instant);
        self.advance(at)?;
        self.control.ask(at)
    }

    /// The control interrupt's report; it shows in the trace when the command takes effect.
    pub fn control_report(&mut self, instant: Instant, report: DualReport) {
        self.control.tell(&self.time, instant, report);
    }

    /// Lateness of the control interrupt, in ticks.
    pub fn control_late_ticks(&self) -> u32 {
        self.spoiler.injected.late_ticks(self.time.now_s())
    }

    /// The PWM interrupt's conversions at the peak `instant`.
    pub fn power_sample(&mut self, instant: Instant) -> Result<PowerSample, BenchError> {
        let at = self.time.widen(instant);
        self.advance(at)?;
        let feedback = std::mem::take(&mut self.feedback);
        // The source's sensor is in front of the contactors.
        let source_v = if self.line.is_some() { self.behind_contactor_v() } else { self.plant.source_v };
        let mut sample = PowerSample {
            currents_a: self.converted_a(),
            capacitor_v: self.plant.network.capacitor_v() as f32,
            source_v: source_v as f32,
            gates: feedback,
        };
        let true_a = sample.currents_a;
        self.spoiler.power(self.time.seconds(at), &mut sample);
        self.compare(true_a, sample.currents_a);
        Ok(sample)
    }

    /// Phase currents of both motors as converted now, in A.
    fn converted_a(&mut self) -> [Abc; 2] {
        self.plant.motors.each_ref().map(|motor| self.converter.currents(motor))
    }

    /// Notes readings that are off by more than this error.
    fn compare(&mut self, true_a: [Abc; 2], read_a: [Abc; 2]) {
        let off = |(read, told): (Abc, Abc)| {
            (read.a - told.a).abs().max((read.b - told.b).abs()).max((read.c - told.c).abs())
        };
        let most_a = read_a.into_iter().zip(true_a).map(off).fold(0.0, f32::max);
        if f64::from(most_a) > MUCH * self.plant.motors[0].largest_a {
            self.observed.makes_a_difference(self.time.now);
        }
    }

    pub(super) fn take_sample(&mut self) -> Result<(), BenchError> {
        let t_s = self.time.now_s();
        let has_control = self.spoiler.injected.has_control(t_s);
        self.control.begin(&self.time, has_control)?;
        self.orders = self.operator.orders(t_s, self.speeds_rpm());
        if let Some(loads_nm) = self.loads_nm {
            self.orders.loads_nm = loads_nm;
        }
        self.set_loads_nm(self.orders.loads_nm);
        // If the source is cut off, its voltage is its capacitor's.
        let source_v = match &self.filter {
            Some(filter) => filter.udc_v,
            None if self.spoiler.injected.kind(t_s) == Some(Kind::SourceLost) => self.plant.source_v,
            None => self.line_v(),
        };
        let hardware = self.spoiler.hardware(t_s);
        match &mut self.line {
            None => self.plant.source_v = source_v,
            Some(line) => {
                // Without the control interrupt nobody handles slots.
                let held = Held { hardware, position_known: true, temperatures: Ratios::default() };
                if has_control && line.gear.sampled(self.time.tick(), held, || ()) {
                    return Err(BenchError::OperatorLate(t_s));
                }
            }
        }
        let network = self.plant.network;
        let mut sample = DualSample {
            currents_a: self.converted_a(),
            angles: self.plant.motors.each_ref().map(|motor| Some(self.converter.angle(motor))),
            capacitor_v: network.capacitor_v() as f32,
            inductor_a: network.inductor_a() as f32,
            source_v: source_v as f32,
            may_pulse: hardware.is_none(),
            hardware: hardware.map(|fault| HardwareBreak { fault, seen: 1 }),
        };
        let true_a = sample.currents_a;
        let mut command = DualDriveCommand {
            enable: self.orders.enable,
            demands: self.orders.demands,
            speed_torque_nm: DualDriveCommand::UNLIMITED_NM,
            link_ref_v: self.settings.link_ref_v as f32,
            scheme: held(&self.course.schemes, t_s).unwrap_or(self.settings.scheme),
            acknowledge: 0,
            calibrate: false,
        };
        self.spoiler.control(t_s, &mut sample, &mut command);
        self.compare(true_a, sample.currents_a);
        self.control.put(self.time.now, (sample, command));
        self.control.show(self.time.now);
        Ok(())
    }
}
