//! The acknowledge of a fault, which control and the PWM interrupt carry out together.

/// Control's side. The operator's number says that he has seen the fault. A release, which has its own number, makes the PWM interrupt forget its
/// fault and leave the safe state. Control asks for a release only while it holds a fault, so never together with a command of pulses. While control
/// holds no fault, the operator's number has nothing to forget, now or later.
pub(super) struct Acknowledge {
    /// Number of the last operator's acknowledge that has been answered.
    answered: u8,
    /// Number of the last release that was requested from the PWM interrupt.
    release: u8,
    /// `true` while that release has not been carried out yet.
    pending: bool,
}

impl Acknowledge {
    /// The state at power-up.
    pub(super) const fn new() -> Self {
        Self { answered: 0, release: 0, pending: false }
    }

    /// One control period, before its checks, with the operator's `number`, whether control is `tripped`, and the release that the PWM interrupt has
    /// `carried_out`, if known. Returns true when control is to forget its fault.
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

    /// The safe state was entered again: the PWM interrupt may have left it for a release that control has not yet seen carried out, so it is asked
    /// to leave it anew.
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
