//! The damping of a source behind a line filter, by the capacitors of the Z-source network.
//!
//! Motors that hold their torque draw constant power: less current when the source rises. To the filter's choke L and capacitor C that is a negative
//! resistance `−U²/P`; if their own resistance is below `P L/(C U²)`, the source swings ever more. The capacitors hold energy enough to draw more than the
//! motors take while the source is high, and less while it is low. So their reference follows the integral of the source's swing: the filter sees a
//! conductance, whatever the motors do, and the motors notice nothing as long as the link leaves them their voltage.

use crate::frames::limit;

/// Bandwidth at which the source's slow value follows, and at which a moved reference returns, in rad/s.
const SLOW_RAD_S: f32 = 20.0;
/// The conductance that a line filter sees, as a multiple of that of the motors' full power. By trial on the ZS9: 0.5 s after steps of the line by a tenth, 5 % of
/// swing are left with 1, 0.2 % with 2, 0.02 % with 3; but with 3 a load step of one motor takes so much of the link that the other one feels 0.34 N·m of
/// it, and with 2 0.06.
pub const CONDUCTANCE: f32 = 2.0;
/// Largest shift of the capacitors' reference, as a share of the source's voltage: 60 V of the 533 that the paper's have, between the source's 400, below which
/// nothing can be stepped up, and the trip at 720. Steps of the line by a tenth then moved them between 429 and 647 V.
const MOST_MOVED: f32 = 0.15;

/// The state of the damping.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SourceDamper {
    /// The source's slow value, in V.
    slow_v: f32,
    /// Shift of the capacitors' reference, in V, and its slope in the newest period, in V/s.
    pub moved_v: f32,
    pub moves_v_s: f32,
}

impl SourceDamper {
    /// On a source that has stood at `slow_v`.
    pub const fn at(slow_v: f32) -> Self {
        Self { slow_v, moved_v: 0.0, moves_v_s: 0.0 }
    }

    /// One period, in s. The source gives `G u Δu` more than the motors take, with the conductance G in S; that charges both capacitors, of `c` farad and at `v`
    /// volt each: `2 C v dv/dt = G u Δu`.
    pub fn step(&mut self, source_v: f32, (c, v): (f32, f32), damping_s: f32, period_s: f32) {
        self.slow_v += SLOW_RAD_S * period_s * (source_v - self.slow_v);
        let charging_w = damping_s * source_v * (source_v - self.slow_v);
        let charging_v_s = charging_w / (2.0 * c * v);
        let (before_v, most_v) = (self.moved_v, MOST_MOVED * self.slow_v);
        let wanted_v = before_v + period_s * (charging_v_s - SLOW_RAD_S * before_v);
        self.moved_v = limit(wanted_v, -most_v, most_v);
        self.moves_v_s = (self.moved_v - before_v) / period_s;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CAPACITORS: (f32, f32) = (500e-6, 533.0);
    const PERIOD_S: f32 = 100e-6;

    /// The energy that the capacitors have taken while the source was 4 V higher than before: `G u Δu`, as long as the slow value has not followed.
    #[test]
    fn the_capacitors_take_what_the_conductance_says() {
        let mut damper = SourceDamper::at(400.0);
        damper.step(404.0, CAPACITORS, 0.3, PERIOD_S);
        let power_w = 2.0 * CAPACITORS.0 * CAPACITORS.1 * damper.moves_v_s;
        assert!((power_w / (0.3 * 404.0 * 4.0) - 1.0).abs() < 0.003, "{power_w}");
        assert_eq!(damper.moved_v, damper.moves_v_s * PERIOD_S);
    }

    /// A step of the source shifts the reference, by `G u Δu/(2 C v e 20/s)` at most, and it returns; a large one shifts it to its limit.
    #[test]
    fn the_reference_returns_and_has_a_limit() {
        for (to_v, expected_v) in [(410.0, 42.4), (800.0, MOST_MOVED * 800.0)] {
            let (mut damper, mut largest_v) = (SourceDamper::at(400.0), 0.0_f32);
            for _ in 0..10_000 {
                let before_v = damper.moved_v;
                damper.step(to_v, CAPACITORS, 0.3, PERIOD_S);
                assert!((damper.moves_v_s - (damper.moved_v - before_v) / PERIOD_S).abs() < 1e-3);
                largest_v = largest_v.max(damper.moved_v);
            }
            assert!((largest_v / expected_v - 1.0).abs() < 0.01, "{largest_v} V");
            assert!(damper.moved_v.abs() < 0.02 * largest_v, "{} V", damper.moved_v);
        }
    }
}
