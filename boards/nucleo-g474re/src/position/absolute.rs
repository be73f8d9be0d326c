//! An absolute encoder with a serial interface, SSI, read by SPI1.
//!
//! At the first falling edge of the clock the encoder latches its position. At each rising edge it puts out a bit, the most significant one first,
//! and after the last one the line stays low until the encoder has had 20 µs without a clock. A frame is 32 clocks at 1.33 MHz; each bit is read at
//! the falling edge after the one that put it out: the line at rest, high; the position; low. An open, shorted or swapped wire shows in the bit
//! before or the bit after. SSI has no checksum: a wrong bit in between makes the angle jump, which the drive detects as `angle_lost`.
//!
//! The control interrupt takes the frame that it began a period ago and begins the next one. So the angle is one period old, which the power stage
//! tells the drive, and its error is the rotor's turn while a PWM interrupt delays it: 1.5 µs, 0.2° at 6,000 r/min with four pole pairs.

use super::Position;
use crate::pins::{Function, Pin, Port, pin};
use crate::power_stage::PowerStage;
use crate::registers::Registers;
use crate::start::{StartError, Wait};
use stm32_metapac::spi::{Spi, vals};
use tractive::frames::Angle;
use tractive::machine::Ratings;

/// An encoder with so many bits per turn, in Gray code or in plain binary.
#[derive(Clone, Copy)]
pub struct Absolute<const BITS: u32, const GRAY: bool> {
    spi: Spi,
    pole_pairs: u32,
    zero: Angle,
}

/// The pins of an absolute encoder, whatever it speaks.
pub(super) const PINS: &[Pin] = &[
    pin(Port::B, 3, Function::Alternate(5), &["SPI1_SCK"], "absolute encoder, clock"),
    pin(Port::B, 4, Function::Alternate(5), &["SPI1_MISO"], "absolute encoder, data"),
];

/// Makes SPI1 a master of words of 16 bits with a clock that rests high; bits are read at its first edges, which fall, or at its second ones, which rise.
pub(super) fn configure(registers: &Registers, rate: vals::Br, reads_at: vals::Cpha, wait: &mut dyn Wait) {
    registers.rcc.apb2enr().modify(|w| w.set_spi1en(true));
    wait.microseconds(1);
    registers.spi1.cr2().write(|w| w.set_ds(vals::Ds::BITS16));
    registers.spi1.cr1().write(|w| {
        w.set_mstr(vals::Mstr::MASTER);
        w.set_cpol(vals::Cpol::IDLE_HIGH);
        w.set_cpha(reads_at);
        w.set_br(rate);
        w.set_ssm(true);
        w.set_ssi(true);
        w.set_spe(true);
    });
}

impl<const BITS: u32, const GRAY: bool> Position for Absolute<BITS, GRAY> {
    const PINS: &'static [Pin] = PINS;

    fn prepare(registers: &Registers, _stage: &PowerStage, wait: &mut dyn Wait) -> Result<(), StartError> {
        configure(registers, vals::Br::DIV128, vals::Cpha::FIRST_EDGE, wait);
        Ok(())
    }

    fn of(registers: &Registers, stage: &PowerStage, ratings: &'static Ratings) -> Self {
        Self { spi: registers.spi1, pole_pairs: ratings.pole_pairs as u32, zero: stage.encoder_zero }
    }

    /// `None` if no frame has come, or an invalid one.
    #[inline]
    fn angle(&mut self) -> Option<Angle> {
        let frame = self.take();
        self.spi.dr16().write_value(0);
        self.spi.dr16().write_value(0);
        let position = decoded(frame, BITS, GRAY)?;
        // The middle of a step, not its beginning.
        let turn = (position << (32 - BITS)) | (1 << (31 - BITS));
        Some(Angle(turn.wrapping_mul(self.pole_pairs)) + self.zero)
    }
}

impl<const BITS: u32, const GRAY: bool> Absolute<BITS, GRAY> {
    /// The bits received in a frame's two words. If a word is missing the first bit is low, which is no valid frame.
    #[inline]
    fn take(&self) -> u32 {
        let came = |frame| match self.spi.sr().read().rxne() {
            true => frame << 16 | u32::from(self.spi.dr16().read()),
            false => frame,
        };
        came(came(0))
    }
}

/// The position in a frame; `None` if the line was not high before it or not low after it.
#[inline]
pub fn decoded(frame: u32, bits: u32, gray: bool) -> Option<u32> {
    let rested = frame >> 31 == 1;
    let ended = frame >> (30 - bits) & 1 == 0;
    let position = frame << 1 >> (32 - bits);
    let plain = if gray { of_gray(position) } else { position };
    (rested && ended).then_some(plain)
}

/// The number that a Gray code stands for: each bit is combined with all those above it.
#[inline]
fn of_gray(code: u32) -> u32 {
    [1, 2, 4, 8, 16].iter().fold(code, |code, shift| code ^ code >> shift)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The frame that an encoder shifts out.
    fn frame(position: u32, bits: u32, gray: bool) -> u32 {
        let code = if gray { position ^ position >> 1 } else { position };
        1 << 31 | code << (31 - bits)
    }

    #[test]
    fn every_position_of_every_length_comes_back() {
        for bits in 8..=24 {
            for gray in [false, true] {
                let all = (0..1 << bits).step_by(if bits > 16 { 61 } else { 1 });
                assert!(
                    all.into_iter().all(|position| {
                        decoded(frame(position, bits, gray), bits, gray) == Some(position)
                    })
                );
            }
        }
    }

    #[test]
    fn a_wire_that_stays_on_a_level_is_no_position() {
        for bits in 8..=24 {
            let sound = frame(1 << (bits - 1) | 1, bits, true);
            assert!(decoded(sound, bits, true).is_some());
            for broken in [0, u32::MAX, sound & u32::MAX >> 1, sound | 1 << (30 - bits)] {
                assert_eq!(decoded(broken, bits, true), None, "{broken:#x} of {bits}");
            }
        }
    }
}
