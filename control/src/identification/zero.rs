//! The angle's zero, as a free rotor shows it.

use crate::frames::{Angle, Dq, SinCos, limit};

/// The angle by which the d axis lies ahead of the measured angle.
#[derive(Clone, Copy, Debug)]
pub struct Zero {
    /// The angle in rad, electrical.
    rad: f32,
    /// Square of the current along d over the bound, integrated over the time that has shown something, in s.
    seen_s: f32,
    ahead: SinCos,
}

/// The weight of the angle as read, as a time with the bound along d, in s; and the largest turn of the frame, in rad: 20°.
const KNOWN_S: f32 = 0.02;
const MOST_RAD: f32 = 0.35;

impl Zero {
    /// A zero exactly where the angle says.
    pub const fn new() -> Self {
        Self { rad: 0.0, seen_s: KNOWN_S, ahead: SinCos { sin: 0.0, cos: 1.0 } }
    }

    /// Turns the frame as long as a current along q, over the bound, is needed beside so much along d, over the bound, to keep the rotor in place: by
    /// least squares over all of them, so it is quick at first. Swings by pulses along q come from their own torque and show no zero: learning from them
    /// turned the frame, and with it the current along d, which made the swings grow.
    pub fn turn(&mut self, back_share: f32, d_share: f32, length_s: f32) {
        if back_share == 0.0 {
            return;
        }
        self.seen_s += d_share * d_share * length_s;
        let more_rad = back_share * d_share * length_s / self.seen_s;
        self.rad = limit(self.rad + more_rad, -MOST_RAD, MOST_RAD);
        self.ahead = Angle::from_radians(self.rad).sin_cos();
    }

    /// A current in A and the direction of the d axis, as the angle says, in the frame that it is in.
    pub fn seen(&self, Dq { d, q }: Dq, frame: SinCos) -> (Dq, SinCos) {
        let SinCos { sin, cos } = self.ahead;
        let frame = SinCos { sin: frame.sin * cos + frame.cos * sin, cos: frame.cos * cos - frame.sin * sin };
        (Dq { d: d * cos + q * sin, q: q * cos - d * sin }, frame)
    }
}
