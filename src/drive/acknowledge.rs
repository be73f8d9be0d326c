//! The acknowledge of a fault, as control and the PWM interrupt carry it out together.

/// Control's side. The operator's number says that he has seen the fault; a release, which has a number of its own, makes the PWM
/// interrupt forget its fault and leave the safe state. A release is asked for only while control holds a fault, and so never with a
/// command of pulses; while control holds none the operator's number has nothing to forget, now or later.
pub(super) struct Acknowledge {
    /// Number of the operator's acknowledge that has been answered.
    answered: u8,
    /// Number of the release that was asked of the PWM interrupt last.
    release: u8,
    /// `true` while that release has not been carried out yet.
    pending: bool,
}

impl Acknowledge {
    /// At power-up.
    pub(super) const fn new() -> Self {
        Self { answered: 0, release: 0, pending: false }
    }

    /// One control period, before its checks: the operator's `number`, whether control is `tripped`, and the release that the PWM
    /// interrupt has `carried_out`, if that is known. True when control is to forget its fault.
    pub(super) fn step(&mut self, number: u8, tripped: bool, carried_out: Option<u8>) -> bool {
        if self.pending {
            let done = carried_out == Some(self.release);
            if done {
                (self.answered, self.pending) = (number, false);
            }
            return done;
        }
        if number != self.answered && tripped {
            (self.release, self.pending) = (self.release.wrapping_add(1), true);
        } else {
            self.answered = number;
        }
        false
    }

    /// The safe state entered once more: the PWM interrupt may have left it for a release that control has not seen carried out, and is
    /// asked to leave it anew.
    pub(super) fn entered(&mut self) {
        self.release = self.release.wrapping_add(u8::from(self.pending));
    }

    /// Number of the operator's acknowledge that both interrupts have carried out, or that had nothing to forget.
    pub(super) fn answered(&self) -> u8 {
        self.answered
    }

    /// Number of the last release, for the command.
    pub(super) fn release(&self) -> u8 {
        self.release
    }
}
