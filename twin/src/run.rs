//! A run: an image, a script of commands over CAN, and what came of them.

use crate::chip::Chip;
use crate::core::cpu::Cpu;
use crate::finding::Finding;
use crate::image::Image;
use crate::machine::Machine;
use crate::replay::Replay;
use crate::stage::PowerStage;
use crate::time::{MILLISECOND, SECOND, Time};
use crate::world::side::{Side, Traction, Zs9};
use crate::world::{Rotor, World, wiring};
use anyhow::{Context, Result, ensure};
use std::path::{Path, PathBuf};
use tractive_rig::machine::Machine as Motor;
use tractive_rig::plant::zs9::{Zs9Plant, Zs9Settings};
use tractive_rig::plant::{DcLink, Plant, PlantSettings, SpeedSource};
use tractive_rig::scenario::System as _;
use tractive_rig::scenario::traction::scaled_link;
use tractive_rig::scenario::{traction, zs9};
use tractive_rig::talk::{Lines, System, Talk, script};

/// The longest run, in s.
const LONGEST_S: Time = 600;
/// The time between two looks at what has been found.
const LOOK: Time = 10 * MILLISECOND;

/// The same with the tasks on the host beside it: half a slot of the operator.
const BESIDE: Time = MILLISECOND / 2;

/// The settings of a run.
pub struct Settings {
    /// The image.
    pub image: PathBuf,
    /// The system that it is the image of.
    pub system: System,
    /// The script's name.
    pub name: String,
    /// The script's text.
    pub script: String,
    /// The rotors' inertia, in kg·m².
    pub inertia_kg_m2: f64,
}

impl Settings {
    /// The delivered power stage and machine, and a script.
    pub fn new(image: &Path, system: System, script: String) -> Self {
        Self {
            image: image.to_owned(),
            system,
            name: "script".to_owned(),
            script,
            inertia_kg_m2: system.inertia_kg_m2(),
        }
    }

    /// The same with the script of a file. The error names it.
    pub fn of_file(image: &Path, system: System, file: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(file).with_context(|| file.display().to_string())?;
        Ok(Self { name: file.display().to_string(), ..Self::new(image, system, text) })
    }

    /// The power stage's file.
    pub fn stage(&self) -> PathBuf {
        let name = match self.system {
            System::Pmasynrm => "power_stage.toml",
            System::Zs9 => "power_stage_zs9.toml",
        };
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../boards/nucleo-g474re").join(name)
    }
}

/// The image in its machine, at the release of reset.
pub fn prepare(settings: &Settings) -> Result<(Cpu, Image)> {
    let image = Image::read(&settings.image)?;
    Ok((Cpu::new(&image, machine(settings)?)?, image))
}

/// The machine around the processor, at the release of reset.
pub fn machine(settings: &Settings) -> Result<Machine> {
    let motor = motor(settings.system)?;
    let wiring = match settings.system {
        System::Pmasynrm => &wiring::TRACTION,
        System::Zs9 => &wiring::ZS9,
    };
    let parameters = &motor.folder.parameters;
    let lines = Lines::Script(script::script(&settings.script, settings.system)?.into());
    let talk = Talk::new(settings.system, lines, settings.inertia_kg_m2, &motor.tables.ratings);
    let rotor = Rotor { inertia_kg_m2: settings.inertia_kg_m2, pole_pairs: parameters.pole_pairs.into() };
    let world =
        World::new(side(settings.system, &motor), wiring, talk, PowerStage::read(&settings.stage())?, rotor);
    Ok(Machine::new(Chip::new(), world))
}

/// The machine of a system's image.
pub fn motor(system: System) -> Result<Motor> {
    Motor::load(match system {
        System::Pmasynrm => traction::Traction::MACHINE,
        System::Zs9 => zs9::Zs9::MACHINE,
    })
}

fn side(system: System, motor: &Motor) -> Side {
    let speed = || SpeedSource::profile(vec![(0.0, 0.0)]);
    match system {
        System::Pmasynrm => Side::Traction(Box::new(Traction {
            plant: Plant::new(&motor.folder, speed(), &PlantSettings::default()),
            link: DcLink::new(scaled_link(motor)),
            rows: Vec::new(),
            slots: Vec::new(),
        })),
        System::Zs9 => {
            let plant = Zs9Plant::new([&motor.folder; 2], [speed(), speed()], &Zs9Settings::default());
            Side::Zs9(Box::new(Zs9::new(plant, tractive_rig::zs9::line::TIMES)))
        }
    }
}

/// The address of the instruction that made a finding: the run is prepared anew and repeated, its end instruction by instruction; `None` if it does not
/// get there.
pub fn instruction(cpu: &mut Cpu, finding: &Finding) -> Result<Option<u32>> {
    cpu.run(finding.at.saturating_sub(MILLISECOND))?;
    cpu.trace()?;
    // The finding may end the emulator, too.
    let _ = cpu.run(finding.at + MILLISECOND);
    let again = cpu.machine().findings.all.first();
    Ok(again.filter(|again| again.text == finding.text).map(|again| again.pc))
}

/// Runs until the script ends, or something is found.
pub fn drive(cpu: &mut Cpu) -> Result<()> {
    drive_beside(cpu, None)
}

/// The same with the tasks on the host beside it.
pub fn drive_beside(cpu: &mut Cpu, mut replay: Option<&mut Replay>) -> Result<()> {
    let look = if replay.is_some() { BESIDE } else { LOOK };
    if replay.is_some() {
        cpu.machine_mut().record = Some(Vec::new());
    }
    loop {
        let machine = cpu.machine();
        if machine.world.done || !machine.findings.all.is_empty() {
            return Ok(());
        }
        let now = machine.now();
        ensure!(now < LONGEST_S * SECOND, "the script has not ended after {LONGEST_S} s");
        cpu.run(now + look)?;
        if let Some(replay) = &mut replay {
            replay.follow(cpu)?;
        }
    }
}
