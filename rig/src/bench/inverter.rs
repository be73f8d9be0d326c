//! The two-level inverter: carrier halves in, gate edges and leg states out, every edge at its exact tick.

use super::Tick;
use crate::plant::Leg;
use tractive::modulation::{CarrierPeriod, Mode};
use tractive::protection::SafeState;

/// A gate edge: device 0 ..= 5 is uh ul vh vl wh wl.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Edge {
    /// When.
    pub tick: Tick,
    /// Which device, as an index into [`GATES`].
    pub gate: u8,
    /// On or off.
    pub on: bool,
}

/// Names of the gates, in the order of [`Edge::gate`].
pub const GATES: [&str; 6] = ["uh", "ul", "vh", "vl", "wh", "wl"];

/// What a leg is told to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Order {
    Off,
    Upper,
    Lower,
}

/// One leg: its order, and what its two gates really do, the dead time included.
#[derive(Clone, Copy, Debug)]
struct LegDriver {
    order: Order,
    upper_on: bool,
    lower_on: bool,
    /// When the device that was ordered on turns on.
    turn_on: Option<Tick>,
}

/// Gates and their timing.
#[derive(Clone, Debug)]
pub struct Inverter {
    legs: [LegDriver; 3],
    dead_time: Tick,
    half: CarrierPeriod,
    half_start: Tick,
    /// Next toggle of each leg within the half.
    toggles: [Option<Tick>; 3],
    safe: Option<SafeState>,
    /// A gate that no longer does what it is told: on (true) or off for good.
    stuck: Option<(u8, bool)>,
    /// Devices whose drivers have found a short circuit and block, a bit each in the order of [`GATES`].
    blocked: u8,
    edges: Vec<Edge>,
}

impl Inverter {
    /// All gates off, with a dead time in ticks, playing a half from tick 0.
    pub fn new(dead_time: Tick, first: CarrierPeriod) -> Self {
        let leg = LegDriver { order: Order::Off, upper_on: false, lower_on: false, turn_on: None };
        Self {
            legs: [leg; 3],
            dead_time,
            half: first,
            half_start: 0,
            toggles: [None; 3],
            safe: None,
            stuck: None,
            blocked: 0,
            edges: Vec::new(),
        }
    }

    /// The half that is played.
    pub fn half(&self) -> &CarrierPeriod {
        &self.half
    }

    /// Its end.
    pub fn half_end(&self) -> Tick {
        self.half_start + Tick::from(self.half.period_ticks)
    }

    /// Whether the gates are in a safe state, whatever is played.
    pub fn is_safe(&self) -> bool {
        self.safe.is_some()
    }

    /// The next half takes over at `tick`.
    pub fn begin(&mut self, half: CarrierPeriod, tick: Tick) {
        self.half = half;
        self.half_start = tick;
        self.toggles = [None; 3];
        if self.safe.is_some() {
            return;
        }
        for phase in 0..3 {
            if half.mode == Mode::Off {
                self.order(phase, Order::Off, tick);
                continue;
            }
            let (mut level, compare) = (half.start_levels[phase], half.compare_ticks[phase]);
            if compare == 0 {
                level = !level;
            } else if compare < half.period_ticks {
                self.toggles[phase] = Some(tick + Tick::from(compare));
            }
            self.order(phase, if level { Order::Upper } else { Order::Lower }, tick);
        }
    }

    /// The safe state takes over, for good.
    pub fn enter(&mut self, safe: SafeState, tick: Tick) {
        self.safe = Some(safe);
        self.toggles = [None; 3];
        for phase in 0..3 {
            let order = match safe {
                SafeState::GatesOff => Order::Off,
                SafeState::ShortCircuit => Order::Lower,
            };
            self.order(phase, order, tick);
        }
    }

    /// The next instant at which a gate changes, after `now`.
    pub fn next_event(&self) -> Option<Tick> {
        self.toggles.iter().chain(self.legs.iter().map(|leg| &leg.turn_on)).flatten().min().copied()
    }

    /// Does what is due at `tick`.
    pub fn act(&mut self, tick: Tick) {
        for phase in 0..3 {
            if self.toggles[phase] == Some(tick) {
                self.toggles[phase] = None;
                let level = !self.half.start_levels[phase];
                self.order(phase, if level { Order::Upper } else { Order::Lower }, tick);
            }
            if self.legs[phase].turn_on == Some(tick) {
                self.legs[phase].turn_on = None;
                let upper = self.legs[phase].order == Order::Upper;
                self.gate(phase, upper, true, tick);
            }
        }
    }

    /// A gate is stuck from now on: its device conducts (true) or not, whatever is ordered.
    pub fn stick(&mut self, gate: u8, on: bool) {
        self.stuck = Some((gate, on));
        let leg = &self.legs[usize::from(gate / 2)];
        if if gate.is_multiple_of(2) { leg.lower_on } else { leg.upper_on } {
            self.turns_on(gate ^ 1);
        }
    }

    /// A device is turned on. Where the other one of its leg is stuck on, its driver sees it desaturate, turns it off within some
    /// microseconds, and blocks.
    fn turns_on(&mut self, gate: u8) {
        if self.stuck == Some((gate ^ 1, true)) {
            self.blocked |= 1 << gate;
        }
    }

    /// Devices whose drivers block, a bit each in the order of [`GATES`].
    pub fn blocked(&self) -> u8 {
        self.blocked
    }

    /// The legs as the machine sees them.
    pub fn legs(&self) -> [Leg; 3] {
        let mut legs = self.ordered_legs();
        if let Some((gate, on)) = self.stuck
            && let Some(leg) = legs.get_mut(usize::from(gate / 2))
        {
            let state = if gate.is_multiple_of(2) { Leg::Upper } else { Leg::Lower };
            if on {
                *leg = state;
            } else if *leg == state {
                *leg = Leg::Open;
            }
        }
        legs
    }

    /// The legs as they would be without a stuck gate.
    pub fn ordered_legs(&self) -> [Leg; 3] {
        self.legs.map(|leg| match (leg.upper_on, leg.lower_on) {
            (true, _) => Leg::Upper,
            (_, true) => Leg::Lower,
            _ => Leg::Open,
        })
    }

    /// Every edge so far.
    pub fn edges(&self) -> &[Edge] {
        &self.edges
    }

    fn order(&mut self, phase: usize, order: Order, tick: Tick) {
        if self.legs[phase].order == order {
            return;
        }
        self.legs[phase].order = order;
        self.legs[phase].turn_on = None;
        let (upper, lower) = (order == Order::Upper, order == Order::Lower);
        if self.legs[phase].upper_on && !upper {
            self.gate(phase, true, false, tick);
        }
        if self.legs[phase].lower_on && !lower {
            self.gate(phase, false, false, tick);
        }
        if order != Order::Off {
            if self.dead_time == 0 {
                self.gate(phase, upper, true, tick);
            } else {
                self.legs[phase].turn_on = Some(tick + self.dead_time);
            }
        }
    }

    fn gate(&mut self, phase: usize, upper: bool, on: bool, tick: Tick) {
        let leg = &mut self.legs[phase];
        debug_assert!(!on || !(if upper { leg.lower_on } else { leg.upper_on }), "both devices of a leg on");
        let state = if upper { &mut leg.upper_on } else { &mut leg.lower_on };
        if *state != on {
            *state = on;
            let gate = (phase * 2) as u8 + u8::from(!upper);
            self.edges.push(Edge { tick, gate, on });
            if on {
                self.turns_on(gate);
            }
        }
    }
}
