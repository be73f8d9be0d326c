//! The wires at the board: power stage, motor, encoder, contactors, bus. By the guide's wiring and the power stage's file, not by the
//! board's code.

pub mod side;
pub mod wiring;

use crate::chip::Chip;
use crate::chip::gpio::{Driver, Gpio, place};
use crate::chip::spi::written;
use crate::chip::timer::Tracks;
use crate::finding::Findings;
use crate::stage::PowerStage;
use crate::time::{MICROSECOND, MILLISECOND, Time, seconds};
use side::Side;
use tractive::ports::GateFeedback;
use tractive::protocol::Frame;
use tractive_rig::plant::LinkSwitches;
use tractive_rig::run::Supervisor;
use tractive_rig::talk::Talk;
use wiring::{BUS, Sensor, Wiring};

/// The times in which a contactor closes and opens.
const CLOSES: Time = 40 * MILLISECOND;
const OPENS: Time = 20 * MILLISECOND;
/// The push of the rotor, a little forwards, then back over its index while the board is already counting, before it is released: until when, and at
/// what speed in r/min.
const PUSHES: [(Time, f64); 3] = [(60 * MILLISECOND, 10.0), (150 * MILLISECOND, -10.0), (Time::MAX, 0.0)];
const PUSH_RPM_S: f64 = 1e6;
/// The time for which the drivers' ready wire drops.
const DROP: Time = 10 * MILLISECOND;
/// The step of the trace.
const SLOT: Time = MILLISECOND;

/// A gate's edge: instant, device (a place in the wiring's list), on or off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Edge {
    /// The instant.
    pub at: Time,
    /// The device.
    pub gate: usize,
    /// `true` if it goes on.
    pub on: bool,
}

#[derive(Clone, Copy, Debug, Default)]
struct Contactor {
    told: bool,
    closed: bool,
    moves: Option<Time>,
}

impl Contactor {
    fn act(&mut self, told: bool, now: Time) {
        if told != self.told {
            self.told = told;
            self.moves = (told != self.closed).then_some(now + if told { CLOSES } else { OPENS });
        }
        if self.moves.is_some_and(|at| at <= now) {
            (self.closed, self.moves) = (self.told, None);
        }
    }
}

/// The rotor: inertia in kg·m², once it is let go of.
#[derive(Clone, Copy, Debug)]
pub struct Rotor {
    /// Inertia, in kg·m².
    pub inertia_kg_m2: f64,
    /// Pole pairs.
    pub pole_pairs: f64,
}

/// The driver board's shift register: its words, and how many have been shifted out since it was selected.
#[derive(Clone, Copy, Debug, Default)]
struct ShiftRegister {
    selected: bool,
    words: [u16; 2],
    shifted: usize,
}

/// The world.
pub struct World {
    /// Inverter, link and motors.
    pub side: Side,
    /// The vehicle's computer.
    pub talk: Talk,
    /// Every edge of a gate.
    pub edges: Vec<Edge>,
    /// Every edge of a contactor's, the discharge resistor's and the chopper's pin, by its place in [`Wiring::lines`].
    pub line_edges: Vec<Edge>,
    /// The drivers are ready.
    pub ready: bool,
    /// Additional current in a phase, in A, that bypasses the motor, such as to earth. The motor, the phase.
    pub excess_a: (usize, usize, f64),
    /// The instant at which the drivers' ready wire drops for 10 ms.
    pub drops: Option<Time>,
    /// The encoders' wires are cut.
    pub cut: bool,
    /// The frame that a babbling node sends without end, and the time from one to the next.
    pub babble: Option<(Frame, Time)>,
    /// The talk is over.
    pub done: bool,
    wiring: &'static Wiring,
    stage: PowerStage,
    rotor: Rotor,
    now: Time,
    pushes: usize,
    contactors: [Contactor; 2],
    gates: Vec<bool>,
    /// The instants at which they last went off.
    off: Vec<Option<Time>>,
    /// The main output of a timer is on.
    pulsing: bool,
    turns: [f64; 2],
    last_turns: [f64; 2],
    next_slot: Time,
    outbox: Vec<(Time, Frame)>,
    pins: Vec<usize>,
    lines: Vec<(usize, bool)>,
    leg_of: Vec<&'static [usize]>,
    shift: ShiftRegister,
    illegal: Option<String>,
}

impl World {
    /// At rest.
    pub fn new(side: Side, wiring: &'static Wiring, talk: Talk, stage: PowerStage, rotor: Rotor) -> Self {
        let mut side = side;
        for motor in side.motors_mut() {
            motor.rotor_mut().hold(PUSHES[0].1, PUSH_RPM_S);
        }
        let count = wiring.gates.len();
        let leg = |gate: usize| wiring.legs.iter().copied().find(|leg| leg.contains(&gate)).unwrap_or(&[]);
        Self {
            side,
            talk,
            edges: Vec::new(),
            line_edges: Vec::new(),
            ready: true,
            drops: None,
            cut: false,
            babble: None,
            done: false,
            wiring,
            stage,
            rotor,
            now: 0,
            pushes: 0,
            contactors: [Contactor::default(); 2],
            gates: vec![false; count],
            off: vec![None; count],
            pulsing: false,
            excess_a: (0, 0, 0.0),
            turns: [0.0; 2],
            last_turns: [0.0; 2],
            next_slot: 0,
            outbox: Vec::new(),
            pins: wiring.gates.iter().map(|(pin, _)| place(pin)).collect(),
            lines: wiring.lines().map(|pin| (place(pin), false)).collect(),
            leg_of: (0..count).map(leg).collect(),
            shift: ShiftRegister::default(),
            illegal: None,
        }
    }

    /// The wiring.
    pub fn wiring(&self) -> &'static Wiring {
        self.wiring
    }

    /// The next instant at which something changes by itself.
    pub fn next_event(&self) -> Time {
        let moves = self.contactors.iter().filter_map(|contactor| contactor.moves);
        let push = PUSHES[self.pushes].0;
        let slot = if self.done { Time::MAX } else { self.next_slot };
        let drop = self.drops.map_or(Time::MAX, |at| if self.ready { at } else { at + DROP });
        moves.fold(slot.min(push).min(drop), Time::min)
    }

    /// Lets the plant run.
    pub fn advance(&mut self, to: Time) {
        if to <= self.now {
            return;
        }
        let dt_s = seconds(to - self.now);
        self.now = to;
        if let Err(error) = self.side.advance(&self.gates, self.pulsing, dt_s) {
            self.illegal.get_or_insert(error);
        }
        for (k, motor) in self.side.motors().iter().enumerate() {
            let turns = motor.angle_turns();
            let moved = turns - self.last_turns[k];
            self.turns[k] += moved - moved.round();
            self.last_turns[k] = turns;
        }
    }

    /// Switchgear, and the vehicle's computer once in a slot.
    pub fn act(&mut self, now: Time, chip: &mut Chip) {
        let on = |pin: &str| Self::is_high(place(pin), chip, now);
        for (gate, (pin, was)) in self.lines.iter_mut().enumerate() {
            let on = Self::is_high(*pin, chip, now);
            if std::mem::replace(was, on) != on {
                self.line_edges.push(Edge { at: now, gate, on });
            }
        }
        for (contactor, pin) in self.contactors.iter_mut().zip(self.wiring.contactors) {
            contactor.act(on(pin), now);
        }
        self.side.switch(LinkSwitches {
            precharge: self.contactors[0].closed,
            main: self.contactors[1].closed,
            discharge: on(self.wiring.discharge),
            chopper: self.wiring.chopper.is_some_and(on),
        });
        if let Some(at) = self.drops {
            self.ready = now < at || now >= at + DROP;
            self.drops = self.drops.filter(|at| now < at + DROP);
        }
        self.pulsing = chip.is_pulsing();
        self.select(chip);
        if now >= PUSHES[self.pushes].0 {
            self.pushes += 1;
            let (push, last) = (PUSHES[self.pushes].1, self.pushes + 1 == PUSHES.len());
            let inertia_kg_m2 = self.rotor.inertia_kg_m2;
            for motor in self.side.motors_mut() {
                let rotor = motor.rotor_mut();
                rotor.hold(push, PUSH_RPM_S);
                if last {
                    rotor.release(inertia_kg_m2, 0.0);
                    rotor.set_speed_rpm(0.0);
                }
            }
        }
        for (at, frame) in std::mem::take(&mut self.outbox) {
            self.talk.hear(seconds(at), &frame);
        }
        if now >= self.next_slot && !self.done {
            self.slot(now, chip);
        }
    }

    fn slot(&mut self, now: Time, chip: &mut Chip) {
        self.next_slot = now + SLOT;
        match self.talk.slot(seconds(now)) {
            Ok(turn) => {
                if let Some(frame) = turn.frame {
                    chip.can.hear(frame, now);
                }
                self.babble(now, chip);
                self.side.load(turn.loads_nm);
                self.done = turn.done;
            }
            Err(error) => {
                self.talk.failures.push(format!("{error:#}"));
                self.done = true;
            }
        }
        self.side.row(seconds(now), &self.talk.listener);
    }

    /// The babbling node's frames of a slot.
    fn babble(&self, now: Time, chip: &mut Chip) {
        let Some((frame, apart)) = self.babble else { return };
        let times = (1..=SLOT / apart).map(|number| now + number * apart);
        times.for_each(|at| chip.can.hear(frame, at));
    }

    /// The driver board is selected while its line is low, and begins anew each time.
    fn select(&mut self, chip: &Chip) {
        let (Some((pin, _)), Side::Zs9(side)) = (self.wiring.feedback, &mut self.side) else { return };
        let pin = place(pin);
        let selected = matches!(chip.gpio.driver(pin), Driver::Level(_)) && !written(&chip.gpio, pin);
        if selected && !self.shift.selected {
            let GateFeedback { on, off } = std::mem::take(&mut side.seen);
            // The marks on top: 1010101 and 0101010.
            self.shift.words = [0b1010101 << 9 | on, 0b0101010 << 9 | off];
            self.shift.shifted = 0;
        }
        self.shift.selected = selected;
    }

    /// The next word that the driver board shifts out.
    pub fn shift_word(&mut self) -> u16 {
        let word = self.shift.words.get(self.shift.shifted).copied().unwrap_or(0);
        self.shift.shifted += 1;
        if self.shift.selected { word } else { 0 }
    }

    /// `true` if the driver board's shift register is at the pin.
    pub fn is_feedback(&self, pin: usize, signal: &str) -> bool {
        let wires = self.wiring.feedback.map(|(_, wires)| wires);
        wires.into_iter().flatten().any(|(name, known)| known == signal && place(name) == pin)
    }

    /// The level of a pin that the chip drives; what floats is pulled down.
    fn is_high(pin: usize, chip: &Chip, now: Time) -> bool {
        match chip.gpio.driver(pin) {
            Driver::Level(level) => level,
            Driver::Timer(timer, channel, complementary) => {
                chip.timers[timer].output(channel, complementary, now, chip.rcc.cycle()).unwrap_or(false)
            }
            Driver::Outside | Driver::Analog => false,
        }
    }

    /// Looks at the gates' pins. A device may still conduct within the dead time after its gate went off. Such devices must not short a leg; commanded
    /// ones alone may, only where the inverter is made for it.
    pub fn see_gates(&mut self, now: Time, chip: &Chip, findings: &mut Findings) {
        let dead = Time::from(self.stage.dead_time_ns) * MICROSECOND / 1_000;
        let before = self.gates.clone();
        for (gate, was) in before.iter().copied().enumerate() {
            self.gates[gate] = Self::is_high(self.pins[gate], chip, now);
            if self.gates[gate] != was {
                self.edges.push(Edge { at: now, gate, on: self.gates[gate] });
                if !self.gates[gate] {
                    self.off[gate] = Some(now);
                }
            }
        }
        if self.gates == before {
            return;
        }
        let shorted = matches!(self.side, Side::Zs9(_));
        for gate in (0..self.pins.len()).filter(|gate| self.gates[*gate] && !before[*gate]) {
            let others = self.leg_of[gate].iter().copied().filter(|other| *other != gate);
            let lingers = |other: usize| self.off[other].is_some_and(|off| now < off + dead);
            let conducts = others.clone().all(|other| self.gates[other] || lingers(other));
            let rested = !conducts || (shorted && others.clone().all(|other| self.gates[other]));
            findings.expect(rested, || {
                let name = self.wiring.gates[gate].0;
                format!("gate {name} goes on within the dead time of its leg's other device")
            });
        }
        if let Some(error) = self.illegal.take() {
            findings.add(error);
        }
    }

    /// `true` while any gate is on.
    pub fn any_gate(&self) -> bool {
        self.gates.contains(&true)
    }

    /// `true` while a contactor, the discharge resistor or the chopper is switched on.
    pub fn any_line(&self) -> bool {
        self.lines.iter().any(|(_, on)| *on)
    }

    /// The level that somebody outside gives a pin.
    pub fn level(&self, pin: usize) -> Option<bool> {
        let is = |name: &str| place(name) == pin;
        if self.wiring.ready.into_iter().any(is) {
            return Some(self.ready);
        }
        if is(self.wiring.enable) {
            return Some(true);
        }
        self.wiring.contacts.iter().position(|name| is(name)).map(|index| self.contactors[index].closed)
    }

    /// The voltage at a pin, in V, where something analog is wired to it.
    pub fn voltage(&self, pin: usize) -> Option<f64> {
        let (_, sensor) = self.wiring.sensors.iter().find(|(name, _)| place(name) == pin)?;
        let volts = self.side.volts(*sensor, &self.stage, self.ready);
        let (motor, phase, excess_a) = self.excess_a;
        let besides = if *sensor == Sensor::Current(motor, phase) { excess_a } else { 0.0 };
        Some(volts + self.stage.current_volts(besides) - self.stage.current_volts(0.0))
    }

    /// The tracks of an encoder as they arrive at its timer; `None` where there is none.
    pub fn encoder(&self, timer: &'static str, gpio: &Gpio) -> Option<Tracks> {
        let motor = self.wiring.encoders.iter().position(|wires| wires.timer == timer)?;
        let wires = self.wiring.encoders[motor];
        let turn = i64::from(self.stage.encoder_counts);
        let leads = |name: &str, signal| gpio.leading_to((timer, signal)).any(|pin| pin == place(name));
        let counts = (self.turns[motor] / self.rotor.pole_pairs * turn as f64).floor() as i64;
        let [a, b] = wires.tracks;
        let counts = match (leads(a, "CH1") && leads(b, "CH2"), leads(a, "CH2") && leads(b, "CH1")) {
            _ if self.cut => None,
            (true, _) => Some(counts),
            (_, true) => Some(-counts),
            _ => None,
        };
        Some(Tracks { counts, turn, has_index: leads(wires.index, "ETR") && !self.cut })
    }

    /// `true` if the transceiver is at the pin.
    pub fn is_bus(&self, pin: usize, signal: &str) -> bool {
        BUS.iter().any(|(name, known)| *known == signal && place(name) == pin)
    }

    /// A frame of the drive.
    pub fn heard(&mut self, now: Time, frame: Frame) {
        self.outbox.push((now, frame));
    }
}
