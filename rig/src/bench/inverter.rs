//! The two-level inverter: carrier halves in, gate edges and leg states out, every edge at its exact tick.

use crate::plant::Leg;
use crate::trace::{Edge, Tick};
use tractive::modulation::{CarrierHalf, Mode};
use tractive::protection::{LegFaults, SafeState};

/// The defect of a gate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stuck {
    /// Its order is on for good; its driver still turns the device off if it desaturates.
    On,
    /// It is off for good.
    Off,
    /// Its device has failed and conducts for good.
    Shorted,
}

/// Time for which a leg's output may differ from its expected level before its monitor reports it, in ticks (10 µs).
const MONITOR_TICKS: Tick = 250;

/// The order to a leg.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Order {
    Off,
    Upper,
    Lower,
}

/// One leg: its order, and the real state of its two gates, including the dead time.
#[derive(Clone, Copy, Debug)]
struct LegDriver {
    order: Order,
    upper_on: bool,
    lower_on: bool,
    /// The time at which the device that was ordered on turns on.
    turn_on: Option<Tick>,
}

/// Gates and their timing.
#[derive(Clone, Debug)]
pub struct Inverter {
    legs: [LegDriver; 3],
    dead_time: Tick,
    half: CarrierHalf,
    half_start: Tick,
    /// Next toggle of each leg within the half.
    toggles: [Option<Tick>; 3],
    safe: Option<SafeState>,
    /// A gate that no longer follows its commands.
    stuck: Option<(u8, Stuck)>,
    /// The time since which a leg's output has not been at its expected level.
    astray_since: Option<Tick>,
    found: LegFaults,
    edges: Vec<Edge>,
    keeps_edges: bool,
}

impl Inverter {
    /// All gates off, with a dead time in ticks, playing a half from tick 0.
    pub fn new(dead_time: Tick, first: CarrierHalf) -> Self {
        let leg = LegDriver { order: Order::Off, upper_on: false, lower_on: false, turn_on: None };
        Self {
            legs: [leg; 3],
            dead_time,
            half: first,
            half_start: 0,
            toggles: [None; 3],
            safe: None,
            stuck: None,
            astray_since: None,
            found: LegFaults::default(),
            edges: Vec::new(),
            keeps_edges: true,
        }
    }

    /// The same, playing from another tick on.
    pub fn beginning_at(mut self, origin: Tick) -> Self {
        self.half_start += origin;
        self
    }

    /// The same, without a list of edges.
    pub fn without_edges(mut self) -> Self {
        self.keeps_edges = false;
        self
    }

    /// The half that is being played.
    pub fn half(&self) -> &CarrierHalf {
        &self.half
    }

    /// Its end.
    pub fn half_end(&self) -> Tick {
        self.half_start + Tick::from(self.half.period_ticks)
    }

    /// The safe state of the gates, whatever is played.
    pub fn safe(&self) -> Option<SafeState> {
        self.safe
    }

    /// The next half takes over at `tick`.
    pub fn begin(&mut self, half: CarrierHalf, tick: Tick) {
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

    /// The safe state takes over, until it is left.
    pub fn enter(&mut self, safe: SafeState, tick: Tick) {
        self.safe = Some(safe);
        self.toggles = [None; 3];
        for phase in 0..3 {
            let order = match safe {
                SafeState::GatesOff => Order::Off,
                SafeState::ShortCircuit => Order::Lower,
                SafeState::UpperShortCircuit => Order::Upper,
            };
            self.order(phase, order, tick);
        }
    }

    /// The safe state is left: all gates stay off until the next half takes over.
    pub fn leave(&mut self, tick: Tick) {
        self.safe = None;
        for phase in 0..3 {
            self.order(phase, Order::Off, tick);
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

    /// A gate is faulty from now on.
    pub fn stick(&mut self, gate: u8, stuck: Stuck) {
        self.stuck = Some((gate, stuck));
        let leg = &self.legs[usize::from(gate / 2)];
        if if gate.is_multiple_of(2) { leg.lower_on } else { leg.upper_on } {
            self.turns_on(gate ^ 1);
        }
    }

    /// Every gate follows its commands again, and the findings are cleared.
    pub fn mend(&mut self) {
        (self.stuck, self.astray_since, self.found) = (None, None, LegFaults::default());
    }

    /// A device is turned on. If the other one of its leg conducts, the drivers detect desaturation, turn their devices off within some microseconds,
    /// and block. A device that has failed stays on.
    fn turns_on(&mut self, gate: u8) {
        match self.stuck {
            Some((other, Stuck::On)) if other == gate ^ 1 => self.found.blocked |= 0b11 << (gate & !1),
            Some((other, Stuck::Shorted)) if other == gate ^ 1 => self.found.blocked |= 1 << gate,
            _ => {}
        }
    }

    /// Checks the legs' outputs over a time in which no gate changed; `currents_a` at its end.
    pub fn monitor(&mut self, currents_a: [f64; 3], from: Tick, to: Tick) {
        let Some((gate, _)) = self.stuck else { return };
        let leg = usize::from(gate / 2);
        let (real, ordered) = (self.legs()[leg], self.ordered_legs()[leg]);
        let high = real.is_high(currents_a[leg]);
        if ordered == Leg::Open || high == (ordered == Leg::Upper) {
            self.astray_since = None;
            return;
        }
        if to - *self.astray_since.get_or_insert(from) > MONITOR_TICKS {
            let found = if high { &mut self.found.high } else { &mut self.found.low };
            *found |= 1 << leg;
        }
    }

    /// The findings of the legs' drivers and monitors.
    pub fn leg_faults(&self) -> LegFaults {
        self.found
    }

    /// The legs as seen by the machine.
    pub fn legs(&self) -> [Leg; 3] {
        let mut legs = self.ordered_legs();
        if let Some((gate, stuck)) = self.stuck
            && let Some(leg) = legs.get_mut(usize::from(gate / 2))
        {
            let state = if gate.is_multiple_of(2) { Leg::Upper } else { Leg::Lower };
            match stuck {
                Stuck::Shorted => *leg = state,
                Stuck::On if self.found.blocked != 0 => *leg = Leg::Open,
                Stuck::On => *leg = state,
                Stuck::Off if *leg == state => *leg = Leg::Open,
                Stuck::Off => {}
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

    /// Takes every edge since the last call.
    pub fn take_edges(&mut self) -> Vec<Edge> {
        std::mem::take(&mut self.edges)
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
            if self.keeps_edges {
                self.edges.push(Edge { tick, gate, on });
            }
            if on {
                self.turns_on(gate);
            }
        }
    }
}
