//! The images of both systems, ready to be driven.

use tractive_rig::talk::System;
use tractive_twin::core::cpu::Cpu;
use tractive_twin::image::Image;
use tractive_twin::run::{Settings, prepare};

/// A system's image with the motor at its pins, its link charged; `mistake` is made in each value that the image writes. The script is that of
/// its system: the PMaSynRM's, the ZS9's.
pub fn prepared(
    system: System,
    [pmasynrm, zs9]: [&str; 2],
    mistake: Option<fn(u32, u32) -> u32>,
) -> (Settings, Cpu, Image) {
    let (name, script) = match system {
        System::Pmasynrm => ("TRACTIVE_NUCLEO_IMAGE", pmasynrm),
        System::Zs9 => ("TRACTIVE_NUCLEO_ZS9_IMAGE", zs9),
    };
    let image = std::env::var_os(name).expect(name);
    let settings = Settings::new(image.as_ref(), system, script.to_owned());
    let (mut cpu, image) = prepare(&settings).unwrap();
    let machine = cpu.machine_mut();
    machine.mistake = mistake;
    machine.world.side.charge();
    (settings, cpu, image)
}

/// Nothing is found, and every expectation met, where no mistake is made.
pub fn is_sound(cpu: &Cpu) {
    let machine = cpu.machine();
    if machine.mistake.is_none() {
        assert!(machine.findings.all.is_empty(), "{:?}", machine.findings.all);
        assert!(machine.world.talk.failures.is_empty(), "{:?}", machine.world.talk.failures);
    }
}
