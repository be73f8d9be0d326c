//! A rotor: angle, speed, and its drive.

use super::shaft::{Shaft, ShaftSettings};
use super::speed::{SpeedSource, profile_speed};
use core::f64::consts::TAU;

/// A rotor with its pole pairs. Its speed changes linearly during a step.
#[derive(Clone, Debug)]
pub struct Rotor {
    source: SpeedSource,
    pole_pairs: f64,
    time_s: f64,
    /// Electrical angle, 0 ≤ x < 1 turn.
    angle_turns: f64,
    /// Its sine and cosine.
    sin_cos: (f64, f64),
    /// Mechanical, in rad/s.
    speed_rad_s: f64,
    /// Torque of friction of a free rotor, in N·m.
    friction_nm: f64,
    /// The elastic shaft between the rotor and its drive; `None`: they are one body.
    shaft: Option<Shaft>,
}

impl Rotor {
    /// At angle zero; turning as the profile says, or at rest.
    pub fn new(source: SpeedSource, pole_pairs: f64) -> Self {
        let speed_rad_s = match &source {
            SpeedSource::Profile(points) => profile_speed(points, 0.0),
            SpeedSource::Inertia { .. } => 0.0,
            SpeedSource::Wheel(wheel) => wheel.train_rad_s,
        };
        let sin_cos = (0.0, 1.0);
        let (time_s, angle_turns, friction_nm) = (0.0, 0.0, 0.0);
        Self { source, pole_pairs, time_s, angle_turns, sin_cos, speed_rad_s, friction_nm, shaft: None }
    }

    /// The same on an elastic shaft, if there is one: the drive or load is at the far end.
    pub fn on_shaft(mut self, shaft: Option<ShaftSettings>) -> Self {
        self.shaft = shaft.map(|settings| Shaft::new(settings, self.speed_rad_s));
        self
    }

    /// Turns the rotor to an electrical angle, in turns.
    pub fn turn_to(&mut self, angle_turns: f64) {
        self.angle_turns =
            if (0.0..1.0).contains(&angle_turns) { angle_turns } else { angle_turns.rem_euclid(1.0) };
        self.sin_cos = libm::sincos(self.angle_turns * TAU);
    }

    /// Electrical rotor angle, in turns, 0 ≤ x < 1.
    pub fn angle_turns(&self) -> f64 {
        self.angle_turns
    }

    /// Its sine and cosine.
    #[inline]
    pub fn sin_cos(&self) -> (f64, f64) {
        self.sin_cos
    }

    /// Mechanical speed, in r/min.
    pub fn speed_rpm(&self) -> f64 {
        self.speed_rad_s * 60.0 / TAU
    }

    /// Lets a free rotor turn at a speed in r/min; a prescribed speed stays as it is.
    pub fn set_speed_rpm(&mut self, speed_rpm: f64) {
        if matches!(self.source, SpeedSource::Inertia { .. }) {
            self.speed_rad_s = speed_rpm * TAU / 60.0;
            if let Some(shaft) = &mut self.shaft {
                shaft.reset(self.speed_rad_s);
            }
        }
    }

    /// Loads a free rotor with a torque against forward rotation, in N·m; a prescribed speed stays as it is.
    pub fn set_load_nm(&mut self, torque_nm: f64) {
        if let SpeedSource::Inertia { load_nm, .. } = &mut self.source {
            *load_nm = torque_nm;
        }
    }

    /// Gives a free rotor friction, in N·m: a torque against either direction of rotation; at rest it holds the rotor against any torque up to that value.
    pub fn set_friction_nm(&mut self, torque_nm: f64) {
        self.friction_nm = torque_nm;
    }

    /// The part of a torque, in N·m, that remains after friction: friction never turns a rotor back beyond rest.
    fn beyond_friction_nm(&self, torque_nm: f64, speed_rad_s: f64, (inertia_kg_m2, dt_s): (f64, f64)) -> f64 {
        if self.friction_nm == 0.0 {
            return torque_nm;
        }
        // The torque that would stop the rotor within the step.
        let stops_nm = -speed_rad_s * inertia_kg_m2 / dt_s;
        let against_nm = (stops_nm - torque_nm).clamp(-self.friction_nm, self.friction_nm);
        torque_nm + against_nm
    }

    /// Holds the rotor at a speed from now on, in r/min, whatever the torque; it goes there at this slope, in r/min per s, above 0.
    pub fn hold(&mut self, speed_rpm: f64, slope_rpm_s: f64) {
        let from_rpm = self.shaft.map_or(self.speed_rad_s, |shaft| shaft.end_rad_s) * 60.0 / TAU;
        let there_s = self.time_s + (speed_rpm - from_rpm).abs() / slope_rpm_s;
        self.source = SpeedSource::profile(vec![(self.time_s, from_rpm), (there_s, speed_rpm)]);
    }

    /// Releases the rotor with an inertia in kg·m², above 0, and a load against forward rotation in N·m.
    pub fn release(&mut self, inertia_kg_m2: f64, load_nm: f64) {
        self.source = SpeedSource::Inertia { inertia_kg_m2, load_nm };
    }

    /// The step that begins now and lasts `dt_s`, with an air-gap torque that is evaluated only if it matters.
    #[inline]
    pub fn turning(&self, torque_nm: impl FnOnce() -> f64, dt_s: f64) -> Turning {
        let acceleration = match (&self.shaft, &self.source) {
            (Some(shaft), source) => {
                let rotor_kg_m2 = shaft.rotor_kg_m2(source.inertia_kg_m2());
                (torque_nm() - shaft.torque_nm(rotor_kg_m2, self.speed_rad_s)) / rotor_kg_m2
            }
            (None, SpeedSource::Profile(points)) => {
                (profile_speed(points, self.time_s + dt_s) - profile_speed(points, self.time_s)) / dt_s
            }
            (None, SpeedSource::Inertia { inertia_kg_m2, load_nm }) => {
                let driven = (*inertia_kg_m2, dt_s);
                self.beyond_friction_nm(torque_nm() - load_nm, self.speed_rad_s, driven) / inertia_kg_m2
            }
            (None, SpeedSource::Wheel(wheel)) => {
                (torque_nm() - wheel.grip_nm(self.speed_rad_s, self.time_s)) / wheel.inertia_kg_m2
            }
        };
        Turning { pole_pairs: self.pole_pairs, speed_rad_s: self.speed_rad_s, acceleration }
    }

    /// Ends a step in which the air-gap torque gave an impulse, in N·m·s. Returns the work done on the rotor, in J.
    #[inline]
    pub fn finish(&mut self, impulse_nm_s: f64, dt_s: f64) -> f64 {
        let speed_before = self.speed_rad_s;
        self.speed_rad_s = match self.shaft {
            None => self.drive(speed_before, (impulse_nm_s, 0.0), dt_s),
            Some(shaft) => self.twist(shaft, impulse_nm_s, dt_s),
        };
        self.time_s += dt_s;
        let mean_speed = 0.5 * (speed_before + self.speed_rad_s);
        self.turn_to(self.angle_turns + self.pole_pairs * mean_speed * dt_s / TAU);
        impulse_nm_s * mean_speed
    }

    /// The speed, in rad/s, after a step from this one of what the source turns, or is turned by, excluding an inertia in kg·m² that is not part of
    /// it, with an impulse in N·m·s.
    fn drive(&mut self, speed_rad_s: f64, (impulse_nm_s, without_kg_m2): (f64, f64), dt_s: f64) -> f64 {
        let began_s = self.time_s;
        let after_rad_s = match &self.source {
            SpeedSource::Profile(points) => profile_speed(points, began_s + dt_s),
            SpeedSource::Inertia { inertia_kg_m2, load_nm } => {
                let inertia_kg_m2 = inertia_kg_m2 - without_kg_m2;
                let impulse_nm_s = impulse_nm_s - load_nm * dt_s;
                let left_nm_s = if self.friction_nm == 0.0 {
                    impulse_nm_s
                } else {
                    let driven = (inertia_kg_m2, dt_s);
                    self.beyond_friction_nm(impulse_nm_s / dt_s, speed_rad_s, driven) * dt_s
                };
                speed_rad_s + left_nm_s / inertia_kg_m2
            }
            SpeedSource::Wheel(wheel) => {
                let grip_nm_s = wheel.grip_nm(speed_rad_s, began_s) * dt_s;
                speed_rad_s + (impulse_nm_s - grip_nm_s) / (wheel.inertia_kg_m2 - without_kg_m2)
            }
        };
        if let SpeedSource::Wheel(wheel) = &mut self.source {
            wheel.drive(speed_rad_s, began_s, dt_s);
        }
        after_rad_s
    }

    /// The rotor's speed, in rad/s, after a step on an elastic shaft: half of its twist, both ends, the other half.
    fn twist(&mut self, mut shaft: Shaft, impulse_nm_s: f64, dt_s: f64) -> f64 {
        let rotor_kg_m2 = shaft.rotor_kg_m2(self.source.inertia_kg_m2());
        shaft.twist(self.speed_rad_s, 0.5 * dt_s);
        let through_nm_s = shaft.torque_nm(rotor_kg_m2, self.speed_rad_s) * dt_s;
        let after_rad_s = self.speed_rad_s + (impulse_nm_s - through_nm_s) / rotor_kg_m2;
        shaft.end_rad_s = self.drive(shaft.end_rad_s, (through_nm_s, rotor_kg_m2), dt_s);
        shaft.twist(after_rad_s, 0.5 * dt_s);
        self.shaft = Some(shaft);
        after_rad_s
    }
}

/// A rotor's motion within a step.
#[derive(Clone, Copy, Debug)]
pub struct Turning {
    pole_pairs: f64,
    speed_rad_s: f64,
    acceleration: f64,
}

impl Turning {
    /// Electrical speed at a time after the step's beginning, in rad/s.
    #[inline]
    pub fn omega(&self, t_s: f64) -> f64 {
        self.pole_pairs * (self.speed_rad_s + self.acceleration * t_s)
    }

    /// Electrical angle turned since the step's beginning, in rad.
    #[inline]
    pub fn turned(&self, t_s: f64) -> f64 {
        self.pole_pairs * (self.speed_rad_s + 0.5 * self.acceleration * t_s) * t_s
    }
}
