//! `cargo rig pattern`: the modulator's own pulses in steady state.

use crate::bench::Inverter;
use crate::files;
use crate::options::{not_negative, positive};
use crate::plant::Leg;
use crate::run::{self, CLOCK, refused};
use anyhow::{Result, bail};
use clap::builder::PossibleValuesParser;
use std::path::Path;
use tractive::frames::{Angle, six_step_v};
use tractive::modulation::{Mode, Modulator, Reference, Schedule, SwitchLimits, index_limit};
use tractive::time::{Clock, Instant};

/// The pattern to make.
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct Wanted {
    /// Mode.
    #[arg(skip)]
    pub mode: Mode,
    /// Fundamental, peak phase, in V; in square wave it is 2/π of the link, whatever is given.
    #[arg(long = "u", id = "u", value_parser = not_negative, allow_negative_numbers = true)]
    pub voltage_v: f64,
    /// DC link, in V.
    #[arg(long = "udc", id = "udc", value_parser = positive, allow_negative_numbers = true)]
    pub udc_v: f64,
    /// Stator frequency, in Hz.
    #[arg(long = "f1", id = "f1", value_parser = positive, allow_negative_numbers = true)]
    pub f1_hz: f64,
    /// Fundamental periods.
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    pub cycles: u32,
    /// Dead time, in µs.
    #[arg(long, default_value_t = 0.0, value_parser = not_negative, allow_negative_numbers = true)]
    pub dead_time_us: f64,
    /// Shortest pulse, in µs.
    #[arg(long, default_value_t = 0.0, value_parser = not_negative, allow_negative_numbers = true)]
    pub min_pulse_us: f64,
    /// Highest switching frequency, in Hz.
    #[arg(skip)]
    pub max_switching_hz: f32,
    /// Rate of control, in Hz; `None` for the one that goes with devices of that frequency.
    #[arg(skip)]
    pub control_hz: Option<u32>,
}

/// The names of the modes with pulses; `opp7` stands for the one of its branches that is used at the modulation index.
pub fn names() -> PossibleValuesParser {
    let pulsing = Mode::ALL.into_iter().filter(|mode| *mode != Mode::Off);
    let mut names: Vec<_> = pulsing.flat_map(|mode| [mode.family(), mode.name()]).collect();
    let mut seen = std::collections::HashSet::new();
    names.retain(|name| seen.insert(*name));
    PossibleValuesParser::new(names)
}

impl Wanted {
    /// The same with the mode of this name.
    pub fn with_mode(self, name: &str) -> Self {
        let index = self.voltage_v / (self.udc_v * core::f64::consts::FRAC_2_PI);
        Self { mode: Mode::named_at(name, index as f32).unwrap_or_default(), ..self }
    }

    /// The clock of the drive that makes the pattern.
    fn clock(&self) -> Result<Clock> {
        self.control_hz.map_or_else(|| run::usual_clock(self.max_switching_hz), |hz| Ok(run::clock(hz)))
    }
}

/// An upper device that changes: time in s, leg 0 ..= 2, on.
pub type LegEdge = (f64, usize, bool);

/// Longest pattern, in s.
const LONGEST_S: f64 = 100.0;

/// Highest stator frequency, in Hz: far beyond the range of any mode.
const HIGHEST_HZ: f64 = 5_000.0;

/// The upper devices' changes over whole fundamental periods, and their levels at the beginning.
pub fn edges(wanted: &Wanted) -> Result<Vec<LegEdge>> {
    let tick_s = f64::from(CLOCK.ticks_per_s).recip();
    let ticks = |microseconds: f64| (microseconds * 1e-6 / tick_s).round() as u32;
    let devices = SwitchLimits::new(
        ticks(wanted.min_pulse_us),
        ticks(wanted.dead_time_us),
        wanted.max_switching_hz,
        &CLOCK,
    );
    devices.check(&wanted.clock()?).map_err(refused)?;
    let rate = (wanted.f1_hz * tick_s * 4_294_967_296.0) as f32;
    let lowest_hz = LONGEST_S.recip();
    if !(lowest_hz..=HIGHEST_HZ).contains(&wanted.f1_hz) {
        bail!("--f1 {}: must be from {lowest_hz} to {HIGHEST_HZ}", wanted.f1_hz);
    }
    let most = (LONGEST_S * wanted.f1_hz).floor();
    if wanted.cycles == 0 || f64::from(wanted.cycles) > most {
        bail!("--cycles {}: must be from 1 to {most} at this frequency", wanted.cycles);
    }
    let six_step_v = wanted.udc_v * core::f64::consts::FRAC_2_PI;
    let most = f64::from(index_limit(wanted.mode, rate, &devices)) * six_step_v;
    if !wanted.mode.is_whole() && wanted.voltage_v > most * 1.000_001 {
        bail!("--u {}: mode {} gives at most {most:.3} V here", wanted.voltage_v, wanted.mode.name());
    }
    let mut modulator = Modulator::new(devices, Schedule::fixed(wanted.mode, &CLOCK));
    let cycle = (1.0 / (wanted.f1_hz * tick_s)).round() as u64;
    // One fundamental period to lock on, then from the next zero of the pulse angle.
    let (begin, end) = (2 * cycle, (2 + u64::from(wanted.cycles)) * cycle);
    let mut inverter: Option<Inverter> = None;
    let mut start = 0_u64;
    let mut changes: Vec<(u64, usize, bool)> = Vec::new();
    while start <= end {
        let reference = reference(wanted, rate, start);
        let half = modulator.step(Instant(start as u32), Some(&reference));
        let gates = inverter.get_or_insert_with(|| Inverter::new(devices.dead_time_ticks.into(), half));
        gates.begin(half, start);
        let mut now = start;
        start = gates.half_end();
        loop {
            for (leg, state) in gates.legs().into_iter().enumerate() {
                changes.push((now, leg, state == Leg::Upper));
            }
            match gates.next_event() {
                Some(event) if event < start => {
                    now = event;
                    gates.act(event);
                }
                _ => break,
            }
        }
    }
    Ok(seen_from(begin, end, &changes, tick_s))
}

/// The reference at a tick, for a steadily turning fundamental whose pulse angle is zero at tick zero.
fn reference(wanted: &Wanted, rate: f32, tick: u64) -> Reference {
    let turned = (f64::from(rate) * tick as f64).rem_euclid(4_294_967_296.0);
    let angle = Angle(turned as u64 as u32) - Angle::DEG_90;
    let udc_v = wanted.udc_v as f32;
    // A whole mode gives the link's full voltage; with a smaller request it would have notches, as after a jump of the link.
    let voltage_v = if wanted.mode.is_whole() { six_step_v(udc_v) } else { wanted.voltage_v as f32 };
    Reference::turning(voltage_v, angle, rate, Instant(tick as u32), udc_v)
}

/// Levels at `begin`, then every change until `end`.
fn seen_from(begin: u64, end: u64, changes: &[(u64, usize, bool)], tick_s: f64) -> Vec<LegEdge> {
    let mut levels = [false; 3];
    for (_, leg, on) in changes.iter().filter(|(tick, _, _)| *tick <= begin) {
        levels[*leg] = *on;
    }
    let mut seen: Vec<_> = levels.iter().enumerate().map(|(leg, on)| (0.0, leg, *on)).collect();
    for (tick, leg, on) in changes.iter().filter(|(tick, _, _)| (begin + 1..=end).contains(tick)) {
        if levels[*leg] != *on {
            levels[*leg] = *on;
            seen.push(((tick - begin) as f64 * tick_s, *leg, *on));
        }
    }
    seen
}

/// Writes the pattern as `t_s,leg,level`.
pub fn write(wanted: &Wanted, out: &Path) -> Result<()> {
    let mut text = String::from("t_s,leg,level\n");
    for (t_s, leg, on) in edges(wanted)? {
        text += &format!("{:.9},{},{}\n", t_s, ["u", "v", "w"][leg], u8::from(on));
    }
    files::write_text(out, &text)
}
