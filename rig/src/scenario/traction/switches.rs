//! Changes of pulse pattern, each by itself: the paper's figures 9a to 9d.

use crate::report::Page;
use crate::trace::Recording;
use tractive::modulation::Mode;

/// Time that is drawn before a switch and after it, in s.
const AROUND_S: (f64, f64) = (0.03, 0.04);

/// Line voltage and phase current around every change between pulsing modes.
pub fn plots(recording: &Recording, page: &mut Page) {
    for switch in recording.switches.iter().filter(|switch| switch.is_between_pulses()) {
        let title = format!("{} → {}", switch.from.name(), switch.to.name());
        page.answers(figure_of(switch.from, switch.to));
        let window = (switch.t_s - AROUND_S.0, switch.t_s + AROUND_S.1);
        page.line_voltage(&format!("{title}, line voltage u-v"), recording, window);
        page.phase_current_in(&format!("{title}, phase current u"), recording, window);
    }
}

/// The paper's figure of a change of mode; it shows these four, on the way up, and no other.
fn figure_of(from: Mode, to: Mode) -> Option<&'static str> {
    const FIGURES: [(Mode, Mode, &str); 4] = [
        (Mode::Sync15, Mode::Sync12, "figure 9a"),
        (Mode::Sync12, Mode::Mid7, "figure 9b"),
        (Mode::Mid7, Mode::Mid3, "figure 9c"),
        (Mode::Mid3, Mode::Square, "figure 9d"),
    ];
    let known = FIGURES.iter().find(|(below, above, _)| (*below, *above) == (from, to));
    known.map(|(_, _, figure)| *figure)
}
