//! A converter's injected sequences (RM0440, chapter 21).

use super::gpio::{Driver, Gpio, name, place};
use crate::finding::Findings;
use crate::map::analog_pin;
use crate::time::{MICROSECOND, Time};
use crate::world::World;

const ISR: u32 = 0x00;
const CR: u32 = 0x08;
const CFGR: u32 = 0x0C;
const SMPR1: u32 = 0x14;
const SMPR2: u32 = 0x18;
const JSQR: u32 = 0x4C;
const JDR1: u32 = 0x80;
const JDR4: u32 = 0x8C;

const ADRDY: u32 = 1;
const JEOC: u32 = 1 << 5;
const JEOS: u32 = 1 << 6;
const ADEN: u32 = 1;
const JADSTART: u32 = 1 << 3;
const ADVREGEN: u32 = 1 << 28;
const DEEPPWD: u32 = 1 << 29;
const ADCAL: u32 = 1 << 31;

/// Half cycles of sampling by SMPR's code, and of the conversion.
const SAMPLING: [Time; 8] = [5, 13, 25, 49, 95, 185, 495, 1_281];
const CONVERTING: Time = 25;
/// Half cycles of a calibration, and those that follow it before the converter may be enabled.
const CALIBRATION: Time = 2 * 116;
const AFTER_CALIBRATION: Time = 2 * 4;
/// The shortest cycle of its clock, at 60 MHz (data sheet, ADC characteristics).
const FASTEST: Time = crate::time::SECOND / 60_000_000;
/// The time that the regulator takes to start.
const REGULATOR: Time = 20 * MICROSECOND;
/// The events of JEXTSEL for ADC1 and ADC2, from 0 (RM0440, table "ADC1/2 - external triggers for injected channels").
const TRIGGERS: [&str; 18] = [
    "TIM1_TRGO",
    "TIM1_CC4",
    "TIM2_TRGO",
    "TIM2_CC1",
    "TIM3_CC4",
    "TIM4_TRGO",
    "EXTI15",
    "TIM8_CC4",
    "TIM1_TRGO2",
    "TIM8_TRGO",
    "TIM8_TRGO2",
    "TIM3_CC3",
    "TIM3_TRGO",
    "TIM3_CC1",
    "TIM6_TRGO",
    "TIM15_TRGO",
    "TIM20_TRGO",
    "TIM20_TRGO2",
];
/// The same of ADC3 to ADC5.
const TRIGGERS_345: [&str; 18] = [
    "TIM1_TRGO",
    "TIM1_CC4",
    "TIM2_TRGO",
    "TIM8_CC2",
    "TIM4_CC3",
    "TIM4_TRGO",
    "TIM4_CC4",
    "TIM8_CC4",
    "TIM1_TRGO2",
    "TIM8_TRGO",
    "TIM8_TRGO2",
    "TIM1_CC3",
    "TIM3_TRGO",
    "EXTI3",
    "TIM6_TRGO",
    "TIM15_TRGO",
    "TIM20_TRGO",
    "TIM20_TRGO2",
];
/// The reference, in V, and the codes of its range.
pub const REFERENCE_V: f64 = 3.3;
const CODES: f64 = 4_096.0;

/// A sampling that a timer started.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sampling {
    /// The instant of the timer's event.
    pub triggered: Time,
    /// The place in the sequence, from 0.
    pub rank: u32,
    /// Its beginning.
    pub from: Time,
    /// Its end: the voltage of this instant is converted.
    pub until: Time,
}

#[derive(Clone, Copy, Debug)]
struct Running {
    rank: u32,
    /// The end of the sampling, while it lasts.
    samples: Option<Time>,
    ends: Time,
    code: u32,
}

/// A converter.
pub struct Adc {
    name: &'static str,
    pins: Vec<Option<usize>>,
    isr: u32,
    cr: u32,
    cfgr: u32,
    smpr: [u32; 2],
    jsqr: u32,
    results: [u32; 4],
    /// ADC12_COMMON.CCR or ADC345_COMMON.CCR, which several converters share.
    pub common: u32,
    regulated: Time,
    calibrated: Option<Time>,
    half: Time,
    running: Option<Running>,
    pending: Option<Time>,
    /// The timer event that started the running sequence.
    triggered: Option<Time>,
    /// The samplings so far that were started by a timer.
    pub samplings: Vec<Sampling>,
}

impl Adc {
    /// After a reset.
    pub fn new(name: &'static str) -> Self {
        let pin =
            |channel: u32| analog_pin(name, &[&format!("IN{channel}"), &format!("INP{channel}")]).map(place);
        Self {
            name,
            pins: (0..20).map(pin).collect(),
            isr: 0,
            cr: DEEPPWD,
            cfgr: 1 << 31,
            smpr: [0; 2],
            jsqr: 0,
            results: [0; 4],
            common: 0,
            regulated: Time::MAX,
            calibrated: None,
            half: 0,
            running: None,
            pending: None,
            triggered: None,
            samplings: Vec::new(),
        }
    }

    /// Its name.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// `true` once it is enabled.
    pub fn is_enabled(&self) -> bool {
        self.cr & ADEN != 0
    }

    /// Half a cycle of its clock; `None` with a clock that is not modelled.
    fn half_cycle(&self, cycle: Time) -> Option<Time> {
        let divider = match self.common >> 16 & 0b11 {
            1 => 1,
            2 => 2,
            3 => 4,
            _ => return None,
        };
        Some(cycle * divider / 2)
    }

    /// The next change.
    pub fn next_event(&self) -> Time {
        let running = self.running.map(|running| running.samples.unwrap_or(running.ends));
        let calibrating = self.calibrated.filter(|_| self.cr & ADCAL != 0);
        running.into_iter().chain(calibrating).chain(self.pending).min().unwrap_or(Time::MAX)
    }

    /// An event of a timer.
    pub fn trigger(&mut self, event: &str, now: Time) {
        let triggers = if self.name == "ADC3" { TRIGGERS_345 } else { TRIGGERS };
        let selected = triggers.get((self.jsqr >> 2 & 0x1F) as usize);
        if self.cr & JADSTART != 0
            && self.jsqr >> 7 & 0b11 == 1
            && selected == Some(&event)
            && self.running.is_none()
        {
            (self.pending, self.triggered) = (Some(now), Some(now));
        }
    }

    fn begin(&mut self, rank: u32, now: Time) {
        let code = |channel: u32| match channel {
            0..10 => self.smpr[0] >> (3 * channel) & 7,
            _ => self.smpr[1] >> (3 * (channel - 10)) & 7,
        };
        let samples = now + SAMPLING[code(self.channel(rank)) as usize] * self.half;
        if let Some(triggered) = self.triggered {
            self.samplings.push(Sampling { triggered, rank, from: now, until: samples });
        }
        self.running =
            Some(Running { rank, samples: Some(samples), ends: samples + CONVERTING * self.half, code: 0 });
    }

    fn channel(&self, rank: u32) -> u32 {
        self.jsqr >> [9, 15, 21, 27][rank as usize] & 0x1F
    }

    /// Does what is due.
    pub fn act(&mut self, now: Time, cycle: Time, gpio: &Gpio, world: &World, findings: &mut Findings) {
        if self.cr & ADCAL != 0 && self.calibrated.is_some_and(|at| at <= now) {
            self.cr &= !ADCAL;
        }
        if self.pending.is_some_and(|at| at <= now) {
            self.pending = None;
            match self.half_cycle(cycle) {
                Some(half) => self.half = half,
                None => findings.add(format!(
                    "{}: converts without a synchronous clock, which the twin does not model",
                    self.name
                )),
            }
            self.begin(0, now);
        }
        let Some(mut running) = self.running else { return };
        if running.samples.is_some_and(|at| at <= now) {
            running.samples = None;
            running.code = self.sample(running.rank, gpio, world, findings);
            self.running = Some(running);
        }
        if running.ends <= now {
            self.end(running, now);
        }
    }

    fn end(&mut self, running: Running, now: Time) {
        self.results[running.rank as usize] = running.code;
        self.isr |= JEOC;
        self.running = None;
        if running.rank < self.jsqr & 0b11 {
            self.begin(running.rank + 1, now);
            return;
        }
        self.isr |= JEOS;
        if self.jsqr >> 7 & 0b11 == 0 {
            self.cr &= !JADSTART;
        }
    }

    fn sample(&self, rank: u32, gpio: &Gpio, world: &World, findings: &mut Findings) -> u32 {
        let channel = self.channel(rank);
        let Some(pin) = self.pins.get(channel as usize).copied().flatten() else {
            findings.add(format!("{}: channel {channel} has no pin", self.name));
            return 0;
        };
        findings.expect(gpio.driver(pin) == Driver::Analog, || {
            format!("{}: {} is converted, and is no analog pin", self.name, name(pin))
        });
        let volts = world.voltage(pin);
        findings.expect(volts.is_some(), || {
            format!("{}: {} is converted, and nothing is wired to it", self.name, name(pin))
        });
        let code = (volts.unwrap_or(0.0) / REFERENCE_V * CODES).floor();
        code.clamp(0.0, CODES - 1.0) as u32
    }

    /// A register is read.
    pub fn read(&self, offset: u32) -> Option<u32> {
        match offset {
            ISR => Some(self.isr),
            CR => Some(self.cr),
            CFGR => Some(self.cfgr),
            SMPR1 | SMPR2 => Some(self.smpr[(offset / 4 - SMPR1 / 4) as usize]),
            JSQR => Some(self.jsqr),
            JDR1..=JDR4 => Some(self.results[(offset / 4 - JDR1 / 4) as usize]),
            _ => None,
        }
    }

    /// A register is written; `false` if the twin has no such register.
    pub fn write(
        &mut self,
        offset: u32,
        value: u32,
        now: Time,
        cycle: Time,
        findings: &mut Findings,
    ) -> bool {
        let started = self.cr & JADSTART != 0;
        match offset {
            ISR => self.isr &= !value,
            CR => self.control(value, now, cycle, findings),
            SMPR1 | SMPR2 => {
                findings.expect(!started, || {
                    format!("{}.SMPR is written while conversions may start", self.name)
                });
                self.smpr[(offset / 4 - SMPR1 / 4) as usize] = value;
            }
            JSQR => {
                // The queue is off after a reset (CFGR.JQDIS).
                findings.expect(!started, || {
                    format!("{}.JSQR is written while conversions may start", self.name)
                });
                self.jsqr = value;
            }
            _ => return false,
        }
        true
    }

    fn control(&mut self, value: u32, now: Time, cycle: Time, findings: &mut Findings) {
        let name = self.name;
        let before = self.cr;
        let sets = |bit: u32| value & bit != 0 && before & bit == 0;
        findings.expect(value & 0b11_0110 == 0, || format!("{name}.CR: {value:#x} is not modelled"));
        if sets(ADVREGEN) {
            findings.expect(before & DEEPPWD == 0, || {
                format!("{name}: the regulator is started in deep power-down")
            });
            self.regulated = now + REGULATOR;
        }
        let half = self.half_cycle(cycle).unwrap_or(cycle);
        if sets(ADCAL) {
            findings.expect(before & ADVREGEN != 0 && now >= self.regulated, || {
                format!("{name}: calibrated before its regulator has started")
            });
            findings.expect(before & ADEN == 0, || format!("{name}: calibrated while it is enabled"));
            findings
                .expect(self.half_cycle(cycle).is_some(), || format!("{name}: calibrated without a clock"));
            self.calibrated = Some(now + CALIBRATION * half);
        }
        if sets(ADEN) {
            findings.expect(2 * half >= FASTEST, || format!("{name}: a clock of more than 60 MHz"));
            let ready =
                before & ADCAL == 0 && self.calibrated.is_some_and(|at| now >= at + AFTER_CALIBRATION * half);
            findings.expect(ready, || format!("{name}: enabled before its calibration has ended"));
            self.isr |= ADRDY;
        }
        if sets(JADSTART) {
            findings.expect(before & ADEN != 0, || format!("{name}: started before it is enabled"));
            if self.jsqr >> 7 & 0b11 == 0 {
                (self.pending, self.triggered) = (Some(now), None);
            }
        }
        // A bit that starts something is not cleared by writing 0.
        let kept = before & (ADEN | JADSTART | ADCAL);
        self.cr = value & (ADVREGEN | DEEPPWD | ADEN | JADSTART | ADCAL) | kept;
    }
}
