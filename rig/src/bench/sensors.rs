//! What the firmware's converters see of the machine.

use crate::plant::Plant;
use rand::SeedableRng;
use rand::rngs::StdRng;
use rand_distr::{Distribution, Normal};
use tractive::control::Measurements;
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
    /// Constant error of the angle sensor, electrical, in degrees.
    pub angle_error_deg: f64,
    /// From this time on control is told the same currents again and again, in s.
    pub freeze_at_s: Option<f64>,
    /// Seed of the noise.
    pub seed: u64,
}

/// The current converters: noise, then steps.
pub struct Converter {
    flaws: Flaws,
    random: StdRng,
}

impl Converter {
    /// Converters with these flaws.
    pub fn new(flaws: Flaws) -> Self {
        Self { flaws, random: StdRng::seed_from_u64(flaws.seed) }
    }

    /// What is wrong with them.
    pub fn flaws(&self) -> &Flaws {
        &self.flaws
    }

    /// Ripple of the supply at an instant, in V.
    pub fn ripple_v(&self, t_s: f64) -> f64 {
        let ripple = self.flaws.udc_ripple;
        ripple.map_or(0.0, |(amplitude_v, hz)| amplitude_v * (core::f64::consts::TAU * hz * t_s).sin())
    }

    /// A current as converted now, in A.
    pub fn convert(&mut self, current_a: f64) -> f64 {
        let mut value = current_a;
        if self.flaws.noise_a > 0.0
            && let Ok(noise) = Normal::new(0.0, self.flaws.noise_a)
        {
            value += noise.sample(&mut self.random);
        }
        if let Some(bits) = self.flaws.adc_bits {
            let step = 2.0 * self.flaws.adc_full_scale_a / f64::from(bits).exp2();
            value = (value / step).round() * step;
        }
        value
    }
}

/// Sensors, and what the supply's voltage is where nothing is wrong with it.
pub struct Sensors {
    udc_v: f64,
    link_steps: Vec<(f64, f64)>,
    converter: Converter,
    /// What control was told last.
    told_a: Abc,
}

impl Sensors {
    /// Sensors on a link of this voltage, which changes at these times (in s) to these values.
    pub fn new(udc_v: f64, link_steps: Vec<(f64, f64)>, flaws: Flaws) -> Self {
        Self { udc_v, link_steps, converter: Converter::new(flaws), told_a: Abc::default() }
    }

    /// The voltage of a healthy supply, which a stiff link has, in V.
    pub fn supply_v(&self, t_s: f64) -> f64 {
        let passed = self.link_steps.iter().rev().find(|(at_s, _)| t_s >= *at_s);
        passed.map_or(self.udc_v, |(_, udc_v)| *udc_v) + self.converter.ripple_v(t_s)
    }

    /// The phase currents as converted now.
    pub fn currents(&mut self, plant: &Plant) -> Abc {
        let [a, b, c] = plant.currents_abc().map(|current| self.converter.convert(current) as f32);
        Abc { a, b, c }
    }

    /// All that control measures, on a link of this true voltage, in V.
    pub fn measure(&mut self, plant: &Plant, udc_v: f64, t_s: f64) -> Measurements {
        let turns = plant.angle_turns() + self.converter.flaws.angle_error_deg / 360.0;
        if self.converter.flaws.freeze_at_s.is_none_or(|freeze_s| t_s < freeze_s) {
            self.told_a = self.currents(plant);
        }
        Measurements {
            currents_a: self.told_a,
            udc_v: udc_v as f32,
            angle: Angle((turns.rem_euclid(1.0) * 4_294_967_296.0).round() as u64 as u32),
        }
    }
}
