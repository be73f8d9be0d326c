//! The paper's figures of vectors and switching sequences on a run's page, drawn from the modulator's own gates.

use crate::pictures::zs9::{sequences, vectors};
use crate::report::Page;
use tractive::nine_switch::Scheme;

/// Figures 2 to 9 beside ours.
pub fn draw(page: &mut Page) {
    page.picture("figure 2", "time-sharing", sequences::figure2());
    page.picture("figure 3", "vectors of either motor", vectors::figure3());
    page.picture("figure 4", "S-SVPWM", sequences::figure4());
    page.picture("figure 5", "RS-SVPWM", sequences::figure5_or_6(Scheme::Rs));
    page.picture("figure 6", "RTHD-SVPWM", sequences::figure5_or_6(Scheme::Rthd));
    page.picture("figure 7", "which zero vector where", vectors::figure7());
    page.picture("figure 8", "ZVO-SVPWM", sequences::figure8());
    for scheme in [Scheme::Rthd, Scheme::S, Scheme::Rs, Scheme::Zvo] {
        let title = format!("{}: shoot-through beside the zero vectors", scheme.name());
        // The paper shows it for one scheme.
        let figure = (scheme == Scheme::Rthd).then_some("figure 9");
        page.picture(figure, &title, sequences::shoot_through(scheme));
    }
}
