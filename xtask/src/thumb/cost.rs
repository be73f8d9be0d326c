//! The cost of an instruction on a Cortex-M4F, in cycles and in stack.
//!
//! The cycles are those of the processor's technical reference manual (instruction timings, chapters 3 and 7), each at its worst: memory without wait
//! states, no load pipelined behind another, three cycles to refill the pipeline after every taken branch, and every result of the floating-point unit
//! needed by the very next instruction.

use super::{Operand, SP};
use capstone::RegId;
use capstone::arch::arm::ArmReg;

/// To refill the pipeline.
pub const REFILL: u32 = 3;
/// Cycles into a handler and out of it again, and for the floating-point registers that its first such instruction stacks.
pub const ENTRY_AND_RETURN: u32 = 12 + 12 + 18;
/// Bytes that an interrupt stacks: eight words, eighteen for the floating-point unit, one to align.
pub const EXCEPTION_FRAME: i32 = 4 * (8 + 18 + 1);

const DIVIDE: u32 = 12;
const BARRIER: u32 = 4;

/// Cycles of the instruction of this name, without the refill where it branches.
pub fn cycles(name: &str, operands: &[Operand]) -> u32 {
    match name {
        "push" | "pop" | "vpush" | "vpop" => 1 + words(operands),
        // The first operand is the base.
        _ if ["ldm", "stm", "vldm", "vstm"].iter().any(|many| name.starts_with(many)) => {
            1 + words(&operands[1..])
        }
        "ldrd" | "strd" | "tbb" | "tbh" => 3,
        _ if name.starts_with("ldrex") || name.starts_with("strex") => 3,
        _ if name.starts_with("ldr") || name.starts_with("str") => 2,
        "vldr" | "vstr" => 1 + words(&operands[..1]),
        "sdiv" | "udiv" => DIVIDE,
        "mla" | "mls" | "msr" | "mrs" => 2,
        "dmb" | "dsb" | "isb" => BARRIER,
        _ if name.starts_with('v') => float(name, operands),
        _ => 1,
    }
}

fn float(name: &str, operands: &[Operand]) -> u32 {
    const CONSUMED: u32 = 1;
    let cores = operands.iter().filter(|operand| is_core(operand)).count() as u32;
    match name {
        // The flags; core registers, one or two.
        "vmrs" | "vmsr" => 1,
        "vmov" if cores > 0 => cores,
        "vmla" | "vmls" | "vnmla" | "vnmls" | "vfma" | "vfms" | "vfnma" | "vfnms" => CONSUMED + 3,
        "vdiv" | "vsqrt" => CONSUMED + 14,
        _ => CONSUMED + 1,
    }
}

/// The number of bytes by which it moves the stack pointer.
pub fn stack_move(name: &str, operands: &[Operand], writes_back: bool) -> i32 {
    match (name, operands) {
        ("push" | "vpush", _) => -4 * words(operands).cast_signed(),
        ("pop" | "vpop", _) => 4 * words(operands).cast_signed(),
        ("str" | "ldr", [_, Operand::Mem(memory), rest @ ..]) if Operand::Reg(memory.base()) == SP => {
            match rest {
                // Behind the access.
                [Operand::Imm(by)] => *by,
                _ if writes_back => memory.disp(),
                _ => 0,
            }
        }
        ("add" | "addw", [SP, Operand::Imm(by)] | [SP, SP, Operand::Imm(by)]) => *by,
        ("sub" | "subw", [SP, Operand::Imm(by)] | [SP, SP, Operand::Imm(by)]) => -*by,
        _ => 0,
    }
}

/// Words that registers hold: two where they are double.
fn words(registers: &[Operand]) -> u32 {
    registers.iter().map(|register| if is_double(register) { 2 } else { 1 }).sum()
}

fn is_double(register: &Operand) -> bool {
    let of = |register: &RegId| u32::from(register.0);
    matches!(register, Operand::Reg(found) if (ArmReg::ARM_REG_D0..=ArmReg::ARM_REG_D31).contains(&of(found)))
}

fn is_core(register: &Operand) -> bool {
    let of = |register: &RegId| u32::from(register.0);
    let is_general =
        |number| (ArmReg::ARM_REG_R0..=ArmReg::ARM_REG_R12).contains(&number) || number == ArmReg::ARM_REG_LR;
    matches!(register, Operand::Reg(found) if is_general(of(found)))
}

#[cfg(test)]
mod tests {
    use crate::thumb::tests::one;

    #[test]
    fn cycles_by_the_manual() {
        for (first, second, expected) in [
            (0x1889, 0, 1),       // adds r1, r1, r2
            (0x6801, 0, 2),       // ldr r1, [r0]
            (0x4801, 0, 2),       // ldr r0, [pc, #4]
            (0xB5F0, 0, 6),       // push {r4-r7, lr}
            (0xE92D, 0x0F00, 5),  // push.w {r8-r11}
            (0xE9D0, 0x1200, 3),  // ldrd r1, r2, [r0]
            (0xF8D0, 0x1004, 2),  // ldr.w r1, [r0, #4]
            (0xFB01, 0xF202, 1),  // mul r2, r1, r2
            (0xFB01, 0x3202, 2),  // mla r2, r1, r2, r3
            (0xFBB1, 0xF2F2, 12), // udiv r2, r1, r2
            (0xFBA1, 0x2302, 1),  // umull r2, r3, r1, r2
            (0xF3BF, 0x8F5F, 4),  // dmb sy
            (0xEE30, 0x0A20, 2),  // vadd.f32 s0, s0, s1
            (0xEE20, 0x0A20, 2),  // vmul.f32 s0, s0, s1
            (0xEE00, 0x0A20, 4),  // vmla.f32 s0, s0, s1
            (0xEEA0, 0x0A20, 4),  // vfma.f32 s0, s0, s1
            (0xEE80, 0x0A20, 15), // vdiv.f32 s0, s0, s1
            (0xEEB1, 0x0AC0, 15), // vsqrt.f32 s0, s0
            (0xEEF1, 0x0AE0, 15), // vsqrt.f32 s1, s1
            (0xEEB0, 0x0A60, 2),  // vmov.f32 s0, s1
            (0xEE00, 0x0A10, 1),  // vmov s0, r0
            (0xEEF1, 0xFA10, 1),  // vmrs APSR_nzcv, fpscr
            (0xED90, 0x0A00, 2),  // vldr s0, [r0]
            (0xED2D, 0x8B04, 5),  // vpush {d8, d9}
        ] {
            assert_eq!(one(0, first, second).cycles, expected, "{first:04x} {second:04x}");
        }
    }

    #[test]
    fn the_stack_moves_there_and_back() {
        for (first, second, expected) in [
            (0xB5F0, 0, -20),         // push {r4-r7, lr}
            (0xBDF0, 0, 20),          // pop {r4-r7, pc}
            (0xB084, 0, -16),         // sub sp, #16
            (0xB004, 0, 16),          // add sp, #16
            (0xE92D, 0x0F00, -16),    // push.w {r8-r11}
            (0xE8BD, 0x0F00, 16),     // pop.w {r8-r11}
            (0xED2D, 0x8B10, -64),    // vpush {d8-d15}
            (0xECBD, 0x8B10, 64),     // vpop {d8-d15}
            (0xF84D, 0xBD04, -4),     // str r11, [sp, #-4]!
            (0xF85D, 0xBB04, 4),      // ldr r11, [sp], #4
            (0xF5AD, 0x7D0C, -0x230), // sub.w sp, sp, #560
            (0xF50D, 0x7D0C, 0x230),  // add.w sp, sp, #560
            (0xF1A0, 0x0D04, 0),      // sub.w sp, r0, #4
            (0x6801, 0, 0),
        ] {
            assert_eq!(one(0, first, second).stack_move, expected, "{first:04x} {second:04x}");
        }
    }
}
