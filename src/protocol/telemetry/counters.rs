//! The counts of the frames received, in pages.

use crate::protocol::message::Message;
use crate::protocol::signal::{Payload, Signal};

const PAGE: Signal = Signal::number("page", 12, 4, 2);
const fn counter(name: &'static str, index: u32) -> Signal {
    Signal::number(name, 16 + index % 3 * 16, 16, 0xFFFF).on_page(index / 3)
}

/// The page's number, then the counters in the order of [`Counts::to_array`].
pub(in crate::protocol) const COUNTER_SIGNALS: [Signal; 10] = [
    PAGE,
    counter("received", 0),
    counter("taken", 1),
    counter("lost", 2),
    counter("unknown", 3),
    counter("truncated", 4),
    counter("corrupted", 5),
    counter("repeated", 6),
    counter("disordered", 7),
    counter("out_of_range", 8),
];
const PAGES: u32 = 3;

/// The counts of the frames received, in pages.
pub const COUNTERS: Message = Message::new("COUNTERS", 0x187, 11, 100, &COUNTER_SIGNALS);

/// The counts of the frames received. Counts wrap; every frame received is counted a second time in one of the other counts except `lost`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counts {
    /// Frames received.
    pub received: u32,
    /// Frames that took effect, or set the counter after a silence.
    pub taken: u32,
    /// Frames missing in a sequence that went on.
    pub lost: u32,
    /// Frames with an identifier that is not one of ours.
    pub unknown: u32,
    /// Frames of another length than eight bytes.
    pub truncated: u32,
    /// Frames with a wrong CRC.
    pub corrupted: u32,
    /// Frames with the same counter as the one before.
    pub repeated: u32,
    /// Frames whose counter is too far from the last.
    pub disordered: u32,
    /// Frames with a value out of its range, or with an unused bit.
    pub out_of_range: u32,
}

impl Counts {
    /// All, in the order of the message's pages.
    pub const fn to_array(self) -> [u32; 9] {
        let Self { received, taken, lost, unknown, truncated, corrupted, repeated, disordered, out_of_range } =
            self;
        [received, taken, lost, unknown, truncated, corrupted, repeated, disordered, out_of_range]
    }

    /// Frames that were rejected.
    pub const fn rejected(&self) -> u32 {
        self.unknown
            .wrapping_add(self.truncated)
            .wrapping_add(self.corrupted)
            .wrapping_add(self.repeated)
            .wrapping_add(self.disordered)
            .wrapping_add(self.out_of_range)
    }

    /// One page of the message, 0 ..= 2.
    pub fn encode(&self, page: u32) -> Payload {
        let mut payload = Payload::default();
        PAGE.put_raw(&mut payload, page);
        for (signal, count) in COUNTER_SIGNALS.iter().skip(1).zip(self.to_array()) {
            if signal.page == Some(page) {
                signal.put_raw(&mut payload, count);
            }
        }
        payload
    }

    /// Adopts one page of the message; counts come with their lower 16 bits.
    pub fn merge(&mut self, payload: Payload) {
        let mut counts = self.to_array();
        for (signal, count) in COUNTER_SIGNALS.iter().skip(1).zip(&mut counts) {
            if signal.page == Some(PAGE.raw(payload)) {
                *count = signal.raw(payload);
            }
        }
        let [received, taken, lost, unknown, truncated, corrupted, repeated, disordered, out_of_range] =
            counts;
        *self =
            Self { received, taken, lost, unknown, truncated, corrupted, repeated, disordered, out_of_range };
    }

    /// The page after this one.
    pub const fn page_after(page: u32) -> u32 {
        (page + 1) % PAGES
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_page_comes_in_its_turn() {
        let mut page = 0;
        for turn in 1..=2 * PAGES {
            page = Counts::page_after(page);
            assert_eq!(page, turn % PAGES);
        }
    }
}
