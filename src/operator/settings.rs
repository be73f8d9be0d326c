//! The settings of the operator's step.

use super::TrainLimits;
use crate::machine::Ratings;
use crate::thermal::Thermal;

/// Time constants on the line side.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LineTimes {
    /// Of precharge resistor and link capacitor, in s.
    pub precharge_s: f32,
    /// Of discharge resistor and link capacitor, in s.
    pub discharge_s: f32,
}

/// The line side: the equipment between the source and the link.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Line {
    /// Time constant of precharge resistor and link capacitor, in s.
    pub precharge_s: f32,
    /// Time constant of discharge resistor and link capacitor, in s.
    pub discharge_s: f32,
    /// Longest time in which a contactor answers, in s.
    pub contactor_s: f32,
    /// Link voltage below which it counts as empty, in V.
    pub empty_v: f32,
    /// Link voltage at which the chopper begins, in V; infinite without a chopper.
    pub chopper_from_v: f32,
    /// Link voltage at which the chopper is always on, in V, above `chopper_from_v`.
    pub chopper_full_v: f32,
}

impl Line {
    /// The usual levels for a machine: the chopper works between its highest operating voltage and where braking is limited.
    pub const fn rated(ratings: &Ratings, precharge_s: f32, discharge_s: f32) -> Self {
        Self {
            precharge_s,
            discharge_s,
            contactor_s: 0.2,
            empty_v: empty_v(ratings),
            chopper_from_v: above_highest_v(ratings, CHOPPER_FROM),
            chopper_full_v: above_highest_v(ratings, CHOPPER_FULL),
        }
    }

    /// The same for a source that takes back the braking energy.
    pub const fn without_chopper(self) -> Self {
        Self { chopper_from_v: f32::INFINITY, chopper_full_v: f32::INFINITY, ..self }
    }
}

/// Limit of extra-low voltage, in V.
const EXTRA_LOW_V: f32 = 60.0;
/// Largest link voltage that counts as empty, as a share of the lowest operating voltage.
const EMPTY_SHARE: f32 = 0.2;

/// Link voltage below which it counts as empty, in V: extra-low voltage, and low compared with the machine's operating voltage.
const fn empty_v(ratings: &Ratings) -> f32 {
    let little_v = EMPTY_SHARE * ratings.dc_link_min_v;
    if little_v < EXTRA_LOW_V { little_v } else { EXTRA_LOW_V }
}

/// Positions between the highest operating voltage (0) and the overvoltage trip (1).
const CHOPPER_FROM: f32 = 0.05;
const CHOPPER_FULL: f32 = 0.25;
const BRAKING_NONE: f32 = 0.6;
const BRAKING_SPAN: f32 = 0.3;
/// Positions between the lowest operating voltage (0) and the undervoltage trip (1).
const MOTORING_NONE: f32 = 0.5;

const fn above_highest_v(ratings: &Ratings, place: f32) -> f32 {
    ratings.dc_link_max_v + place * (ratings.trip_dc_over_v - ratings.dc_link_max_v)
}

/// Link voltages that end motoring and braking as rated, and the spans over which each fades, in V.
pub(super) struct Ends {
    pub motoring_none_v: f32,
    pub motoring_span_v: f32,
    pub braking_none_v: f32,
    pub braking_span_v: f32,
}

impl Ends {
    pub(super) const fn rated(ratings: &Ratings) -> Self {
        let below = ratings.dc_link_min_v - ratings.trip_dc_under_v;
        let above = ratings.trip_dc_over_v - ratings.dc_link_max_v;
        Self {
            motoring_none_v: ratings.dc_link_min_v - MOTORING_NONE * below,
            motoring_span_v: MOTORING_NONE * below,
            braking_none_v: above_highest_v(ratings, BRAKING_NONE),
            braking_span_v: BRAKING_SPAN * above,
        }
    }
}

/// The settings that do not change during operation.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Settings<'a> {
    /// The machine.
    pub ratings: &'a Ratings,
    /// Length of a slot, in s, above 0.
    pub slot_s: f32,
    /// Slew rate of the torque demand, in N·m/s, above 0; below the drive's own, so that the drive can follow.
    pub slew_nm_s: f32,
    /// Rate at which the slew rate changes, in N·m/s², above 0.
    pub jerk_nm_s2: f32,
    /// Contactors and resistors; `None`: the link is alive by itself.
    pub line: Option<Line>,
    /// Temperature sensors, and the known thermal behaviour of machine and power stage; `None`, and always for the ZS9: nothing is known, and nothing
    /// derates.
    pub thermal: Option<&'a Thermal>,
    /// Limits of line and acceleration.
    pub train: TrainLimits,
}

/// The demand's slew rate as a share of the drive's.
const SLEW_SHARE: f32 = 0.8;
/// Time in which the demand reaches its slew rate, in s.
const JERK_S: f32 = 0.05;

impl<'a> Settings<'a> {
    /// The usual settings for a machine.
    pub const fn rated(ratings: &'a Ratings, slot_s: f32, line: Option<Line>) -> Self {
        let slew_nm_s = SLEW_SHARE * ratings.torque_slew_nm_s;
        Self {
            ratings,
            slot_s,
            slew_nm_s,
            jerk_nm_s2: slew_nm_s / JERK_S,
            line,
            thermal: None,
            train: TrainLimits::NONE,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::built_in::traction::BUILT_IN;

    /// Trips at 200 V below the lowest operating voltage, and 400 V above the highest one.
    const RATINGS: Ratings = Ratings {
        dc_link_min_v: 1_000.0,
        dc_link_max_v: 1_800.0,
        trip_dc_under_v: 800.0,
        trip_dc_over_v: 2_200.0,
        torque_slew_nm_s: 5_000.0,
        ..BUILT_IN.ratings
    };

    fn near(got: f32, wanted: f32) {
        assert!((got / wanted - 1.0).abs() < 1e-6, "{got}, not {wanted}");
    }

    #[test]
    fn levels_lie_at_their_places_between_operation_and_trip() {
        let ends = Ends::rated(&RATINGS);
        near(ends.motoring_none_v, 900.0);
        near(ends.motoring_span_v, 100.0);
        near(ends.braking_none_v, 2_040.0);
        near(ends.braking_span_v, 120.0);
        let line = Line::rated(&RATINGS, 0.3, 40.0);
        assert_eq!((line.precharge_s, line.discharge_s, line.contactor_s), (0.3, 40.0, 0.2));
        near(line.chopper_from_v, 1_820.0);
        near(line.chopper_full_v, 1_900.0);
        let without = line.without_chopper();
        assert_eq!((without.chopper_from_v, without.chopper_full_v), (f32::INFINITY, f32::INFINITY));
        assert_eq!((without.precharge_s, without.empty_v), (0.3, line.empty_v));
    }

    /// Extra-low voltage, but no more than a fifth of the lowest voltage in operation.
    #[test]
    fn a_link_counts_as_empty_below_extra_low_voltage() {
        for (dc_link_min_v, empty_v) in [(1_000.0, 60.0), (300.0, 60.0), (250.0, 50.0), (40.0, 8.0)] {
            near(Line::rated(&Ratings { dc_link_min_v, ..RATINGS }, 0.3, 40.0).empty_v, empty_v);
        }
    }

    #[test]
    fn the_operator_slews_slower_than_the_drive() {
        let settings = Settings::rated(&RATINGS, 1e-3, None);
        near(settings.slew_nm_s, 4_000.0);
        near(settings.jerk_nm_s2, 80_000.0);
        assert_eq!(
            (settings.slot_s, settings.line.is_none(), settings.thermal.is_none()),
            (1e-3, true, true)
        );
        assert_eq!(settings.train, TrainLimits::NONE);
    }
}
