//! Which frame is sent in which slot: fixed places in a cycle of 100 ms, so that the bus load is the same whatever happens.

use super::e2e::Counter;
use super::frame::Frame;
use super::telemetry::{
    COUNTERS, CURRENTS, Counts, FAULT_LIMIT, FAULT_VALUE, MOTION, Measured, PARAMETER_ANSWER,
    ParameterAnswer, STATUS, StatusFrame, VOLTAGES, trip_frames,
};
use crate::protection::Trip;

/// Slots in a cycle.
const CYCLE: u32 = 100;

/// Counters of all messages, and the place in the cycle.
#[derive(Clone, Copy, Debug)]
pub struct Sender {
    slot: u32,
    page: u32,
    answer: Option<ParameterAnswer>,
    status: Counter,
    motion: Counter,
    currents: Counter,
    voltages: Counter,
    fault_value: Counter,
    fault_limit: Counter,
    counters: Counter,
    parameter: Counter,
}

impl Sender {
    /// At the cycle's beginning.
    pub const fn new() -> Self {
        Self {
            slot: 0,
            page: 0,
            answer: None,
            status: Counter::new(),
            motion: Counter::new(),
            currents: Counter::new(),
            voltages: Counter::new(),
            fault_value: Counter::new(),
            fault_limit: Counter::new(),
            counters: Counter::new(),
            parameter: Counter::new(),
        }
    }

    /// Sends this in the next free slot; it takes the place of an answer that still waits.
    pub fn answer(&mut self, answer: ParameterAnswer) {
        self.answer = Some(answer);
    }

    /// One slot.
    pub fn step(
        &mut self,
        status: &StatusFrame,
        measured: &Measured,
        trip: Option<&Trip>,
        counts: &Counts,
    ) -> Option<Frame> {
        let slot = self.slot;
        self.slot = (slot + 1) % CYCLE;
        match (slot % 10, slot / 10) {
            (0, _) => Some(STATUS.frame(status.encode(), &mut self.status)),
            (2, _) => Some(MOTION.frame(measured.motion(), &mut self.motion)),
            (4, _) => Some(CURRENTS.frame(measured.currents(), &mut self.currents)),
            (6, _) => Some(VOLTAGES.frame(measured.voltages(), &mut self.voltages)),
            (8, 0) => {
                let content = counts.encode(self.page);
                self.page = Counts::page_after(self.page);
                Some(COUNTERS.frame(content, &mut self.counters))
            }
            (8, 3) => {
                let [value, _] = trip_frames(trip?);
                Some(FAULT_VALUE.frame(value, &mut self.fault_value))
            }
            (8, 6) => {
                let [_, limit] = trip_frames(trip?);
                Some(FAULT_LIMIT.frame(limit, &mut self.fault_limit))
            }
            (8, _) => None,
            _ => Some(PARAMETER_ANSWER.frame(self.answer.take()?.encode(), &mut self.parameter)),
        }
    }
}

impl Default for Sender {
    fn default() -> Self {
        Self::new()
    }
}
