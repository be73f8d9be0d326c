//! Dead-time compensation.
//!
//! When two gates of a leg exchange, one node of the leg floats for the dead time, and its motor's current chooses the
//! potential: out of the node (positive) it pulls the node down, into the node up. As in a two-level leg, a rising node is late when
//! the current is positive, a falling one when it is negative:
//!
//! | exchange | what floats | current that chooses |
//! |---|---|---|
//! | H and M (1 ↔ 0) | upper node | the upper motor's |
//! | M and L (−1 ↔ 1) | lower node | the lower motor's |
//! | H and L with M on (−1 ↔ 0) | both nodes, tied | their sum |
//! | none: shoot-through, or no edge | – | – |
//!
//! A period is its own mirror image, so a border has one instant for its falling and its rising edge. It is moved by half the
//! dead time: later when the current is positive, earlier when it is negative. Then either edge comes half a dead time late,
//! and the node is high for as long as intended. M's pause cannot be less than none: if its ends would cross, H and L exchange in
//! the middle of it.
//!
//! Not compensated are two exchanges of a leg within a dead time, and what is late by half a dead time beside a shoot-through,
//! which is not late.

use super::GateTicks;
use crate::frames::Abc;

/// The dead time of the nine gates, and what its compensation needs to know.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DeadTime {
    /// Time from the turn-off of one gate of a leg to the turn-on of another, in ticks of [`GateTicks`].
    pub ticks: u32,
    /// Current below which either sign is possible because of ripple; such currents count in proportion; in A, above 0.
    pub small_a: f32,
}

impl DeadTime {
    /// Moves the pauses of the nine gates, in the order of [`GATES`](super::GATES), so that the nodes do as they said;
    /// `currents_a` are the phase currents expected in the upper and in the lower motor, positive into the motor.
    ///
    /// ```
    /// use tractive_control::frames::Abc;
    /// use tractive_control::nine_switch::{DeadTime, GateTicks};
    /// // Leg U goes from −1 to 1 at 1,000 and on to 0 at 3,000 of 4,000; the other legs stay at 1.
    /// let pause = |off_from, off_to| GateTicks { off_from, off_to };
    /// let (on, off) = (pause(4_000, 4_000), pause(0, 4_000));
    /// let mut gates =
    ///     [pause(3_000, 4_000), on, on, pause(1_000, 3_000), off, off, pause(0, 1_000), pause(0, 0), pause(0, 0)];
    /// let upper = Abc { a: 30.0, b: -15.0, c: -15.0 };
    /// let lower = Abc { a: -30.0, b: 15.0, c: 15.0 };
    /// DeadTime { ticks: 200, small_a: 2.0 }.compensate(&mut gates, &[upper, lower]);
    /// // The upper node would rise late, the lower one fall late.
    /// assert_eq!([gates[0], gates[3], gates[6]], [pause(3_100, 4_000), pause(900, 3_100), pause(0, 900)]);
    /// assert_eq!([gates[1], gates[4], gates[7]], [on, off, pause(0, 0)]);
    /// ```
    #[inline(never)]
    pub fn compensate(self, gates: &mut [GateTicks; 9], currents_a: &[Abc; 2]) {
        let [uh, vh, wh, um, vm, wm, ul, vl, wl] = gates;
        let [upper, lower] = currents_a;
        self.leg([uh, um, ul], upper.a, lower.a);
        self.leg([vh, vm, vl], upper.b, lower.b);
        self.leg([wh, wm, wl], upper.c, lower.c);
    }

    /// The same for a leg's H, M and L. A border stays within the pauses of H and L of which it is an end.
    fn leg(self, [high, middle, low]: [&mut GateTicks; 3], upper_a: f32, lower_a: f32) {
        let (fall, step) = (high.off_from, low.off_to);
        let moved = |border: u32, current_a: f32| {
            let at = border.saturating_add_signed(self.shift(current_a));
            let at = if at < high.off_to { at } else { high.off_to };
            if at > low.off_from { at } else { low.off_from }
        };
        let paused = middle.off_from < middle.off_to;
        let upper = fall == middle.off_to && fall < high.off_to;
        let lower = step == middle.off_from && low.off_from < step;
        let (mut from, mut to) = (middle.off_from, middle.off_to);
        if paused {
            to = if upper { moved(fall, upper_a) } else { to };
            from = if lower { moved(step, lower_a) } else { from };
        }
        if !paused || from >= to {
            // M is on all the time, or is to be.
            let at = match (lower, upper) {
                (true, true) => moved((step + fall) / 2, upper_a + lower_a),
                (true, false) => to,
                _ => from,
            };
            (from, to) = (at, at);
        }
        (middle.off_from, middle.off_to) = (from, to);
        if upper {
            high.off_from = to;
        }
        if lower {
            low.off_to = from;
        }
    }

    /// The shift of a border for this current of its node.
    #[inline]
    fn shift(self, current_a: f32) -> i32 {
        let share = if current_a > self.small_a {
            1.0
        } else if current_a > -self.small_a {
            current_a / self.small_a
        } else {
            -1.0
        };
        (0.5 * self.ticks as f32 * share) as i32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DEAD_TIME: DeadTime = DeadTime { ticks: 200, small_a: 2.0 };

    /// Leg U's pauses, H, M and L, compensated for these currents of the upper and of the lower motor.
    fn leg(pauses: [(u32, u32); 3], currents_a: [f32; 2]) -> [(u32, u32); 3] {
        let mut gates = [GateTicks::default(); 9];
        for (row, (off_from, off_to)) in pauses.into_iter().enumerate() {
            gates[3 * row] = GateTicks { off_from, off_to };
        }
        DEAD_TIME.compensate(&mut gates, &currents_a.map(|a| Abc { a, b: 50.0, c: 50.0 }));
        assert!([1, 2, 4, 5, 7, 8].iter().all(|other| gates[*other] == GateTicks::default()));
        [0, 3, 6].map(|gate| (gates[gate].off_from, gates[gate].off_to))
    }

    #[test]
    fn each_border_follows_its_own_motors_current() {
        let pauses = [(3_000, 4_000), (1_000, 3_000), (0, 1_000)];
        let moved = |step, fall| [(fall, 4_000), (step, fall), (0, step)];
        assert_eq!(leg(pauses, [30.0, 30.0]), moved(1_100, 3_100));
        assert_eq!(leg(pauses, [-30.0, 30.0]), moved(1_100, 2_900));
        assert_eq!(leg(pauses, [30.0, -30.0]), moved(900, 3_100));
        assert_eq!(leg(pauses, [1.0, -0.5]), moved(975, 3_050));
        assert_eq!(leg(pauses, [0.0, f32::NAN]), moved(900, 3_000));
    }

    #[test]
    fn shoot_through_and_legs_that_rest_stay() {
        // H off later, L on earlier; M's borders are those of the active vectors.
        let shorted = [(3_200, 4_000), (1_000, 3_000), (0, 800)];
        assert_eq!(leg(shorted, [30.0, -30.0]), shorted);
        // M on earlier, off later.
        let inside = [(3_000, 4_000), (1_200, 2_800), (0, 1_000)];
        assert_eq!(leg(inside, [30.0, -30.0]), inside);
        // H is never off, L never: 1 all the time.
        let resting = [(4_000, 4_000), (0, 4_000), (0, 0)];
        assert_eq!(leg(resting, [30.0, -30.0]), resting);
        // Through the shoot-through from −1 to 0: M has no pause.
        let through = [(2_100, 4_000), (2_000, 2_000), (0, 1_900)];
        assert_eq!(leg(through, [30.0, -30.0]), through);
    }

    #[test]
    fn nodes_that_are_tied_follow_the_sum() {
        let tied = |at| [(at, 4_000), (at, at), (0, at)];
        assert_eq!(leg(tied(2_000), [30.0, -10.0]), tied(2_100));
        assert_eq!(leg(tied(2_000), [-30.0, 10.0]), tied(1_900));
        assert_eq!(leg(tied(2_000), [1.5, -1.0]), tied(2_025));
        // M's pause of 100 would be less than none.
        let short = [(2_100, 4_000), (2_000, 2_100), (0, 2_000)];
        assert_eq!(leg(short, [-30.0, 20.0]), tied(1_950));
        // Beside a shoot-through M's pause ends where that begins.
        let beside = [(2_050, 4_000), (2_000, 2_050), (0, 1_800)];
        assert_eq!(leg(beside, [-30.0, 20.0]), [(2_000, 4_000), (2_000, 2_000), (0, 1_800)]);
    }

    #[test]
    fn edges_stay_in_the_half() {
        assert_eq!(leg([(3_950, 4_000), (0, 3_950), (0, 0)], [30.0, 0.0])[0], (4_000, 4_000));
        assert_eq!(leg([(4_000, 4_000), (50, 4_000), (0, 50)], [0.0, -30.0])[2], (0, 0));
    }
}
