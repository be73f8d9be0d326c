//! The auxiliary contacts, without their bounce.
//!
//! A contact that reads as ordered is believed at once, any other only once it has lasted. So one that bounces on its way has arrived the first time, and
//! a disturbed reading is no fault yet.

use super::{Feedback, Switches};

/// Time after which a contact that does not read as ordered is believed, in s.
const BOUNCE_S: f32 = 0.01;

/// One auxiliary contact.
#[derive(Clone, Copy, Debug)]
struct Contact {
    ordered: bool,
    /// As it is believed to be.
    closed: bool,
    /// Slots in which it has read otherwise.
    slots: u32,
}

impl Contact {
    const OPEN: Self = Self { ordered: false, closed: false, slots: 0 };

    fn step(&mut self, reads: bool, slot_s: f32) {
        self.slots = if reads == self.closed { 0 } else { self.slots.saturating_add(1) };
        if reads == self.ordered || self.slots as f32 * slot_s > BOUNCE_S {
            (self.closed, self.slots) = (reads, 0);
        }
    }
}

/// Those of precharge relay and main contactor.
#[derive(Clone, Copy, Debug)]
pub(super) struct Contacts {
    precharge: Contact,
    main: Contact,
}

impl Contacts {
    pub(super) const OPEN: Self = Self { precharge: Contact::OPEN, main: Contact::OPEN };

    /// One slot with a feedback as it was read.
    pub(super) fn step(&mut self, read: &Feedback, slot_s: f32) {
        self.precharge.step(read.precharge_closed, slot_s);
        self.main.step(read.main_closed, slot_s);
    }

    /// Notes what is ordered until the next slot.
    pub(super) fn order(&mut self, switches: &Switches) {
        (self.precharge.ordered, self.main.ordered) = (switches.precharge, switches.main);
    }

    /// The feedback with the contacts as they are believed to be.
    pub(super) fn believed(&self, read: &Feedback) -> Feedback {
        Feedback { precharge_closed: self.precharge.closed, main_closed: self.main.closed, ..*read }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The contact's state after these readings, at 1 ms each.
    fn after(contact: &mut Contact, reads: &[bool]) -> bool {
        reads.iter().for_each(|reads| contact.step(*reads, 1e-3));
        contact.closed
    }

    #[test]
    fn a_contact_that_bounces_has_arrived() {
        for ordered in [true, false] {
            let mut contact = Contact { ordered, closed: !ordered, slots: 0 };
            assert_eq!(after(&mut contact, &[!ordered; 50]), !ordered, "not yet");
            for reads in [ordered, !ordered, !ordered, ordered, !ordered, ordered] {
                assert_eq!(after(&mut contact, &[reads]), ordered, "{reads}");
            }
        }
    }

    #[test]
    fn a_contact_that_lets_go_is_believed_after_ten_milliseconds() {
        for ordered in [true, false] {
            let mut contact = Contact { ordered, closed: ordered, slots: 0 };
            assert_eq!(after(&mut contact, &[!ordered; 9]), ordered);
            assert_eq!(after(&mut contact, &[ordered]), ordered);
            assert_eq!(after(&mut contact, &[!ordered; 9]), ordered, "the time begins anew");
            assert_eq!(after(&mut contact, &[!ordered; 2]), !ordered);
        }
    }

    #[test]
    fn each_contact_has_its_own_order() {
        let read =
            Feedback { precharge_closed: true, main_closed: true, driver_ready: true, ..Feedback::default() };
        for (precharge, main) in [(true, false), (false, true)] {
            let mut contacts = Contacts::OPEN;
            contacts.order(&Switches { precharge, main, ..Switches::default() });
            contacts.step(&read, 1e-3);
            let wanted = Feedback { precharge_closed: precharge, main_closed: main, ..read };
            assert_eq!(contacts.believed(&read), wanted);
            (0..10).for_each(|_| contacts.step(&read, 1e-3));
            assert_eq!(contacts.believed(&read), read);
        }
    }
}
