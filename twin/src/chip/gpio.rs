//! Pins (RM0440, chapter 9): what drives each, and where each leads.

use super::TIMERS;
use crate::map::Map;
use crate::world::World;
use std::collections::HashMap;

const PORTS: usize = 7;
const PINS: usize = 16 * PORTS;
const MODER: u32 = 0x00;
const PUPDR: u32 = 0x0C;
const IDR: u32 = 0x10;
const ODR: u32 = 0x14;
const BSRR: u32 = 0x18;
const BRR: u32 = 0x28;

/// The driver of a pin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Driver {
    /// An input, or nothing that the twin models: the pin's own pull, or whatever is outside, sets the level.
    Outside,
    /// Switched to the converters.
    Analog,
    /// A level that the program has written.
    Level(bool),
    /// A timer's channel, by its place in [`TIMERS`], from 0, and whether it is the complementary output.
    Timer(usize, usize, bool),
}

/// A signal that a pin leads to, as `("TIM4", "CH1")`.
type Signal = (&'static str, &'static str);

/// The ports.
pub struct Gpio {
    words: [[u32; 11]; PORTS],
    signals: HashMap<(usize, u8), Vec<Signal>>,
    drivers: [Driver; PINS],
    inputs: Vec<(usize, Signal)>,
    /// The pins that lead to each timer's break.
    breaks: [Vec<usize>; TIMERS.len()],
}

/// A pin's place by its name, as `PB13`.
pub fn place(name: &str) -> usize {
    let port = usize::from(name.as_bytes()[1] - b'A');
    16 * port + name[2..].parse::<usize>().unwrap_or(0)
}

/// A pin's name.
pub fn name(place: usize) -> String {
    format!("P{}{}", char::from(b'A' + (place / 16) as u8), place % 16)
}

impl Gpio {
    /// After a reset: analog, but for the debug port's pins.
    pub fn new(map: &Map) -> Self {
        let mut words = [[0; 11]; PORTS];
        for (port, words) in words.iter_mut().enumerate() {
            let (mode, speed, pull) = match port {
                0 => (0xABFF_FFFF, 0x0C00_0000, 0x6400_0000),
                1 => (0xFFFF_FEBF, 0x0000_00C0, 0x0000_0100),
                _ => (u32::MAX, 0, 0),
            };
            (words[0], words[2], words[3]) = (mode, speed, pull);
        }
        let mut signals = HashMap::new();
        for pin in 0..PINS {
            for af in 0..16 {
                let found = map.signals(&name(pin), af);
                if !found.is_empty() {
                    signals.insert((pin, af), found.to_vec());
                }
            }
        }
        let mut gpio = Self {
            words,
            signals,
            drivers: [Driver::Analog; PINS],
            inputs: Vec::new(),
            breaks: Default::default(),
        };
        gpio.connect();
        gpio
    }

    fn port(name: &str) -> usize {
        usize::from(name.as_bytes()[4] - b'A')
    }

    fn connect(&mut self) {
        self.inputs.clear();
        for pin in 0..PINS {
            let (words, number) = (&self.words[pin / 16], pin % 16);
            self.drivers[pin] = match words[0] >> (2 * number) & 0b11 {
                0b00 => Driver::Outside,
                0b01 => Driver::Level(words[5] >> number & 1 != 0),
                0b11 => Driver::Analog,
                _ => {
                    let af = (words[8 + number / 8] >> (4 * (number % 8)) & 0xF) as u8;
                    let signals = self.signals.get(&(pin, af)).map_or(&[][..], Vec::as_slice);
                    self.inputs.extend(signals.iter().map(|signal| (pin, *signal)));
                    signals.iter().find_map(|signal| output(*signal)).unwrap_or(Driver::Outside)
                }
            };
        }
        self.breaks = TIMERS.map(|(timer, _)| self.leading_to((timer, "BKIN")).collect());
    }

    /// The driver of a pin.
    pub fn driver(&self, pin: usize) -> Driver {
        self.drivers[pin]
    }

    /// The pins that lead to a signal.
    pub fn leading_to(&self, signal: Signal) -> impl Iterator<Item = usize> + '_ {
        self.inputs.iter().filter(move |(_, known)| *known == signal).map(|(pin, _)| *pin)
    }

    /// The level of a pin that nothing inside the chip drives.
    fn level(&self, pin: usize, world: &World) -> bool {
        let pull = self.words[pin / 16][(PUPDR / 4) as usize] >> (2 * (pin % 16)) & 0b11;
        world.level(pin).unwrap_or(pull == 0b01)
    }

    /// The level of a timer's break input, by its place in [`TIMERS`]; low where no pin leads to it.
    pub fn break_level(&self, timer: usize, world: &World) -> bool {
        self.breaks[timer].iter().any(|pin| self.level(*pin, world))
    }

    /// A register is read.
    pub fn read(&self, port: &str, offset: u32, world: &World) -> Option<u32> {
        let port = Self::port(port);
        match offset {
            IDR => Some((0..16).fold(0, |word, number| {
                let pin = 16 * port + number;
                let level = match self.drivers[pin] {
                    Driver::Level(level) => level,
                    Driver::Analog => false,
                    Driver::Outside | Driver::Timer(..) => self.level(pin, world),
                };
                word | u32::from(level) << number
            })),
            BSRR | BRR => None,
            _ => self.words[port].get((offset / 4) as usize).copied(),
        }
    }

    /// A register is written; `false` if the twin has no such register.
    pub fn write(&mut self, port: &str, offset: u32, value: u32) -> bool {
        let words = &mut self.words[Self::port(port)];
        let output = &mut words[(ODR / 4) as usize];
        match offset {
            BSRR => *output = *output & !(value >> 16) | value & 0xFFFF,
            BRR => *output &= !value,
            MODER..=PUPDR | ODR | 0x20 | 0x24 => words[(offset / 4) as usize] = value,
            _ => return false,
        }
        self.connect();
        true
    }
}

/// A timer's output as a driver.
fn output((peripheral, signal): Signal) -> Option<Driver> {
    let timer = TIMERS.iter().position(|(name, _)| *name == peripheral)?;
    let channel = signal.strip_prefix("CH")?;
    let (number, complementary) = match channel.strip_suffix('N') {
        Some(number) => (number, true),
        None => (channel, false),
    };
    Some(Driver::Timer(timer, number.parse::<usize>().ok()?.checked_sub(1)?, complementary))
}
