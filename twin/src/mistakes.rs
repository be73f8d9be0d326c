//! Mistakes in a board's code and settings, each made by changing a write on the way to its register, and whether a short drive reveals them.
//!
//! The drive is the same for all: the link is charged, the motor pulls, then the gate drivers' ready wire drops or a phase carries an
//! overcurrent. A mistake is caught by a finding, by an expectation that is not met, or by gates that do not go off.

use crate::core::cpu::Cpu;
use crate::run::{Settings, drive, prepare};
use crate::time::{MICROSECOND, seconds};
use anyhow::Result;
use std::path::Path;
use tractive_rig::talk::System;

/// A change of a write: address and value in, value out.
pub type Change = fn(u32, u32) -> u32;

/// The drive.
const SCRIPT: &str = "\
0.10 expect state ready
0.10 charge
0.26 expect state charged
0.26 enable
0.31 expect state enabled
0.31 torque 300 over 0.05
0.66 expect state running
     expect torque_nm 300 within 15
     expect speed_rpm 84.5 within 2
     expect mode async
     expect fault none
0.66 end
";
/// The drive for mistakes that show only where the carrier's halves differ: it goes on until a synchronous mode runs.
const SYNCHRONOUS: &str = "\
0.10 charge
0.26 enable
0.31 torque 1235 over 0.1
1.16 expect mode sync15
     expect fault none
1.16 end
";
/// The time from the cause of a break until every gate must be off.
const BREAK: u64 = MICROSECOND;

/// The telemetry's period, in s, and the share by which its mean may be off: a crystal's error and the frames' jitter are far below.
const TELEMETRY_S: f64 = 0.01;
const TELEMETRY_SHARE: f64 = 0.01;

/// The PWM interrupt, as an exception, and the longest time that it may wait: it preempts everything, so one instruction and its entry.
const PWM: usize = 41;
const WAIT: u64 = MICROSECOND;

/// The least number of edges that every gate has in the drive: half of those of a carrier of 900 Hz.
const PULSES: usize = 300;

/// A mistake, and the change that makes it.
pub struct Mistake {
    /// In words.
    pub name: &'static str,
    change: Change,
}

const fn of(name: &'static str, change: Change) -> Mistake {
    Mistake { name, change }
}

/// The value with a field's bits in another state, at one address.
fn at(register: u32, address: u32, value: u32, mask: u32, bits: u32) -> u32 {
    if address == register { value & !mask | bits } else { value }
}

/// The same where the field is written at all.
fn field(register: u32, address: u32, value: u32, mask: u32, [from, to]: [u32; 2]) -> u32 {
    if address == register && value & mask == from { value & !mask | to } else { value }
}

const TIM1: u32 = 0x4001_2C00;
const TIM8: u32 = 0x4001_3400;
const TIM3: u32 = 0x4000_0400;
const TIM4: u32 = 0x4000_0800;
const RCC: u32 = 0x4002_1000;
const GPIOA: u32 = 0x4800_0000;
const GPIOB: u32 = 0x4800_0400;
const GPIOC: u32 = 0x4800_0800;
const ADC1: u32 = 0x5000_0000;
const ADC2: u32 = 0x5000_0100;
const PRIORITIES: u32 = 0xE000_E400;

/// The mistakes.
pub const MISTAKES: [Mistake; 40] = [
    of("PB15 has alternate function 6", |a, v| field(GPIOB + 0x24, a, v, 0xF << 28, [4 << 28, 6 << 28])),
    of("PA10 has alternate function 5", |a, v| field(GPIOA + 0x24, a, v, 0xF << 8, [6 << 8, 5 << 8])),
    of("PC6 has alternate function 2", |a, v| field(GPIOC + 0x20, a, v, 0xF << 24, [4 << 24, 2 << 24])),
    of("PA1 stays an input", |a, v| field(GPIOA, a, v, 3 << 2, [3 << 2, 0])),
    of("encoder's tracks without their alternate function", |a, v| {
        field(GPIOB + 0x20, a, v, 0xF << 24, [2 << 24, 0])
    }),
    of("currents of U and V swapped", |a, v| match a {
        0x5000_004C => v & !(0x1F << 9 | 0x1F << 15) | (v >> 9 & 0x1F) << 15 | (v >> 15 & 0x1F) << 9,
        _ => v,
    }),
    of("ADC1 follows TIM3_CC3", |a, v| field(ADC1 + 0x4C, a, v, 0x1F << 2, [12 << 2, 11 << 2])),
    of("ADC2 follows TIM8's TRGO", |a, v| field(ADC2 + 0x4C, a, v, 0x1F << 2, [8 << 2, 9 << 2])),
    of("ADC1 never follows a timer", |a, v| at(ADC1 + 0x4C, a, v, 3 << 7, 0)),
    of("ADC's clock undivided", |a, v| at(0x5000_0308, a, v, 3 << 16, 1 << 16)),
    of("lower device of U inverted", |a, v| at(TIM1 + 0x20, a, v, 8, 8)),
    of("upper device of V inverted", |a, v| at(TIM1 + 0x20, a, v, 1 << 9, 1 << 9)),
    of("lower device of U not enabled", |a, v| at(TIM1 + 0x20, a, v, 4, 0)),
    of("upper device of W not enabled", |a, v| at(TIM8 + 0x20, a, v, 1, 0)),
    of("no dead time on U and V", |a, v| at(TIM1 + 0x44, a, v, 0xFF, 0)),
    of("no dead time on W", |a, v| at(TIM8 + 0x44, a, v, 0xFF, 0)),
    of("dead-time clock undivided", |a, v| at(TIM1, a, v, 3 << 8, 0)),
    of("TIM1 without a clock", |a, v| at(RCC + 0x60, a, v, 1 << 11, 0)),
    of("TIM3 without a clock", |a, v| at(RCC + 0x58, a, v, 1 << 1, 0)),
    of("ADC1 and ADC2 without a clock", |a, v| at(RCC + 0x4C, a, v, 1 << 13, 0)),
    of("comparators without a clock", |a, v| at(RCC + 0x60, a, v, 1, 0)),
    of("CAN's clock from the bus", |a, v| at(RCC + 0x88, a, v, 3 << 24, 2 << 24)),
    of("reload of the carrier not preloaded", |a, v| at(TIM1, a, v, 1 << 7, 0)),
    of("compare of U not preloaded", |a, v| at(TIM1 + 0x18, a, v, 1 << 3, 0)),
    of("carrier's prescaler one less", |a, v| at(TIM1 + 0x28, a, v, 1, 0)),
    of("control timer's prescaler one less", |a, v| at(TIM3 + 0x28, a, v, 1, 0)),
    of("PLL at 160 MHz", |a, v| field(RCC + 0x0C, a, v, 0x7F << 8, [85 << 8, 80 << 8])),
    of("two wait states", |a, v| field(0x4002_2000, a, v, 0xF, [4, 2])),
    of("no boost at 170 MHz", |a, v| at(0x4000_7080, a, v, 1 << 8, 1 << 8)),
    of("TIM8 does not follow TIM1", |a, v| at(TIM8 + 0x08, a, v, u32::MAX, 0)),
    of("encoder counts one track", |a, v| field(TIM4 + 0x08, a, v, 7, [3, 1])),
    of("encoder's turn of 2,048 counts", |a, v| at(TIM4 + 0x2C, a, v, u32::MAX, 2_047)),
    of("encoder captured by another timer", |a, v| field(TIM4 + 0x08, a, v, 0x70, [0x20, 0x10])),
    of("encoder's index not enabled", |a, v| at(TIM4 + 0x58, a, v, 1, 0)),
    of("break of U and V disabled", |a, v| at(TIM1 + 0x44, a, v, 1 << 12, 0)),
    of("break input inverted", |a, v| at(TIM8 + 0x60, a, v, 1 << 9, 0)),
    of("comparators do not break U and V", |a, v| at(TIM1 + 0x60, a, v, 0x7F << 1, 0)),
    of("PWM's priority that of control", |a, v| at(PRIORITIES + 25, a, v, 0xFF, 0x80)),
    of("PWM's priority below control's", |a, v| at(PRIORITIES + 25, a, v, 0xFF, 0xC0)),
    of("watchdog never started", |a, v| if a == 0x4000_3000 && v == 0xCCCC { 0 } else { v }),
];

/// Runs the drive of a script with a change; returns what revealed it, or `None`.
fn caught_in(
    image: &Path,
    script: &str,
    change: Option<Change>,
    overcurrent: bool,
) -> Result<Option<String>> {
    let settings = Settings::new(image, System::Pmasynrm, script.to_owned());
    let (mut cpu, _) = prepare(&settings)?;
    let machine = cpu.machine_mut();
    machine.mistake = change;
    machine.world.side.charge();
    if let Err(error) = drive(&mut cpu) {
        return Ok(Some(format!("{error:#}")));
    }
    let machine = cpu.machine();
    if let Some(finding) = machine.findings.all.first() {
        return Ok(Some(finding.text.clone()));
    }
    if let Some(failure) = machine.world.talk.failures.first() {
        return Ok(Some(failure.clone()));
    }
    if let Some(gate) =
        (0..6).find(|gate| machine.world.edges.iter().filter(|edge| edge.gate == *gate).count() < PULSES)
    {
        return Ok(Some(format!("gate {gate} hardly pulses")));
    }
    if let Some(slow) = off_time(&machine.world.talk.rows) {
        return Ok(Some(slow));
    }
    let waited = machine.nvic.waited(PWM);
    if waited > WAIT {
        return Ok(Some(format!("the PWM interrupt waits for {:.1} µs", 1e6 * seconds(waited))));
    }
    if !machine.chip.watchdog.is_running() {
        return Ok(Some("the watchdog does not run".into()));
    }
    held(&mut cpu, overcurrent)
}

/// The telemetry's period if it is not the protocol's, measured by the bus's clock, which is not the drive's.
fn off_time(rows: &[Vec<String>]) -> Option<String> {
    let instant = |row: &Vec<String>| row.first()?.parse::<f64>().ok();
    let (first, last) = (instant(rows.first()?)?, instant(rows.last()?)?);
    let mean_s = (last - first) / (rows.len() - 1).max(1) as f64;
    let off = (mean_s / TELEMETRY_S - 1.0).abs() > TELEMETRY_SHARE;
    off.then(|| {
        format!("telemetry comes every {:.3} ms, not every {:.3} ms", 1e3 * mean_s, 1e3 * TELEMETRY_S)
    })
}

/// The cause of a break while the gates pulse: whether a gate is on later than it may be.
fn held(cpu: &mut Cpu, overcurrent: bool) -> Result<Option<String>> {
    let machine = cpu.machine_mut();
    machine.world.done = false;
    let world = &mut machine.world;
    if !world.any_gate() {
        return Ok(Some("no gate is on".to_owned()));
    }
    (world.ready, world.excess_a) = (overcurrent, (0, 0, if overcurrent { 600.0 } else { 0.0 }));
    // Both act without a clock: at once.
    machine.settle();
    let until = machine.now() + BREAK;
    cpu.run(until)?;
    cpu.machine_mut().settle();
    let world = &cpu.machine().world;
    let cause = if overcurrent { "an overcurrent" } else { "the drivers' ready wire" };
    Ok(world.any_gate().then(|| format!("gates are on 1 µs after {cause}")))
}

/// A mistake's outcome with both causes of a break and, if neither reveals it, in a synchronous mode; the same without a mistake.
pub fn outcome(image: &Path, mistake: Option<&Mistake>) -> Result<Option<String>> {
    let change = mistake.map(|mistake| mistake.change);
    for (script, overcurrent) in [(SCRIPT, false), (SCRIPT, true), (SYNCHRONOUS, false)] {
        let shown = caught_in(image, script, change, overcurrent)?;
        if shown.is_some() {
            return Ok(shown);
        }
    }
    Ok(None)
}
