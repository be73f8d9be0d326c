//! The slot of each frame: fixed places in a cycle of 100 ms, so that the bus load is always the same.

use super::e2e::Counter;
use super::frame::Frame;
use super::message_set::MessageSet;
use super::scales::Scales;
use super::telemetry::{Counts, ParameterAnswer, StatusFrame, TemperaturesFrame, trip_frames};
use crate::protection::Trip;
use crate::thermal::Temperatures;

/// Slots in a cycle.
const CYCLE: u32 = 100;

/// Places in [`MessageSet::FROM_DRIVE`].
const STATUS: usize = 0;
const FAULT_VALUE: usize = 4;
const FAULT_LIMIT: usize = 5;
const COUNTERS: usize = 6;
const ANSWER: usize = 7;
/// A fourth message of measurements, if a drive has one.
const MORE: usize = 8;
/// The temperatures, if a drive has them.
const TEMPERATURES: usize = 9;

/// Counters of all messages, and the place in the cycle.
#[derive(Clone, Copy, Debug)]
pub struct Sender<D> {
    slot: u32,
    page: u32,
    answer: Option<ParameterAnswer>,
    counters: [Counter; 11],
    message_set: core::marker::PhantomData<D>,
}

impl<D: MessageSet> Sender<D> {
    /// The state at the cycle's beginning.
    pub const fn new() -> Self {
        Self {
            slot: 0,
            page: 0,
            answer: None,
            counters: [Counter::new(); 11],
            message_set: core::marker::PhantomData,
        }
    }

    /// Sends this answer in the next free slot; it replaces an answer that still waits.
    pub fn answer(&mut self, answer: ParameterAnswer) {
        self.answer = Some(answer);
    }

    /// One slot.
    pub fn step(
        &mut self,
        status: &StatusFrame<D::Pattern>,
        (measured, scales): (&D::Measured, Scales),
        temperatures: Option<&Temperatures>,
        trip: Option<&Trip>,
        counts: &Counts,
    ) -> Option<Frame> {
        let slot = self.slot;
        self.slot = (slot + 1) % CYCLE;
        let (place, content) = match (slot % 10, slot / 10) {
            (0, _) => (STATUS, status.encode()),
            (2, _) => (1, D::measured(measured, 0, scales)),
            (4, _) => (2, D::measured(measured, 1, scales)),
            (6, _) => (3, D::measured(measured, 2, scales)),
            (7, _) if D::ANGLE_ZERO != MORE => (MORE, D::measured(measured, 3, scales)),
            (8, 0) => {
                let content = counts.encode(self.page);
                self.page = Counts::page_after(self.page);
                (COUNTERS, content)
            }
            (8, 1) if D::FROM_DRIVE.len() > TEMPERATURES => {
                (TEMPERATURES, TemperaturesFrame::from(temperatures?).encode())
            }
            (8, 2) => (D::ANGLE_ZERO, D::measured(measured, 4, scales)),
            (8, 3) => {
                let [value, _] = trip_frames(trip?);
                (FAULT_VALUE, value)
            }
            (8, 6) => {
                let [_, limit] = trip_frames(trip?);
                (FAULT_LIMIT, limit)
            }
            (8, _) => return None,
            _ => (ANSWER, self.answer.take()?.encode()),
        };
        let message = D::FROM_DRIVE.get(place)?;
        Some(message.frame(message.mark(content, scales), self.counters.get_mut(place)?))
    }
}
