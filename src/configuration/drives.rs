//! Settings of the two systems.

use crate::control::{SpeedDesign, SpeedTracker, ZSourceDesign, ZSourceGains};
use crate::drive::{dual, traction};
use crate::machine::{Ratings, Tables};
use crate::protection::{INNOVATION_RAD, LinkLimits};
use crate::time::Clock;
use tractive_control::checked;
use tractive_control::configuration::{ABOVE_ZERO, Bound, ROUNDING, Refused, within};

/// Ratio of the capacitors' highest voltage to the source's: at a shoot-through duty of a quarter.
const HIGHEST_SHARE: f32 = 1.5;
/// Most carrier periods in a control period.
const MOST_CARRIERS: f32 = 8.0;
/// The longest carrier period, in ticks: sixteen bits must hold half of it in compare steps.
const LONGEST_CARRIER: f32 = 4_000.0;

/// Largest lag of the tracked angle behind a rotor that accelerates by itself, in rad: the rest of the check's bound is for the sensor.
const LARGEST_LAG_RAD: f32 = 0.8 * INNOVATION_RAD;
/// The oldest angle that can be extrapolated to the present, in s.
pub const LATEST_ANGLE_S: f32 = 0.5e-3;
/// Largest step of a counted angle, in rad: twice the error that counts as a lost angle.
const COARSEST_STEP_RAD: f32 = 0.1;
/// Highest threshold of devices, in V.
const HIGHEST_THRESHOLD_V: f32 = 20.0;
/// Largest slope, in ohm.
const LARGEST_SLOPE_OHM: f32 = 0.15;

impl traction::Settings {
    /// The check that a drive may start with these settings and this machine.
    ///
    /// # Errors
    /// The first scalar that makes no sense, of the machine or of the settings.
    pub const fn check(&self, tables: &Tables) -> Result<(), Refused> {
        checked!(tables.check());
        checked!(self.check_settings());
        check_acceleration(&tables.ratings, &self.clock)
    }

    /// The same for a machine that has been checked already.
    ///
    /// # Errors
    /// The first scalar that makes no sense.
    pub const fn check_settings(&self) -> Result<(), Refused> {
        let Self {
            clock,
            devices,
            gains,
            angle_late_s,
            angle_step_rad,
            current_filter_ticks,
            drops,
            iron_share,
        } = self;
        checked!(clock.check());
        checked!(devices.check(clock));
        checked!(within(&[
            Bound("angle_late_s", *angle_late_s, -LATEST_ANGLE_S, LATEST_ANGLE_S),
            Bound("angle_step_rad", *angle_step_rad, 0.0, COARSEST_STEP_RAD),
            Bound(
                "current_filter_ticks",
                *current_filter_ticks as f32,
                0.0,
                devices.shortest_half_ticks as f32,
            ),
            Bound("drops.threshold_v", drops.threshold_v, 0.0, HIGHEST_THRESHOLD_V),
            Bound("drops.slope_ohm", drops.slope_ohm, 0.0, LARGEST_SLOPE_OHM),
            Bound("iron_share", *iron_share, 0.0, 1.0),
        ]));
        gains.check()
    }
}

impl dual::Settings {
    /// The check that a drive may start with these settings and this machine.
    ///
    /// # Errors
    /// The first scalar that makes no sense, of the machine or of the settings.
    pub const fn check(&self, tables: &Tables) -> Result<(), Refused> {
        let Self { clock, carrier_ticks: _, dead_time_ticks: _, gains, speed, link, link_gains, limits } =
            self;
        checked!(tables.check());
        checked!(clock.check());
        checked!(self.check_carrier());
        checked!(gains.check());
        checked!(check_speed(speed, clock.control_s(), &tables.ratings));
        checked!(check_acceleration(&tables.ratings, clock));
        // The voltage that shoot-through makes from the source, and room to regulate; ratings are rounded.
        let most_v = 1.01 * HIGHEST_SHARE * tables.z_source.source_v * dual::TWO_LEVEL_SHARE;
        checked!(within(
            &[Bound("ratings.dc_link_max_v", tables.ratings.dc_link_max_v, ABOVE_ZERO, most_v),]
        ));
        checked!(check_link(link, clock.control_s()));
        checked!(check_link_gains(link_gains, link));
        check_limits(limits)
    }

    /// The check that carrier and dead time suit a clock which has been checked already.
    ///
    /// # Errors
    /// The first of them that does not.
    pub const fn check_carrier(&self) -> Result<(), Refused> {
        let Self { clock, carrier_ticks, dead_time_ticks, .. } = self;
        let control = clock.control_ticks as f32;
        let carrier = *carrier_ticks as f32;
        let longest = if control < LONGEST_CARRIER { control } else { LONGEST_CARRIER };
        checked!(within(&[Bound("carrier_ticks", carrier, control / MOST_CARRIERS, longest)]));
        // An even number, and an integer fraction of the control period.
        let whole = clock.control_ticks.is_multiple_of(*carrier_ticks) && carrier_ticks.is_multiple_of(2);
        if !whole {
            return Err(Refused { name: "carrier_ticks", value: carrier, least: control, most: control });
        }
        within(&[Bound("dead_time_ticks", *dead_time_ticks as f32, 0.0, 0.125 * carrier)])
    }
}

/// The check that the tracked angle can follow the acceleration.
const fn check_acceleration(ratings: &Ratings, clock: &Clock) -> Result<(), Refused> {
    let most = SpeedTracker::most_acceleration_rad_s2(LARGEST_LAG_RAD, clock.control_s());
    within(&[Bound("ratings.max_acceleration_rad_s2", ratings.max_acceleration_rad_s2, ABOVE_ZERO, most)])
}

const fn check_speed(speed: &SpeedDesign, control_s: f32, ratings: &Ratings) -> Result<(), Refused> {
    let SpeedDesign { inertia_kg_m2, natural_rad_s, period_s } = *speed;
    // The loop runs when its motor has a new operating point.
    let turns_s = dual::TURNS as f32 * control_s;
    let most_nm = (1.0 + ROUNDING) * SpeedDesign::STIFFEST * ratings.max_torque_nm;
    within(&[
        Bound("speed.period_s", period_s, (1.0 - ROUNDING) * turns_s, (1.0 + ROUNDING) * turns_s),
        Bound("speed.natural_rad_s", natural_rad_s, ABOVE_ZERO, 0.5 / turns_s),
        Bound("speed.inertia_kg_m2", inertia_kg_m2, ABOVE_ZERO, 0.5 * most_nm / natural_rad_s),
    ])
}

const fn check_link(link: &ZSourceDesign, control_s: f32) -> Result<(), Refused> {
    let ZSourceDesign {
        inductance_h,
        resistance_ohm,
        capacitance_f,
        period_s,
        inner_hz,
        outer_hz,
        link_slew_v_s,
        duty_max,
        inductor_max_a,
        damping_s,
    } = *link;
    within(&[
        Bound("link.inductance_h", inductance_h, ABOVE_ZERO, 0.1),
        Bound("link.resistance_ohm", resistance_ohm, 0.0, 1.0),
        Bound("link.capacitance_f", capacitance_f, ABOVE_ZERO, 0.1),
        Bound("link.period_s", period_s, (1.0 - ROUNDING) * control_s, (1.0 + ROUNDING) * control_s),
        Bound("link.inner_hz", inner_hz, ABOVE_ZERO, 0.2 / control_s),
        Bound("link.outer_hz", outer_hz, ABOVE_ZERO, 0.5 * inner_hz),
        Bound("link.link_slew_v_s", link_slew_v_s, ABOVE_ZERO, 1e5),
        Bound("link.duty_max", duty_max, ABOVE_ZERO, 0.5 - ROUNDING),
        Bound("link.inductor_max_a", inductor_max_a, ABOVE_ZERO, 1e4),
        Bound("link.damping_s", damping_s, 0.0, 1e3),
    ])
}

/// The check that the gains are those of the design.
const fn check_link_gains(gains: &ZSourceGains, link: &ZSourceDesign) -> Result<(), Refused> {
    const LEAST: f32 = 0.99;
    const MOST: f32 = 1.01;
    let ZSourceGains { inner_ohm, outer_s, integral_share } = *gains;
    let wanted = link.gains();
    within(&[
        Bound("link_gains.inner_ohm", inner_ohm, LEAST * wanted.inner_ohm, MOST * wanted.inner_ohm),
        Bound("link_gains.outer_s", outer_s, LEAST * wanted.outer_s, MOST * wanted.outer_s),
        Bound(
            "link_gains.integral_share",
            integral_share,
            LEAST * wanted.integral_share,
            MOST * wanted.integral_share,
        ),
    ])
}

const fn check_limits(limits: &LinkLimits) -> Result<(), Refused> {
    let LinkLimits { source_min_v, capacitor_max_v, duty_max } = *limits;
    within(&[
        Bound("limits.capacitor_max_v", capacitor_max_v, 1.0, 1e4),
        Bound("limits.source_min_v", source_min_v, ABOVE_ZERO, capacitor_max_v),
        Bound("limits.duty_max", duty_max, ABOVE_ZERO, 0.5 - ROUNDING),
    ])
}
