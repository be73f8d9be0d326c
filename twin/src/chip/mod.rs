//! The chip's peripherals, each in a file of its own, and the wires between them.

pub mod adc;
mod bits;
pub mod can;
pub mod comparators;
mod dispatch;
pub mod gpio;
pub mod output;
pub mod rcc;
pub mod spi;
pub mod system;
pub mod timer;
pub mod watchdog;

use crate::core::nvic::Nvic;
use crate::finding::Findings;
use crate::map::Map;
use crate::time::Time;
use crate::world::World;
use adc::Adc;
use can::Can;
use comparators::Comparators;
use gpio::Gpio;
use rcc::Rcc;
use spi::Spi;
use system::System;
use timer::Timer;
use watchdog::Watchdog;

/// The timers that are modelled, and the interrupt of each one's update (RM0440, vector table).
pub const TIMERS: [(&str, Option<usize>); 7] = [
    ("TIM1", Some(25)),
    ("TIM8", Some(44)),
    ("TIM2", Some(28)),
    ("TIM3", Some(29)),
    ("TIM4", Some(30)),
    ("TIM17", Some(26)),
    ("TIM20", Some(78)),
];

/// The chip.
pub struct Chip {
    map: Map,
    /// Reset and clocks.
    pub rcc: Rcc,
    /// Supply, flash interface, system configuration, debug.
    pub system: System,
    /// Pins.
    pub gpio: Gpio,
    /// Timers, as [`TIMERS`].
    pub timers: Vec<Timer>,
    /// ADC1, ADC2 and ADC3.
    pub adcs: [Adc; 3],
    /// SPI3.
    pub spi: Spi,
    /// Comparators, and the converters of their thresholds.
    pub comparators: Comparators,
    /// The CAN controller.
    pub can: Can,
    /// The independent watchdog.
    pub watchdog: Watchdog,
    /// Every access so far, by address: reads and writes.
    pub accesses: std::collections::BTreeMap<u32, (u64, u64)>,
}

impl Chip {
    /// Out of a power-on reset.
    pub fn new() -> Self {
        let map = Map::new();
        Self {
            rcc: Rcc::default(),
            system: System::default(),
            gpio: Gpio::new(&map),
            timers: TIMERS.iter().map(|(name, _)| Timer::new(name)).collect(),
            adcs: ["ADC1", "ADC2", "ADC3"].map(Adc::new),
            spi: Spi::default(),
            comparators: Comparators::default(),
            can: Can::default(),
            watchdog: Watchdog::default(),
            accesses: Default::default(),
            map,
        }
    }

    /// A timer by its name.
    pub fn timer(&self, name: &str) -> Option<&Timer> {
        self.timers.iter().find(|timer| timer.name == name)
    }

    /// `true` while any PWM timer's main output is on.
    pub fn is_pulsing(&self) -> bool {
        self.timers.iter().any(|timer| ["TIM1", "TIM8", "TIM20"].contains(&timer.name) && timer.is_on())
    }

    /// The next instant at which something happens by itself.
    pub fn next_event(&self) -> Time {
        let timers = self.timers.iter().map(|timer| timer.next_event(self.rcc.cycle()));
        let adcs = self.adcs.iter().map(Adc::next_event);
        let others =
            [self.rcc.next_event(), self.can.next_event(), self.watchdog.next_event(), self.spi.next_event()];
        timers.chain(adcs).chain(others).min().unwrap_or(Time::MAX)
    }

    /// Does what is due.
    pub fn act(&mut self, now: Time, world: &mut World, findings: &mut Findings) {
        self.rcc.act(now);
        self.watchdog.act(now);
        for timer in self.timers.iter_mut().filter(|timer| timer.is_encoder()) {
            if let Some(tracks) = world.encoder(timer.name, &self.gpio) {
                timer.follow(tracks);
            }
        }
        let cycle = self.rcc.cycle();
        for index in 0..self.timers.len() {
            self.timers[index].act(now, cycle);
            self.pass_triggers(index, now);
        }
        for adc in &mut self.adcs {
            adc.act(now, cycle, &self.gpio, world, findings);
        }
        self.spi.act(now, cycle, &self.gpio, world);
        let seen = self.comparators.see(&self.gpio, world);
        let supply = self.system.breaks(&self.rcc);
        for (index, timer) in self.timers.iter_mut().enumerate() {
            let pin = self.gpio.break_level(index, world);
            timer.break_by(pin, seen, supply);
        }
        self.can.act(now, &self.gpio, world);
    }

    /// Passes a timer's triggers on: to timers, by the internal trigger connection, and to converters.
    fn pass_triggers(&mut self, from: usize, now: Time) {
        let triggers = self.timers[from].take_triggers();
        let source = self.timers[from].name;
        if triggers.first {
            for (index, timer) in self.timers.iter_mut().enumerate() {
                if index != from {
                    timer.triggered(source, now);
                }
            }
        }
        for adc in &mut self.adcs {
            for (happened, signal) in [(triggers.first, "TRGO"), (triggers.second, "TRGO2")] {
                if happened {
                    adc.trigger(&format!("{source}_{signal}"), now);
                }
            }
        }
    }

    /// The debugger halts the core: the timers that are configured to stop with it stop, with their outputs off.
    pub fn halt(&mut self, now: Time) {
        let cycle = self.rcc.cycle();
        for timer in &mut self.timers {
            if self.system.stops_with_core(timer.name) {
                timer.freeze(now, cycle);
            }
        }
    }

    /// The interrupts' lines.
    pub fn drive_interrupts(&self, nvic: &mut Nvic, now: Time) {
        for (timer, (_, line)) in self.timers.iter().zip(TIMERS) {
            if let Some(line) = line {
                nvic.drive(line, timer.interrupts(), now);
            }
        }
    }
}

impl Default for Chip {
    fn default() -> Self {
        Self::new()
    }
}
