//! The gates' real states: two latches per gate on the driver board, read by SPI3 at every peak.
//!
//! For each gate the driver board latches whether its device has been on and whether it has been off. While the select line is low it shifts out two words, the
//! most significant bit first; when the line goes high it starts over:
//!
//! | word | bits 15 … 9 | bits 8 … 0 |
//! |---|---|---|
//! | first | `1010101` | has been on, bit k gate k |
//! | second | `0101010` | has been off |
//!
//! Any other bits on top mean a broken wire: then no gate counts as seen, which is a fault as soon as pulses are wanted.

use stm32_metapac::gpio::Gpio;
use stm32_metapac::spi::{Spi, vals};
use tractive::ports::GateFeedback;

const GATES: u16 = 0x1FF;
const FIRST_MARK: u16 = 0b1010101 << 9;
const SECOND_MARK: u16 = 0b0101010 << 9;

/// Polls of the receive flag before a word counts as missing: several times a word's length.
const PATIENCE: u32 = 100;

/// The select line's number in its port.
pub const SELECT: usize = 15;

/// The connection to the driver board.
#[derive(Clone, Copy)]
pub struct Feedback {
    /// SPI3.
    pub spi: Spi,
    /// Port of the select line, number [`SELECT`].
    pub port: Gpio,
}

impl Feedback {
    /// Master, 16 bits, 10.6 MHz; each bit is read at the falling edge that ends it, 94 ns after it was put out. What it sends goes nowhere.
    pub fn configure(&self) {
        self.spi.cr2().write(|w| w.set_ds(vals::Ds::BITS16));
        self.spi.cr1().write(|w| {
            w.set_mstr(vals::Mstr::MASTER);
            w.set_cpha(vals::Cpha::SECOND_EDGE);
            w.set_br(vals::Br::DIV16);
            w.set_ssm(true);
            w.set_ssi(true);
            w.set_spe(true);
        });
    }

    /// First step at a peak: both words are under way.
    #[inline]
    pub fn begin(&self) {
        self.port.bsrr().write(|w| w.set_br(SELECT, true));
        self.spi.dr16().write_value(0);
        self.spi.dr16().write_value(0);
    }

    /// The words that [`Self::begin`] asked for.
    #[inline]
    pub fn end(&self) -> GateFeedback {
        let words = [self.word(), self.word()];
        self.port.bsrr().write(|w| w.set_bs(SELECT, true));
        decoded(words)
    }

    /// The next word; `None` if it does not come.
    #[inline]
    pub fn word(&self) -> Option<u16> {
        let arrived = (0..PATIENCE).any(|_| self.spi.sr().read().rxne());
        arrived.then(|| self.spi.dr16().read())
    }
}

/// The feedback decoded from two words; nothing is seen if one of them is missing or has no mark.
#[inline]
pub fn decoded(words: [Option<u16>; 2]) -> GateFeedback {
    let [Some(on), Some(off)] = words else { return GateFeedback::default() };
    if on & !GATES == FIRST_MARK && off & !GATES == SECOND_MARK {
        GateFeedback { on: on & GATES, off: off & GATES }
    } else {
        GateFeedback::default()
    }
}

/// The words that a driver board sends if it has seen this.
pub const fn encoded(seen: GateFeedback) -> [u16; 2] {
    [FIRST_MARK | (seen.on & GATES), SECOND_MARK | (seen.off & GATES)]
}
