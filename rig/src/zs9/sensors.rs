//! What the ZS9's converters see.

use crate::bench::Converter;
use crate::plant::zs9::{Motor, Zs9Plant};
use tractive::frames::{Abc, Angle};
use tractive::ports::{GateFeedback, PowerSample};

/// Converters and angle sensors.
pub struct Sensors {
    converter: Converter,
}

impl Sensors {
    /// With the flaws of a converter.
    pub fn new(converter: Converter) -> Self {
        Self { converter }
    }

    /// Ripple of the source at an instant, in V.
    pub fn ripple_v(&self, t_s: f64) -> f64 {
        self.converter.ripple_v(t_s)
    }

    /// Phase currents of both motors, in A.
    pub fn currents(&mut self, plant: &Zs9Plant) -> [Abc; 2] {
        plant.motors().each_ref().map(|motor| {
            let [a, b, c] = motor.currents_abc().map(|current| self.converter.convert(current) as f32);
            Abc { a, b, c }
        })
    }

    /// Rotor angle.
    pub fn angle(&self, motor: &Motor) -> Angle {
        let turns = motor.angle_turns() + self.converter.flaws().angle_error_deg / 360.0;
        Angle((turns.rem_euclid(1.0) * 4_294_967_296.0).round() as u64 as u32)
    }

    /// What the PWM interrupt converts.
    pub fn power(&mut self, plant: &Zs9Plant, gates: GateFeedback) -> PowerSample {
        PowerSample {
            currents_a: self.currents(plant),
            capacitor_v: plant.network().capacitor_v() as f32,
            source_v: plant.source_v() as f32,
            gates,
        }
    }
}
