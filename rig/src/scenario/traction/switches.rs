//! Changes of pulse pattern, each by itself: the paper's figures 9a to 9d.

use crate::pictures::chai::runs::{AROUND_S, change};
use crate::report::Page;
use crate::trace::Recording;

/// Line voltage, phase currents and torque around every change between pulsing modes.
pub fn plots(recording: &Recording, page: &mut Page) {
    for switch in recording.switches.iter().filter(|switch| switch.is_between_pulses()) {
        let title = format!("{} → {}", switch.from.name(), switch.to.name());
        page.answers(change(switch.from, switch.to));
        let window = (switch.t_s - AROUND_S.0, switch.t_s + AROUND_S.1);
        page.zoom(&title, recording, window);
    }
}
