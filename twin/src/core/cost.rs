//! The cycles of a basic block, by the Cortex-M4's documented timings: an upper bound, since no load is taken as pipelined and every refill takes three
//! cycles. Whether a conditional branch will be taken is not known beforehand: a block's last instruction is counted as taken.

/// Cycles that the pipeline's refill takes after a branch.
const REFILL: u32 = 3;
/// Cycles of a floating-point division or square root, and of an integer division at most.
const DIVISION: u32 = 14;
const INTEGER_DIVISION: u32 = 12;

/// Bytes of a line of the flash memory.
const LINE: usize = 8;
/// Its wait states at 170 MHz.
pub const WAIT_STATES: u32 = 4;

/// The cost of a block, in cycles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// Its instructions, fetched without a wait.
    pub cycles: u32,
    /// The waits that its fetches add without cache and prefetch: each of the flash memory's lines that the block touches costs the wait states once
    /// (RM0440, 3.3.4; two banks, lines of 64 bits).
    pub waits: u32,
    /// The waits with the prefetch alone: the next line is fetched while one is executed, so only the first line, which the program has reached by a
    /// branch, costs all of them.
    pub prefetched: u32,
    /// The cycles that are saved, with or without prefetch, where the preceding block runs on into this one without a branch: its pipeline's refill,
    /// and the first line's wait unless the block begins a line.
    pub led_on: u32,
}

/// The cost of a block's instructions in a memory without wait states.
pub fn unwaited(code: &[u8]) -> Cost {
    Cost { waits: 0, prefetched: 0, led_on: REFILL - 1, ..of(0, code) }
}

/// The cost of a block's instructions at an offset in the flash memory.
pub fn of(at: usize, code: &[u8]) -> Cost {
    let halves: Vec<u32> =
        code.chunks_exact(2).map(|pair| u32::from(u16::from_le_bytes([pair[0], pair[1]]))).collect();
    let lines = (at + code.len()).div_ceil(LINE) - at / LINE;
    let inside = if at.is_multiple_of(LINE) { 0 } else { WAIT_STATES };
    let mut cost = Cost {
        cycles: REFILL - 1,
        waits: WAIT_STATES * lines as u32,
        prefetched: 0,
        led_on: REFILL - 1 + inside,
    };
    let (mut place, mut line, mut in_line) = (0, None, 0);
    while let Some(first) = halves.get(place) {
        let wide = first >> 11 >= 0b11101;
        let second = if wide { halves.get(place + 1).copied().unwrap_or(0) } else { 0 };
        let cycles = if wide { wide_cycles(*first, second) } else { narrow_cycles(*first) };
        // The instruction is complete with its last half.
        let ends = (at + 2 * place + if wide { 2 } else { 0 }) / LINE;
        if line.replace(ends).is_none_or(|before| before != ends) {
            let first = cost.prefetched == 0;
            cost.prefetched += if first { WAIT_STATES } else { (1 + WAIT_STATES).saturating_sub(in_line) };
            in_line = 0;
        }
        (cost.cycles, in_line) = (cost.cycles + cycles, in_line + cycles);
        place += if wide { 2 } else { 1 };
    }
    cost
}

/// Cycles of a block's instructions.
#[cfg(test)]
fn cycles(code: &[u8]) -> u32 {
    of(0, code).cycles
}

fn narrow_cycles(code: u32) -> u32 {
    match code >> 12 {
        // Loads and stores, the literal's among them.
        0b0101..=0b1001 => 2,
        0b0100 if code >> 11 == 0b01001 => 2,
        // Push and pop, multiple loads and stores: one a register.
        0b1011 if code >> 9 & 0b11 == 0b10 => 1 + (code & 0x1FF).count_ones(),
        0b1100 => 1 + (code & 0xFF).count_ones(),
        _ => 1,
    }
}

fn wide_cycles(first: u32, second: u32) -> u32 {
    match first >> 8 & 0x1F {
        // Multiple and double loads and stores, table branches.
        0b01000 | 0b01001 if first & 1 << 6 == 0 => 1 + second.count_ones(),
        0b01000 | 0b01001 => 3,
        // Single loads and stores.
        0b11000 | 0b11001 => 2,
        0b11011 if first & 0xF0 == 0x90 || first & 0xF0 == 0xB0 => INTEGER_DIVISION,
        // Floating point: loads, stores, arithmetic.
        0b01101 if first & 1 << 5 == 0 => 2,
        0b01100 | 0b01101 => 1 + (second & 0xFF),
        0b01110 if first & 0xB0 == 0x80 => DIVISION,
        0b01110 if first & 0xBF == 0xB1 && second & 0xC0 == 0xC0 => DIVISION,
        // Multiply and accumulate.
        0b01110 if first & 0xB0 == 0x00 || first & 0xB0 == 0xA0 => 3,
        _ => 1,
    }
}

#[cfg(test)]
mod tests {
    use super::{Cost, cycles, of, unwaited};

    #[test]
    fn each_kind_has_its_price() {
        let of = |halves: &[u16]| {
            cycles(&halves.iter().flat_map(|half| half.to_le_bytes()).collect::<Vec<_>>()) - 2
        };
        assert_eq!(of(&[0xBF00]), 1, "nop");
        assert_eq!(of(&[0x6808]), 2, "ldr r0, [r1]");
        assert_eq!(of(&[0xB570]), 5, "push {{r4, r5, r6, lr}}");
        assert_eq!(of(&[0xEE80, 0x0A20]), 14, "vdiv.f32 s0, s0, s1");
        assert_eq!(of(&[0xEEB1, 0x0AC0]), 14, "vsqrt.f32 s0, s0");
        assert_eq!(of(&[0xEE30, 0x0A20]), 1, "vadd.f32 s0, s0, s1");
        assert_eq!(of(&[0xED90, 0x0A20]), 2, "vldr s0, [r0, #128]");
        assert_eq!(of(&[0xED2D, 0x8A04]), 5, "vpush {{s16-s19}}");
        assert_eq!(of(&[0xFBB0, 0xF0F1]), 12, "udiv r0, r0, r1");
        assert_eq!(of(&[0xE8BD, 0x8070]), 5, "pop.w {{r4, r5, r6, pc}}");
    }
    #[test]
    fn a_line_waits_for_what_the_one_before_leaves() {
        let nops = |count: usize| [0x00, 0xBF].repeat(count);
        // Four one-cycle instructions a line: the next line arrives a cycle after they are done.
        assert_eq!(of(0, &nops(4)), Cost { cycles: 6, waits: 4, prefetched: 4, led_on: 2 });
        assert_eq!(of(0, &nops(12)), Cost { cycles: 14, waits: 12, prefetched: 4 + 1 + 1, led_on: 2 });
        assert_eq!(unwaited(&nops(12)), Cost { cycles: 14, waits: 0, prefetched: 0, led_on: 2 });
        // From the middle of a line.
        assert_eq!(of(4, &nops(6)), Cost { cycles: 8, waits: 8, prefetched: 4 + 3, led_on: 6 });
        // A division hides it.
        let division: Vec<u8> =
            [0xEE80_u16, 0x0A20, 0xEE80, 0x0A20, 0xBF00].iter().flat_map(|half| half.to_le_bytes()).collect();
        assert_eq!(of(0, &division), Cost { cycles: 31, waits: 8, prefetched: 4, led_on: 2 });
    }
}
