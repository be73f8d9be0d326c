//! The flying start of a pattern: it begins on a turning machine whose gates were off.
//!
//! The flux in the machine is that of the magnets. A pattern that began at once would leave its hexagon off the centre by what is missing,
//! and the machine with a current that decays slowly. So the first half is a carrier's, as long as it takes to lead the
//! flux to the hexagon, to the corner or the middle of an edge where it will be at that time by the pattern's angle.

use super::half::boundary;
use super::{Mode, Reference, RippleFlux};
use crate::frames::{AlphaBeta, Angle, SQRT_3, UNITS_PER_RADIAN};

/// The voltage that a carrier gives in every direction, as a share of the link's.
const LARGEST_SHARE: f32 = 1.0 / SQRT_3;

/// Least angle of the first half, 15°: as short as a half gets that catches up with its angle.
const LEAST: Angle = Angle(178_956_971);

/// Ends of the first half are considered up to here, 135°, one after the other.
const FARTHEST: Angle = Angle(0x6000_0000);

/// `true` of an EMF, as a share of the link's voltage, that drives current through the diodes: its line voltage is more than the link's.
///
/// The diodes switch as square wave does, at its angle, so a pattern begins where they are. No carrier can lead as much flux as that:
/// a first half that tried to, up to 135° long, was 2 to 8 times the largest current of machines whose magnets have that EMF.
pub fn diodes_conduct(emf: AlphaBeta) -> bool {
    emf.squared() > LARGEST_SHARE * LARGEST_SHARE
}

/// The number of the half of a pattern that begins nearest to a pulse angle.
pub fn nearest(mode: Mode, pulse: Angle) -> u32 {
    let halves = 2 * mode.carriers();
    let half = ((u64::from(pulse.0) * u64::from(halves) + (1 << 31)) >> 32) as u32;
    if half >= halves { 0 } else { half }
}

/// The first half of a pattern.
#[derive(Clone, Copy, Debug)]
pub struct FlyingStart {
    /// Its number in the pattern, for its end.
    pub half: u32,
    /// By how much the pulse angle turns meanwhile.
    pub turned: Angle,
    /// Its mean voltage, stationary frame, as a share of the link's.
    pub share: AlphaBeta,
}

impl FlyingStart {
    /// Begun at pulse angle `pulse` with an EMF as a share of the link's voltage. It ends at the first boundary which the voltage of a
    /// carrier can reach.
    pub fn new(mode: Mode, pulse: Angle, emf: AlphaBeta, seen: &Reference) -> Self {
        // Flux times frequency is a voltage, here as a share of the link's.
        let hexagon = RippleFlux::new(mode, seen.voltage_v, seen.udc_v, seen.udc_v);
        let present = AlphaBeta { alpha: emf.beta, beta: -emf.alpha };
        let turn = 2 * mode.carriers();
        let mut end = ((u64::from((pulse + LEAST).0) * u64::from(turn)) >> 32) as u32 + 1;
        // Each end is 10° farther at least, so the farthest comes within 14.
        loop {
            if end >= turn {
                end -= turn;
            }
            let turned = boundary(end, mode.carriers()) - pulse;
            let reached = hexagon.map_or(present, |hexagon| hexagon.hexagon(end));
            let share = (reached - present) * (UNITS_PER_RADIAN / turned.0 as f32);
            if turned.0 >= FARTHEST.0 || share.squared() <= LARGEST_SHARE * LARGEST_SHARE {
                let half = if end == 0 { turn - 1 } else { end - 1 };
                return Self { half, turned, share };
            }
            end += 1;
        }
    }
}
