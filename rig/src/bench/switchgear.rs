//! Contactors with their delays, and the operator's slots: the requests to it, and its answers.

use super::Tick;
use std::collections::VecDeque;
use tractive::frames::Abc;
use tractive::operator::{Configuration, Feedback, Status};
use tractive::protection::Fault;
use tractive::thermal::Ratios;
use tractive::time::Clock;

/// Time in which a contactor closes, and opens, in s.
const CLOSES_S: f64 = 0.04;
const OPENS_S: f64 = 0.02;

/// A contactor: its command and its position.
#[derive(Clone, Copy, Debug, Default)]
struct Contactor {
    told: bool,
    closed: bool,
    moves: Option<Tick>,
}

impl Contactor {
    fn tell(&mut self, told: bool, now: Tick, tick_s: f64) {
        if told != self.told {
            self.told = told;
            let takes_s = if told { CLOSES_S } else { OPENS_S };
            self.moves = (told != self.closed).then(|| now + (takes_s / tick_s).round() as Tick);
        }
    }

    fn act(&mut self, now: Tick) {
        if self.moves.is_some_and(|at| at <= now) {
            (self.closed, self.moves) = (self.told, None);
        }
    }
}

/// The rest of the board's feedback.
pub struct Held {
    /// The cause that holds the gates off in hardware.
    pub hardware: Option<Fault>,
    /// `true` if the rotor's angle is known.
    pub position_known: bool,
    /// The temperature sensors' voltages.
    pub temperatures: Ratios,
}

/// Contactors and slots; `A` is what is asked in addition to the board's feedback, `T` what is reported about the demands.
pub struct Switchgear<A, T> {
    tick_s: f64,
    main: Contactor,
    precharge: Contactor,
    /// The operator's status, and the time from which on it holds.
    told: VecDeque<(Tick, Status<T>)>,
    /// The request that the operator will see, by the slot's beginning.
    asked: VecDeque<(Tick, A, Feedback)>,
    samples: u32,
    /// Samples in a slot.
    slot_samples: u32,
}

impl<A, T: Copy> Switchgear<A, T> {
    /// At tick 0, everything open.
    pub fn new(clock: &Clock) -> Self {
        Self {
            tick_s: f64::from(clock.ticks_per_s).recip(),
            main: Contactor::default(),
            precharge: Contactor::default(),
            told: VecDeque::new(),
            asked: VecDeque::new(),
            samples: 0,
            slot_samples: clock.millisecond_periods(),
        }
    }

    /// `true` while the precharge relay is closed.
    pub fn precharge_closed(&self) -> bool {
        self.precharge.closed
    }

    /// `true` while the main contactor is closed.
    pub fn main_closed(&self) -> bool {
        self.main.closed
    }

    /// A control sample at `now`, with what the board sees apart from contactors: the first one of every millisecond begins a slot, with this
    /// request. Returns whether the operator has fallen behind.
    pub fn sampled(
        &mut self,
        now: Tick,
        Held { hardware, position_known, temperatures }: Held,
        ask: impl FnOnce() -> A,
    ) -> bool {
        let begins = self.samples.is_multiple_of(self.slot_samples);
        self.samples = self.samples.wrapping_add(1);
        if begins {
            let feedback = Feedback {
                precharge_closed: self.precharge.closed,
                main_closed: self.main.closed,
                driver_ready: hardware != Some(Fault::GateDriver),
                enable_input: true,
                sensor_alive: true,
                position_known,
                position_counted: !position_known,
                offsets_a: Abc::default(),
                configuration: Configuration::Good,
                parameters_open: false,
                hardware,
                temperatures,
            };
            self.asked.push_back((now, ask(), feedback));
        }
        self.asked.len() > 2
    }

    /// The request in the slot that began at `tick`, and the board's feedback.
    pub fn ask(&mut self, tick: Tick) -> Option<(A, Feedback)> {
        while let Some((at, request, feedback)) = self.asked.pop_front() {
            if at == tick {
                return Some((request, feedback));
            }
        }
        None
    }

    /// Takes the operator's status; it holds from `from` on.
    pub fn tell(&mut self, from: Tick, status: Status<T>) {
        self.told.push_back((from, status));
    }

    /// The next instant at which something changes.
    pub fn next_event(&self) -> Option<Tick> {
        let told = self.told.front().map(|(at, _)| *at);
        [told, self.main.moves, self.precharge.moves].into_iter().flatten().min()
    }

    /// Does what is due at `now`; returns the operator's status if it takes effect here.
    pub fn act(&mut self, now: Tick) -> Option<Status<T>> {
        let mut newest = None;
        while let Some((at, status)) = self.told.front().copied()
            && at <= now
        {
            self.told.pop_front();
            self.precharge.tell(status.switches.precharge, now, self.tick_s);
            self.main.tell(status.switches.main, now, self.tick_s);
            newest = Some(status);
        }
        self.main.act(now);
        self.precharge.act(now);
        newest
    }
}
