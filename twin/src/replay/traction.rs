//! The PMaSynRM's tasks on the host, and the edges of the halves that they play.

use super::edges::{Scale, Span};
use super::given::Given;
use super::{CORE_HZ, Commands, Tasks, WORDS};
use crate::time::Time;
use crate::world::Edge;
use tractive::control::{Demand, Gains, LinkWindow, Warmth};
use tractive::drive::traction::{ControlTask, Drops, PwmTask, Settings, Shared};
use tractive::frames::{Abc, Angle};
use tractive::machine::{Ratings, Tables};
use tractive::modulation::{CarrierHalf, Mode, SwitchLimits};
use tractive::ports::{ControlPort, DriveCommand, PwmPort, Report, Sample};
use tractive::protection::SafeState;
use tractive::time::{Clock, Instant};

/// Cycles of a tick at most.
const COARSEST: u32 = 8;

/// The time after the first half with pulses begins in which software switches the outputs on.
const SWITCHING_ON: Time = 20 * crate::time::MICROSECOND;

/// The power stage's file.
#[derive(Clone, Debug, serde::Deserialize)]
pub struct Stage {
    control_hz: u32,
    dead_time_ns: u32,
    min_pulse_ns: u32,
    current_range_a: f64,
    dc_link_range_v: f64,
    encoder_counts: u64,
    encoder_zeros_deg: [f64; 1],
    behind_line_filter: bool,
    angle_late_us: f32,
    #[serde(default)]
    current_filter_us: f32,
    #[serde(default)]
    device_threshold_v: f32,
    #[serde(default)]
    device_slope_mohm: f32,
}

impl Stage {
    /// Cycles of a tick of the drive's.
    fn prescaler(&self) -> u32 {
        let period = CORE_HZ / self.control_hz;
        (1..=COARSEST).rev().find(|cycles| period.is_multiple_of(*cycles)).unwrap_or(1)
    }

    fn settings(&self, ratings: &Ratings) -> Settings {
        let ticks_per_s = CORE_HZ / self.prescaler();
        let clock = Clock::new(ticks_per_s, ticks_per_s / self.control_hz);
        let ticks = |ns: u32| {
            let cycles = (u64::from(ns) * u64::from(CORE_HZ)).div_ceil(1_000_000_000) as u32;
            cycles.div_ceil(self.prescaler())
        };
        let (pulse, dead) = (ticks(self.min_pulse_ns), ticks(self.dead_time_ns));
        let devices = SwitchLimits::new(pulse, dead, ratings.max_switching_hz, &clock);
        let gains = Gains::of(false, self.behind_line_filter);
        let angle_late_s = 1e-6 * self.angle_late_us;
        let angle_step_rad = Settings::step_rad(self.encoder_counts as u32, ratings.pole_pairs);
        let current_filter_ticks = (1e-6 * self.current_filter_us * clock.ticks_per_s + 0.5) as u32;
        let drops = Drops { threshold_v: self.device_threshold_v, slope_ohm: 1e-3 * self.device_slope_mohm };
        Settings {
            gains,
            angle_late_s,
            angle_step_rad,
            current_filter_ticks,
            drops,
            ..Settings::new(clock, devices)
        }
    }
}

/// A half, and the instant at which it begins.
#[derive(Clone, Copy, Debug)]
struct Begun {
    /// Ticks since the timers' start.
    begins: u32,
    half: CarrierHalf,
}

/// Both tasks.
pub struct Host {
    control: ControlTask,
    pwm: PwmTask,
    shared: Shared<'static>,
    board: Board,
    tick_cycles: u32,
    /// The halves so far.
    halves: Vec<Begun>,
}

/// The sensors' scales, the encoder, and the commands.
struct Board {
    zeros: [[u32; 3]; 2],
    a_per_code: f32,
    v_per_code: f32,
    units_per_count: u32,
    zero: Angle,
    /// The index has passed in the call before; the angle is known.
    passed: bool,
    known: bool,
    commands: Commands<DriveCommand>,
}

impl Host {
    /// At rest. The zeros are those of control's converter and of the PWM's.
    pub fn new(stage: &Stage, tables: &'static Tables, zeros: &[u32]) -> Self {
        let settings = stage.settings(&tables.ratings);
        let turns = (tables.ratings.pole_pairs as u64) << 32;
        let units_per_count = ((turns + stage.encoder_counts / 2) / stage.encoder_counts) as u32;
        let degrees = stage.encoder_zeros_deg[0] / 360.0 * 2f64.powi(32);
        let zero = |index: usize| zeros.get(index).copied().unwrap_or(0);
        let board = Board {
            zeros: [[zero(0), zero(1), zero(2)], [zero(3), zero(4), zero(5)]],
            a_per_code: stage.current_range_a as f32 / 2_048.0,
            v_per_code: stage.dc_link_range_v as f32 / 4_095.0,
            units_per_count,
            // The middle of a count.
            zero: Angle(degrees.round() as i64 as u32) + Angle(units_per_count / 2),
            passed: false,
            known: false,
            commands: Commands(Vec::new()),
        };
        Self {
            control: ControlTask::new(tables, settings, Instant(settings.clock.control_ticks)),
            pwm: PwmTask::new(tables, settings, Instant(settings.devices.shortest_half_ticks)),
            shared: Shared::new(),
            board,
            tick_cycles: stage.prescaler(),
            halves: Vec::new(),
        }
    }
}

impl Tasks for Host {
    fn command(&mut self, [from, flags, torque, window @ ..]: [u32; WORDS]) {
        let [motoring_none_v, motoring_full_v, braking_full_v, braking_none_v] = window.map(f32::from_bits);
        self.board.commands.add(from, || DriveCommand {
            enable: flags & 1 != 0,
            demand: Demand { torque_nm: f32::from_bits(torque), slew_limited: flags & 2 != 0 },
            window: LinkWindow { motoring_none_v, motoring_full_v, braking_full_v, braking_none_v },
            acknowledge: (flags >> 8) as u8,
            warmth: Warmth::from_word((flags >> 16) as u16),
            calibrate: flags & 4 != 0,
        });
    }

    fn run(&mut self, given: &Given) {
        let Self { control, pwm, shared, board, halves, .. } = self;
        if given.control {
            control.run(&mut ControlSide { given, board, pwm, shared, halves }, shared);
        } else {
            let [_, codes, _] = given.codes;
            play(pwm, shared, halves, board.currents(1, [1, 2, 3].map(|rank| codes[rank])), true);
        }
    }

    /// The edges of each half with pulses: where a leg switches, one device turns off at once, and the other one turns on after the dead time.
    fn spans(&self, scale: &Scale) -> Vec<Span> {
        let tick = scale.cycle * Time::from(self.tick_cycles);
        let mut spans: Vec<Span> = Vec::new();
        let mut levels = None;
        for Begun { begins, half } in &self.halves {
            let at = |ticks: u32| scale.started + Time::from(begins + ticks) * tick;
            if half.mode == Mode::Off {
                levels = None;
                continue;
            }
            let before = levels.unwrap_or_else(|| {
                spans.push(Span { from: at(0) + SWITCHING_ON, until: at(0), edges: Vec::new() });
                half.start_levels
            });
            let Some(span) = spans.last_mut() else { continue };
            span.until = at(half.period_ticks);
            let mut now = before;
            for (phase, now) in now.iter_mut().enumerate() {
                let (start, ticks) = (half.start_levels[phase], half.compare_ticks[phase]);
                let turn = (ticks < half.period_ticks).then_some((!start, ticks));
                for (level, ticks) in [(start, 0)].into_iter().chain(turn) {
                    if std::mem::replace(now, level) == level {
                        continue;
                    }
                    let [on, off] = [usize::from(!level), usize::from(level)].map(|lower| 2 * phase + lower);
                    span.edges.push(Edge { at: at(ticks), gate: off, on: false });
                    span.edges.push(Edge { at: at(ticks) + scale.dead, gate: on, on: true });
                }
            }
            levels = Some(now);
        }
        spans
    }

    fn tick_cycles(&self) -> u32 {
        self.tick_cycles
    }
}

/// The PWM's task, at a boundary or for a revision.
fn play(pwm: &mut PwmTask, shared: &Shared, halves: &mut Vec<Begun>, currents_a: Abc, boundary: bool) {
    let mut side = PwmSide { boundary, currents_a, played: None };
    pwm.run(&mut side, shared);
    let Some(half) = side.played else { return };
    if !boundary {
        halves.pop();
    }
    halves.push(Begun { begins: pwm.next_call().0, half });
}

impl Board {
    fn currents(&self, converter: usize, codes: [u32; 3]) -> Abc {
        let current = |phase: usize| {
            (codes[phase] as i32 - self.zeros[converter][phase] as i32) as f32 * self.a_per_code
        };
        Abc { a: current(0), b: current(1), c: current(2) }
    }

    fn angle(&mut self, given: &Given) -> Option<Angle> {
        let [encoder, _] = given.encoders;
        let passed = std::mem::replace(&mut self.passed, encoder.index);
        self.known |= passed;
        self.known.then(|| Angle(encoder.count.wrapping_mul(self.units_per_count)) + self.zero)
    }
}

struct ControlSide<'a> {
    given: &'a Given,
    board: &'a mut Board,
    pwm: &'a mut PwmTask,
    shared: &'a Shared<'static>,
    halves: &'a mut Vec<Begun>,
}

impl ControlPort for ControlSide<'_> {
    fn begin(&mut self, _revises: bool) {
        if self.given.revised {
            play(self.pwm, self.shared, self.halves, Abc::default(), false);
        }
    }

    fn sample(&mut self, _now: Instant) -> Sample {
        let [[u, v, w, link], ..] = self.given.codes;
        Sample {
            currents_a: self.board.currents(0, [u, v, w]),
            udc_v: link as f32 * self.board.v_per_code,
            angle: self.board.angle(self.given),
            may_pulse: true,
            hardware: None,
        }
    }

    fn command(&mut self, now: Instant, _operator: impl FnOnce() -> DriveCommand) -> DriveCommand {
        self.board.commands.at(now)
    }

    fn enter(&mut self, _safe: SafeState, _now: Instant) {}

    fn overrun_ticks(&mut self, _now: Instant, _deadline_ticks: u32) -> u32 {
        0
    }

    fn report(&mut self, _now: Instant, _report: impl FnOnce() -> Report) {}
}

struct PwmSide {
    boundary: bool,
    currents_a: Abc,
    played: Option<CarrierHalf>,
}

impl PwmPort for PwmSide {
    fn begin(&mut self) -> bool {
        self.boundary
    }

    fn sample(&mut self, _now: Instant) -> Abc {
        self.currents_a
    }

    fn play(&mut self, _now: Instant, next: &CarrierHalf) {
        self.played = Some(*next);
    }

    fn enter(&mut self, _safe: SafeState, _now: Instant) {}

    fn leave(&mut self, _now: Instant) -> bool {
        true
    }
}
