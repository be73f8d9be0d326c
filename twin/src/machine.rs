//! The machine around the processor: time, chip, motor, and what is found wrong.

use crate::chip::Chip;
use crate::core::cpu::Stop;
use crate::core::nvic::Nvic;
use crate::finding::Findings;
use crate::time::{Time, seconds};
use crate::world::World;

/// The longest time that nothing is looked at.
const LONGEST: Time = 20 * crate::time::MICROSECOND;
/// The private peripheral bus.
const PRIVATE: u32 = 0xE000_0000;
const PRIVATE_END: u32 = 0xE001_0000;

/// The machine.
pub struct Machine {
    /// The interrupt controller.
    pub nvic: Nvic,
    /// The chip's peripherals.
    pub chip: Chip,
    /// The world at its pins.
    pub world: World,
    /// The findings.
    pub findings: Findings,
    /// The mistake that a run is made with: what becomes of a write on its way.
    pub mistake: Option<fn(u32, u32) -> u32>,
    /// The reason why the emulator was stopped.
    pub stop: Option<Stop>,
    /// The instant at which the run ends.
    pub until: Time,
    /// An interrupt is pending that may not be taken.
    pub masked: bool,
    now: Time,
    next: Time,
    /// The block before which the emulator has stopped: its cost is counted already.
    counted: Option<u32>,
}

impl Machine {
    /// At the release of reset.
    pub fn new(chip: Chip, world: World) -> Self {
        Self {
            nvic: Nvic::default(),
            chip,
            world,
            findings: Findings::default(),
            mistake: None,
            stop: None,
            until: 0,
            masked: false,
            now: 0,
            next: 0,
            counted: None,
        }
    }

    /// The instant.
    pub fn now(&self) -> Time {
        self.now
    }

    /// The core's cycle.
    pub fn cycle(&self) -> Time {
        self.chip.rcc.cycle()
    }

    /// The instant and the place, in words.
    pub fn told(&self) -> String {
        format!("{:.6} s, block {:#010x}", seconds(self.now), self.findings.now.1)
    }

    /// Cycles pass.
    pub fn pass(&mut self, cycles: u32) {
        self.now += Time::from(cycles) * self.cycle();
        if self.now >= self.next {
            self.settle();
        }
    }

    /// A basic block begins; `true` if the emulator is to stop before it.
    pub fn block(&mut self, address: u32, cycles: u32) -> bool {
        self.findings.now = (self.now, address);
        if self.counted.take() != Some(address) {
            self.pass(cycles);
        }
        let stop = if self.wants_interrupt() {
            Stop::Interrupt
        } else if self.now >= self.until || self.world.done {
            Stop::Done
        } else {
            return false;
        };
        self.counted = Some(address);
        self.stop = Some(stop);
        true
    }

    /// `true` if an interrupt is to be taken, unless it is masked.
    pub fn wants_interrupt(&self) -> bool {
        !self.masked && self.nvic.next(false).is_some()
    }

    /// Does everything that is due, instant by instant.
    pub fn settle(&mut self) {
        let Self { chip, world, findings, nvic, now, .. } = self;
        self.masked = false;
        loop {
            let due = chip.next_event().min(world.next_event()).min(*now);
            if !nvic.has_fpu() && chip.is_pulsing() {
                findings.add("the gates pulse before CPACR has switched the floating-point unit on");
            }
            world.advance(due);
            world.act(due, chip);
            chip.act(due, world, findings);
            world.see_gates(due, chip, findings);
            if due >= *now {
                break;
            }
        }
        chip.drive_interrupts(nvic);
        self.next = chip.next_event().min(world.next_event()).min(*now + LONGEST);
    }

    /// The program reads.
    pub fn read(&mut self, address: u32, size: usize) -> u32 {
        if (PRIVATE..PRIVATE_END).contains(&address) {
            return self.nvic.read(address, &mut self.findings);
        }
        self.chip.read(address, size, self.now, &mut self.world, &mut self.findings)
    }

    /// The program writes.
    pub fn write(&mut self, address: u32, size: usize, value: u32) {
        let value = self.mistake.map_or(value, |mistake| mistake(address, value));
        if (PRIVATE..PRIVATE_END).contains(&address) {
            self.nvic.write(address, size, value, &mut self.findings);
            return;
        }
        // All that happens before it, then the write, then all that it brings about.
        self.settle();
        self.chip.write(address, size, value, self.now, &mut self.findings);
        self.settle();
    }
}
