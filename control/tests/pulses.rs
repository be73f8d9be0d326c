//! Every pulse of the modulator over random walks of its reference, and what it tells control of its modes, pinned bit for bit in `tests/pinned/`, as those of
//! the drive are: `TRACTIVE_PINNED=write` writes the files anew. With `--features optimal` the optimised patterns, too.

#[path = "../../tests/pinned/file.rs"]
mod file;

use file::{BASIS, hash, holds};
use std::fmt::Write;
use tractive_control::frames::Angle;
use tractive_control::modulation::{
    CarrierHalf, Ladder, Mode, Modulator, Reference, Schedule, SwitchLimits, index_limit, ripple_at,
    ripple_share,
};
use tractive_control::time::{Clock, Instant};

const CLOCK: Clock = Clock::new(25_000_000, 2_500);
const DEVICES: SwitchLimits = SwitchLimits::new(250, 0, 900.0, &CLOCK);
const HALVES: u32 = 48_000;

/// Random numbers, the same on every machine.
struct Random(u64);

impl Random {
    fn within(&mut self, low: f32, high: f32) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (self.0 >> 40) as f32 / (1 << 24) as f32 * (high - low)
    }

    fn is(&mut self, share: f32) -> bool {
        self.within(0.0, 1.0) < share
    }
}

/// A machine whose voltage grows with its frequency, and what is wanted of it.
struct Walk {
    random: Random,
    hz: f32,
    wanted_hz: f32,
    index: f32,
    index_off: f32,
    udc_v: f32,
    angle: Angle,
    /// By how much the carrier's angle has jumped.
    jumped: Angle,
    now: Instant,
}

impl Walk {
    fn new(seed: u64) -> Self {
        let (angle, jumped) = (Angle::ZERO, Angle::ZERO);
        Self {
            random: Random(seed),
            hz: 0.0,
            wanted_hz: 90.0,
            index: 0.0,
            index_off: 0.0,
            udc_v: 1_500.0,
            angle,
            jumped,
            now: Instant(0),
        }
    }

    fn pass(&mut self, ticks: u32) {
        let random = &mut self.random;
        if random.is(0.003) {
            self.wanted_hz = random.within(-1.0, 1.0).signum() * random.within(0.0, 300.0);
        }
        if random.is(0.01) {
            self.index_off = random.within(-0.25, 0.3);
        }
        if random.is(0.005) {
            self.jumped = Angle::from_turns(random.within(-0.05, 0.05));
        }
        let most_hz = 400.0 * ticks as f32 / 25e6;
        self.hz += (self.wanted_hz - self.hz).clamp(-most_hz, most_hz);
        self.index += ((self.hz.abs() / 130.0).min(0.98) + self.index_off - self.index) * 0.05;
        self.udc_v = (self.udc_v + random.within(-3.0, 3.0)).clamp(1_200.0, 1_800.0);
        self.angle = self.angle + Angle::from_turns(self.hz * ticks as f32 / 25e6);
        self.now = self.now.after(ticks);
    }

    /// The command that was made up to a control period ago, and regulates by a little.
    fn reference(&mut self) -> Reference {
        let (rate, index) = (CLOCK.angle_rate(self.hz * std::f32::consts::TAU), self.index.clamp(0.0, 1.02));
        let ago = self.random.within(0.0, 2_500.0) as u32;
        let at = Instant(self.now.0.wrapping_sub(ago));
        let voltage_v = index * self.udc_v * std::f32::consts::FRAC_2_PI;
        let angle = self.angle - Angle::from_turns(self.hz * ago as f32 / 25e6);
        let regulated = Angle::from_turns(self.random.within(-0.01, 0.01));
        let made = Reference::turning(
            voltage_v * self.random.within(0.97, 1.02),
            angle + regulated,
            rate,
            at,
            self.udc_v,
        );
        Reference { voltage_v, carrier_angle: angle + self.jumped, modulation_index: index, ..made }
    }
}

fn pin(sum: u64, half: &CarrierHalf) -> u64 {
    hash(sum, format!("{half:?}").as_bytes())
}

/// The halves of a schedule on a walk: a line each eighth, with the hash until then. Returns the modes that came by.
fn walk(name: &str, schedule: Schedule, seed: u64, halves: u32, out: &mut String) -> Vec<Mode> {
    let mut modulator = Modulator::new(DEVICES, schedule);
    let (mut walk, mut sum, mut modes) = (Walk::new(seed), BASIS, Vec::new());
    let mut resting = 0;
    for number in 1..=halves {
        if resting == 0 && walk.random.is(0.001) {
            resting = walk.random.within(1.0, 60.0) as u32;
        }
        let reference = walk.reference();
        let half = match resting {
            0 => modulator.step(walk.now, Some(&reference)),
            1 => modulator.rest(walk.now, Some(&Reference { voltage_v: 0.0, ..reference })),
            _ => modulator.step(walk.now, None),
        };
        resting = resting.saturating_sub(1);
        sum = pin(sum, &half);
        sum = hash(sum, &[modulator.is_mirrored().into()]);
        if half.is_free() && half.mode == Mode::Async {
            let newer = walk.reference();
            sum = pin(sum, &modulator.revised(&half, walk.now, &newer));
        }
        if !modes.contains(&half.mode) {
            modes.push(half.mode);
        }
        if number % (halves / 8) == 0 {
            writeln!(out, "{name} half {number}: {sum:016x}, {:?}", half.mode).unwrap();
        }
        walk.pass(half.period_ticks);
    }
    modes
}

/// A ladder's walks, on each of which every rung comes by.
fn ladder(name: &str, ladder: Ladder) {
    let mut out = String::new();
    let mut modes = Vec::new();
    for seed in 0..3 {
        modes.extend(walk(&format!("{name} {seed}"), Schedule::on(ladder, &CLOCK), seed, HALVES, &mut out));
    }
    for mode in ladder.modes() {
        assert!(modes.contains(&mode), "{mode:?} did not come by: {modes:?}");
    }
    holds(name, &out);
}

#[test]
fn every_pulse_of_the_papers_ladder_is_as_it_was() {
    ladder("paper", Ladder::PAPER);
}

#[cfg(feature = "optimal")]
#[test]
fn every_pulse_of_the_optimised_ladder_is_as_it_was() {
    ladder("optimal", Ladder::OPTIMAL);
}

fn pin_numbers(sum: u64, numbers: &[f32]) -> u64 {
    numbers.iter().fold(sum, |sum, number| hash(sum, &number.to_bits().to_le_bytes()))
}

/// Of a mode: its pulses where it is held, its limit, and its ripple.
fn told(mode: Mode, out: &mut String) {
    let name = mode.name();
    walk(&format!("{name} fixed"), Schedule::fixed(mode, &CLOCK), mode as u64, 1_600, out);
    let mut sum = BASIS;
    for (hz, index) in (0..400_u16).map(|step| (f32::from(step) - 99.5, f32::from(step % 56) * 0.02)) {
        let omega = hz * std::f32::consts::TAU;
        sum = pin_numbers(
            sum,
            &[index_limit(mode, CLOCK.angle_rate(omega), &DEVICES), ripple_share(mode, index)],
        );
        let voltage_v = index * 1_500.0 * std::f32::consts::FRAC_2_PI;
        let half = step_of(hz) % (2 * mode.carriers()).max(1);
        if mode.is_pattern() || mode.is_optimal() {
            let flux = ripple_at(mode, half, voltage_v, 1_500.0, omega.abs());
            sum = pin_numbers(sum, &[flux.alpha, flux.beta]);
        }
    }
    writeln!(out, "{name} limits and ripple: {sum:016x}").unwrap();
}

fn step_of(hz: f32) -> u32 {
    (hz + 99.5) as u32
}

/// The optimised ones in a file of their own: without their feature there are none.
#[test]
fn what_each_mode_is_told_for_is_as_it_was() {
    let mut texts = [String::new(), String::new()];
    for mode in Mode::ALL {
        told(mode, &mut texts[usize::from(mode.is_optimal())]);
    }
    let [paper, optimal] = texts;
    holds("paper-modes", &paper);
    if cfg!(feature = "optimal") {
        holds("optimal-modes", &optimal);
    }
}
