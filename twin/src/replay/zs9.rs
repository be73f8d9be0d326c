//! The ZS9's tasks on the host, and the edges of the carrier periods that they play.

use super::edges::{Scale, Span};
use super::given::{Encoder, Given};
use super::{CORE_HZ, Commands, Tasks, WORDS};
use crate::time::Time;
use crate::world::Edge;
use tractive::control::Demand;
use tractive::drive::dual::{COMPARE_STEPS, ControlTask, PwmTask, Settings, Shared};
use tractive::frames::{Abc, Angle};
use tractive::machine::Tables;
use tractive::nine_switch::{GateTicks, Scheme};
use tractive::ports::{
    ControlPort, Dual, DualDriveCommand, DualReport, DualSample, GateFeedback, MotorDemand, PlayedPeriod,
    PowerSample, PwmPort,
};
use tractive::protection::SafeState;
use tractive::time::{Clock, Instant};

/// Cycles of a tick of the drive's; control interrupts, and as many carrier periods, in a second.
const TICK_CYCLES: u32 = 5;
const CONTROL_HZ: u32 = 10_000;
/// Cycles of a carrier's half.
const HALF: u32 = CORE_HZ / CONTROL_HZ / 2;
/// The marks on top of the words of the gates' feedback, and the gates' bits below.
const MARKS: [u32; 2] = [0b1010101 << 9, 0b0101010 << 9];
const GATES: u32 = 0x1FF;

/// The power stage's file.
#[derive(Clone, Debug, serde::Deserialize)]
pub struct Stage {
    current_range_a: f64,
    dc_link_range_v: f64,
    encoder_counts: u64,
    encoder_zeros_deg: [f64; 2],
    behind_line_filter: bool,
    z_source: ZSource,
}

/// Its part that only the ZS9 has.
#[derive(Clone, Copy, Debug, serde::Deserialize)]
struct ZSource {
    inductor_range_a: f64,
    source_range_v: f64,
    link_ref_v: f64,
}

/// Both tasks.
pub struct Host {
    control: ControlTask,
    pwm: PwmTask,
    shared: Shared<'static>,
    board: Board,
    /// The carrier periods so far, each with the ticks from the timers' start to its beginning.
    periods: Vec<(u32, PlayedPeriod)>,
}

/// The sensors' scales, the encoders, and the commands.
struct Board {
    /// Both motors' phases, then the inductor.
    zeros: [u32; 7],
    a_per_code: f32,
    inductor_a_per_code: f32,
    capacitor_v_per_code: f32,
    source_v_per_code: f32,
    link_ref_v: f32,
    units_per_count: u32,
    encoders: [Rotor; 2],
    commands: Commands<DualDriveCommand>,
}

/// An encoder's state.
#[derive(Clone, Copy, Debug)]
struct Rotor {
    zero: Angle,
    /// The index has passed in the call before; the angle is known.
    passed: bool,
    known: bool,
}

impl Rotor {
    fn angle(&mut self, read: Encoder, units_per_count: u32) -> Option<Angle> {
        let passed = std::mem::replace(&mut self.passed, read.index);
        self.known |= passed;
        self.known.then(|| Angle(read.count.wrapping_mul(units_per_count)) + self.zero)
    }
}

impl Host {
    /// At rest. The zeros are those of both motors' phases, then the inductor's.
    pub fn new(stage: &Stage, tables: &'static Tables, zeros: &[u32]) -> Self {
        let ticks_per_s = CORE_HZ / TICK_CYCLES;
        let clock = Clock::new(ticks_per_s, ticks_per_s / CONTROL_HZ);
        let settings = Settings::new(clock, clock.control_ticks, tables)
            .behind_line_filter(stage.behind_line_filter, tables);
        let turns = (tables.ratings.pole_pairs as u64) << 32;
        let units_per_count = ((turns + stage.encoder_counts / 2) / stage.encoder_counts) as u32;
        let rotor = |degrees: f64| {
            let zero = Angle((degrees / 360.0 * 2f64.powi(32)).round() as i64 as u32);
            // The middle of a count.
            Rotor { zero: zero + Angle(units_per_count / 2), passed: false, known: false }
        };
        let board = Board {
            zeros: std::array::from_fn(|index| zeros.get(index).copied().unwrap_or(0)),
            a_per_code: stage.current_range_a as f32 / 2_048.0,
            inductor_a_per_code: stage.z_source.inductor_range_a as f32 / 2_048.0,
            capacitor_v_per_code: stage.dc_link_range_v as f32 / 4_095.0,
            source_v_per_code: stage.z_source.source_range_v as f32 / 4_095.0,
            link_ref_v: stage.z_source.link_ref_v as f32,
            units_per_count,
            encoders: stage.encoder_zeros_deg.map(rotor),
            commands: Commands(Vec::new()),
        };
        Self {
            control: ControlTask::new(tables, settings),
            pwm: PwmTask::new(tables, settings),
            shared: Shared::new(),
            board,
            periods: Vec::new(),
        }
    }
}

impl Tasks for Host {
    fn command(&mut self, [from, flags, demand1, demand2, most1, most2, link]: [u32; WORDS]) {
        let demand = |bit: u32, word: u32| match flags & bit {
            0 => MotorDemand::Torque(Demand { torque_nm: f32::from_bits(word), slew_limited: true }),
            _ => MotorDemand::Speed(f32::from_bits(word)),
        };
        self.board.commands.add(from, || DualDriveCommand {
            enable: flags & 1 != 0,
            demands: [demand(2, demand1), demand(4, demand2)],
            speed_torque_nm: [most1, most2].map(f32::from_bits),
            link_ref_v: f32::from_bits(link),
            scheme: Scheme::from_code(flags >> 16),
            acknowledge: (flags >> 8) as u8,
            calibrate: flags & 8 != 0,
        });
    }

    fn run(&mut self, given: &Given) {
        let Self { control, pwm, shared, board, periods } = self;
        if given.control {
            control.run(&mut ControlSide { given, board }, shared);
            return;
        }
        let mut side = PwmSide { sample: board.power(given), played: None };
        pwm.run(&mut side, shared);
        if let Some(period) = side.played {
            // The next peak is half a period behind the one that is made here.
            let begins = pwm.next_call().0.wrapping_sub(HALF / TICK_CYCLES);
            periods.push((begins, period));
        }
    }

    /// A device turns off at once; it turns on after the dead time, and not at all if it is to turn off by then.
    fn spans(&self, scale: &Scale) -> Vec<Span> {
        let Some((first, _)) = self.periods.first() else { return Vec::new() };
        let at = |ticks: u32, cycles: u32| {
            scale.started + (Time::from(ticks) * Time::from(TICK_CYCLES) + Time::from(cycles)) * scale.cycle
        };
        let dead = (scale.dead / scale.cycle.max(1)) as u32;
        let mut pulses = [Pulse::new(at(*first, 0)); 9];
        let mut span = Span { from: at(*first, 0), until: at(*first, 0), edges: Vec::new() };
        for (begins, period) in &self.periods {
            for leg in 0..3 {
                let gates = [leg, leg + 3, leg + 6];
                let pauses = pauses(gates.map(|gate| &period.gates[gate]), dead);
                for (gate, (from, to)) in gates.into_iter().zip(pauses) {
                    let both = [(from, to), (2 * HALF - to, 2 * HALF - from)];
                    for (from, to) in both.into_iter().filter(|(from, to)| from < to) {
                        let pulse = pulses[gate].pause(at(*begins, from), at(*begins, to));
                        let edges = pulse.into_iter().flat_map(|pulse| pulse.edges(gate, scale.dead));
                        span.edges.extend(edges);
                    }
                }
            }
            span.until = at(*begins, 2 * HALF);
        }
        for (gate, pulse) in pulses.iter_mut().enumerate() {
            let last = pulse.pause(span.until, span.until);
            span.edges.extend(last.into_iter().flat_map(|pulse| pulse.edges(gate, scale.dead)));
        }
        vec![span]
    }

    /// The compares are whole cycles.
    fn tick_cycles(&self) -> u32 {
        1
    }
}

/// A gate's pulse: on from an instant, off at another.
#[derive(Clone, Copy, Debug)]
struct Pulse {
    on: Time,
    off: Time,
}

impl Pulse {
    /// None yet, from an instant on.
    fn new(at: Time) -> Self {
        Self { on: at, off: at }
    }

    /// The next pause of the gate; gives the pulse before it, if there is one.
    fn pause(&mut self, from: Time, to: Time) -> Option<Self> {
        let pulse = Self { on: self.on, off: from };
        self.on = to;
        (pulse.on < pulse.off).then_some(pulse)
    }

    fn edges(self, gate: usize, dead: Time) -> impl Iterator<Item = Edge> {
        let is_one = self.on + dead < self.off;
        let edges = [Edge { at: self.on + dead, gate, on: true }, Edge { at: self.off, gate, on: false }];
        edges.into_iter().filter(move |_| is_one)
    }
}

/// The pauses of a leg's devices H, M and L in the rising half, in cycles from its beginning: to the nearest cycle, one at least. A shoot-through
/// section that the dead time would take up completely is left out.
fn pauses([high, middle, low]: [&GateTicks; 3], dead: u32) -> [(u32, u32); 3] {
    let nearest = |steps: u32| ((steps * TICK_CYCLES + COMPARE_STEPS / 2) / COMPARE_STEPS).min(HALF);
    let is_pause = |gate: &GateTicks| gate.off_from < gate.off_to;
    let (mut from, mut to) = (nearest(middle.off_from), nearest(middle.off_to));
    let mut high_from = if is_pause(high) { nearest(high.off_from) } else { HALF };
    let mut low_to = if is_pause(low) { nearest(low.off_to) } else { 0 };
    if is_pause(high) && high_from == HALF {
        high_from = HALF - 1;
        to = to.min(high_from);
    }
    if is_pause(low) && low_to == 0 {
        low_to = 1;
        from = from.max(low_to);
    }
    if is_pause(middle) && from >= to {
        from = from.min(HALF - 1);
        to = from + 1;
        (low_to, high_from) = (low_to.min(from), high_from.max(to));
    }
    let is_short = |from: u32, to: u32| from < to && to - from <= dead;
    if from >= to {
        if is_short(low_to, high_from) {
            high_from = low_to;
        }
    } else {
        if is_short(to, high_from) {
            to = high_from;
        }
        if is_short(low_to, from) {
            from = low_to;
        }
    }
    [(high_from, HALF), (from, to), (0, low_to)]
}

impl Board {
    fn current(&self, code: u32, zero: usize) -> f32 {
        (code as i32 - self.zeros[zero] as i32) as f32 * self.a_per_code
    }

    fn power(&self, given: &Given) -> PowerSample {
        let [[u1, v1, u2, v2], [w1, w2, capacitor, source], _] = given.codes;
        let abc = |[a, b, c]: [u32; 3], first: usize| Abc {
            a: self.current(a, first),
            b: self.current(b, first + 1),
            c: self.current(c, first + 2),
        };
        let (words, read) = given.feedback;
        let marked = read == 2 && words.iter().zip(MARKS).all(|(word, mark)| word & !GATES == mark);
        let seen = |word: u32| (word & GATES) as u16;
        let gates = GateFeedback { on: seen(words[0]), off: seen(words[1]) };
        PowerSample {
            currents_a: [abc([u1, v1, w1], 0), abc([u2, v2, w2], 3)],
            capacitor_v: capacitor as f32 * self.capacitor_v_per_code,
            source_v: source as f32 * self.source_v_per_code,
            gates: if marked { gates } else { GateFeedback::default() },
        }
    }
}

struct ControlSide<'a> {
    given: &'a Given,
    board: &'a mut Board,
}

impl ControlPort<Dual> for ControlSide<'_> {
    fn sample(&mut self, _now: Instant) -> DualSample {
        let Self { given, board } = self;
        let power = board.power(given);
        let inductor = given.codes[2][0] as i32 - board.zeros[6] as i32;
        let units = board.units_per_count;
        let [first, second] = &mut board.encoders;
        DualSample {
            currents_a: power.currents_a,
            angles: [first.angle(given.encoders[0], units), second.angle(given.encoders[1], units)],
            capacitor_v: power.capacitor_v,
            inductor_a: inductor as f32 * board.inductor_a_per_code,
            source_v: power.source_v,
            may_pulse: true,
            hardware: None,
        }
    }

    fn command(&mut self, now: Instant, _operator: impl FnOnce() -> DualDriveCommand) -> DualDriveCommand {
        self.board.commands.at(now).with_link(self.board.link_ref_v)
    }

    fn enter(&mut self, _safe: SafeState, _now: Instant) {}

    fn overrun_ticks(&mut self, _now: Instant, _deadline_ticks: u32) -> u32 {
        0
    }

    fn report(&mut self, _now: Instant, _report: impl FnOnce() -> DualReport) {}
}

struct PwmSide {
    sample: PowerSample,
    played: Option<PlayedPeriod>,
}

impl PwmPort<Dual> for PwmSide {
    fn sample(&mut self, _now: Instant) -> PowerSample {
        self.sample
    }

    fn play(&mut self, _now: Instant, next: &PlayedPeriod) {
        self.played = Some(*next);
    }

    fn enter(&mut self, _safe: SafeState, _now: Instant) {}

    fn leave(&mut self, _now: Instant) -> bool {
        true
    }
}
