//! The processor's exceptions, by a program of a few instructions.

use super::cpu::{CCM, Cpu};
use crate::finding::Finding;
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

/// The program after it has stored the flags, with or without an interrupt between the comparison and its use.
fn after(interrupted: bool, holds_code_apart: bool) -> Cpu {
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
    if holds_code_apart {
        machine.write_code(CCM.0);
    }
    if interrupted {
        let line = EXCEPTION - 16;
        let (register, bit) = (4 * (line as u32 / 32), 1 << (line % 32));
        machine.nvic.write(0xE000_E100 + register, 4, bit, &mut machine.findings);
        machine.nvic.write(0xE000_E200 + register, 4, bit, &mut machine.findings);
    }
    let until = machine.now() + 100 * MICROSECOND;
    cpu.run(until).unwrap();
    assert_eq!(cpu.longest.contains_key(&EXCEPTION), interrupted);
    cpu
}

/// FPSCR's condition flags and S0 as the program has stored them.
fn left(interrupted: bool) -> (u32, f32) {
    let cpu = after(interrupted, false);
    assert!(cpu.machine().findings.all.is_empty(), "{:?}", cpu.machine().findings.all);
    (cpu.word(LEFT).unwrap() & 0xF << 28, f32::from_bits(cpu.word(LEFT + 4).unwrap()))
}

#[test]
fn an_interrupt_between_a_comparison_and_its_use_leaves_the_flags() {
    assert_eq!(left(false), (LESS, 1.0));
    assert_eq!(left(true), (LESS, 1.0));
}

#[test]
fn an_interrupt_that_executes_from_the_flash_memory_all_the_same_is_found() {
    assert!(after(false, true).machine().findings.all.is_empty());
    let cpu = after(true, true);
    let [finding] = &cpu.machine().findings.all[..] else { panic!("{:?}", cpu.machine().findings.all) };
    assert_eq!(finding.text, "an interrupt executes from the flash memory");
    assert_eq!(finding.pc, 0x0800_0000 + HANDLER);
}

/// The instructions of a program that writes words to addresses, one after another; last it reads the last address.
fn writes(of: &[(u32, u32)]) -> Vec<u32> {
    // ldr r0, its address; ldr r1, the word; str r1, [r0]; a nop. Then ldr r2, [r0]; b to itself.
    let literals = 2 * of.len() as u32 + 1;
    let mut words = Vec::new();
    for index in 0..of.len() as u32 {
        // A literal's offset counts from the word behind the instruction's own word.
        let to_literal = |place: u32, instruction: u32| literals + place - (instruction + 1);
        let load = |register: u32, words: u32| 0x4800 | register << 8 | words;
        let (address, value) = (to_literal(2 * index, 2 * index), to_literal(2 * index + 1, 2 * index));
        words.extend([load(1, value) << 16 | load(0, address), 0xBF00 << 16 | 0x6001]);
    }
    words.push(0xE7FE << 16 | 0x6802);
    words.extend(of.iter().flat_map(|(address, value)| [*address, *value]));
    words
}

/// The processor before a program that writes these words.
fn before(of: &[(u32, u32)]) -> Cpu {
    let mut words = vec![0; VECTORS];
    (words[0], words[1]) = (0x2000_1000, 0x0800_0001 + PROGRAM);
    words.extend(writes(of));
    let settings = Settings::new(Path::new(""), System::Pmasynrm, "1 end".to_owned());
    Cpu::new(&Image::of(&words), machine(&settings).unwrap()).unwrap()
}

/// The report on the first offence of a program that writes these words; `traced`: located by its instruction.
fn offence(of: &[(u32, u32)], traced: bool) -> Finding {
    let mut cpu = before(of);
    if traced {
        cpu.trace().unwrap();
    }
    // A place outside every region ends the emulator, and is found as well.
    let outcome = cpu.run(20 * MICROSECOND);
    let findings = &cpu.machine().findings.all;
    assert!(outcome.is_ok() || !findings.is_empty(), "{outcome:?}");
    findings.first().unwrap_or_else(|| panic!("nothing is found of {of:x?}")).clone()
}

/// All of it protected before the program begins: no hook tells of the write.
#[test]
fn a_write_to_code_that_is_all_protected_is_told_and_comes_to_nothing() {
    let place = CCM.0 + 0x400;
    let mut cpu = before(&[(place, 1)]);
    for (address, value) in [(0x4002_1060, 1), (0x4001_0020, u32::MAX)] {
        cpu.machine_mut().write(address, 4, value);
    }
    cpu.run(20 * MICROSECOND).unwrap();
    let findings = &cpu.machine().findings.all;
    let [finding] = &findings[..] else { panic!("{findings:?}") };
    assert!(finding.text.ends_with("page 1, which is protected"), "{}", finding.text);
    assert_ne!(cpu.word(place).unwrap(), 1);
}

#[test]
fn an_offence_is_told_with_its_address_and_its_place_in_the_program() {
    const ENABLE_APB1: (u32, u32) = (0x4002_1058, 0x400 | 1 << 11 | 1);
    const ENABLE_APB2: (u32, u32) = (0x4002_1060, 1 << 11);
    const ENABLE_SYSCFG: (u32, u32) = (0x4002_1060, 1);
    const ENABLE_DMA: (u32, u32) = (0x4002_1048, 0x100 | 1);
    let cases: [(&[(u32, u32)], &str); 15] = [
        // What the twin does not model: the window watchdog, a DMA channel, the second CAN's clock is off.
        (
            &[ENABLE_APB1, (0x4000_2C00, 0xFF)],
            "WWDG.CR is written with 0x000000ff, which the twin does not model",
        ),
        (&[ENABLE_DMA, (0x4002_0008, 1)], "is written with 0x00000001, which the twin does not model"),
        (&[(0x4000_6818, 0)], "FDCAN2.CCCR is written while its clock is off"),
        // A bit that is not: the second break's.
        (
            &[ENABLE_APB2, (0x4001_2C44, 1 << 24)],
            "bits 0x01000000 of TIM1.BDTR are written, which the twin does not model",
        ),
        // No register there; reserved bits; registers that are only read; halves of a register.
        (&[(0x4000_5FFC, 0)], "0x40005ffc is written, where the chip has no register"),
        (&[ENABLE_APB2, (0x4001_2C00, 1 << 15)], "reserved bits 0x00008000 of TIM1.CR1 are written"),
        (&[(0x4800_0010, 1)], "GPIOA.IDR is written"),
        // Code that is protected, and whose protection cannot be lifted any more.
        (
            &[ENABLE_SYSCFG, (0x4001_0020, 2), (CCM.0, 1), (CCM.0 + 0x400, 1)],
            "a write to the CCM SRAM's page 1, which is protected",
        ),
        (&[ENABLE_SYSCFG, (0x4001_0020, 2), (0x4001_0020, 1)], "SYSCFG.SWPR: a lock cannot be taken back"),
        // Without a clock; locked; out of its order; too fast; not modelled in the private bus.
        (&[(0x4001_2C00, 0)], "TIM1.CR1 is written while its clock is off"),
        (&[(0x4000_3004, 0)], "IWDG is written while it is locked"),
        (&[(0x4002_1008, 0b11)], "RCC.CFGR switches to clock 3, which is not ready"),
        (&[(0xE000_E010, 1)], "the private peripheral bus is written at 0xe000e010"),
        (&[(0x6000_0000, 1)], "at 0x60000000, where nothing is"),
        (&[(0x0800_0000, 1)], "at 0x08000000"),
    ];
    for (of, told) in cases {
        let finding = offence(of, false);
        let text = finding.to_string();
        assert!(text.to_lowercase().contains(&told.to_lowercase()), "{text}, not {told}");
        assert!(text.contains(&format!("block {:#010x}", 0x0800_0000 + PROGRAM)), "{text}");
        let (address, _) = of[of.len() - 1];
        assert!(text.contains(&format!("{address:#010x}")), "{text}");
        // Each write takes eight bytes; the store is its third instruction.
        let store = PROGRAM + 8 * (of.len() as u32 - 1) + 4;
        assert_eq!(offence(of, true).pc, 0x0800_0000 + store, "{text}");
    }
}
