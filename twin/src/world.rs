//! The wires at the board: power stage, motor, encoder, contactors, bus. By the guide's wiring and the power stage's file, not by the
//! board's code.

use crate::chip::Chip;
use crate::chip::gpio::{Driver, Gpio, place};
use crate::chip::timer::Tracks;
use crate::finding::Findings;
use crate::stage::PowerStage;
use crate::time::{MICROSECOND, MILLISECOND, Time, seconds};
use tractive::protocol::Frame;
use tractive_rig::plant::{DcLink, Leg, Plant};
use tractive_rig::run::Supervisor;
use tractive_rig::talk::Talk;

/// The gates' pins: upper and lower device of U, V, W.
const GATES: [&str; 6] = ["PA8", "PB13", "PA10", "PB15", "PC6", "PC10"];
/// Precharge relay, main contactor, discharge resistor, and the chopper.
const PRECHARGE: &str = "PC8";
const MAIN: &str = "PC9";
const DISCHARGE: &str = "PC11";
const CHOPPER: &str = "PB9";
/// The currents' pins, two each, and the link voltage's.
const CURRENTS: [(&str, usize); 6] =
    [("PA1", 0), ("PA7", 0), ("PC1", 1), ("PB0", 1), ("PB11", 2), ("PB14", 2)];
const LINK: &str = "PC0";
/// The encoder's tracks and index.
const TRACKS: [&str; 2] = ["PB6", "PB7"];
const INDEX: &str = "PB3";
/// Inputs: drivers ready (two pins of one wire), enable, auxiliary contacts.
const READY: [&str; 2] = ["PB12", "PA6"];
const ENABLE: &str = "PC2";
const CONTACTS: [&str; 2] = ["PC4", "PC5"];
/// The bus transceiver's pins.
const BUS: [(&str, &str); 2] = [("PA11", "RX"), ("PA12", "TX")];

/// The times in which a contactor closes and opens.
const CLOSES: Time = 40 * MILLISECOND;
const OPENS: Time = 20 * MILLISECOND;
/// The rotor is pushed a little forwards, then back over its index while the board counts already, and let go of: until when, and at what
/// speed in r/min.
const PUSHES: [(Time, f64); 3] = [(60 * MILLISECOND, 10.0), (150 * MILLISECOND, -10.0), (Time::MAX, 0.0)];
const PUSH_RPM_S: f64 = 1e6;
/// The step of the trace.
const SLOT: Time = MILLISECOND;

/// A gate's edge: instant, device (upper and lower of U, V, W in turn), on or off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Edge {
    /// The instant.
    pub at: Time,
    /// The device.
    pub gate: usize,
    /// `true` if it goes on.
    pub on: bool,
}

/// A row of the trace.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Row {
    /// Time since the reset, in s.
    pub t_s: f64,
    /// Speed, in r/min.
    pub speed_rpm: f64,
    /// Air-gap torque, in N·m.
    pub te_nm: f64,
    /// Current, d, in A.
    pub id_a: f64,
    /// Current, q, in A.
    pub iq_a: f64,
    /// Phase current a, in A.
    pub ia_a: f64,
    /// Phase current b, in A.
    pub ib_a: f64,
    /// Phase current c, in A.
    pub ic_a: f64,
    /// Link voltage, in V.
    pub udc_v: f64,
    /// State as told.
    pub state: String,
    /// Mode as told.
    pub mode: String,
    /// Fault as told.
    pub fault: String,
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

/// The world.
pub struct World {
    /// The machine.
    pub plant: Plant,
    /// The link.
    pub link: DcLink,
    /// The vehicle's computer.
    pub talk: Talk,
    /// Every edge of a gate.
    pub edges: Vec<Edge>,
    /// The trace.
    pub rows: Vec<Row>,
    /// The drivers are ready.
    pub ready: bool,
    /// Current that flows in phase U besides, in A: past the motor, as to earth.
    pub excess_a: f64,
    /// The talk is over.
    pub done: bool,
    stage: PowerStage,
    rotor: Rotor,
    now: Time,
    pushes: usize,
    contactors: [Contactor; 2],
    gates: [bool; 6],
    /// The instants at which they last went off.
    off: [Option<Time>; 6],
    turns: f64,
    last_turns: f64,
    next_slot: Time,
    outbox: Vec<(Time, Frame)>,
    pins: [usize; 6],
}

impl World {
    /// At rest.
    pub fn new(plant: Plant, link: DcLink, talk: Talk, stage: PowerStage, rotor: Rotor) -> Self {
        let mut plant = plant;
        plant.motor.rotor_mut().hold(PUSHES[0].1, PUSH_RPM_S);
        Self {
            plant,
            link,
            talk,
            edges: Vec::new(),
            rows: Vec::new(),
            ready: true,
            done: false,
            stage,
            rotor,
            now: 0,
            pushes: 0,
            contactors: [Contactor::default(); 2],
            gates: [false; 6],
            off: [None; 6],
            excess_a: 0.0,
            turns: 0.0,
            last_turns: 0.0,
            next_slot: 0,
            outbox: Vec::new(),
            pins: GATES.map(place),
        }
    }

    /// The next instant at which something changes by itself.
    pub fn next_event(&self) -> Time {
        let moves = self.contactors.iter().filter_map(|contactor| contactor.moves);
        let push = PUSHES[self.pushes].0;
        let slot = if self.done { Time::MAX } else { self.next_slot };
        moves.fold(slot.min(push), Time::min)
    }

    fn legs(&self) -> [Leg; 3] {
        [0, 2, 4].map(|upper| match (self.gates[upper], self.gates[upper + 1]) {
            (true, _) => Leg::Upper,
            (_, true) => Leg::Lower,
            _ => Leg::Open,
        })
    }

    /// Lets the plant run.
    pub fn advance(&mut self, to: Time) {
        if to <= self.now {
            return;
        }
        let dt_s = seconds(to - self.now);
        self.now = to;
        let legs = self.legs();
        self.plant.advance_on(&mut self.link, legs, dt_s);
        let turns = self.plant.motor.angle_turns();
        let moved = turns - self.last_turns;
        self.turns += moved - moved.round();
        self.last_turns = turns;
    }

    /// Switchgear, and the vehicle's computer once in a slot.
    pub fn act(&mut self, now: Time, chip: &mut Chip) {
        let on = |pin: &str| Self::is_high(place(pin), chip, now);
        self.contactors[0].act(on(PRECHARGE), now);
        self.contactors[1].act(on(MAIN), now);
        let switches = &mut self.link.switches;
        (switches.precharge, switches.main) = (self.contactors[0].closed, self.contactors[1].closed);
        (switches.discharge, switches.chopper) = (on(DISCHARGE), on(CHOPPER));
        if now >= PUSHES[self.pushes].0 {
            self.pushes += 1;
            let rotor = self.plant.motor.rotor_mut();
            rotor.hold(PUSHES[self.pushes].1, PUSH_RPM_S);
            if self.pushes + 1 == PUSHES.len() {
                rotor.release(self.rotor.inertia_kg_m2, 0.0);
                rotor.set_speed_rpm(0.0);
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
                self.plant.motor.set_load_nm(turn.loads_nm[0]);
                self.done = turn.done;
            }
            Err(error) => {
                self.talk.failures.push(format!("{error:#}"));
                self.done = true;
            }
        }
        let motor = &self.plant.motor;
        let ((id_a, iq_a), [ia_a, ib_a, ic_a]) = (motor.currents_dq(), motor.currents_abc());
        let say = |column: &str| self.talk.listener.value(column);
        self.rows.push(Row {
            t_s: seconds(now),
            speed_rpm: motor.speed_rpm(),
            te_nm: motor.torque_nm(),
            id_a,
            iq_a,
            ia_a,
            ib_a,
            ic_a,
            udc_v: self.link.udc_v,
            state: say("state"),
            mode: say("mode"),
            fault: say("fault"),
        });
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

    /// Looks at the gates' pins: no leg has both devices on, nor one on before the other has been off for the dead time.
    pub fn see_gates(&mut self, now: Time, chip: &Chip, findings: &mut Findings) {
        let dead = Time::from(self.stage.dead_time_ns) * MICROSECOND / 1_000;
        for (gate, name) in GATES.iter().enumerate() {
            let on = Self::is_high(self.pins[gate], chip, now);
            if on == self.gates[gate] {
                continue;
            }
            self.gates[gate] = on;
            self.edges.push(Edge { at: now, gate, on });
            if on {
                let other = gate ^ 1;
                let rested = !self.gates[other] && self.off[other].is_none_or(|off| now >= off + dead);
                findings.expect(rested, || {
                    format!("gate {name} goes on within the dead time of its leg's other device")
                });
            } else {
                self.off[gate] = Some(now);
            }
        }
    }

    /// `true` while any gate is on.
    pub fn any_gate(&self) -> bool {
        self.gates.contains(&true)
    }

    /// The level that somebody outside gives a pin.
    pub fn level(&self, pin: usize) -> Option<bool> {
        let is = |name: &str| place(name) == pin;
        if READY.into_iter().any(is) {
            return Some(self.ready);
        }
        if is(ENABLE) {
            return Some(true);
        }
        CONTACTS.iter().position(|name| is(name)).map(|index| self.contactors[index].closed)
    }

    /// The voltage at a pin, in V, where something analog is wired to it.
    pub fn voltage(&self, pin: usize) -> Option<f64> {
        if pin == place(LINK) {
            return Some(self.stage.link_volts(self.link.udc_v));
        }
        let (_, phase) = CURRENTS.iter().find(|(name, _)| place(name) == pin)?;
        let excess_a = if *phase == 0 { self.excess_a } else { 0.0 };
        Some(self.stage.current_volts(self.plant.motor.currents_abc()[*phase] + excess_a))
    }

    /// The encoder's tracks as they arrive at its timer.
    pub fn encoder(&self, gpio: &Gpio) -> Tracks {
        let turn = i64::from(self.stage.encoder_counts);
        let leads = |name: &str, signal| gpio.leading_to(("TIM4", signal)).any(|pin| pin == place(name));
        let counts = (self.turns / self.rotor.pole_pairs * turn as f64).floor() as i64;
        let counts = match (
            leads(TRACKS[0], "CH1") && leads(TRACKS[1], "CH2"),
            leads(TRACKS[0], "CH2") && leads(TRACKS[1], "CH1"),
        ) {
            (true, _) => Some(counts),
            (_, true) => Some(-counts),
            _ => None,
        };
        Tracks { counts, turn, has_index: leads(INDEX, "ETR") }
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
