//! The instructions of an image, decoded by Capstone: where each may go, whether it masks interrupts, what it costs.

pub mod cost;

use anyhow::{Context, Result};
use capstone::arch::DetailsArchInsn;
use capstone::arch::arm::{ArchExtraMode, ArchMode, ArmCC, ArmOperandType, ArmReg};
use capstone::prelude::*;
use std::collections::BTreeMap;

/// The operands as they are written.
pub type Operand = ArmOperandType;

/// The meaning of an instruction for the flow between functions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Flow {
    /// A direct branch to this address, conditional or not, with or without a return address.
    To(u32),
    /// A branch to the address in a register or a memory word, other than a return.
    Indirect,
    /// MOVW: the register's lower half, the upper one cleared.
    Low { register: u16, half: u16 },
    /// MOVT: the register's upper half.
    High { register: u16, half: u16 },
    /// None of these.
    #[default]
    Other,
}

/// An instruction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Instruction {
    /// Bytes.
    pub length: u32,
    pub flow: Flow,
    /// BL: a direct branch that keeps the return address.
    pub links: bool,
    /// CPSID; MSR to PRIMASK, BASEPRI, BASEPRI_MAX or FAULTMASK.
    pub masks: bool,
    /// Cycles at most, without the refill where it branches.
    pub cycles: u32,
    /// The number of bytes by which it moves the stack pointer.
    pub stack_move: i32,
}

/// The instructions of a piece of code without literals, by their addresses.
pub fn decode(address: u32, code: &[u8]) -> Result<BTreeMap<u32, Instruction>> {
    let m_class = [ArchExtraMode::MClass].into_iter();
    let capstone = Capstone::new().arm().mode(ArchMode::Thumb).extra_mode(m_class).detail(true).build()?;
    let (mut found, mut at) = (BTreeMap::new(), 0);
    while at + 1 < code.len() {
        for decoded in capstone.disasm_all(&code[at..], u64::from(address) + at as u64)?.iter() {
            found.insert(u32::try_from(decoded.address())?, instruction(&capstone, decoded)?);
            at += decoded.len();
        }
        if at + 1 < code.len() {
            // Anything that is not an instruction goes nowhere.
            let length = if code[at + 1] >> 3 < 0b11101 { 2 } else { 4 };
            found.insert(address + at as u32, Instruction { length, cycles: 1, ..Instruction::default() });
            at += length as usize;
        }
    }
    Ok(found)
}

fn instruction(capstone: &Capstone, decoded: &capstone::Insn) -> Result<Instruction> {
    let detail = capstone.insn_detail(decoded)?;
    let arch = detail.arch_detail();
    let arm = arch.arm().context("an instruction of another architecture")?;
    let operands: Vec<Operand> = arm.operands().map(|operand| operand.op_type).collect();
    let name = name(decoded.mnemonic().unwrap_or_default(), arm.cc());
    let register = decoded.op_str().unwrap_or_default();
    let is_mask = ["primask", "basepri", "faultmask"].iter().any(|mask| register.starts_with(mask));
    Ok(Instruction {
        length: decoded.len() as u32,
        flow: flow(name, &operands),
        links: name == "bl",
        masks: name == "cpsid" || name == "msr" && is_mask,
        cycles: cost::cycles(name, &operands),
        stack_move: cost::stack_move(name, &operands, arm.writeback()),
    })
}

/// The mnemonic without its width, its type and its condition.
fn name(mnemonic: &str, condition: ArmCC) -> &str {
    let name = mnemonic.split('.').next().unwrap_or(mnemonic);
    let is_conditional = !matches!(condition, ArmCC::ARM_CC_AL | ArmCC::ARM_CC_INVALID);
    let bare = name.len().checked_sub(2).filter(|length| is_conditional && *length > 0);
    bare.and_then(|length| name.get(..length)).unwrap_or(name)
}

fn flow(name: &str, operands: &[Operand]) -> Flow {
    let half = |value: &i32| *value as u16;
    match (name, operands) {
        ("b" | "bl" | "cbz" | "cbnz", [.., Operand::Imm(target)]) => Flow::To(target.cast_unsigned()),
        // Through the link register it is a return.
        ("bx", [to]) | ("mov", [PC, to]) if *to != LR => Flow::Indirect,
        ("blx", _) => Flow::Indirect,
        // From the stack it is a return.
        ("ldr", [PC, Operand::Mem(memory), ..]) if Operand::Reg(memory.base()) != SP => Flow::Indirect,
        ("movw", [Operand::Reg(register), Operand::Imm(value)]) => {
            Flow::Low { register: register.0, half: half(value) }
        }
        ("movt", [Operand::Reg(register), Operand::Imm(value)]) => {
            Flow::High { register: register.0, half: half(value) }
        }
        _ => Flow::Other,
    }
}

const fn register(number: u32) -> Operand {
    Operand::Reg(RegId(number as u16))
}

/// The stack pointer, the link register and the program counter.
pub const SP: Operand = register(ArmReg::ARM_REG_SP);
const LR: Operand = register(ArmReg::ARM_REG_LR);
const PC: Operand = register(ArmReg::ARM_REG_PC);

#[cfg(test)]
pub mod tests {
    use super::*;

    /// The instruction of these half-words at an address.
    pub fn one(address: u32, first: u16, second: u16) -> Instruction {
        let bytes = [first.to_le_bytes(), second.to_le_bytes()].concat();
        decode(address, &bytes).unwrap()[&address]
    }

    #[test]
    fn branches_and_where_they_lead() {
        for (first, second, to, length, links) in [
            (0xF000, 0xF800, 0x404, 4, true),  // bl
            (0xF7FF, 0xFFFE, 0x400, 4, true),  // bl to itself
            (0xF000, 0xB800, 0x404, 4, false), // b.w
            (0xF43F, 0xAFFE, 0x400, 4, false), // beq.w
            (0xE7FE, 0, 0x400, 2, false),      // b
            (0xD000, 0, 0x404, 2, false),      // beq
        ] {
            let found = one(0x400, first, second);
            assert_eq!((found.flow, found.length, found.links), (Flow::To(to), length, links), "{first:04x}");
        }
    }

    #[test]
    fn indirect_branches_and_returns() {
        for (first, second) in [(0x4798, 0), (0x4718, 0), (0x469F, 0), (0xF8D3, 0xF000)] {
            // blx r3, bx r3, mov pc, r3, ldr.w pc, [r3].
            assert_eq!(one(0, first, second).flow, Flow::Indirect, "{first:04x}");
        }
        // bx lr; pop {r4, pc}; ldr pc, [sp], #4; ldr.w r0, [r3]; dsb sy; udf; svc.
        for (first, second) in [
            (0x4770, 0),
            (0xBD10, 0),
            (0xF85D, 0xFB04),
            (0xF8D3, 0),
            (0xF3BF, 0x8F4F),
            (0xDE00, 0),
            (0xDF00, 0),
        ] {
            assert_eq!(one(0, first, second).flow, Flow::Other, "{first:04x}");
        }
    }

    #[test]
    fn halves_of_an_address() {
        // movw r3, #0xABCD; movt r3, #0x2000.
        let Flow::Low { register, half: 0xABCD } = one(0, 0xF64A, 0x33CD).flow else { panic!("no MOVW") };
        assert_eq!(one(0, 0xF2C2, 0x0300).flow, Flow::High { register, half: 0x2000 });
    }

    #[test]
    fn what_is_no_instruction_is_passed_over() {
        // Undefined coprocessor instruction, then bx lr.
        let found = decode(0, &[0xFF, 0xFF, 0xFF, 0xFF, 0x70, 0x47]).unwrap();
        assert_eq!(found.into_keys().collect::<Vec<_>>(), [0, 4]);
    }
}
