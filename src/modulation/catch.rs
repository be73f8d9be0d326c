//! How a pattern catches a turning machine whose gates were off.
//!
//! The flux in the machine is that of the magnets. A pattern that began at once would leave its hexagon off the centre by what is missing,
//! and the machine with a current that decays slowly. So the first half is a carrier's, as long as it takes to lead the
//! flux to the hexagon, to the corner or the middle of an edge where it will be at that time by the pattern's angle.

use super::{Mode, Reference, RippleFlux, boundary};
use crate::frames::{AlphaBeta, Angle, SQRT_3};

/// Least angle of the first half, 15°: as short as a half gets that catches up with its angle.
const LEAST: Angle = Angle(178_956_971);

/// Ends of the first half that are considered, 20° apart in middle 60° with 7 pulses, 30° in the others.
const ENDS: u32 = 5;

/// The first half of a pattern.
#[derive(Clone, Copy, Debug)]
pub struct Catch {
    /// Its number in the pattern, for its end.
    pub half: u32,
    /// By how much the pulse angle turns meanwhile, in rad.
    pub turn_rad: f32,
    /// Its mean voltage, stationary frame, in V.
    pub voltage: AlphaBeta,
}

impl Catch {
    /// Begun at pulse angle `pulse` with an EMF in V. It ends at the first boundary which the voltage of a carrier can reach.
    pub fn new(mode: Mode, pulse: Angle, emf: AlphaBeta, seen: &Reference) -> Self {
        let largest_v = seen.udc_v * (1.0 / SQRT_3);
        let step = if mode == Mode::Mid7 { 2 } else { 1 };
        let turn = 6 * mode.sector_halves();
        let place = ((u64::from((pulse + LEAST).0) * u64::from(turn)) >> 32) as u32;
        let first = place + 1;
        let mut catch = Self::ending(mode, first, pulse, emf, seen);
        for later in 1..ENDS {
            if catch.voltage.squared() <= largest_v * largest_v {
                break;
            }
            catch = Self::ending(mode, first + later * step, pulse, emf, seen);
        }
        catch
    }

    /// The one that ends where half number `end` begins (it may be beyond the turn).
    fn ending(mode: Mode, end: u32, pulse: Angle, emf: AlphaBeta, seen: &Reference) -> Self {
        let turn = 6 * mode.sector_halves();
        let end = if end >= turn { end - turn } else { end };
        let at = boundary(end, mode.carriers());
        let turned = at - pulse;
        let turn_rad = turned.turns() * core::f32::consts::TAU;
        // Flux times frequency, which is a voltage; the fundamental's lags the pulse angle by 180°.
        let direction = at.sin_cos();
        let round = AlphaBeta { alpha: -direction.cos, beta: -direction.sin } * seen.voltage_v;
        let ripple = RippleFlux::new(mode, seen.voltage_v, seen.udc_v, 1.0);
        let hexagon = round + ripple.map_or(AlphaBeta::default(), |ripple| ripple.at(end));
        let present = AlphaBeta { alpha: emf.beta, beta: -emf.alpha };
        let half = if end == 0 { turn - 1 } else { end - 1 };
        Self { half, turn_rad, voltage: (hexagon - present) * (1.0 / turn_rad) }
    }
}
