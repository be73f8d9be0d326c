//! A run: an image, a script of commands over CAN, and what came of them.

use crate::chip::Chip;
use crate::core::cpu::Cpu;
use crate::image::Image;
use crate::machine::Machine;
use crate::stage::PowerStage;
use crate::time::{MILLISECOND, SECOND, Time};
use crate::world::{Rotor, World};
use anyhow::{Result, ensure};
use std::path::{Path, PathBuf};
use tractive_rig::machine::Machine as Motor;
use tractive_rig::plant::{DcLink, Plant, PlantSettings, SpeedSource};
use tractive_rig::scenario::traction::scaled_link;
use tractive_rig::talk::{Lines, System, Talk, script};

/// The longest run, in s.
const LONGEST_S: Time = 600;
/// The time between two looks at what has been found.
const LOOK: Time = 10 * MILLISECOND;

/// The settings of a run.
pub struct Settings {
    /// The image.
    pub image: PathBuf,
    /// The power stage's file.
    pub stage: PathBuf,
    /// The machine's name or folder.
    pub machine: String,
    /// The script's text.
    pub script: String,
    /// The rotor's inertia, in kg·m².
    pub inertia_kg_m2: f64,
}

impl Settings {
    /// The delivered power stage and machine, and a script.
    pub fn new(image: &Path, script: String) -> Self {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        Self {
            image: image.to_owned(),
            stage: root.join("boards/nucleo-g474re/power_stage.toml"),
            machine: "pmasynrm-180kw".to_owned(),
            script,
            inertia_kg_m2: System::Pmasynrm.inertia_kg_m2(),
        }
    }
}

/// The image in its machine, at the release of reset.
pub fn prepare(settings: &Settings) -> Result<(Cpu, Image)> {
    let image = Image::read(&settings.image)?;
    let motor = Motor::load(&settings.machine)?;
    let parameters = &motor.folder.parameters;
    let lines = Lines::Script(script::script(&settings.script, System::Pmasynrm)?.into());
    let talk = Talk::new(System::Pmasynrm, lines, settings.inertia_kg_m2, parameters.max_torque_nm);
    let speed = SpeedSource::profile(vec![(0.0, 0.0)]);
    let plant = Plant::new(&motor.folder, speed, &PlantSettings::default());
    let link = DcLink::new(scaled_link(&motor));
    let rotor = Rotor { inertia_kg_m2: settings.inertia_kg_m2, pole_pairs: parameters.pole_pairs.into() };
    let world = World::new(plant, link, talk, PowerStage::read(&settings.stage)?, rotor);
    Ok((Cpu::new(&image, Machine::new(Chip::new(), world))?, image))
}

/// Runs until the script ends, or something is found.
pub fn drive(cpu: &mut Cpu) -> Result<()> {
    loop {
        let machine = cpu.machine();
        if machine.world.done || !machine.findings.all.is_empty() {
            return Ok(());
        }
        let now = machine.now();
        ensure!(now < LONGEST_S * SECOND, "the script has not ended after {LONGEST_S} s");
        cpu.run(now + LOOK)?;
    }
}
