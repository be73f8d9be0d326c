//! An absolute encoder with BiSS-C, read by SPI1 and two channels of DMA1.
//!
//! At the first falling edge of the clock the encoder latches its position. The line stays high until the second rising edge, is low while the encoder
//! computes, and then carries, a bit a clock: a high start bit, a control bit, the turns and the position within the turn, the most significant bit
//! first, an error and a warning bit, both low if set, and an inverted checksum of six bits. Then it is low until the encoder has had 20 µs without a
//! clock. A frame is 64 clocks at 2.66 MHz, each bit read at the rising edge after the one that put it out: cable, transceivers and encoder may take 0.35 µs there
//! and back, of which 10 m of cable are 0.1 µs.
//!
//! As with [`Absolute`](super::Absolute), the control interrupt takes the frame that it began a period ago and begins the next one.

use super::Position;
use super::absolute::{self, PINS};
use crate::pins::Pin;
use crate::power_stage::PowerStage;
use crate::registers::Registers;
use crate::start::{StartError, Wait};
use core::sync::atomic::{AtomicU16, Ordering, fence};
use stm32_metapac::bdma::{Ch, regs, vals};
use stm32_metapac::spi::{
    Spi,
    vals::{Br, Cpha},
};
use tractive::frames::Angle;
use tractive::machine::Ratings;

/// Words of 16 bits in a frame.
const WORDS: usize = 4;

/// The DMA channels of what is received and of what is sent, and their requests in the multiplexer.
pub const CHANNELS: [(usize, u8); 2] = [(0, 10), (1, 11)];

/// The frame as the DMA writes it, in the order in which the words came; what is sent goes nowhere and is read from here, too.
pub static FRAME: [AtomicU16; WORDS] = [const { AtomicU16::new(0) }; WORDS];

/// Most spoilt frames in a row that are bridged. With one wrong bit in 10⁹, a 10 kHz control gets a spoilt frame every hour.
const BRIDGED: u8 = 2;

/// An encoder with so many bits for the position within a turn, and so many before them for the turns.
#[derive(Clone, Copy)]
pub struct Biss<const BITS: u32, const TURNS_BITS: u32> {
    spi: Spi,
    receives: Ch,
    sends: Ch,
    pole_pairs: u32,
    zero: Angle,
    bridge: Bridge,
}

impl<const BITS: u32, const TURNS_BITS: u32> Position for Biss<BITS, TURNS_BITS> {
    const PINS: &'static [Pin] = PINS;

    fn prepare(registers: &Registers, _stage: &PowerStage, wait: &mut dyn Wait) -> Result<(), StartError> {
        registers.rcc.ahb1enr().modify(|w| {
            w.set_dma1en(true);
            w.set_dmamux1en(true);
        });
        absolute::configure(registers, Br::DIV64, Cpha::SECOND_EDGE, wait);
        for ((channel, request), receives) in CHANNELS.into_iter().zip([true, false]) {
            registers.dmamux1.ccr(channel).write(|w| w.set_dmareq_id(request));
            let channel = registers.dma1.ch(channel);
            channel.par().write_value(registers.spi1.dr16().as_ptr() as usize as u32);
            channel.mar().write_value(FRAME.as_ptr() as usize as u32);
            channel.cr().write_value(halted(receives));
        }
        registers.spi1.cr2().modify(|w| {
            w.set_rxdmaen(true);
            w.set_txdmaen(true);
        });
        Ok(())
    }

    fn of(registers: &Registers, stage: &PowerStage, ratings: &'static Ratings) -> Self {
        let [receives, sends] = CHANNELS.map(|(channel, _)| registers.dma1.ch(channel));
        let (pole_pairs, zero) = (ratings.pole_pairs as u32, stage.encoder_zero);
        Self { spi: registers.spi1, receives, sends, pole_pairs, zero, bridge: Bridge::default() }
    }

    /// `None` if three frames in a row are missing or invalid, or the first ones.
    #[inline]
    fn angle(&mut self) -> Option<Angle> {
        let frame = self.take();
        self.begin();
        let read = position(frame, BITS + TURNS_BITS).map(|position| {
            // The middle of a step, not its beginning.
            let turn = position << (32 - BITS) | 1 << (31 - BITS);
            Angle(turn.wrapping_mul(self.pole_pairs)) + self.zero
        });
        self.bridge.angle(read)
    }
}

impl<const BITS: u32, const TURNS_BITS: u32> Biss<BITS, TURNS_BITS> {
    /// The bits received, the first one on top. All are low, which is no valid frame, if it is not complete.
    #[inline]
    fn take(&self) -> u64 {
        if self.receives.ndtr().read().ndt() != 0 {
            return 0;
        }
        fence(Ordering::Acquire);
        FRAME.iter().fold(0, |frame, word| frame << 16 | u64::from(word.load(Ordering::Relaxed)))
    }

    /// Begins the next frame. Words of a frame that was not complete are thrown away.
    #[inline]
    fn begin(&self) {
        let channels = [(self.receives, true), (self.sends, false)];
        for (channel, receives) in channels {
            channel.cr().write_value(halted(receives));
            channel.ndtr().write(|w| w.set_ndt(WORDS as u16));
        }
        self.spi.dr16().read();
        self.spi.dr16().read();
        self.spi.sr().read();
        for (channel, receives) in channels {
            let mut runs = halted(receives);
            runs.set_en(true);
            channel.cr().write_value(runs);
        }
    }
}

/// A channel's configuration while it is halted: words of 16 bits, written one behind the other or always read from the first.
#[inline]
fn halted(receives: bool) -> regs::Cr {
    let mut control = regs::Cr(0);
    control.set_dir(if receives { vals::Dir::FROM_PERIPHERAL } else { vals::Dir::FROM_MEMORY });
    control.set_minc(receives);
    control.set_psize(vals::Size::BITS16);
    control.set_msize(vals::Size::BITS16);
    control
}

/// The position of so many bits, up to 32, in a frame; `None` if the line was not high before it or not low after it, if the checksum is wrong, or if
/// the encoder tells an error.
#[inline]
pub fn position(frame: u64, bits: u32) -> Option<u32> {
    let busy = frame << frame.leading_ones().min(63);
    let (rested, waits) = (frame.leading_ones(), busy.leading_zeros());
    // Behind the start bit and the control bit come position, error, warning, checksum and a low line.
    let length = bits + 9;
    if rested == 0 || rested + waits + 2 + length > u64::BITS {
        return None;
    }
    let tail = busy << waits << 2 >> (u64::BITS - length);
    let (data, sum, ended) = (tail >> 7, tail >> 1 & 0x3F, tail & 1 == 0);
    let sound = data & 0b10 != 0;
    (sound && ended && sum == u64::from(!checksum(data) & 0x3F)).then_some((data >> 2) as u32)
}

/// The checksum of position, error and warning: the remainder modulo x⁶ + x + 1.
#[inline]
pub fn checksum(data: u64) -> u8 {
    (0..6).rev().fold(0, |sum, chunk| REMAINDERS[usize::from(sum ^ (data >> (6 * chunk)) as u8 & 0x3F)])
}

/// The remainder of each chunk of six bits, followed by six zeros.
const REMAINDERS: [u8; 64] = {
    let mut remainders = [0; 64];
    let mut chunk = 0;
    while chunk < 64 {
        let (mut rest, mut bit) = (chunk as u8, 0);
        while bit < 6 {
            rest = rest << 1 ^ if rest & 0x20 == 0 { 0 } else { 0x43 };
            bit += 1;
        }
        remainders[chunk] = rest;
        chunk += 1;
    }
    remainders
};

/// The angle over a few spoilt frames: the rotor turns on as in the period before.
#[derive(Clone, Copy, Default)]
struct Bridge {
    last: Option<Angle>,
    turned: Option<Angle>,
    spoilt: u8,
}

impl Bridge {
    #[inline]
    fn angle(&mut self, read: Option<Angle>) -> Option<Angle> {
        self.spoilt = if read.is_some() { 0 } else { self.spoilt.saturating_add(1) };
        if let Some(angle) = read {
            self.turned = self.last.map(|last| angle - last);
            self.last = read;
        } else {
            let bridges = self.spoilt <= BRIDGED;
            self.last = self.last.zip(self.turned).filter(|_| bridges).map(|(last, turned)| last + turned);
        }
        self.last
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The frame that an encoder shifts out after so many clocks of rest and so many of computing.
    fn frame(position: u32, bits: u32, [rested, waits]: [u32; 2], healthy: bool) -> u64 {
        let data = u64::from(position) << 2 | u64::from(healthy) << 1 | 1;
        // Bit by bit, as the encoder does it.
        let sum = (0..bits + 2).rev().fold(0, |sum: u64, bit| {
            let carry = sum >> 5 & 1 ^ data >> bit & 1;
            ((sum << 1) ^ (carry * 0x43)) & 0x3F
        });
        let told = 1 << (bits + 9) | data << 6 | sum ^ 0x3F;
        let begins = u64::MAX << (64 - rested);
        begins | told << (64 - rested - waits - bits - 10)
    }

    #[test]
    fn every_position_comes_back_after_any_wait() {
        for bits in [8, 13, 18, 26, 32] {
            for delays in [[1, 1], [2, 1], [2, 9], [3, 18]] {
                let all =
                    (0..=u32::MAX >> (32 - bits)).step_by(if bits > 13 { 1 << (bits - 9) | 1 } else { 1 });
                for told in all {
                    assert_eq!(position(frame(told, bits, delays, true), bits), Some(told));
                }
            }
        }
    }

    #[test]
    fn one_or_two_wrong_bits_behind_the_start_bit_are_noticed() {
        let (bits, delays) = (18, [2, 5]);
        let sound = frame(0x2_A5C3, bits, delays, true);
        // Below rest, wait, start and control bit: position, error, warning, checksum, and the low line.
        let first = 64 - (2 + 5 + 2) - 1;
        let behind = |number: u32| 1_u64 << (first - number);
        for one in 0..bits + 9 {
            assert_eq!(position(sound ^ behind(one), bits), None, "bit {one}");
            for other in 0..one {
                assert_eq!(position(sound ^ behind(one) ^ behind(other), bits), None, "bits {one}, {other}");
            }
        }
    }

    #[test]
    fn a_wire_that_stays_on_a_level_a_late_encoder_and_one_that_tells_an_error_have_no_position() {
        let sound = frame(77, 18, [2, 5], true);
        assert!(position(sound, 18).is_some());
        // The longest that fits, and one clock more: the low line behind it is not seen.
        let longest = frame(77, 18, [19, 16], true);
        assert!(position(longest, 18).is_some());
        let late = longest >> 1 | 1 << 63;
        for broken in [0, u64::MAX, 1 << 63, sound & u64::MAX >> 2, late, frame(77, 18, [2, 5], false)] {
            assert_eq!(position(broken, 18), None, "{broken:#x}");
        }
    }

    #[test]
    fn two_spoilt_frames_are_bridged_once_the_speed_is_known() {
        let mut bridge = Bridge::default();
        let (step, mut at) = (Angle(1 << 20), Angle(u32::MAX - 5));
        let mut next = |bridge: &mut Bridge, sound: bool| {
            at = at + step;
            bridge.angle(sound.then_some(at)).map(|told| told - at)
        };
        assert_eq!(next(&mut bridge, false), None);
        assert_eq!(next(&mut bridge, true), Some(Angle(0)));
        assert_eq!(next(&mut bridge, false), None, "a speed needs two frames");
        for sound in [true, true, false, true, true, false, false, true, true] {
            assert_eq!(next(&mut bridge, sound), Some(Angle(0)), "{sound}");
        }
        for told in [Some(Angle(0)), Some(Angle(0)), None, None] {
            assert_eq!(next(&mut bridge, false), told);
        }
        bridge.spoilt = u8::MAX;
        assert_eq!(next(&mut bridge, false), None, "a broken wire stays broken");
    }
}
