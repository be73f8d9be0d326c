//! As much of the Thumb-2 instruction set as it takes to see where a function may go: direct branches, indirect ones,
//! and the addresses it puts together from halves. Encodings are those of the ARMv7-M reference manual, chapter A7.

/// What an instruction means for the flow between functions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flow {
    /// BL or B to this address, conditional or not.
    To(u32),
    /// A branch to what a register or a memory word holds, other than a return.
    Indirect,
    /// MOVW: the register's lower half, the upper one cleared.
    Low { register: u8, half: u16 },
    /// MOVT: the register's upper half.
    High { register: u8, half: u16 },
    /// None of these.
    Other,
}

/// The instruction at `address` and its length in bytes; `second` is the next half-word, 0 at the end of the code.
pub fn decode(address: u32, first: u16, second: u16) -> (Flow, u32) {
    let is_wide = first >> 11 >= 0b11101;
    if is_wide { (wide(address, first, second), 4) } else { (narrow(address, first), 2) }
}

fn narrow(address: u32, op: u16) -> Flow {
    const LINK_REGISTER: u16 = 14;
    let register = op >> 3 & 0xF;
    match op {
        // B<c> T1; conditions 14 and 15 are UDF and SVC.
        _ if op >> 12 == 0b1101 && op >> 8 & 0xF < 14 => to(address, u32::from(op & 0xFF) << 1, 9),
        // B T2.
        _ if op >> 11 == 0b11100 => to(address, u32::from(op & 0x7FF) << 1, 12),
        // BX; by way of the link register it is a return.
        _ if op & 0xFF87 == 0x4700 && register != LINK_REGISTER => Flow::Indirect,
        // BLX.
        _ if op & 0xFF87 == 0x4780 => Flow::Indirect,
        // MOV pc, Rm; from the link register it is a return.
        _ if op & 0xFF87 == 0x4687 && register != LINK_REGISTER => Flow::Indirect,
        _ => Flow::Other,
    }
}

fn wide(address: u32, first: u16, second: u16) -> Flow {
    let (high, low) = (u32::from(first), u32::from(second));
    if first >> 11 == 0b11110 && second >> 15 == 1 {
        let sign = high >> 10 & 1;
        let (j1, j2) = (low >> 13 & 1, low >> 11 & 1);
        let is_plain_or_linked = low >> 12 & 1 == 1;
        let is_linked = low >> 14 & 1 == 1;
        if is_plain_or_linked {
            // BL T1 and B T4: 25 bits, of which two are stored against the sign.
            let (i1, i2) = (1 ^ j1 ^ sign, 1 ^ j2 ^ sign);
            let offset = sign << 24 | i1 << 23 | i2 << 22 | (high & 0x3FF) << 12 | (low & 0x7FF) << 1;
            return to(address, offset, 25);
        }
        // B<c> T3: 21 bits; conditions 14 and 15 are other instructions (MSR, barriers, UDF).
        if !is_linked && high >> 6 & 0xF < 14 {
            let offset = sign << 20 | j2 << 19 | j1 << 18 | (high & 0x3F) << 12 | (low & 0x7FF) << 1;
            return to(address, offset, 21);
        }
        return Flow::Other;
    }
    let half = (high & 0xF) << 12 | (high >> 10 & 1) << 11 | (low >> 12 & 7) << 8 | low & 0xFF;
    let (register, half) = ((low >> 8 & 0xF) as u8, half as u16);
    match first & 0xFBF0 {
        0xF240 => return Flow::Low { register, half },
        0xF2C0 => return Flow::High { register, half },
        _ => {}
    }
    // LDR pc, […]: indirect, but for the one that pops the return address.
    const STACK_POINTER: u16 = 13;
    let is_load_to_pc = first & 0xFF70 == 0xF850 && second >> 12 == 15;
    if is_load_to_pc && first & 0xF != STACK_POINTER { Flow::Indirect } else { Flow::Other }
}

/// A branch by `bits` signed bits from where the program counter reads, four bytes on.
fn to(address: u32, offset: u32, bits: u32) -> Flow {
    let unused = 32 - bits;
    let signed = (offset << unused).cast_signed() >> unused;
    Flow::To(address.wrapping_add(4).wrapping_add_signed(signed))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bl_forward_and_back() {
        // bl .+4 (offset 0), bl .-2+… by hand from the manual's fields.
        assert_eq!(decode(0x400, 0xF000, 0xF800), (Flow::To(0x404), 4));
        // bl self: offset −4.
        assert_eq!(decode(0x400, 0xF7FF, 0xFFFE), (Flow::To(0x400), 4));
        // bl +0x1000: imm10 = 1.
        assert_eq!(decode(0x400, 0xF001, 0xF800), (Flow::To(0x1404), 4));
        // bl −0x1000: imm10 = 0x3FF, imm11 = 0.
        assert_eq!(decode(0x2000, 0xF7FF, 0xF800), (Flow::To(0x1004), 4));
        // The ends of the range: ±16 MiB.
        assert_eq!(decode(0x0200_0000, 0xF400, 0xD000), (Flow::To(0x0100_0004), 4));
        assert_eq!(decode(0, 0xF3FF, 0xD7FF), (Flow::To(0x0100_0002), 4));
    }

    #[test]
    fn b_wide_forward_back_and_conditional() {
        assert_eq!(decode(0x100, 0xF000, 0xB800), (Flow::To(0x104), 4));
        assert_eq!(decode(0x100, 0xF7FF, 0xBFFE), (Flow::To(0x100), 4));
        // beq.w +0 and beq.w self.
        assert_eq!(decode(0x100, 0xF000, 0x8000), (Flow::To(0x104), 4));
        assert_eq!(decode(0x100, 0xF43F, 0xAFFE), (Flow::To(0x100), 4));
        // dsb sy, msr and udf.w share the prefix and go nowhere.
        assert_eq!(decode(0, 0xF3BF, 0x8F4F), (Flow::Other, 4));
        assert_eq!(decode(0, 0xF380, 0x8808), (Flow::Other, 4));
        assert_eq!(decode(0, 0xF7F0, 0xA000), (Flow::Other, 4));
    }

    #[test]
    fn narrow_branches() {
        // b . and beq .+4; udf #0 and svc #0 are none.
        assert_eq!(decode(0x200, 0xE7FE, 0), (Flow::To(0x200), 2));
        assert_eq!(decode(0x200, 0xD000, 0), (Flow::To(0x204), 2));
        assert_eq!(decode(0x200, 0xDE00, 0), (Flow::Other, 2));
        assert_eq!(decode(0x200, 0xDF00, 0), (Flow::Other, 2));
    }

    #[test]
    fn indirect_branches_and_returns() {
        assert_eq!(decode(0, 0x4798, 0).0, Flow::Indirect); // blx r3
        assert_eq!(decode(0, 0x4718, 0).0, Flow::Indirect); // bx r3
        assert_eq!(decode(0, 0x469F, 0).0, Flow::Indirect); // mov pc, r3
        assert_eq!(decode(0, 0xF8D3, 0xF000).0, Flow::Indirect); // ldr.w pc, [r3]
        assert_eq!(decode(0, 0x4770, 0).0, Flow::Other); // bx lr
        assert_eq!(decode(0, 0xBD10, 0).0, Flow::Other); // pop {r4, pc}
        assert_eq!(decode(0, 0xF85D, 0xFB04).0, Flow::Other); // ldr pc, [sp], #4
        assert_eq!(decode(0, 0xF8D3, 0x0000).0, Flow::Other); // ldr.w r0, [r3]
    }

    #[test]
    fn halves_of_an_address() {
        // movw r3, #0xABCD: imm4 = A, i = 1, imm3 = 3, imm8 = CD; movt r3, #0x2000.
        assert_eq!(decode(0, 0xF64A, 0x33CD).0, Flow::Low { register: 3, half: 0xABCD });
        assert_eq!(decode(0, 0xF2C2, 0x0300).0, Flow::High { register: 3, half: 0x2000 });
    }

    #[test]
    fn any_pair_of_half_words_decodes() {
        for first in 0..=u16::MAX {
            for second in [0, 0x8000, 0x9000, 0xD000, 0xF800, 0xFFFF] {
                let (_, length) = decode(0xFFFF_FFFE, first, second);
                assert!(length == 2 || length == 4);
            }
        }
    }
}
