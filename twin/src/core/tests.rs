//! The processor's exceptions, by a program of a few instructions.

use super::cpu::Cpu;
use crate::image::Image;
use crate::run::{Settings, machine};
use crate::time::MICROSECOND;
use std::path::Path;
use tractive_rig::talk::System;

/// The program's address, and the words of the vector table before it.
const PROGRAM: u32 = 0x200;
const VECTORS: usize = PROGRAM as usize / 4;
/// The block that reads the comparison's flags, and the handler.
const READS: u32 = PROGRAM + 0x1C;
const HANDLER: u32 = PROGRAM + 0x2A;
/// The interrupt, as an exception.
const EXCEPTION: usize = 45;
/// The place where the program leaves FPSCR and S0.
const LEFT: u32 = 0x2000_2000;

/// Switches the floating-point unit on, compares 1 with 2, and in the next basic block reads the flags and stores them with S0. The handler
/// puts 3 into S0 and compares it with itself.
const CODE: [u32; 17] = [
    0x490E_480D, // ldr r0, CPACR; ldr r1, its value
    0xF3BF_6001, // str r1, [r0]; dsb
    0xF3BF_8F4F, // isb
    0xEEB7_8F6F, // vmov.f32 s0, #1.0
    0xEEF0_0A00, // vmov.f32 s1, #2.0
    0xEEB4_0A00, // vcmp.f32 s0, s1
    0xE7FF_0A60, // b to the next instruction
    0x2A10_EEF1, // vmrs r2, fpscr
    0x601A_4B07, // ldr r3, LEFT; str r2, [r3]
    0x0A01_ED83, // vstr s0, [r3, #4]
    0xEEB0_E7FE, // b to itself; the handler: vmov.f32 s0, #3.0
    0xEEB4_0A08, // vcmp.f32 s0, s0
    0x4770_0A40, // bx lr
    0xBF00_BF00,
    0xE000_ED88, // CPACR
    0x00F0_0000, // its value
    LEFT,
];

/// FPSCR.N: less.
const LESS: u32 = 1 << 31;

/// FPSCR's condition flags and S0 as the program has stored them, with or without an interrupt between the comparison and its use.
fn left(interrupted: bool) -> (u32, f32) {
    let mut words = vec![0; VECTORS];
    (words[0], words[1], words[EXCEPTION]) = (0x2000_1000, 0x0800_0001 + PROGRAM, 0x0800_0001 + HANDLER);
    words.extend(CODE);
    let settings = Settings::new(Path::new(""), System::Pmasynrm, "1 end".to_owned());
    let mut cpu = Cpu::new(&Image::of(&words), machine(&settings).unwrap()).unwrap();
    while cpu.machine().findings.now.1 != 0x0800_0000 + READS {
        let now = cpu.machine().now();
        assert!(now < MICROSECOND * 100);
        cpu.run(now + 1).unwrap();
    }
    let machine = cpu.machine_mut();
    if interrupted {
        let line = EXCEPTION - 16;
        let (register, bit) = (4 * (line as u32 / 32), 1 << (line % 32));
        machine.nvic.write(0xE000_E100 + register, 4, bit, &mut machine.findings);
        machine.nvic.write(0xE000_E200 + register, 4, bit, &mut machine.findings);
    }
    let until = machine.now() + 100 * MICROSECOND;
    cpu.run(until).unwrap();
    assert_eq!(cpu.longest.contains_key(&EXCEPTION), interrupted);
    assert!(cpu.machine().findings.all.is_empty(), "{:?}", cpu.machine().findings.all);
    (cpu.word(LEFT).unwrap() & 0xF << 28, f32::from_bits(cpu.word(LEFT + 4).unwrap()))
}

#[test]
fn an_interrupt_between_a_comparison_and_its_use_leaves_the_flags() {
    assert_eq!(left(false), (LESS, 1.0));
    assert_eq!(left(true), (LESS, 1.0));
}
