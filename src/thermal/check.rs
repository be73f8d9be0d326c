//! The check of the thermal settings, at start-up or by the compiler.

use super::{Derating, DeviceLosses, Element, Magnets, Rise, Sensor, Thermal};
use tractive_control::checked;
use tractive_control::configuration::{ABOVE_ZERO, Bound, Refused, within};

/// Least distance between two temperatures of derating, in K.
const APART_K: f32 = 1.0;
/// The highest temperature that a setting may give, in °C.
const HOTTEST_C: f32 = 500.0;
const COLDEST_C: f32 = -100.0;

impl Thermal {
    /// The check that these settings make sense; a board makes it before its drive starts.
    ///
    /// # Errors
    /// The first scalar that does not make sense.
    pub const fn check(&self) -> Result<(), Refused> {
        let Self {
            winding_sensor,
            heat_sink_sensor,
            resistance_ohm,
            winding,
            junction,
            losses,
            winding_derating,
            winding_trip_c,
            junction_derating,
            junction_trip_c,
            magnets,
        } = self;
        checked!(winding_sensor.check());
        checked!(heat_sink_sensor.check());
        checked!(winding.check());
        checked!(junction.check());
        let DeviceLosses { threshold_v, slope_ohm, switching_share } = *losses;
        checked!(winding_derating.check());
        checked!(junction_derating.check());
        checked!(within(&[
            Bound("thermal.resistance_ohm", *resistance_ohm, 0.0, 1e3),
            Bound("thermal.losses.threshold_v", threshold_v, 0.0, 100.0),
            Bound("thermal.losses.slope_ohm", slope_ohm, 0.0, 1e3),
            Bound("thermal.losses.switching_share", switching_share, 0.0, 1.0),
            Bound("thermal.winding_trip_c", *winding_trip_c, winding_derating.none_c + APART_K, HOTTEST_C),
            Bound("thermal.junction_trip_c", *junction_trip_c, junction_derating.none_c + APART_K, HOTTEST_C),
        ]));
        match magnets {
            None => Ok(()),
            Some(Magnets { per_k, map_c, derating }) => {
                checked!(derating.check());
                within(&[
                    Bound("thermal.magnets.per_k", *per_k, -0.01, -1e-4),
                    Bound("thermal.magnets.map_c", *map_c, COLDEST_C, HOTTEST_C),
                ])
            }
        }
    }
}

impl Sensor {
    const fn check(&self) -> Result<(), Refused> {
        let Self { element, series_ohm, range_c: [lowest_c, highest_c] } = *self;
        if let Element::Ntc { at_25_ohm, beta_k } = element {
            checked!(within(&[
                Bound("thermal.sensor.at_25_ohm", at_25_ohm, 1.0, 1e7),
                Bound("thermal.sensor.beta_k", beta_k, 1e3, 1e4),
            ]));
        }
        within(&[
            Bound("thermal.sensor.series_ohm", series_ohm, 1.0, 1e7),
            Bound("thermal.sensor.lowest_c", lowest_c, COLDEST_C, highest_c - APART_K),
            Bound("thermal.sensor.highest_c", highest_c, lowest_c + APART_K, HOTTEST_C),
        ])
    }
}

impl Rise {
    const fn check(&self) -> Result<(), Refused> {
        let Self { k_per_w, time_s } = *self;
        // If slower, a slot's change is lost in single precision; if quicker, a slot is a step of its own.
        within(&[
            Bound("thermal.rise.k_per_w", k_per_w, 0.0, 1e3),
            Bound("thermal.rise.time_s", time_s, 0.02, 600.0),
        ])
    }
}

impl Derating {
    const fn check(&self) -> Result<(), Refused> {
        let Self { from_c, none_c } = *self;
        within(&[
            Bound("thermal.derating.from_c", from_c, ABOVE_ZERO, none_c - APART_K),
            Bound("thermal.derating.none_c", none_c, from_c + APART_K, HOTTEST_C),
        ])
    }
}
