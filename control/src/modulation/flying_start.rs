//! The flying start of a pattern: it begins on a turning machine whose gates were off.
//!
//! The flux in the machine is that of the magnets. A pattern that began at once would leave its hexagon off the centre by the missing flux,
//! and the machine with a slowly decaying current. So the first half is a carrier's, as long as it takes to lead the
//! flux to the hexagon: to the corner or the middle of an edge where it will be at that time by the pattern's angle. If the diodes conduct all the time
//! they have led it there already.

use super::half::boundary;
use super::{Mode, Reference, RippleFlux};
use crate::frames::{AlphaBeta, Angle, SQRT_3, UNITS_PER_RADIAN};

/// The voltage that a carrier can give in every direction, as a share of the link's.
const LARGEST_SHARE: f32 = 1.0 / SQRT_3;

/// Least angle of the first half, 15°: the shortest of a half that catches up with its angle.
const LEAST: Angle = Angle(178_956_971);

/// Angle up to which ends of the first half are considered, one after the other: 135°.
const FARTHEST: Angle = Angle(0x6000_0000);

/// EMF from which the diodes conduct all the time, as a share of the link's voltage: their own voltage is that of six-step, 2/π, less the possible error of
/// sensors. Below it, a map with too strong magnets would have the diodes lead a flux linkage that is not there: two of 10,000 random runs tripped.
const CONDUCTING: f32 = 0.62;

/// Distance of an EMF from the pattern's fundamental within which the diodes lead, as a share of the link's voltage. In steady state they leave up to 0.24, the
/// difference of the operating point from theirs; 0.57 and more are currents that another command has left.
const LED_WITHIN: f32 = 0.4;

/// `true` for an EMF, as a share of the link's voltage, that drives current through the diodes in steady state.
///
/// The diodes switch as square wave does, at its angle, so a pattern begins where they are. No carrier can lead so much flux:
/// with a first half that tried to, up to 135° long, machines whose magnets have that EMF took 2 to 8 times their largest current.
pub fn diodes_lead(emf: AlphaBeta, pulse: Angle, seen: &Reference) -> bool {
    let round = (pulse - Angle::DEG_90).sin_cos();
    let off = emf - AlphaBeta { alpha: round.cos, beta: round.sin } * (seen.voltage_v / seen.udc_v);
    emf.squared() > CONDUCTING * CONDUCTING && off.squared() < LED_WITHIN * LED_WITHIN
}

/// The first half of a pattern.
#[derive(Clone, Copy, Debug)]
pub struct FlyingStart {
    /// Its number in the pattern, for its end.
    pub half: u32,
    /// Turn of the pulse angle meanwhile.
    pub turned: Angle,
    /// Its mean voltage, stationary frame, as a share of the link's.
    pub share: AlphaBeta,
}

impl FlyingStart {
    /// The first half for a start at pulse angle `pulse` with an EMF as a share of the link's voltage. It ends at the first boundary that the voltage of a
    /// carrier can reach.
    pub fn new(mode: Mode, pulse: Angle, emf: AlphaBeta, seen: &Reference) -> Self {
        // Flux times frequency is a voltage, here as a share of the link's.
        let hexagon = RippleFlux::new(mode, seen.voltage_v, seen.udc_v, seen.udc_v);
        let present = AlphaBeta { alpha: emf.beta, beta: -emf.alpha };
        let turn = 2 * mode.carriers();
        let mut end = ((u64::from((pulse + LEAST).0) * u64::from(turn)) >> 32) as u32 + 1;
        // Each end is at least 10° farther, so the farthest comes within 14.
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

#[cfg(test)]
mod tests {
    use super::super::schedule::nearest;
    use super::super::{Modulator, Schedule, SwitchLimits};
    use super::*;
    use crate::time::{Clock, Instant};

    /// An EMF along α and along β, beside a fundamental of six-step along α.
    #[test]
    fn diodes_lead_where_they_conduct_all_the_time_and_near_the_pattern() {
        let seen = Reference::turning(
            1_500.0 * core::f32::consts::FRAC_2_PI,
            Angle::ZERO,
            100.0,
            Instant(0),
            1_500.0,
        );
        for (alpha, beta, leads) in [
            (0.61, 0.0, false),
            (0.63, 0.0, true),
            (1.03, 0.0, true),
            (1.04, 0.0, false),
            (0.63, 0.39, true),
            (0.63, -0.41, false),
            (-0.63, 0.0, false),
        ] {
            let found = diodes_lead(AlphaBeta { alpha, beta }, Angle::DEG_90, &seen);
            assert_eq!(found, leads, "{alpha} {beta}");
        }
    }

    #[test]
    fn the_nearest_half_begins_within_half_of_one() {
        for mode in [Mode::Mid7, Mode::Mid3, Mode::Square] {
            let half = boundary(1, mode.carriers()).0;
            for pulse in (0..720).map(|k| Angle(k * (u32::MAX / 720))) {
                let nearest = nearest(2 * mode.carriers(), pulse);
                let off = (boundary(nearest, mode.carriers()) - pulse).signed().unsigned_abs();
                assert!(nearest < 2 * mode.carriers() && off <= half / 2 + 1, "{} {pulse:?}", mode.name());
            }
        }
    }

    /// Every 5° at the lowest frequencies of the locked modes, of slow devices and of fast ones: the first half is as long as its angle.
    #[test]
    fn the_first_half_ends_at_the_angle_of_its_boundary() {
        let mut starts = 0;
        for (max_switching_hz, hz) in [(900.0, 100.0), (8_000.0, 360.0), (20_000.0, 900.0)] {
            let clock = Clock::new(25_000_000, 1_250);
            let devices = SwitchLimits::new(25, 0, max_switching_hz, &clock);
            let rate = (hz * 4_294_967_296.0 / 25e6) as f32;
            for mode in [Mode::Mid7, Mode::Mid3, Mode::Square] {
                for angle in (0..72).map(|step| Angle::from_turns(step as f32 / 72.0)) {
                    let mut modulator = Modulator::new(devices, Schedule::fixed(mode, &clock));
                    // As much flux linkage as the pattern has, all but a twentieth.
                    let seen = Reference::turning(600.0, angle, rate, Instant(0), 1_000.0);
                    let seen = Reference { vector: seen.vector * 0.95, ..seen };
                    let half = modulator.step(Instant(0), Some(&seen));
                    let off = seen.pulse_at(Instant(half.period_ticks)) - half.end_angle().unwrap();
                    let off_deg = off.signed() as f32 * (360.0 / 4_294_967_296.0);
                    assert!(
                        off_deg.abs() < 0.5,
                        "{max_switching_hz} Hz {} {angle:?}: {off_deg}°",
                        mode.name()
                    );
                    starts += 1;
                }
            }
        }
        assert_eq!(starts, 648);
    }

    /// Every 5°, forward and backward: square wave begins with one of the two edges beside its voltage and the link's whole voltage; led by a carrier, with none.
    #[test]
    fn square_wave_begins_where_the_diodes_are() {
        let clock = Clock::new(25_000_000, 2_500);
        let devices = SwitchLimits::new(250, 0, 900.0, &clock);
        let rate = (300.0 * 4_294_967_296.0 / 25e6) as f32;
        for (step, direction) in (0..72).flat_map(|step| [(step, 1.0), (step, -1.0)]) {
            let angle = Angle::from_turns(step as f32 / 72.0);
            let along = |share: f32| {
                let mut modulator = Modulator::new(devices, Schedule::fixed(Mode::Square, &clock));
                let seen = Reference::turning(share * 1_500.0, angle, direction * rate, Instant(0), 1_500.0);
                let half = modulator.step(Instant(0), Some(&seen));
                assert_eq!(half.mode, Mode::Square);
                let [a, b, c] = half.start_levels.map(|on| if on { 1.0_f32 } else { 0.0 });
                let levels = AlphaBeta { alpha: (2.0 * a - b - c) / 3.0, beta: (b - c) / SQRT_3 };
                let round = angle.sin_cos();
                levels.alpha * round.cos + levels.beta * round.sin
            };
            let (begun, led) = (along(core::f32::consts::FRAC_2_PI), along(0.5));
            assert!(led.abs() < 1e-6 && begun > 2.0 / 3.0 * 0.7, "{step} {direction}: {begun} {led}");
        }
    }
}
