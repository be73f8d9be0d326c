//! The settings of the operator's step.

use super::TrainLimits;
use crate::machine::Ratings;
use crate::thermal::Thermal;

/// Time constants of the line side.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LineTimes {
    /// Of precharge resistor and link capacitor, in s.
    pub precharge_s: f32,
    /// Of discharge resistor and link capacitor, in s.
    pub discharge_s: f32,
}

/// The line side: what stands between the source and the link.
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
    /// Link voltage at which the chopper begins, in V; none has no chopper.
    pub chopper_from_v: f32,
    /// Link voltage at which it is always on, in V, above `chopper_from_v`.
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

    /// The same for a source that takes back what is braked.
    pub const fn without_chopper(self) -> Self {
        Self { chopper_from_v: f32::INFINITY, chopper_full_v: f32::INFINITY, ..self }
    }
}

/// Limit of extra-low voltage, in V.
const EXTRA_LOW_V: f32 = 60.0;
/// Share of the lowest operating voltage that a link of extra-low voltage may be left with.
const EMPTY_SHARE: f32 = 0.2;

/// Link voltage below which it counts as empty, in V: extra-low voltage, and little beside what the machine runs on.
const fn empty_v(ratings: &Ratings) -> f32 {
    let little_v = EMPTY_SHARE * ratings.dc_link_min_v;
    if little_v < EXTRA_LOW_V { little_v } else { EXTRA_LOW_V }
}

/// Places between the highest operating voltage (0) and the overvoltage trip (1).
const CHOPPER_FROM: f32 = 0.05;
const CHOPPER_FULL: f32 = 0.25;
const BRAKING_NONE: f32 = 0.6;
const BRAKING_SPAN: f32 = 0.3;
/// Places between the lowest operating voltage (0) and the undervoltage trip (1).
const MOTORING_NONE: f32 = 0.5;

const fn above_highest_v(ratings: &Ratings, place: f32) -> f32 {
    ratings.dc_link_max_v + place * (ratings.trip_dc_over_v - ratings.dc_link_max_v)
}

/// Link voltages that end motoring and braking as rated, and over how many volts each fades, in V.
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

/// Everything that does not change while it runs.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Settings<'a> {
    /// The machine.
    pub ratings: &'a Ratings,
    /// Length of a slot, in s, above 0.
    pub slot_s: f32,
    /// Slew rate of the torque demand, in N·m/s, above 0; below the drive's own, so that it follows.
    pub slew_nm_s: f32,
    /// Rate at which the slew rate changes, in N·m/s², above 0.
    pub jerk_nm_s2: f32,
    /// Contactors and resistors; `None`: the link is alive by itself.
    pub line: Option<Line>,
    /// Temperature sensors, and what is known of how machine and power stage warm; `None`, and of the ZS9: nothing is, and nothing derates.
    pub thermal: Option<&'a Thermal>,
    /// Limits of line and acceleration.
    pub train: TrainLimits,
}

/// The demand's slew rate as a share of the drive's.
const SLEW_SHARE: f32 = 0.8;
/// Time in which the demand takes up its slew rate, in s.
const JERK_S: f32 = 0.05;

impl<'a> Settings<'a> {
    /// The usual ones for a machine.
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
