//! An elastic shaft: the rotor at one end, its load at the other.
//!
//! `J dω/dt = T − k δ − c (ω − ω_end)`, `dδ/dt = ω − ω_end`, all quantities mechanical.

/// The properties of a shaft that oscillates with its far end held.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShaftSettings {
    /// Natural frequency, in Hz, above 0.
    pub hz: f64,
    /// Damping ratio, from 0.
    pub damping: f64,
    /// Inertia of the rotor, in kg·m², above 0; if rotor and load turn freely, half of both at most.
    pub rotor_kg_m2: f64,
}

/// A shaft and its twist.
#[derive(Clone, Copy, Debug)]
pub struct Shaft {
    settings: ShaftSettings,
    /// Angle by which the rotor is ahead of the far end, in rad.
    twist_rad: f64,
    /// Speed of the far end, in rad/s.
    pub end_rad_s: f64,
}

impl Shaft {
    /// Without twist, turning at a speed in rad/s.
    pub fn new(settings: ShaftSettings, end_rad_s: f64) -> Self {
        Self { settings, twist_rad: 0.0, end_rad_s }
    }

    /// Inertia of the rotor alone, in kg·m², out of the total inertia; `None`: the far end's speed is prescribed.
    pub fn rotor_kg_m2(&self, all_kg_m2: Option<f64>) -> f64 {
        let own = self.settings.rotor_kg_m2;
        all_kg_m2.map_or(own, |all| own.min(0.5 * all))
    }

    /// The torque that the shaft takes from a rotor with an inertia in kg·m² at a speed in rad/s, and gives to its far end, in N·m.
    pub fn torque_nm(&self, rotor_kg_m2: f64, speed_rad_s: f64) -> f64 {
        let natural = core::f64::consts::TAU * self.settings.hz;
        let damped = 2.0 * self.settings.damping * natural * (speed_rad_s - self.end_rad_s);
        rotor_kg_m2 * (natural * natural * self.twist_rad + damped)
    }

    /// Lets the ends turn on for half a step of `half_s`, the rotor at a speed in rad/s.
    pub fn twist(&mut self, speed_rad_s: f64, half_s: f64) {
        self.twist_rad += (speed_rad_s - self.end_rad_s) * half_s;
    }

    /// Without twist at a speed in rad/s.
    pub fn reset(&mut self, speed_rad_s: f64) {
        *self = Self::new(self.settings, speed_rad_s);
    }
}
