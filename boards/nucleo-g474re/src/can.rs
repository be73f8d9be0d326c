//! CAN: FDCAN1 with classic frames at 500 kbit/s, served from the idle loop.
//!
//! Its clock is the crystal itself, so the bit rate does not depend on the PLL. The message RAM of this chip has a fixed layout: filters, two receive
//! FIFOs and a transmit FIFO of three elements each, with 18 words an element. Only the protocol's own identifiers pass the filters; remote frames
//! and 29-bit identifiers never do.

use super::start::{StartError, Wait};
use stm32_metapac as pac;
use stm32_metapac::can::vals::{Anfe, Anfs, Pdiv, Tfqm};
use stm32_metapac::rcc::vals::Fdcansel;
use tractive::protocol::{Frame, Message};

/// The crystal, in Hz.
pub const CLOCK_HZ: u32 = 24_000_000;
/// Bits per second.
pub const BIT_RATE: u32 = 500_000;
/// The point in a bit at which it is sampled, in thousandths, as CiA recommends.
pub const SAMPLE_POINT: u32 = 875;

/// The length of a bit, in quanta; each value is the true one, not the one that the register holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BitTiming {
    /// Clock cycles in a quantum, 1 ..= 512.
    pub prescaler: u32,
    /// Quanta from the synchronisation quantum to the sample point, 1 ..= 256.
    pub before_sample: u32,
    /// Quanta after it, 1 ..= 128.
    pub after_sample: u32,
}

impl BitTiming {
    /// Quanta in a bit.
    pub const fn quanta(&self) -> u32 {
        1 + self.before_sample + self.after_sample
    }

    /// The timing with 16 quanta a bit; `None` if clock, rate and sample point do not match exactly.
    pub const fn exact(clock_hz: u32, bit_rate: u32, sample_point: u32) -> Option<Self> {
        const QUANTA: u32 = 16;
        let quantum_hz = bit_rate * QUANTA;
        let sampled = QUANTA * sample_point;
        if quantum_hz == 0 || !clock_hz.is_multiple_of(quantum_hz) || !sampled.is_multiple_of(1_000) {
            return None;
        }
        let (prescaler, sampled) = (clock_hz / quantum_hz, sampled / 1_000);
        if prescaler == 0 || prescaler > 512 || sampled < 2 || sampled >= QUANTA {
            return None;
        }
        Some(Self { prescaler, before_sample: sampled - 1, after_sample: QUANTA - sampled })
    }
}

/// The bus's timing.
pub const TIMING: BitTiming = match BitTiming::exact(CLOCK_HZ, BIT_RATE, SAMPLE_POINT) {
    Some(timing) => timing,
    None => panic!("clock, bit rate and sample point do not come out exactly"),
};

/// Words of an element of a FIFO.
const ELEMENT: usize = 18;
/// Elements of a FIFO.
const ELEMENTS: usize = 3;
/// Slots from a bus-off until the controller rejoins the bus, in ms, so that a shorted bus is not flooded.
pub const BUS_OFF_MS: u32 = 100;

/// The state of the bus.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Health {
    /// Frames that found the transmit FIFO full; wraps.
    pub dropped: u32,
    /// Number of times that the controller has left the bus; wraps.
    pub bus_offs: u32,
}

/// The controller and its memory.
#[derive(Clone, Copy)]
pub struct Can {
    can: pac::can::Fdcan,
    ram: pac::fdcanram::Fdcanram,
    health: Health,
    /// Slots until the bus is rejoined, while it is off.
    waits_ms: Option<u32>,
}

impl Can {
    /// The chip's own.
    pub const CHIP: Self = Self::new(pac::FDCAN1, pac::FDCANRAM1);

    /// Made of these blocks.
    pub const fn new(can: pac::can::Fdcan, ram: pac::fdcanram::Fdcanram) -> Self {
        Self { can, ram, health: Health { dropped: 0, bus_offs: 0 }, waits_ms: None }
    }

    /// Sets clock, timing and filters for these messages, then joins the bus. The pins are configured afterwards, so that nothing dominant is sent
    /// before. The clock is the crystal, however far the start has come.
    pub fn configure(
        &self,
        messages: &[&Message],
        rcc: &pac::rcc::Rcc,
        wait: &mut dyn Wait,
    ) -> Result<(), StartError> {
        rcc.cr().modify(|w| w.set_hseon(true));
        wait.until(&mut || rcc.cr().read().hserdy()).or(Err(StartError::Can))?;
        rcc.ccipr().modify(|w| w.set_fdcansel(Fdcansel::HSE));
        rcc.apb1enr1().modify(|w| w.set_fdcanen(true));
        // A peripheral accepts writes only some cycles after its clock has been enabled.
        wait.microseconds(1);
        let can = self.can;
        can.cccr().modify(|w| w.set_init(true));
        wait.until(&mut || can.cccr().read().init()).or(Err(StartError::Can))?;
        // Everything below is write-protected until this bit is set.
        can.cccr().modify(|w| w.set_cce(true));
        can.cccr().modify(|w| {
            w.set_fdoe(false);
            w.set_brse(false);
            w.set_dar(false);
            w.set_mon(false);
            w.set_asm(false);
            w.set_test(false);
        });
        can.ckdiv().write(|w| w.set_pdiv(Pdiv::DIV_1));
        can.nbtp().write(|w| {
            w.set_nbrp((TIMING.prescaler - 1) as u16);
            w.set_ntseg1((TIMING.before_sample - 1) as u8);
            w.set_ntseg2((TIMING.after_sample - 1) as u8);
            // As long as the segment after the sample point.
            w.set_nsjw((TIMING.after_sample - 1) as u8);
        });
        can.rxgfc().write(|w| {
            w.set_rrfe(true);
            w.set_rrfs(true);
            w.set_anfe(Anfe::REJECT);
            w.set_anfs(Anfs::REJECT);
            // A full FIFO keeps what it has: the counters show the gap in the sequence.
            w.set_f0om(false);
            // Two identifiers share a filter.
            w.set_lss(messages.len().div_ceil(2) as u8);
            w.set_lse(0);
        });
        for (index, pair) in messages.chunks(2).enumerate() {
            if let (Some(first), Some(last)) = (pair.first(), pair.last()) {
                self.ram.flssa(index).write_value(dual_filter(first.id, last.id));
            }
        }
        can.txbc().write(|w| w.set_tfqm(Tfqm::FIFO));
        self.join();
        wait.until(&mut || !can.cccr().read().init()).or(Err(StartError::Can))
    }

    /// Leaves the initialisation: the controller waits for eleven recessive bits, or 128 times as many after a bus-off.
    fn join(&self) {
        self.can.cccr().modify(|w| {
            w.set_cce(false);
            w.set_init(false);
        });
    }

    /// Takes the received frames, oldest first, as many as there is room for; returns their number.
    pub fn receive(&mut self, into: &mut [Frame]) -> usize {
        let status = self.can.rxfs(0).read();
        let taken = usize::from(status.ffl()).min(ELEMENTS).min(into.len());
        for (frame, element) in into.iter_mut().zip(0..taken) {
            *frame = self.element((usize::from(status.fgi()) + element) % ELEMENTS);
        }
        if taken > 0 {
            // The last one that was read: releasing it releases those before it, too.
            let last = (usize::from(status.fgi()) + taken - 1) % ELEMENTS;
            self.can.rxfa(0).write(|w| w.set_fai(last as u8));
        }
        taken
    }

    /// An element of the receive FIFO.
    fn element(&self, index: usize) -> Frame {
        let base = index * ELEMENT;
        let [id, length, low, high] = [0, 1, 2, 3].map(|word| self.ram.rxfifo0(base + word).read());
        // Codes above 8 mean eight bytes.
        let length = (length >> 16 & 0xF).min(8) as u8;
        let [a, b, c, d] = low.to_le_bytes();
        let [e, f, g, h] = high.to_le_bytes();
        let mut data = [a, b, c, d, e, f, g, h];
        data.iter_mut().skip(usize::from(length)).for_each(|byte| *byte = 0);
        Frame { id: (id >> 18 & 0x7FF) as u16, length, data }
    }

    /// Sends a frame, or drops it if three are already waiting: telemetry is repeated, and a bus without listeners fills no memory.
    pub fn send(&mut self, frame: &Frame) {
        let status = self.can.txfqs().read();
        if status.tfqf() {
            self.health.dropped = self.health.dropped.wrapping_add(1);
            return;
        }
        let index = usize::from(status.tfqpi()).min(ELEMENTS - 1);
        let [a, b, c, d, e, f, g, h] = frame.data;
        let words = [
            u32::from(frame.id & 0x7FF) << 18,
            u32::from(frame.length.min(8)) << 16,
            u32::from_le_bytes([a, b, c, d]),
            u32::from_le_bytes([e, f, g, h]),
        ];
        for (word, value) in words.into_iter().enumerate() {
            self.ram.txbuf(index * ELEMENT + word).write_value(value);
        }
        self.can.txbar().write(|w| w.set_ar(index, true));
    }

    /// Called once a millisecond: rejoins the bus some time after a bus-off.
    pub fn tend(&mut self) {
        if !self.can.psr().read().bo() {
            self.waits_ms = None;
            return;
        }
        match self.waits_ms {
            None => {
                self.health.bus_offs = self.health.bus_offs.wrapping_add(1);
                self.waits_ms = Some(BUS_OFF_MS);
            }
            Some(0) => {
                // The controller has set the bit itself; the flag stays until the bus has been quiet for long enough.
                if self.can.cccr().read().init() {
                    self.join();
                }
            }
            Some(left_ms) => self.waits_ms = Some(left_ms - 1),
        }
    }

    /// The state of the bus.
    pub const fn health(&self) -> Health {
        self.health
    }
}

/// A filter that stores frames with one of two identifiers in FIFO 0.
const fn dual_filter(first: u16, second: u16) -> u32 {
    const DUAL: u32 = 0b01 << 30;
    const STORE_IN_FIFO_0: u32 = 0b001 << 27;
    DUAL | STORE_IN_FIFO_0 | (first as u32) << 16 | second as u32
}
