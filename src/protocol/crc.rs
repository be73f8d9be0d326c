//! CRC-8 with the polynomial 0x2F, start value 0xFF and final inversion: AUTOSAR's `CRC8H2F`.

/// x⁸ + x⁵ + x³ + x² + x + 1.
const POLYNOMIAL: u8 = 0x2F;

/// The remainders of all values of a byte's upper half.
const REMAINDERS: [u8; 16] = {
    let mut table = [0; 16];
    let mut value = 0;
    while value < 16 {
        let mut remainder = (value as u8) << 4;
        let mut bit = 0;
        while bit < 4 {
            let carry = remainder & 0x80 != 0;
            remainder <<= 1;
            if carry {
                remainder ^= POLYNOMIAL;
            }
            bit += 1;
        }
        table[value] = remainder;
        value += 1;
    }
    table
};

fn half(crc: u8) -> u8 {
    // Four bits are always within the table, so the compiler needs no check.
    REMAINDERS[usize::from(crc >> 4) & 0xF] ^ crc << 4
}

/// The check value of some bytes.
pub fn crc8_h2f(bytes: impl IntoIterator<Item = u8>) -> u8 {
    !bytes.into_iter().fold(0xFF, |crc, byte| half(half(crc ^ byte)))
}
