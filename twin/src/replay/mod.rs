//! The host's edges from the same inputs: the drive's tasks run on the host with the conversions, counts and flags that the image's interrupts read and
//! with the commands that its idle loop left in the mailbox, and make the pulses that the host would play. The edges at the gates' pins are compared
//! with these.

pub mod edges;
mod given;
mod place;
mod traction;
mod zs9;

use crate::core::cpu::Cpu;
use crate::image::Image;
use crate::machine::Machine;
use crate::run::Settings;
use crate::stage;
use anyhow::{Context, Result};
use edges::{Compared, Scale, Span, compare};
use given::{Given, Stream};
use tractive::time::Instant;
use tractive_rig::machine::Machine as Motor;
use tractive_rig::scenario::System as _;
use tractive_rig::scenario::traction::Traction;
use tractive_rig::scenario::zs9::Zs9;
use tractive_rig::talk::System;

/// The core's clock, in Hz.
const CORE_HZ: u32 = 170_000_000;
/// Words of a command in the operator's mailbox, of either system.
const WORDS: usize = 7;
/// The mailbox's fields in the image's SHARED.
const SLOTS: [&str; 3] = ["operator", "command", "slots"];
/// The image's variables with the sensors' zeros, and how many each holds.
const ZEROS: [(&str, u32); 2] = [("CONTROL_ZEROS", 3), ("PWM_ZEROS", 3)];
const ZEROS_ZS9: [(&str, u32); 1] = [("ZEROS", 7)];

/// A system's tasks on the host, given what the image's were given.
trait Tasks {
    /// A command of the operator's mailbox, by its words, as the image's idle loop has left it there.
    fn command(&mut self, words: [u32; WORDS]);

    /// An interrupt.
    fn run(&mut self, given: &Given);

    /// The edges of all pulses so far.
    fn spans(&self, scale: &Scale) -> Vec<Span>;

    /// Cycles of the tick in which its pulses are laid.
    fn tick_cycles(&self) -> u32;
}

/// The commands that the operator's mailbox has held, and from when on each holds.
struct Commands<C>(Vec<(Instant, C)>);

impl<C: Copy + Default> Commands<C> {
    fn add(&mut self, from: u32, command: impl FnOnce() -> C) {
        let from = Instant(from);
        if !self.0.iter().rev().any(|(known, _)| *known == from) {
            self.0.push((from, command()));
        }
    }

    fn at(&self, now: Instant) -> C {
        let held = self.0.iter().rev().find(|(from, _)| now.reached(*from));
        held.map_or_else(C::default, |(_, command)| *command)
    }
}

/// The tasks on the host beside the image.
pub struct Replay {
    system: System,
    stage: std::path::PathBuf,
    stream: Stream,
    tasks: Option<Box<dyn Tasks>>,
    slots: u32,
    /// The places of the sensors' zeros.
    zeros: Vec<u32>,
}

impl Replay {
    /// Beside a system's image. The error says what of it cannot be found.
    pub fn new(settings: &Settings, image: &Image) -> Result<Self> {
        let known: &[_] = match settings.system {
            System::Pmasynrm => &ZEROS,
            System::Zs9 => &ZEROS_ZS9,
        };
        let mut zeros = Vec::new();
        for (name, count) in known {
            let base = image.variable(name).with_context(|| format!("no symbol {name}"))?;
            zeros.extend((0..*count).map(|index| base + 4 * index));
        }
        Ok(Self {
            system: settings.system,
            stage: settings.stage(),
            stream: Stream::new(settings.system),
            tasks: None,
            slots: place::place(&settings.image, "SHARED", &SLOTS)?,
            zeros,
        })
    }

    /// Follows the image: call it at least once in a slot of the operator.
    pub fn follow(&mut self, cpu: &mut Cpu) -> Result<()> {
        let accesses = cpu.machine_mut().record.replace(Vec::new()).unwrap_or_default();
        let given = self.stream.take(&accesses);
        if self.stream.started.is_none() {
            return Ok(());
        }
        if self.tasks.is_none() {
            let zeros: Vec<u32> = self.zeros.iter().map(|at| cpu.word(*at)).collect::<Result<_>>()?;
            self.tasks = Some(self.begin(&zeros)?);
        }
        let Some(tasks) = &mut self.tasks else { return Ok(()) };
        for slot in 0..2 {
            let mut words = [0; WORDS];
            for (index, word) in (0..).zip(&mut words) {
                *word = cpu.word(self.slots + 4 * (WORDS as u32 * slot + index))?;
            }
            tasks.command(words);
        }
        given.iter().for_each(|given| tasks.run(given));
        Ok(())
    }

    /// The tasks at rest. The zeros are those that the image has measured.
    fn begin(&self, zeros: &[u32]) -> Result<Box<dyn Tasks>> {
        Ok(match self.system {
            System::Pmasynrm => {
                let stage = stage::keys(&self.stage)?;
                Box::new(traction::Host::new(&stage, Motor::load(Traction::MACHINE)?.tables, zeros))
            }
            System::Zs9 => {
                let stage = stage::keys(&self.stage)?;
                Box::new(zs9::Host::new(&stage, Motor::load(Zs9::MACHINE)?.tables, zeros))
            }
        })
    }

    /// The edges at the pins beside the host's. The dead time is the generator's own, which is not shorter than asked for.
    pub fn compare(&self, machine: &Machine) -> Compared {
        let cycle = machine.cycle();
        let (Some(tasks), Some(started)) = (&self.tasks, self.stream.started) else {
            return Compared::default();
        };
        let dead = machine.chip.timer("TIM1").map_or(0, |timer| timer.dead(cycle));
        let scale = Scale { started, cycle, dead, ended: machine.now() };
        let (gates, tick) = (machine.world.wiring().gates.len(), cycle * u64::from(tasks.tick_cycles()));
        compare(&tasks.spans(&scale), &machine.world.edges, gates, tick, scale.ended)
    }
}
