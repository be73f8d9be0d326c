//! The machine around the processor: time, chip, motor, and what is found wrong.

use crate::chip::Chip;
use crate::core::cost::Cost;
use crate::core::cpu::{CCM, Stop};
use crate::core::nvic::Nvic;
use crate::finding::Findings;
use crate::image::FLASH;
use crate::time::{Time, seconds};
use crate::world::World;

/// The longest time that nothing is looked at.
const LONGEST: Time = 20 * crate::time::MICROSECOND;
/// The private peripheral bus.
const PRIVATE: u32 = 0xE000_0000;
const PRIVATE_END: u32 = 0xE001_0000;

/// An access of the program, for whoever replays it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Access {
    /// The instant.
    pub at: Time,
    /// The exception that it was made in; 0 is none.
    pub exception: usize,
    /// The kind, with address and value.
    pub what: What,
}

/// The kind of an access.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum What {
    /// The exception began.
    Entry,
    /// A value was read at an address.
    Read(u32, u32),
    /// A value was written to an address.
    Write(u32, u32),
}

/// Cycles that reading from the flash memory would add, since the beginning.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Waits {
    /// With the prefetch alone, less the cycles that branches that were not taken have saved.
    pub prefetched: i64,
    /// Without any cache or prefetch.
    pub all: u64,
}

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
    /// A reset by the watchdog is intended.
    pub may_bite: bool,
    /// The resets so far, without the first.
    pub resets: u32,
    /// The mistake that a run is made with: the change that it makes to a write on its way.
    pub mistake: Option<fn(u32, u32) -> u32>,
    /// Every access to a peripheral, and every entry into an exception, if they are kept.
    pub record: Option<Vec<Access>>,
    /// Cycles that reading from the flash memory would add, if they are counted.
    pub waits: Option<Waits>,
    /// The reason why the emulator was stopped.
    pub stop: Option<Stop>,
    /// The instant at which the run ends.
    pub until: Time,
    /// An interrupt is pending that may not be taken.
    pub masked: bool,
    /// The same, but only for one block.
    pub deferred: bool,
    /// The interrupts' code is in the CCM SRAM.
    holds_code_apart: bool,
    now: Time,
    settled: Time,
    next: Time,
    /// The end of the last block.
    block_end: u32,
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
            may_bite: false,
            resets: 0,
            mistake: None,
            record: None,
            waits: None,
            stop: None,
            until: 0,
            masked: false,
            deferred: false,
            holds_code_apart: false,
            now: 0,
            settled: 0,
            next: 0,
            block_end: 0,
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

    /// More waits for the flash memory, if they are counted.
    pub fn wait(&mut self, prefetched: i64, all: u32) {
        if let Some(waits) = &mut self.waits {
            waits.prefetched += prefetched;
            waits.all += u64::from(all);
        }
    }

    /// A basic block begins; `true` if the emulator is to stop before it.
    pub fn block(&mut self, address: u32, size: u32, cost: Cost) -> bool {
        self.findings.now = (self.now, address);
        if self.counted.take() != Some(address) {
            // What had to wait for the block before comes now.
            self.masked &= !std::mem::take(&mut self.deferred);
            let led_on = if self.block_end == address { cost.led_on } else { 0 };
            self.wait(i64::from(cost.prefetched) - i64::from(led_on), cost.waits);
            self.block_end = address + size;
            if self.holds_code_apart
                && self.nvic.in_interrupt()
                && (FLASH.0..FLASH.0 + FLASH.1).contains(&address)
            {
                self.findings.add("an interrupt executes from the flash memory");
            }
            self.pass(cost.cycles);
        }
        let stop = if self.wants_reset() {
            Stop::Reset
        } else if self.wants_interrupt() {
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

    /// The program writes to the CCM SRAM: from now on the interrupts' code is there, all of it.
    pub fn write_code(&mut self, address: u32) {
        self.holds_code_apart = true;
        let offset = address - CCM.0;
        self.findings.access = Some(address);
        let is_protected = self.chip.system.is_protected(offset);
        self.findings.expect(!is_protected, || {
            format!("a write to the CCM SRAM's page {}, which is protected", offset >> 10)
        });
        self.findings.access = None;
    }

    /// `true` if an interrupt is to be taken, unless it is masked.
    pub fn wants_interrupt(&self) -> bool {
        !self.masked && self.nvic.next(false).is_some()
    }

    /// `true` once the watchdog has bitten.
    pub fn wants_reset(&self) -> bool {
        self.chip.watchdog.has_bitten
    }

    /// The chip is reset, with these flags of the cause; the world goes on.
    pub fn reset(&mut self, cause: u32) {
        let crystal = self.chip.rcc.crystal;
        self.chip = Chip::new();
        self.chip.rcc.crystal = crystal;
        self.chip.rcc.set_cause(cause);
        self.nvic = Nvic::default();
        (self.counted, self.masked, self.next) = (None, false, 0);
        self.resets += 1;
        self.settle();
    }

    /// The crystal stops.
    pub fn stop_crystal(&mut self) {
        self.settle();
        self.settled = self.now;
        if self.chip.rcc.lose_crystal() {
            self.nvic.pend(crate::core::nvic::NMI);
        }
        self.settle();
    }

    /// Does everything that is due, instant by instant.
    pub fn settle(&mut self) {
        let Self { chip, world, findings, nvic, now, settled, .. } = self;
        self.masked = false;
        loop {
            // Time never goes back: whatever a changed clock has made overdue happens now.
            let due = chip.next_event().min(world.next_event()).min(*now).max(*settled);
            *settled = due;
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
        chip.drive_interrupts(nvic, *now);
        if chip.watchdog.has_bitten && !self.may_bite {
            findings.add("the watchdog resets the chip");
        }
        self.next = chip.next_event().min(world.next_event()).min(*now + LONGEST);
    }

    /// The program reads.
    pub fn read(&mut self, address: u32, size: usize) -> u32 {
        self.findings.access = Some(address);
        let is_private = (PRIVATE..PRIVATE_END).contains(&address);
        let value = match is_private {
            true => self.nvic.read(address, &mut self.findings),
            false => self.chip.read(address, size, self.now, &mut self.world, &mut self.findings),
        };
        self.findings.access = None;
        if !is_private {
            self.keep(What::Read(address, value));
        }
        value
    }

    /// Keeps what is done now, if that is wanted.
    pub fn keep(&mut self, what: What) {
        if let Some(record) = &mut self.record {
            let exception = self.nvic.active.last().copied().unwrap_or(0);
            record.push(Access { at: self.now, exception, what });
        }
    }

    /// The program writes.
    pub fn write(&mut self, address: u32, size: usize, value: u32) {
        let value = self.mistake.map_or(value, |mistake| mistake(address, value));
        if (PRIVATE..PRIVATE_END).contains(&address) {
            self.findings.access = Some(address);
            self.nvic.write(address, size, value, &mut self.findings);
            self.findings.access = None;
            return;
        }
        self.keep(What::Write(address, value));
        // First all that happens before it, then the write, then all its effects.
        self.settle();
        self.findings.access = Some(address);
        self.chip.write(address, size, value, self.now, &mut self.findings);
        self.findings.access = None;
        self.settle();
    }
}
