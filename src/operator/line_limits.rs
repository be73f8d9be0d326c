//! The torque that the limits of line current and line power allow.
//!
//! The line's power is the shaft's power plus the copper loss: `P = ω T + k T²`, with `k` from the currents that flow, the pulses' ripple included:
//! at a sixth of the largest torque the ripple loss of three pulses a turn is nearly as much again. The equation is solved for the torque, so that no
//! loop closes over the loss; at the limit, where it counts, `k T²` is the loss itself. Inverter, iron and auxiliaries are not included.

use super::{Settings, TrainLimits};
use crate::frames::{limit, sqrt};
use crate::machine::Ratings;
use crate::ports::Report;

/// Time constant of the link voltage and of the loss, in s: slower than the swing of a usual line filter, which is not a property of the line.
const SMOOTH_S: f32 = 0.05;
/// Share of the largest torque below which the loss is attributed to that torque, as weakening currents cause a loss without torque; and is taken to be
/// that of the largest torque at least, as small currents show little of it.
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
}

/// Largest torques, in N·m. Braking is limited twice: shaft power less copper loss is within what the line takes up to `braking_nm`, and again from
/// `copper_nm` on, where the loss takes all of it: that holds a train on a hill even if the line takes nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Most {
    pub motoring_nm: f32,
    pub braking_nm: f32,
    pub copper_nm: f32,
    /// The largest braking torque of all: what the line, or a link without one, can give for the copper.
    pub largest_nm: f32,
}

impl Most {
    /// The same with less motoring.
    pub(super) fn motoring_at_most(self, motoring_nm: f32) -> Self {
        if motoring_nm < self.motoring_nm { Self { motoring_nm, ..self } } else { self }
    }

    /// The same with less braking.
    pub(super) fn braking_at_most(self, largest_nm: f32) -> Self {
        if largest_nm < self.largest_nm { Self { largest_nm, ..self } } else { self }
    }

    /// The same without a line that braking could give power.
    pub(super) fn without_braking_power(self) -> Self {
        Self { braking_nm: f32::INFINITY, ..self }
    }

    /// A torque, in N·m, within these at a mechanical speed.
    pub(super) fn within(&self, torque_nm: f32, speed: f32) -> f32 {
        let along = if speed < 0.0 { -1.0 } else { 1.0 };
        let motoring_nm = along * torque_nm;
        let motoring_nm = if motoring_nm > self.motoring_nm { self.motoring_nm } else { motoring_nm };
        let braking_nm = if -motoring_nm > self.largest_nm { self.largest_nm } else { -motoring_nm };
        let gives = braking_nm > self.braking_nm && braking_nm < self.copper_nm;
        -along * if gives { self.braking_nm } else { braking_nm }
    }
}

impl Drawn {
    pub(super) const UNKNOWN: Self = Self { udc_v: 0.0, loss: 0.0 };

    /// One slot.
    #[inline(never)]
    pub(super) fn step(&mut self, report: &Report, settings: &Settings) {
        let Settings { ratings, slot_s, .. } = *settings;
        let Report { udc_v, torque_nm, squares_a2, .. } = *report;
        let least_nm = LEAST_SHARE * ratings.max_torque_nm;
        let loss = |torque_nm: f32| ratings.stator_resistance_ohm * squares_a2 / (torque_nm * torque_nm);
        let loss = if torque_nm.abs() > least_nm {
            loss(torque_nm)
        } else {
            larger(loss(least_nm), rated_loss(ratings))
        };
        let share = if self.udc_v > 0.0 { slot_s / (slot_s + SMOOTH_S) } else { 1.0 };
        self.udc_v += share * (udc_v - self.udc_v);
        self.loss += share * (loss - self.loss);
    }

    /// The torques that the limits allow at a mechanical speed, in rad/s.
    #[inline(never)]
    pub(super) fn most(&self, speed: f32, ratings: &Ratings, limits: &TrainLimits) -> Most {
        let TrainLimits { motoring_a, braking_a, motoring_w, braking_w, .. } = *limits;
        let none = TrainLimits::NONE;
        let speed = speed.abs();
        let udc_v = self.udc_v;
        let current_w = motoring_a * motoring_share(udc_v, ratings) * udc_v;
        let taken_w = lower((motoring_a, none.motoring_a, current_w), (motoring_w, none.motoring_w));
        let given_w = lower((braking_a, none.braking_a, braking_a * udc_v), (braking_w, none.braking_w));
        Most {
            motoring_nm: taken_w.map_or(f32::INFINITY, |power_w| torque_nm(power_w, speed, self.loss)),
            braking_nm: given_w.map_or(f32::INFINITY, |power_w| torque_nm(power_w, speed, -self.loss)),
            copper_nm: given_w.map_or(0.0, |power_w| taking_nm(-power_w, speed, self.loss)),
            largest_nm: taken_w.map_or(f32::INFINITY, |power_w| taking_nm(power_w, speed, self.loss)),
        }
    }

    /// The largest braking torque, in N·m, on a link of which such a share of the motoring window is left, 0 ..= 1. With none left it is the one whose
    /// power less its copper loss, `ω T − k T²`, is largest: slower than `k T`, a braking machine takes more than it gives, and empties a link
    /// without a line. `k` is at least that of the largest torque: small currents show little of it.
    #[inline(never)]
    pub(super) fn giving_nm(&self, link_share: f32, speed: f32, ratings: &Ratings) -> f32 {
        let largest_nm = ratings.max_torque_nm;
        let most_nm = speed.abs() / (2.0 * larger(self.loss, rated_loss(ratings)));
        if most_nm < largest_nm { most_nm + link_share * (largest_nm - most_nm) } else { largest_nm }
    }
}

/// Copper loss over the torque's square, in W/(N·m)², at the largest torque.
fn rated_loss(ratings: &Ratings) -> f32 {
    let current = ratings.max_current_a / ratings.max_torque_nm;
    1.5 * ratings.stator_resistance_ohm * current * current
}

/// The larger of two numbers; the second if the first is none.
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
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

/// The braking torque whose copper loss is so much more than its shaft's power that the line gives `power_w`: the larger root of `k T² − ω T = P`;
/// not a number if there is none.
fn taking_nm(power_w: f32, speed: f32, loss: f32) -> f32 {
    if loss > 0.0 {
        (speed + sqrt(speed * speed + 4.0 * loss * power_w)) / (2.0 * loss)
    } else {
        f32::INFINITY
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::built_in::traction::BUILT_IN;

    const LIMITS: TrainLimits = TrainLimits { motoring_a: 100.0, braking_w: 90e3, ..TrainLimits::NONE };

    fn drawn(udc_v: f32) -> Drawn {
        Drawn { udc_v, loss: 4e-3 }
    }

    #[test]
    fn without_limits_there_is_no_bound() {
        for (speed, udc_v) in [(0.0, 0.0), (100.0, 900.0), (-600.0, 1_500.0), (300.0, f32::NAN)] {
            let most = drawn(udc_v).most(speed, &BUILT_IN.ratings, &TrainLimits::NONE);
            for torque_nm in [-1e9, -10.0, 0.0, 10.0, 1e9] {
                assert_eq!(most.within(torque_nm, speed), torque_nm);
            }
        }
    }

    /// The torque and its copper loss make the power of the limit.
    #[test]
    fn shaft_and_loss_are_the_line_s_power() {
        for speed in [2.0, -20.0, 200.0, -600.0] {
            let most = drawn(1_500.0).most(speed, &BUILT_IN.ratings, &LIMITS);
            let power_w =
                |torque_nm: f32, sign: f32| torque_nm * speed.abs() + sign * 4e-3 * torque_nm * torque_nm;
            assert!((power_w(most.motoring_nm, 1.0) / 150e3 - 1.0).abs() < 1e-3, "{speed}: {most:?}");
            assert!((power_w(most.largest_nm, -1.0) / -150e3 - 1.0).abs() < 1e-3, "{speed}: {most:?}");
            // Slowly turning, the copper takes all that braking gives.
            if speed.abs() < 40.0 {
                assert_eq!(most.braking_nm, f32::INFINITY);
                continue;
            }
            assert!(most.braking_nm < most.copper_nm && most.copper_nm < most.largest_nm);
            for root_nm in [most.braking_nm, most.copper_nm] {
                assert!((power_w(root_nm, -1.0) / 90e3 - 1.0).abs() < 1e-2, "{speed}: {most:?}");
            }
        }
    }

    /// With none of the window left, the torque at which `ω T − k T²` is largest; with all of it, the machine's.
    #[test]
    fn braking_on_a_link_without_a_line_gives_it_power() {
        let ratings = &BUILT_IN.ratings;
        let most_nm = ratings.max_torque_nm;
        let fast = 16e-3 * most_nm;
        for (speed, link_share, wanted_nm) in [
            (0.0, 0.0, 0.0),
            (4.0, 0.0, 250.0),
            (-4.0, 0.0, 250.0),
            (-4.0, 0.5, 0.5 * (250.0 + most_nm)),
            (2.0, 1.0, most_nm),
            (fast.next_up(), 0.0, most_nm),
            (400.0, 0.5, most_nm),
        ] {
            let drawn = Drawn { loss: 8e-3, ..drawn(900.0) };
            let found_nm = drawn.giving_nm(link_share, speed, ratings);
            assert!((found_nm - wanted_nm).abs() < 1e-3 * most_nm, "{speed} {link_share}: {found_nm}");
        }
        let still = Drawn { loss: 0.0, ..drawn(1_500.0) }.most(0.0, ratings, &LIMITS);
        assert_eq!(still.within(-1e9, 0.0), -1e9, "no loss is known that the line could feed");
        let rated = 1.5 * ratings.stator_resistance_ohm * (ratings.max_current_a / most_nm).powi(2);
        for loss in [0.0, f32::NAN] {
            let found_nm = Drawn { loss, ..drawn(900.0) }.giving_nm(0.0, 1.0, ratings);
            assert!((found_nm * 2.0 * rated - 1.0).abs() < 1e-4, "{found_nm}");
        }
    }

    #[test]
    fn a_line_that_sags_gives_less_current_and_at_the_lowest_voltage_none() {
        let ratings = &BUILT_IN.ratings;
        let current_a = |udc_v: f32| {
            let most = drawn(udc_v).most(300.0, ratings, &LIMITS).motoring_nm;
            (most * 300.0 + 4e-3 * most * most) / udc_v
        };
        let (full_v, none_v) = (FULL_SHARE * ratings.dc_link_nominal_v, ratings.dc_link_min_v);
        for (udc_v, share) in [(1_800.0, 1.0), (full_v, 1.0), (0.5 * (full_v + none_v), 0.5)] {
            assert!((current_a(udc_v) / (100.0 * share) - 1.0).abs() < 1e-3, "{udc_v}: {}", current_a(udc_v));
        }
        assert_eq!(current_a(none_v), 0.0);
        assert_eq!(drawn(f32::NAN).most(300.0, ratings, &LIMITS).motoring_nm, 0.0);
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
            squares_a2: 1.5 * current_a * current_a,
            ..Report::default()
        };
        let loss = |current_a: f32, torque_nm: f32| {
            1.5 * ratings.stator_resistance_ohm * (current_a / torque_nm).powi(2)
        };
        let least_nm = 0.1 * ratings.max_torque_nm;
        for (torque_nm, counted_nm) in [
            (200.0, 200.0),
            (-200.0, 200.0),
            (least_nm.next_up(), least_nm),
            (least_nm, least_nm),
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
            let now = if torque_nm.abs() > least_nm { 0.0 } else { rated_loss(ratings) };
            let smoothed = (50.0 * before.loss + now) / 51.0;
            assert!((drawn.loss / smoothed - 1.0).abs() < 1e-5, "{drawn:?}");
        }
    }

    /// Each limit by itself and both together: the lower one counts.
    #[test]
    fn the_lower_of_current_and_power_counts() {
        let ratings = &BUILT_IN.ratings;
        let none = TrainLimits::NONE;
        let free = |udc_v: f32, speed: f32, limits: &TrainLimits| {
            let Most { motoring_nm, braking_nm, .. } =
                Drawn { udc_v, loss: 0.0 }.most(speed, ratings, limits);
            (motoring_nm, braking_nm)
        };
        let most = |limits: TrainLimits| free(1_500.0, -200.0, &limits);
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
            assert_eq!(most(limits), (motoring_nm, braking_nm), "{limits:?}");
        }
        // Braking uses the full line limit, whatever the line's voltage.
        let limits = TrainLimits { motoring_a: 20.0, braking_a: 20.0, ..none };
        assert_eq!(free(1_000.0, 200.0, &limits), (0.0, 100.0));
    }

    /// Between the two torques that give the line just as much as it takes, the smaller one; beyond the larger one, what is asked.
    #[test]
    fn a_train_on_a_hill_is_held_by_what_its_copper_takes() {
        let most = Most { motoring_nm: 500.0, braking_nm: 100.0, copper_nm: 300.0, largest_nm: 900.0 };
        for (asked_nm, given_nm) in [
            (600.0, 500.0),
            (500.0, 500.0),
            (-100.0, -100.0),
            (-101.0, -100.0),
            (-299.0, -100.0),
            (-300.0, -300.0),
            (-700.0, -700.0),
            (-901.0, -900.0),
        ] {
            assert_eq!(most.within(asked_nm, 1.0), given_nm);
            assert_eq!(most.within(-asked_nm, -1.0), -given_nm);
        }
        assert_eq!(
            (most.within(600.0, 0.0), most.within(-600.0, 0.0)),
            (500.0, -600.0),
            "at rest forward counts"
        );
        // A line that takes nothing: a rotor that rolls back slowly is held, a quick one not.
        let most = |speed: f32| {
            let limits = TrainLimits { braking_w: 0.0, ..TrainLimits::NONE };
            drawn(1_500.0).most(speed, &BUILT_IN.ratings, &limits)
        };
        for (speed, asked_nm, given_nm) in
            [(-2.0, 600.0, 600.0), (-2.0, 400.0, 0.0), (-3.0, 600.0, 0.0), (0.0, 1.0, 1.0)]
        {
            assert_eq!(most(speed).within(asked_nm, speed), given_nm, "{speed} {asked_nm}");
        }
    }

    /// The bounds of a hold: braking that the line's power limit, but not the link, allows; and less motoring.
    #[test]
    fn bounds_are_lowered_one_by_one() {
        let most = Most { motoring_nm: 500.0, braking_nm: 100.0, copper_nm: 300.0, largest_nm: 900.0 };
        let ends = |most: Most| (most.within(1e9, 1.0), most.within(-200.0, 1.0), most.within(-1e9, 1.0));
        assert_eq!(ends(most), (500.0, -100.0, -900.0));
        assert_eq!(ends(most.motoring_at_most(-50.0)), (-50.0, -100.0, -900.0));
        assert_eq!(ends(most.motoring_at_most(600.0)), ends(most));
        assert_eq!(ends(most.braking_at_most(50.0)), (500.0, -50.0, -50.0));
        assert_eq!(ends(most.braking_at_most(1_000.0)), ends(most));
        assert_eq!(ends(most.without_braking_power()), (500.0, -200.0, -900.0));
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
            let (squares_a2, omega) = (3_750.0, mechanical * ratings.pole_pairs);
            Report { udc_v, torque_nm, squares_a2, omega, ..Report::default() }
        };
        let copper_w = 3_750.0 * ratings.stator_resistance_ohm;
        let near = |got: f32, wanted: f32| assert!((got / wanted - 1.0).abs() < 1e-5, "{got}, not {wanted}");
        let mut drawn = Drawn::UNKNOWN;
        drawn.step(&report(1_500.0, 400.0, 50.0), &settings);
        near(drawn.udc_v, 1_500.0);
        near(drawn.loss, copper_w / 160e3);
        let share = 1.0 / 51.0;
        drawn.step(&report(1_400.0, -300.0, 60.0), &settings);
        near(drawn.udc_v, 1_500.0 - 100.0 * share);
        near(drawn.loss, copper_w / 160e3 + share * (copper_w / 90e3 - copper_w / 160e3));
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
