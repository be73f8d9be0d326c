//! The firmware's converters and their view of the machine.

use super::{Encoder, Position, Wiring};
use crate::plant::Motor;
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use rand_distr::{Distribution, Normal};
use tractive::frames::{Abc, Angle};

/// Imperfections of inverter and sensors, all zero or `None` by default.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Flaws {
    /// Resolution of the current converters, in bits, over ± `adc_full_scale_a`.
    pub adc_bits: Option<u32>,
    /// Range of the current converters, in A.
    pub adc_full_scale_a: f64,
    /// Noise on each current sample, rms, in A.
    pub noise_a: f64,
    /// Amplitude (V) and frequency (Hz) of the DC link's ripple.
    pub udc_ripple: Option<(f64, f64)>,
    /// Relative error by which a current is read too large, as a share.
    pub current_gain: f64,
    /// The same of each phase by itself.
    pub current_gains: [f64; 3],
    /// The readings at zero current, in A.
    pub current_offsets_a: [f64; 3],
    /// Relative error by which the DC link is read too large, as a share.
    pub udc_gain: f64,
    /// The wires of the current sensors.
    pub current_wiring: Wiring,
    /// `true` if the angle sensor counts the wrong way.
    pub angle_reversed: bool,
    /// Constant error of the angle sensor, electrical, in degrees.
    pub angle_error_deg: f64,
    /// Time after its sample at which the angle is read, in s; different each time.
    pub angle_jitter_s: f64,
    /// Errors of the angle of first and second order over it, electrical: amplitudes in degrees.
    pub angle_harmonics_deg: [f64; 2],
    /// Their phases at angle 0, in degrees.
    pub angle_phases_deg: [f64; 2],
    /// Age of the angle when it is read, in s.
    pub angle_late_s: f64,
    /// Counts of the angle in an electrical turn, with the middle of a count reported; `None`: as fine as the word.
    pub angle_counts: Option<f64>,
    /// Time constant of the current sensors, in s.
    pub current_filter_s: f64,
    /// Time by which each phase's current is sampled before the nominal instant, in s.
    pub adc_skew_s: [f64; 3],
    /// Time from which on control gets the same currents again and again, in s.
    pub freeze_at_s: Option<f64>,
    /// Seed of the noise.
    pub seed: u64,
}

impl Flaws {
    /// No flaws.
    pub const NONE: Self = Self {
        adc_bits: None,
        adc_full_scale_a: 0.0,
        noise_a: 0.0,
        udc_ripple: None,
        current_gain: 0.0,
        current_gains: [0.0; 3],
        current_offsets_a: [0.0; 3],
        udc_gain: 0.0,
        current_wiring: Wiring::RIGHT,
        angle_reversed: false,
        angle_error_deg: 0.0,
        angle_jitter_s: 0.0,
        angle_harmonics_deg: [0.0; 2],
        angle_phases_deg: [0.0; 2],
        angle_late_s: 0.0,
        angle_counts: None,
        current_filter_s: 0.0,
        adc_skew_s: [0.0; 3],
        freeze_at_s: None,
        seed: 0,
    };
}

/// The current converters: noise, then steps.
pub struct Converter {
    flaws: Flaws,
    random: StdRng,
    /// Phase currents after the sensors' time constant, in A.
    filtered_a: [f64; 3],
    /// Phase currents at the end of the last step, in A.
    before_a: [f64; 3],
}

impl Converter {
    /// Converters with these flaws.
    pub fn new(flaws: Flaws) -> Self {
        Self { flaws, random: StdRng::seed_from_u64(flaws.seed), filtered_a: [0.0; 3], before_a: [0.0; 3] }
    }

    /// Lets time pass until the motor has these phase currents, in A: between two edges they are straight lines, and a step may be longer than the
    /// sensors' time constant.
    pub fn pass(&mut self, currents_a: [f64; 3], dt_s: f64) {
        if self.flaws.current_filter_s > 0.0 && dt_s > 0.0 {
            let steps = dt_s / self.flaws.current_filter_s;
            let kept = libm::exp(-steps);
            let phases = self.filtered_a.iter_mut().zip(self.before_a).zip(currents_a);
            for ((filtered_a, before_a), current_a) in phases {
                // A ramp's output lags by its rise in a time constant.
                let behind_a = (current_a - before_a) / steps;
                *filtered_a = current_a - behind_a + (*filtered_a - before_a + behind_a) * kept;
            }
            self.before_a = currents_a;
        }
    }

    /// Ripple of the supply at an instant, in V.
    pub fn ripple_v(&self, t_s: f64) -> f64 {
        let ripple = self.flaws.udc_ripple;
        ripple.map_or(0.0, |(amplitude_v, hz)| amplitude_v * libm::sin(core::f64::consts::TAU * hz * t_s))
    }

    /// Turn of an angle that is read late, in turns, at a speed in turns per s.
    fn late_turns(&mut self, turns_s: f64) -> f64 {
        let latest_s = self.flaws.angle_jitter_s;
        if latest_s > 0.0 { turns_s * self.random.random_range(0.0..latest_s) } else { 0.0 }
    }

    /// A sensor's current as converted now, in A.
    fn convert(&mut self, sensor: usize, current_a: f64) -> f64 {
        let offset_a = self.flaws.current_offsets_a[sensor];
        let mut value = current_a * (1.0 + self.flaws.current_gain + self.flaws.current_gains[sensor]);
        if offset_a != 0.0 {
            value += offset_a;
        }
        if self.flaws.noise_a > 0.0
            && let Ok(noise) = Normal::new(0.0, self.flaws.noise_a)
        {
            value += noise.sample(&mut self.random);
        }
        if self.flaws.adc_bits.is_some() {
            let step = self.step_a();
            value = (value / step).round() * step;
        }
        value
    }

    /// A step of a current converter, in A; 0 without steps.
    fn step_a(&self) -> f64 {
        self.flaws
            .adc_bits
            .map_or(0.0, |bits| 2.0 * self.flaws.adc_full_scale_a / libm::exp2(f64::from(bits)))
    }

    /// A motor's phase currents as converted now, in A.
    pub fn currents(&mut self, motor: &Motor) -> Abc {
        self.converted(self.behind(motor))
    }

    /// A motor's phase currents after the sensors' time constant, in A.
    pub fn behind(&self, motor: &Motor) -> [f64; 3] {
        if self.flaws.current_filter_s > 0.0 { self.filtered_a } else { motor.currents_abc() }
    }

    /// Held phase currents, as converted, in A.
    pub fn converted(&mut self, behind_a: [f64; 3]) -> Abc {
        let read_a = self.flaws.current_wiring.read(behind_a);
        let [a, b, c] = [0, 1, 2].map(|sensor| self.convert(sensor, read_a[sensor]) as f32);
        Abc { a, b, c }
    }

    /// A motor's rotor angle as read by its sensor.
    pub fn angle(&mut self, motor: &Motor) -> Angle {
        let flaws = self.flaws;
        let true_turns = motor.angle_turns() - motor.turns_s() * flaws.angle_late_s;
        let harmonics_deg: f64 = flaws
            .angle_harmonics_deg
            .into_iter()
            .zip(flaws.angle_phases_deg)
            .zip([1.0, 2.0])
            .map(|((deg, phase_deg), order)| {
                deg * libm::sin(core::f64::consts::TAU * order * true_turns + phase_deg.to_radians())
            })
            .sum();
        let error_turns = (flaws.angle_error_deg + harmonics_deg) / 360.0;
        let turns = true_turns + self.late_turns(motor.turns_s()) + error_turns;
        let turns = if flaws.angle_reversed { -turns } else { turns };
        let turns = flaws.angle_counts.map_or(turns, |counts| ((turns * counts).floor() + 0.5) / counts);
        Angle((turns.rem_euclid(1.0) * 4_294_967_296.0).round() as u64 as u32)
    }
}

/// Sensors, and the voltage of the supply without a fault.
pub struct Sensors {
    udc_v: f64,
    link_steps: Vec<(f64, f64)>,
    converter: Converter,
    encoder: Option<Encoder>,
    /// The currents that control was given last.
    told_a: Abc,
}

impl Sensors {
    /// Sensors on a link of this voltage, which changes at these times (in s) to these values.
    pub fn new(udc_v: f64, link_steps: Vec<(f64, f64)>, flaws: Flaws) -> Self {
        Self { udc_v, link_steps, converter: Converter::new(flaws), encoder: None, told_a: Abc::default() }
    }

    /// The part of the sum of three phase currents that does not show in the readings, in A: a multiple of its noise, and half a step of each converter.
    pub fn hidden_a(&self, noises: f64) -> f32 {
        let Flaws { noise_a, .. } = self.converter.flaws;
        (noises * 3.0_f64.sqrt() * noise_a + 1.5 * self.converter.step_a()) as f32
    }

    /// The same, with an incremental encoder, if there is one.
    pub fn with_encoder(mut self, encoder: Option<Encoder>) -> Self {
        self.encoder = encoder;
        self
    }

    /// `true` with an incremental encoder.
    pub fn has_encoder(&self) -> bool {
        self.encoder.is_some()
    }

    /// Tells the encoder, if there is one, its angle at power-up; returns by how many degrees that is ahead.
    pub fn align(&mut self, zero: Angle) -> Option<f64> {
        self.encoder.as_mut().map(|encoder| encoder.align(zero))
    }

    /// The voltage of a healthy supply, which is also a stiff link's, in V.
    pub fn supply_v(&self, t_s: f64) -> f64 {
        let passed = self.link_steps.iter().rev().find(|(at_s, _)| t_s >= *at_s);
        passed.map_or(self.udc_v, |(_, udc_v)| *udc_v) + self.ripple_v(t_s)
    }

    /// See [`Converter::ripple_v`].
    pub fn ripple_v(&self, t_s: f64) -> f64 {
        self.converter.ripple_v(t_s)
    }

    /// A link's voltage as converted, in V.
    pub fn link_v(&self, udc_v: f64) -> f64 {
        udc_v * (1.0 + self.converter.flaws.udc_gain)
    }

    /// See [`Converter::pass`].
    pub fn pass(&mut self, motor: &Motor, dt_s: f64) {
        self.converter.pass(motor.currents_abc(), dt_s);
    }

    /// See [`Converter::behind`].
    pub fn behind(&self, motor: &Motor) -> [f64; 3] {
        self.converter.behind(motor)
    }

    /// Held phase currents, as converted.
    pub fn converted(&mut self, held_a: [f64; 3]) -> Abc {
        self.converter.converted(held_a)
    }

    /// The phase currents that control gets at `t_s`, from the held ones, and the rotor's angle.
    pub fn measure(&mut self, held_a: [f64; 3], motor: &Motor, t_s: f64) -> (Abc, Position) {
        if self.converter.flaws.freeze_at_s.is_none_or(|freeze_s| t_s < freeze_s) {
            self.told_a = self.converted(held_a);
        }
        let angle = self.converter.angle(motor);
        let absolute = Position { angle: Some(angle), counted: None };
        (self.told_a, self.encoder.as_mut().map_or(absolute, |encoder| encoder.read(angle)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A rotating current, behind a filter of 100 µs, in steps of this many s: the largest deviation from the filter's own answer, as a share of it.
    fn off(step_s: f64) -> f64 {
        let (omega, filter_s) = (2_000.0, 1e-4);
        let mut converter = Converter::new(Flaws { current_filter_s: filter_s, ..Flaws::NONE });
        let turning = |t_s: f64| [(omega * t_s).sin(), 0.0, 0.0];
        let steps = (0.01 / step_s).round() as u32;
        let late = |step: u32| {
            let t_s = f64::from(step) * step_s;
            converter.pass(turning(t_s), step_s);
            let settled = (omega * t_s - (omega * filter_s).atan()).sin() / (omega * filter_s).hypot(1.0);
            if t_s > 1e-3 { (converter.filtered_a[0] - settled).abs() } else { 0.0 }
        };
        (1..=steps).map(late).fold(0.0, f64::max)
    }

    #[test]
    fn a_filter_is_as_late_in_steps_as_long_as_itself() {
        for (step_s, most) in [(1e-6, 1e-3), (1e-5, 1e-3), (1e-4, 4e-3)] {
            let found = off(step_s);
            assert!(found < most, "{step_s} s: {found}");
        }
    }
}
