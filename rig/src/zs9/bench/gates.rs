//! The nine gates: their ordered states, and their actual states once dead times have passed.

use crate::bench::Tick;
use crate::plant::zs9::LegGates;

/// Orders and levels, in the order of [`tractive::nine_switch::GATES`].
pub struct Gates {
    /// The ordered states.
    pub ordered: [bool; 9],
    /// The actual states.
    pub levels: [bool; 9],
    /// The times at which the gates that wait for the dead time turn on.
    turn_on: [Option<Tick>; 9],
    dead_time: Tick,
    /// The time from which edges are kept, if they are.
    edges_from: Option<Tick>,
    /// Edges that were kept: time, gate, on or off.
    pub edges: Vec<(Tick, u8, bool)>,
}

impl Gates {
    /// All off.
    pub fn new(dead_time: Tick, edges_from: Option<Tick>) -> Self {
        Self {
            ordered: [false; 9],
            levels: [false; 9],
            turn_on: [None; 9],
            dead_time,
            edges_from,
            edges: Vec::new(),
        }
    }

    /// The same on a bench that begins at another step than 0.
    pub fn beginning_at(self, origin: Tick) -> Self {
        Self { edges_from: self.edges_from.map(|from| from + origin), ..self }
    }

    /// The time at which the next one turns on.
    pub fn next_event(&self) -> Option<Tick> {
        self.turn_on.iter().flatten().min().copied()
    }

    /// Turns on the gates that have waited long enough.
    pub fn act(&mut self, now: Tick) {
        for gate in 0..9 {
            if self.turn_on[usize::from(gate)].is_some_and(|at| at <= now) {
                self.turn_on[usize::from(gate)] = None;
                self.set(now, gate, true);
            }
        }
    }

    /// New orders to the gates. A gate that turns on while another gate of its leg turns off waits for the dead time; a gate that
    /// turns on alone shorts its leg on purpose, so it turns on at once.
    pub fn order(&mut self, now: Tick, ordered: [bool; 9]) {
        if ordered == self.ordered {
            return;
        }
        for leg in 0..3_u8 {
            let gates = [leg, leg + 3, leg + 6];
            if gates.iter().all(|gate| ordered[usize::from(*gate)] == self.ordered[usize::from(*gate)]) {
                continue;
            }
            let changes = |gate: u8, to: bool| {
                ordered[usize::from(gate)] == to && self.ordered[usize::from(gate)] != to
            };
            let turns_off = gates.map(|gate| changes(gate, false));
            let turns_on = gates.map(|gate| changes(gate, true));
            let waits = self.dead_time > 0 && turns_off.contains(&true);
            for (gate, _) in gates.into_iter().zip(turns_off).filter(|(_, turns)| *turns) {
                self.turn_on[usize::from(gate)] = None;
                self.set(now, gate, false);
                // A gate that already waits now waits for this one, too.
                for other in gates.map(usize::from) {
                    self.turn_on[other] = self.turn_on[other].map(|_| now + self.dead_time);
                }
            }
            for (gate, _) in gates.into_iter().zip(turns_on).filter(|(_, turns)| *turns) {
                if waits {
                    self.turn_on[usize::from(gate)] = Some(now + self.dead_time);
                } else {
                    self.set(now, gate, true);
                }
            }
        }
        self.ordered = ordered;
    }

    /// As [`as_diodes_have_it`]; without a dead time no gate waits.
    pub fn as_diodes_have_it(
        &self,
        gates: [LegGates; 3],
        currents_a: impl FnOnce() -> [[f64; 3]; 2],
    ) -> [LegGates; 3] {
        if self.dead_time == 0 { gates } else { as_diodes_have_it(gates, currents_a) }
    }

    fn set(&mut self, now: Tick, gate: u8, on: bool) {
        let level = &mut self.levels[usize::from(gate)];
        if *level != on {
            *level = on;
            if self.edges_from.is_some_and(|from| now >= from) {
                self.edges.push((now, gate, on));
            }
        }
    }
}

/// The legs of a pulsing bridge, with the states that the diodes give to legs that wait for a gate: at a node that is not tied to a rail the current
/// chooses the state. Current out of the node flows through a diode from below, current into it through one from above.
pub fn as_diodes_have_it(gates: [LegGates; 3], currents_a: impl FnOnce() -> [[f64; 3]; 2]) -> [LegGates; 3] {
    let [upper, lower] = currents_a();
    core::array::from_fn(|leg| {
        let choose = |current_a: f64, out: LegGates, into: LegGates| if current_a > 0.0 { out } else { into };
        match (gates[leg].high, gates[leg].middle, gates[leg].low) {
            (false, false, true) => choose(upper[leg], LegGates::ZERO, LegGates::ONE),
            (true, false, false) => choose(lower[leg], LegGates::ONE, LegGates::MINUS_ONE),
            (false, true, false) => choose(upper[leg] + lower[leg], LegGates::ZERO, LegGates::MINUS_ONE),
            // Two exchanges within a dead time: both nodes are free; if their currents pull them together, the sum chooses.
            (false, false, false) if upper[leg] <= 0.0 => {
                choose(lower[leg], LegGates::ONE, LegGates::MINUS_ONE)
            }
            (false, false, false) => {
                choose(upper[leg] + lower[leg].min(0.0), LegGates::ZERO, LegGates::MINUS_ONE)
            }
            _ => gates[leg],
        }
    })
}
