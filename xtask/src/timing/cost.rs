//! What an instruction costs on a Cortex-M4F, in cycles and in stack.
//!
//! The cycles are those of the processor's technical reference manual (instruction timings, chapters 3 and 7), each at its
//! worst: memory without wait states, no load pipelined behind another, three cycles to refill the pipeline after every
//! branch that is taken, and every result of the floating-point unit wanted by the very next instruction.

/// To refill the pipeline.
pub const REFILL: u32 = 3;
/// Into a handler and out of it again, and for the floating-point registers that its first such instruction stacks.
pub const ENTRY_AND_RETURN: u32 = 12 + 12 + 18;
/// Bytes that an interrupt stacks: eight words, eighteen for the floating-point unit, one to align.
pub const EXCEPTION_FRAME: i32 = 4 * (8 + 18 + 1);

const DIVIDE: u32 = 12;
const BARRIER: u32 = 4;

/// Cycles of the instruction with these half-words, without the refill where it branches.
pub fn cycles(first: u16, second: u16) -> u32 {
    if first >> 11 < 0b11101 { narrow(first) } else { wide(first, second) }
}

fn narrow(op: u16) -> u32 {
    match op >> 8 {
        // PUSH; POP; STM, LDM.
        0xB4 | 0xB5 | 0xBC | 0xBD => 1 + (op & 0x1FF).count_ones(),
        0xC0..=0xCF => 1 + (op & 0xFF).count_ones(),
        // LDR from a literal; loads and stores of one value.
        0x48..=0x9F => 2,
        _ => 1,
    }
}

fn wide(first: u16, second: u16) -> u32 {
    match first {
        // LDM, STM; two words, exclusives and TBB.
        _ if first & 0xFE40 == 0xE800 => 1 + second.count_ones(),
        _ if first & 0xFE40 == 0xE840 => 3,
        0xEC00..=0xEFFF => float(first, second),
        0xF800..=0xF9FF => 2,
        0xFB90 | 0xFBB0..=0xFBBF | 0xFB91..=0xFB9F => DIVIDE,
        // MLA and MLS; MUL has no addend.
        _ if first & 0xFFF0 == 0xFB00 && second >> 12 != 15 => 2,
        // Barriers and the like; MSR, MRS.
        0xF3BF => BARRIER,
        0xF380..=0xF38F | 0xF3EF if second & 0xD000 == 0x8000 => 2,
        _ => 1,
    }
}

fn float(first: u16, second: u16) -> u32 {
    const CONSUMED: u32 = 1;
    let words = u32::from(second & 0xFF);
    match first & 0xFF00 {
        // Two core registers; VLDM, VSTM, VPUSH, VPOP.
        0xEC00 if first & 0x00E0 == 0x0040 => 2,
        0xEC00 => 1 + words,
        0xED00 if first & 0x0020 != 0 => 1 + words,
        // VLDR, VSTR of one word or two.
        0xED00 => {
            if second & 0x0100 == 0 {
                2
            } else {
                3
            }
        }
        // One core register, or the flags.
        _ if second & 0x10 != 0 => 1,
        _ => {
            CONSUMED
                + match first >> 4 & 0xB {
                    // With addend, fused or not; VDIV.
                    0b0000 | 0b0001 | 0b1001 | 0b1010 => 3,
                    0b1000 => 14,
                    // VSQRT among those of one operand.
                    0b1011 if first & 0xF == 1 && second >> 6 & 3 == 3 => 14,
                    _ => 1,
                }
        }
    }
}

/// By how many bytes it moves the stack pointer.
pub fn stack_move(first: u16, second: u16) -> i32 {
    let words = |count: u32| 4 * count as i32;
    match first {
        _ if first & 0xFE00 == 0xB400 => -words((first & 0x1FF).count_ones()),
        _ if first & 0xFE00 == 0xBC00 => words((first & 0x1FF).count_ones()),
        _ if first & 0xFF80 == 0xB000 => words(u32::from(first & 0x7F)),
        _ if first & 0xFF80 == 0xB080 => -words(u32::from(first & 0x7F)),
        0xE92D => -words(second.count_ones()),
        0xE8BD => words(second.count_ones()),
        // VPUSH, VPOP.
        _ if first & 0xFFBF == 0xED2D => -words(u32::from(second & 0xFF)),
        _ if first & 0xFFBF == 0xECBD => words(u32::from(second & 0xFF)),
        // One register.
        0xF84D if second & 0x0FFF == 0x0D04 => -4,
        0xF85D if second & 0x0FFF == 0x0B04 => 4,
        // ADD, SUB of a constant: modified, or of twelve bits.
        _ if second >> 8 & 0xF == 13 && second >> 15 == 0 => match first & 0xFBFF {
            0xF10D => modified(first, second),
            0xF1AD => -modified(first, second),
            0xF20D => plain(first, second),
            0xF2AD => -plain(first, second),
            _ => 0,
        },
        _ => 0,
    }
}

fn plain(first: u16, second: u16) -> i32 {
    i32::from(first >> 10 & 1) << 11 | i32::from(second >> 12 & 7) << 8 | i32::from(second & 0xFF)
}

/// A byte at any place in a word; the repeated patterns are no stack sizes.
fn modified(first: u16, second: u16) -> i32 {
    let field = plain(first, second) as u32;
    if field < 0x400 {
        return (field & 0xFF) as i32;
    }
    (0x80 | field & 0x7F).rotate_right(field >> 7) as i32
}

#[cfg(test)]
mod tests {
    use super::*;

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
            assert_eq!(cycles(first, second), expected, "{first:04x} {second:04x}");
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
            assert_eq!(stack_move(first, second), expected, "{first:04x} {second:04x}");
        }
    }
}
