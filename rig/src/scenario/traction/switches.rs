//! Changes of pulse pattern, each by itself.

use crate::pictures::chai::runs::AROUND_S;
use crate::report::Page;
use crate::trace::Recording;
use tractive::modulation::Mode;

/// The paper's figure of a change of mode, where it has one.
pub type Figure = fn(Mode, Mode) -> Option<&'static str>;

/// Line voltage, phase currents and torque around every change between pulsing modes, each under its `figure`.
pub fn plots(recording: &Recording, page: &mut Page, figure: Figure) {
    for switch in recording.switches.iter().filter(|switch| switch.is_between_pulses()) {
        let title = format!("{} → {}", switch.from.name(), switch.to.name());
        page.answers(figure(switch.from, switch.to));
        let window = (switch.t_s - AROUND_S.0, switch.t_s + AROUND_S.1);
        page.zoom(&title, recording, window);
    }
}
