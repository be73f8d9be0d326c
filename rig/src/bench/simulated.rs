//! A bench, from the point of view of the code that runs a drive on it.

use super::Timeline;
use tractive::time::Instant;

/// A bench of either system.
pub trait Simulated {
    /// The record of the drive's flight recorder.
    type Record;
    /// The recording of a run.
    type Recording;

    /// Its time.
    fn time(&self) -> &Timeline;
    /// `true` once the recording is complete.
    fn is_done(&self) -> bool;
    /// Share of the run that is done, 0 ..= 1.
    fn progress(&self) -> f64;
    /// `true` if the control interrupt comes at this instant at all.
    fn has_control(&self, instant: Instant) -> bool;
    /// An instant near to now, in s from the recording's beginning.
    fn instant_s(&self, instant: Instant) -> f64 {
        self.time().seconds(self.time().widen(instant))
    }
    /// Beginning of the operator's slot after the one that begins at `slot`.
    fn slot_after(&self, slot: Instant) -> Instant {
        self.time().slot_after(slot)
    }
    /// Time since the recording's beginning, in s.
    fn time_s(&self) -> f64 {
        self.time().now_s()
    }
    /// The rotors' loads from `instant` on, in N·m; for one rotor the first.
    fn loads_from(&mut self, instant: Instant, loads_nm: [f64; 2]);
    /// Ends the recording at `instant`.
    fn end_at(&mut self, instant: Instant);
    /// The recording: the bench's observations, and the content of the drive's own recorder; instants in seconds from its beginning.
    fn into_recording(self, records: Vec<Self::Record>) -> Self::Recording;
}
