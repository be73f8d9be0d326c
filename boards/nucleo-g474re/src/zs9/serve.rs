//! The idle loop's operator of the ZS9.

use super::{CLOCK, hardware, pins};
use crate::serve::Serve;
use crate::switchgear;
use tractive::drive::DualOperatorMailboxes;
use tractive::operator::{DualDemands, DualRequest, DualSlot, DualStatus, Feedback, OperatorPort, Settings};
use tractive::ports::DualReport;
use tractive::protection::FailedCheck;
use tractive::protocol::Zs9CanEndpoint;
use tractive::time::Instant;

/// The operator's side of the board.
pub type DualServe<'a> = Serve<'a, Zs9CanEndpoint>;

impl DualServe<'_> {
    /// The board's feedback.
    pub fn feedback(&self) -> Feedback {
        Feedback {
            enable_input: pins::is_enabled(&self.registers),
            hardware: hardware::held_by(&self.registers),
            ..self.common(&pins::SWITCHGEAR)
        }
    }

    /// As [`Serve::pass`].
    pub fn pass(&mut self, slot: &mut DualSlot, mailboxes: &DualOperatorMailboxes, rated: &Settings) -> bool {
        self.collect();
        let settings = self.station.settings(rated);
        slot.run(mailboxes, self, &settings, &CLOCK)
    }

    /// As [`Serve::refuse`].
    pub fn refuse(&mut self, slot: &mut DualSlot, why: FailedCheck, rated: &Settings) {
        self.collect();
        slot.refuse(why, self, rated, &CLOCK);
    }
}

/// As the PMaSynRM's.
impl OperatorPort<DualDemands> for DualServe<'_> {
    fn ask(&mut self, _at: Instant, slots: u32) -> (DualRequest, Feedback) {
        let frames = self.hear();
        (self.station.listen(slots, frames), self.feedback())
    }

    fn tell(&mut self, _from: Instant, status: &DualStatus, report: Option<&DualReport>) {
        switchgear::set_wires(&self.registers, &pins::SWITCHGEAR, &status.switches);
        let frame = self.station.tell(status, report);
        self.say(frame);
    }
}
