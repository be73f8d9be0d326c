//! The host's edges of the same inputs: the drive's tasks, run on the host with the conversions, counts and flags that the image's interrupts
//! read and with the commands that its idle loop left in the mailbox, make the halves that the host would play; the edges at the gates' pins
//! are held against them.

pub mod edges;
mod given;
pub mod host;
mod place;

use crate::core::cpu::Cpu;
use crate::image::Image;
use crate::machine::Machine;
use crate::run::Settings;
use crate::stage;
use crate::time::Time;
use anyhow::{Context, Result};
use edges::{Compared, Scale, compare};
use given::Stream;
use host::{Host, Stage};
use tractive_rig::machine::Machine as Motor;
use tractive_rig::scenario::System as _;
use tractive_rig::scenario::traction::Traction;

/// The words of a command in the operator's mailbox.
const WORDS: u32 = 7;
/// The mailbox's fields in the image's SHARED.
const SLOTS: [&str; 3] = ["operator", "command", "slots"];

/// The tasks on the host beside the image.
pub struct Replay {
    stage: Stage,
    stream: Stream,
    host: Option<Host>,
    slots: u32,
    zeros: [u32; 2],
}

impl Replay {
    /// Beside the PMaSynRM's image. The error says what of it cannot be found.
    pub fn new(settings: &Settings, image: &Image) -> Result<Self> {
        let zeros = |name: &str| image.variable(name).with_context(|| format!("no symbol {name}"));
        Ok(Self {
            stage: stage::keys(&settings.stage())?,
            stream: Stream::default(),
            host: None,
            slots: place::place(&settings.image, "SHARED", &SLOTS)?,
            zeros: [zeros("CONTROL_ZEROS")?, zeros("PWM_ZEROS")?],
        })
    }

    /// Follows the image: call it at least once in a slot of the operator.
    pub fn follow(&mut self, cpu: &mut Cpu) -> Result<()> {
        let accesses = cpu.machine_mut().record.replace(Vec::new()).unwrap_or_default();
        let given = self.stream.take(&accesses);
        if self.stream.started.is_none() {
            return Ok(());
        }
        let host = match &mut self.host {
            Some(host) => host,
            None => {
                let word = |base: u32, phase: u32| cpu.word(base + 4 * phase);
                let mut zeros = [[0; 3]; 2];
                for (zeros, base) in zeros.iter_mut().zip(self.zeros) {
                    *zeros = [word(base, 0)?, word(base, 1)?, word(base, 2)?];
                }
                let tables = Motor::load(Traction::MACHINE)?.tables;
                self.host.insert(Host::new(&self.stage, tables, zeros))
            }
        };
        for slot in 0..2 {
            let mut words = [0; WORDS as usize];
            for (index, word) in (0..).zip(&mut words) {
                *word = cpu.word(self.slots + 4 * (WORDS * slot + index))?;
            }
            host.command(words);
        }
        given.iter().for_each(|given| host.run(given));
        Ok(())
    }

    /// The edges at the pins beside the host's. The dead time is the generator's own, which is not shorter than asked for.
    pub fn compare(&self, machine: &Machine) -> Compared {
        let cycle = machine.cycle();
        let (Some(host), Some(started)) = (&self.host, self.stream.started) else {
            return Compared::default();
        };
        let dead = machine.chip.timer("TIM1").map_or(0, |timer| timer.dead(cycle));
        let tick = cycle * Time::from(self.stage.prescaler());
        let scale = Scale { started, tick, dead, ended: machine.now() };
        compare(&host.halves, &machine.world.edges, &scale)
    }
}
