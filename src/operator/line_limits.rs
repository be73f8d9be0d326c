//! The torque that the limits of line current and line power allow.
//!
//! The line's power is the shaft's power plus the copper loss: `P = ω T + k T²`, with `k` from the currents that flow, the pulses' ripple included:
//! at a sixth of the largest torque the ripple loss of three pulses a turn is nearly as much again. The equation is solved for the torque, so that no
//! loop closes over the loss; at the limit, where it counts, `k T²` is the loss itself. Inverter, iron and auxiliaries are not included.

use super::{Settings, TrainLimits};
use crate::frames::{limit, sqrt};
use crate::machine::Ratings;
use crate::ports::Report;
use crate::thermal::copper_w;

/// Time constant of the link voltage and of the loss, in s: slower than the swing of a usual line filter, which is not a property of the line.
const SMOOTH_S: f32 = 0.05;
/// Delay from a speed to the torque that follows from it, in s: two slots, and a carrier half.
const FOLLOWS_S: f32 = 3e-3;
/// Share of the largest torque below which the loss is attributed to that torque: weakening currents cause a loss without torque.
const LEAST_SHARE: f32 = 0.1;
/// Share of the nominal voltage below which the permitted line current falls, to zero at the lowest operating voltage.
const FULL_SHARE: f32 = 0.9;

/// The line as seen through the link, and the drive's losses.
#[derive(Clone, Copy, Debug)]
pub(super) struct Drawn {
    /// Link voltage, in V; 0 while it is not known.
    udc_v: f32,
    /// Copper loss over the torque's square, in W/(N·m)².
    loss: f32,
    /// Mechanical speed, smoothed, in rad/s: a ramp is ahead of it by its acceleration times [`SMOOTH_S`].
    speed: f32,
}

/// Largest torques, in N·m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Most {
    pub motoring_nm: f32,
    pub braking_nm: f32,
}

impl Drawn {
    pub(super) const UNKNOWN: Self = Self { udc_v: 0.0, loss: 0.0, speed: 0.0 };

    /// One slot.
    #[inline(never)]
    pub(super) fn step(&mut self, report: &Report, settings: &Settings) {
        let Settings { ratings, slot_s, .. } = *settings;
        let Report { udc_v, torque_nm, current_a, omega, .. } = *report;
        let least_nm = LEAST_SHARE * ratings.max_torque_nm;
        let torque_nm = if torque_nm.abs() > least_nm { torque_nm } else { least_nm };
        let loss = copper_w(current_a, ratings.stator_resistance_ohm) / (torque_nm * torque_nm);
        let share = if self.udc_v > 0.0 { slot_s / (slot_s + SMOOTH_S) } else { 1.0 };
        self.udc_v += share * (udc_v - self.udc_v);
        self.loss += share * (loss - self.loss);
        self.speed += share * (omega / ratings.pole_pairs - self.speed);
    }

    /// The torques that the limits allow at a mechanical speed, in rad/s, extrapolated to the speed of a ramp when they take effect.
    #[inline(never)]
    pub(super) fn most(&self, speed: f32, ratings: &Ratings, limits: &TrainLimits) -> Most {
        let TrainLimits { motoring_a, braking_a, motoring_w, braking_w, .. } = *limits;
        let none = TrainLimits::NONE;
        let speed = (speed + FOLLOWS_S / SMOOTH_S * (speed - self.speed)).abs();
        let udc_v = self.udc_v;
        let current_w = motoring_a * motoring_share(udc_v, ratings) * udc_v;
        let taken_w = lower((motoring_a, none.motoring_a, current_w), (motoring_w, none.motoring_w));
        let given_w = lower((braking_a, none.braking_a, braking_a * udc_v), (braking_w, none.braking_w));
        Most {
            motoring_nm: taken_w.map_or(f32::INFINITY, |power_w| torque_nm(power_w, speed, self.loss)),
            braking_nm: given_w.map_or(f32::INFINITY, |power_w| torque_nm(power_w, speed, -self.loss)),
        }
    }
}

/// The permitted power, in W: the lower of the current limit's power and the power limit itself; `None` without a limit.
fn lower(
    (limit_a, no_limit_a, current_w): (f32, f32, f32),
    (limit_w, no_limit_w): (f32, f32),
) -> Option<f32> {
    let power_w = if limit_a >= no_limit_a || limit_w < current_w { limit_w } else { current_w };
    (limit_a < no_limit_a || limit_w < no_limit_w).then_some(power_w)
}

/// Share of the line's current that a motoring drive may take at a line voltage.
fn motoring_share(udc_v: f32, ratings: &Ratings) -> f32 {
    let none_v = ratings.dc_link_min_v;
    let span_v = FULL_SHARE * ratings.dc_link_nominal_v - none_v;
    if span_v > 0.0 { limit((udc_v - none_v) / span_v, 0.0, 1.0) } else { 1.0 }
}

/// The torque at which the line's power is `power_w`: the positive root of `ω T + k T² = P`. Without a root the loss absorbs all of the braking
/// power: no limit. A power that is not a number gives no torque.
fn torque_nm(power_w: f32, speed: f32, loss: f32) -> f32 {
    let square = speed * speed + 4.0 * loss * power_w;
    if loss < 0.0 && square <= 0.0 {
        f32::INFINITY
    } else if power_w > 0.0 && square >= 0.0 {
        2.0 * power_w / (speed + sqrt(square))
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::built_in::traction::BUILT_IN;

    const LIMITS: TrainLimits = TrainLimits { motoring_a: 100.0, braking_w: 90e3, ..TrainLimits::NONE };

    /// For a constant speed.
    fn drawn(udc_v: f32, speed: f32) -> Drawn {
        Drawn { udc_v, loss: 4e-3, speed }
    }

    #[test]
    fn without_limits_there_is_no_bound() {
        for (speed, udc_v) in [(0.0, 0.0), (100.0, 900.0), (-600.0, 1_500.0), (300.0, f32::NAN)] {
            let most = drawn(udc_v, speed).most(speed, &BUILT_IN.ratings, &TrainLimits::NONE);
            assert_eq!(most, Most { motoring_nm: f32::INFINITY, braking_nm: f32::INFINITY });
        }
    }

    /// The torque and its copper loss make the power of the limit.
    #[test]
    fn shaft_and_loss_are_the_line_s_power() {
        for speed in [2.0, -20.0, 200.0, -600.0] {
            let most = drawn(1_500.0, speed).most(speed, &BUILT_IN.ratings, &LIMITS);
            let power_w =
                |torque_nm: f32, sign: f32| torque_nm * speed.abs() + sign * 4e-3 * torque_nm * torque_nm;
            assert!((power_w(most.motoring_nm, 1.0) / 150e3 - 1.0).abs() < 1e-3, "{speed}: {most:?}");
            let given_w = power_w(most.braking_nm, -1.0);
            assert!(most.braking_nm == f32::INFINITY || (given_w / 90e3 - 1.0).abs() < 1e-3, "{speed}");
        }
    }

    /// A speed that has risen evenly is extrapolated to the speed that it will reach.
    #[test]
    fn a_ramp_is_looked_ahead_of() {
        let acceleration = 150.0;
        let rising = drawn(1_500.0, 40.0 - acceleration * SMOOTH_S);
        let later = drawn(1_500.0, 40.45).most(40.45, &BUILT_IN.ratings, &LIMITS).motoring_nm;
        let found = rising.most(40.0, &BUILT_IN.ratings, &LIMITS).motoring_nm;
        assert!((found / later - 1.0).abs() < 1e-4, "{found} {later}");
    }

    #[test]
    fn a_line_that_sags_gives_less_current_and_at_the_lowest_voltage_none() {
        let ratings = &BUILT_IN.ratings;
        let current_a = |udc_v: f32| {
            let most = drawn(udc_v, 300.0).most(300.0, ratings, &LIMITS).motoring_nm;
            (most * 300.0 + 4e-3 * most * most) / udc_v
        };
        let (full_v, none_v) = (FULL_SHARE * ratings.dc_link_nominal_v, ratings.dc_link_min_v);
        for (udc_v, share) in [(1_800.0, 1.0), (full_v, 1.0), (0.5 * (full_v + none_v), 0.5)] {
            assert!((current_a(udc_v) / (100.0 * share) - 1.0).abs() < 1e-3, "{udc_v}: {}", current_a(udc_v));
        }
        assert_eq!(current_a(none_v), 0.0);
        assert_eq!(drawn(f32::NAN, 300.0).most(300.0, ratings, &LIMITS).motoring_nm, 0.0);
    }

    /// The first slot adopts the present values, every later one a part in 51; the loss is that of the present currents, at a tenth of the largest
    /// torque at least.
    #[test]
    fn the_line_and_the_loss_are_smoothed() {
        let ratings = &BUILT_IN.ratings;
        let settings = Settings::rated(ratings, 1e-3, None);
        let report = |udc_v: f32, torque_nm: f32, current_a: f32| Report {
            udc_v,
            torque_nm,
            current_a,
            ..Report::default()
        };
        let loss = |current_a: f32, torque_nm: f32| {
            copper_w(current_a, ratings.stator_resistance_ohm) / (torque_nm * torque_nm)
        };
        let least_nm = 0.1 * ratings.max_torque_nm;
        for (torque_nm, counted_nm) in [
            (200.0, 200.0),
            (-200.0, 200.0),
            (least_nm.next_up(), least_nm),
            (10.0, least_nm),
            (0.0, least_nm),
        ] {
            let mut drawn = Drawn::UNKNOWN;
            drawn.step(&report(1_500.0, torque_nm, 50.0), &settings);
            assert_eq!(drawn.udc_v, 1_500.0);
            assert!((drawn.loss / loss(50.0, counted_nm) - 1.0).abs() < 1e-5, "{torque_nm}: {drawn:?}");
            let before = drawn;
            drawn.step(&report(1_449.0, torque_nm, 0.0), &settings);
            assert!((drawn.udc_v - 1_499.0).abs() < 1e-2, "{drawn:?}");
            assert!((drawn.loss / before.loss - 50.0 / 51.0).abs() < 1e-5, "{drawn:?}");
        }
    }

    /// Each limit by itself and both together: the lower one counts.
    #[test]
    fn the_lower_of_current_and_power_counts() {
        let ratings = &BUILT_IN.ratings;
        let none = TrainLimits::NONE;
        let free = |udc_v: f32, speed: f32| Drawn { udc_v, loss: 0.0, speed };
        let most = |limits: TrainLimits| free(1_500.0, -200.0).most(-200.0, ratings, &limits);
        let free_nm = f32::INFINITY;
        for (limits, motoring_nm, braking_nm) in [
            (TrainLimits { motoring_a: 20.0, ..none }, 150.0, free_nm),
            (TrainLimits { motoring_w: 40e3, ..none }, 200.0, free_nm),
            (TrainLimits { motoring_a: 20.0, motoring_w: 40e3, ..none }, 150.0, free_nm),
            (TrainLimits { motoring_a: 40.0, motoring_w: 40e3, ..none }, 200.0, free_nm),
            (TrainLimits { braking_a: 20.0, ..none }, free_nm, 150.0),
            (TrainLimits { braking_w: 40e3, ..none }, free_nm, 200.0),
            (TrainLimits { braking_a: 20.0, braking_w: 40e3, ..none }, free_nm, 150.0),
            (TrainLimits { braking_a: 40.0, braking_w: 40e3, ..none }, free_nm, 200.0),
            (TrainLimits { motoring_a: 0.0, braking_w: 0.0, ..none }, 0.0, 0.0),
        ] {
            assert_eq!(most(limits), Most { motoring_nm, braking_nm }, "{limits:?}");
        }
        // Braking uses the full line limit, whatever the line's voltage.
        let limits = TrainLimits { motoring_a: 20.0, braking_a: 20.0, ..none };
        let Most { motoring_nm, braking_nm } = free(1_000.0, 200.0).most(200.0, ratings, &limits);
        assert_eq!((motoring_nm, braking_nm), (0.0, 100.0));
    }

    /// The positive root of `ω T + k T² = P`, and the result if there is none.
    #[test]
    fn the_torque_of_a_power_is_the_positive_root() {
        // 100 T + 4 T² = 600 at 5; 100 T − 4 T² = 400 at 5; at rest 4 T² = 100.
        for (power_w, speed, loss, wanted_nm) in [
            (600.0, 100.0, 4.0, 5.0),
            (400.0, 100.0, -4.0, 5.0),
            (100.0, 0.0, 4.0, 5.0),
            (625.0, 100.0, -4.0, f32::INFINITY),
            (700.0, 100.0, -4.0, f32::INFINITY),
            (0.0, 100.0, 4.0, 0.0),
            (-100.0, 100.0, 4.0, 0.0),
            (f32::NAN, 100.0, 4.0, 0.0),
            // At rest and without loss any torque takes nothing; without power and loss there is none.
            (100.0, 0.0, 0.0, f32::INFINITY),
            (0.0, 0.0, 0.0, 0.0),
            (0.0, 0.0, 4.0, 0.0),
        ] {
            assert_eq!(torque_nm(power_w, speed, loss), wanted_nm, "{power_w} {speed} {loss}");
        }
    }

    /// The current does not fall for a machine whose lowest voltage is where it would begin to fall.
    #[test]
    fn without_a_span_the_current_does_not_fall() {
        let nominal_v = BUILT_IN.ratings.dc_link_nominal_v;
        for (lowest, udc_v) in [(FULL_SHARE, 1_000.0), (FULL_SHARE, 1_500.0), (0.95, 1_000.0)] {
            let ratings = Ratings { dc_link_min_v: lowest * nominal_v, ..BUILT_IN.ratings };
            assert_eq!(motoring_share(udc_v, &ratings), 1.0, "{lowest} {udc_v}");
        }
    }

    /// At once if nothing is known, then with its time constant.
    #[test]
    fn what_is_drawn_follows_link_loss_and_speed() {
        let settings = Settings::rated(&BUILT_IN.ratings, 1e-3, None);
        let ratings = settings.ratings;
        let report = |udc_v, torque_nm, mechanical: f32| {
            let (current_a, omega) = (50.0, mechanical * ratings.pole_pairs);
            Report { udc_v, torque_nm, current_a, omega, ..Report::default() }
        };
        let copper_w = copper_w(50.0, ratings.stator_resistance_ohm);
        let near = |got: f32, wanted: f32| assert!((got / wanted - 1.0).abs() < 1e-5, "{got}, not {wanted}");
        let mut drawn = Drawn::UNKNOWN;
        drawn.step(&report(1_500.0, 400.0, 50.0), &settings);
        near(drawn.udc_v, 1_500.0);
        near(drawn.loss, copper_w / 160e3);
        near(drawn.speed, 50.0);
        let share = 1.0 / 51.0;
        drawn.step(&report(1_400.0, -300.0, 60.0), &settings);
        near(drawn.udc_v, 1_500.0 - 100.0 * share);
        near(drawn.loss, copper_w / 160e3 + share * (copper_w / 90e3 - copper_w / 160e3));
        near(drawn.speed, 50.0 + 10.0 * share);
        // A small torque counts as a tenth of the largest.
        let mut idle = Drawn::UNKNOWN;
        idle.step(&report(1_500.0, 1.0, 0.0), &settings);
        let least_nm = 0.1 * ratings.max_torque_nm;
        near(idle.loss, copper_w / (least_nm * least_nm));
    }

    #[test]
    fn limits_come_back_from_their_words() {
        use crate::cell::Words;
        let words = [1.0_f32, 2.0, 3.0, 4.0, 5.0].map(f32::to_bits);
        let limits = TrainLimits::from_words(words);
        assert_eq!((limits.motoring_a, limits.braking_w, limits.acceleration_rad_s2), (1.0, 4.0, 5.0));
        assert_eq!(limits.to_words(), words);
    }
}
