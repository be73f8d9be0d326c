//! The path of the flux reference under a pattern of few pulses.
//!
//! On a circle of constant flux linkage a small change of torque can be a large change of load angle: near zero torque, with more
//! flux than the magnets', the two signs of torque lie some 70° apart. A pattern turns its flux hexagon against the rotor by a
//! few degrees a sector; a reference that jumps would throw the hexagon off its centre.

use crate::frames::Dq;

/// Largest rate at which the reference turns against the rotor, in rad/s.
const TURN_RAD_S: f32 = 120.0;

/// Part of its way that it turns in a radian of the stator's turn while a pattern and square wave take over from each other: the voltage,
/// and so the flux, is given, and the load angle changes with it, which takes four sectors. Chosen by trial: 0.35 does as
/// well, and an immediate change is worst.
const GROWING_PER_RAD: f32 = 0.7;

#[derive(Clone, Copy, Debug)]
pub struct FluxPath {
    last: Option<Dq>,
}

impl FluxPath {
    pub const fn new() -> Self {
        Self { last: None }
    }

    /// The reference on its way to `target`: there at once if a carrier follows (`can_step`), slowly while a pattern grows with a given voltage (`growing`)
    /// at a stator frequency of `omega` in rad/s.
    pub fn step(&mut self, target: Dq, (can_step, growing): (bool, bool), omega: f32, period_s: f32) -> Dq {
        let reference = match self.last {
            Some(last) if !can_step => {
                let size = target.length();
                let (change, most) = (target - last, TURN_RAD_S * period_s * size);
                let length = change.length();
                let slow = GROWING_PER_RAD * omega.abs() * period_s * length;
                let most = if growing && slow < most { slow } else { most };
                if length > most {
                    let moved = last + change * (most / length);
                    // On the circle of the target, not on the chord.
                    let moved_size = moved.length();
                    if moved_size > 0.0 { moved * (size / moved_size) } else { target }
                } else {
                    target
                }
            }
            _ => target,
        };
        self.last = Some(reference);
        reference
    }
}
