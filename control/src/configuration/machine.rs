//! Ratings and tables of a machine.

use super::{ABOVE_ZERO, Bound, ROUNDING, Refused, checked, within};
use crate::machine::{Curve, Grid, Mtpa, Ratings, Tables, Weakening};
use core::f32::consts::FRAC_2_PI;

/// The largest ratio of a trip level to its limit: beyond it the trip level protects nothing.
const TRIP_CURRENT: f32 = 4.0;
const TRIP_OTHERS: f32 = 3.0;
/// Full torque in 1 ms at the quickest, in 100 s at the slowest.
const SLEW_PER_S: (f32, f32) = (0.01, 1e3);
/// Largest share of the nominal link that the largest current may drop across the stator's resistance.
const RESISTIVE_SHARE: f32 = 0.5;
/// Nodes of an axis.
const NODES: (f32, f32) = (2.0, 1e4);

impl Ratings {
    /// The check of the ratings, by themselves and together.
    ///
    /// # Errors
    /// The first scalar that does not pass.
    pub const fn check(&self) -> Result<(), Refused> {
        let Self {
            pole_pairs,
            stator_resistance_ohm,
            max_torque_nm,
            max_power_w,
            max_current_a,
            min_id_a,
            max_speed_rad_s,
            magnet_flux_wb,
            dc_link_min_v,
            dc_link_nominal_v,
            dc_link_max_v,
            max_switching_hz,
            trip_current_a,
            trip_dc_over_v,
            trip_dc_under_v,
            trip_speed_rad_s,
            torque_slew_nm_s,
            max_acceleration_rad_s2,
            iron: _,
            iron_share,
        } = *self;
        checked!(within(&[
            Bound("ratings.pole_pairs", pole_pairs, 1.0, 100.0),
            Bound("ratings.stator_resistance_ohm", stator_resistance_ohm, 0.0, 1e3),
            Bound("ratings.max_torque_nm", max_torque_nm, ABOVE_ZERO, 1e7),
            Bound("ratings.max_power_w", max_power_w, ABOVE_ZERO, 1e9),
            Bound("ratings.max_current_a", max_current_a, ABOVE_ZERO, 1e5),
            Bound("ratings.min_id_a", min_id_a, -max_current_a, 0.0),
            Bound("ratings.max_speed_rad_s", max_speed_rad_s, ABOVE_ZERO, 1.1e5),
            Bound("ratings.magnet_flux_wb", magnet_flux_wb, 0.0, 1e3),
            Bound("ratings.dc_link_min_v", dc_link_min_v, ABOVE_ZERO, 1e5),
            Bound("ratings.dc_link_nominal_v", dc_link_nominal_v, ABOVE_ZERO, 1e5),
            Bound("ratings.dc_link_max_v", dc_link_max_v, ABOVE_ZERO, 1e5),
            Bound("ratings.max_switching_hz", max_switching_hz, 50.0, 1e5),
            Bound("ratings.trip_current_a", trip_current_a, ABOVE_ZERO, 1e6),
            Bound("ratings.trip_dc_over_v", trip_dc_over_v, ABOVE_ZERO, 1e6),
            Bound("ratings.trip_dc_under_v", trip_dc_under_v, 0.0, 1e6),
            Bound("ratings.trip_speed_rad_s", trip_speed_rad_s, ABOVE_ZERO, 1.1e6),
            Bound("ratings.torque_slew_nm_s", torque_slew_nm_s, ABOVE_ZERO, 1e9),
            Bound("ratings.max_acceleration_rad_s2", max_acceleration_rad_s2, ABOVE_ZERO, 1e9),
            Bound("ratings.iron_share", iron_share, 0.0, 1.0),
        ]));
        self.check_together()
    }

    /// The check of the ratings together.
    const fn check_together(&self) -> Result<(), Refused> {
        let Self {
            pole_pairs,
            stator_resistance_ohm,
            max_torque_nm,
            max_power_w,
            max_current_a,
            max_speed_rad_s,
            dc_link_min_v,
            dc_link_nominal_v,
            dc_link_max_v,
            trip_current_a,
            trip_dc_over_v,
            trip_dc_under_v,
            trip_speed_rad_s,
            torque_slew_nm_s,
            ..
        } = *self;
        let whole = pole_pairs as u32 as f32;
        let ohm = RESISTIVE_SHARE * dc_link_nominal_v / max_current_a;
        let (slowest, quickest) = SLEW_PER_S;
        let full_power_w = (1.0 + 0.01) * max_torque_nm * max_speed_rad_s;
        within(&[
            Bound("ratings.pole_pairs", pole_pairs, whole, whole),
            Bound("ratings.max_power_w", max_power_w, ABOVE_ZERO, full_power_w),
            Bound("ratings.dc_link_min_v", dc_link_min_v, ABOVE_ZERO, dc_link_nominal_v),
            Bound("ratings.dc_link_nominal_v", dc_link_nominal_v, dc_link_min_v, dc_link_max_v),
            Bound("ratings.dc_link_max_v", dc_link_max_v, dc_link_nominal_v, below(trip_dc_over_v)),
            Bound("ratings.trip_dc_over_v", trip_dc_over_v, dc_link_max_v, TRIP_OTHERS * dc_link_max_v),
            Bound("ratings.trip_dc_under_v", trip_dc_under_v, 0.0, below(dc_link_min_v)),
            Bound("ratings.max_current_a", max_current_a, ABOVE_ZERO, below(trip_current_a)),
            Bound("ratings.trip_current_a", trip_current_a, max_current_a, TRIP_CURRENT * max_current_a),
            Bound("ratings.max_speed_rad_s", max_speed_rad_s, ABOVE_ZERO, below(trip_speed_rad_s)),
            Bound(
                "ratings.trip_speed_rad_s",
                trip_speed_rad_s,
                max_speed_rad_s,
                TRIP_OTHERS * max_speed_rad_s,
            ),
            Bound("ratings.stator_resistance_ohm", stator_resistance_ohm, 0.0, ohm),
            Bound(
                "ratings.torque_slew_nm_s",
                torque_slew_nm_s,
                slowest * max_torque_nm,
                quickest * max_torque_nm,
            ),
        ])
    }
}

/// The largest number below a given one above 0.
const fn below(value: f32) -> f32 {
    f32::from_bits(value.to_bits().saturating_sub(1))
}

/// The bounds of an axis: of its first value, of its last one.
struct Axis {
    names: [&'static str; 3],
    first: (f32, f32),
    last: (f32, f32),
}

impl Axis {
    const fn check(&self, first: f32, inverse_step: f32, count: usize) -> Result<(), Refused> {
        let [first_name, step_name, count_name] = self.names;
        let steps = count.saturating_sub(1) as f32;
        let (least, most) = self.last;
        within(&[
            Bound(count_name, count as f32, NODES.0, NODES.1),
            Bound(first_name, first, self.first.0, self.first.1),
            // The last node lies where it is allowed to.
            Bound(step_name, inverse_step, steps / (most - first), steps / (least - first)),
        ])
    }
}

/// As many nodes as stated, every one a number.
const fn nodes<const N: usize>(
    name: &'static str,
    nodes: &[[f32; N]],
    count: usize,
    least: f32,
) -> Result<(), Refused> {
    checked!(near(name, nodes.len() as f32, count as f32, 0.0));
    let mut rest = nodes.as_flattened();
    while let [value, others @ ..] = rest {
        checked!(within(&[Bound(name, *value, least, f32::MAX)]));
        rest = others;
    }
    Ok(())
}

const fn near(name: &'static str, value: f32, wanted: f32, off: f32) -> Result<(), Refused> {
    within(&[Bound(name, value, wanted - off, wanted + off)])
}

impl Tables {
    /// The check of ratings and tables, by themselves and together.
    ///
    /// # Errors
    /// The first scalar that does not pass.
    pub const fn check(&self) -> Result<(), Refused> {
        // The network belongs to one inverter alone, whose drive checks what it makes of it.
        let Self { name: _, ratings, flux, mtpa, weakening, z_source: _ } = self;
        checked!(ratings.check());
        checked!(check_flux(flux, ratings));
        checked!(check_weakening(weakening, ratings));
        let most_nm = match weakening.torque.nodes {
            [.., [_, most_nm, ..]] => *most_nm,
            [] => 0.0,
        };
        checked!(within(&[Bound(
            "ratings.max_torque_nm",
            ratings.max_torque_nm,
            ABOVE_ZERO,
            1.02 * most_nm
        )]));
        // The table's nodes lie a little off the map, so that it is right on average.
        let off = 0.05 * largest_wb(weakening);
        checked!(near("ratings.magnet_flux_wb", ratings.magnet_flux_wb, rest_wb(flux), off));
        checked!(check_iron(ratings, largest_wb(weakening)));
        check_mtpa(mtpa, flux, ratings)
    }
}

/// Iron that takes no more than the largest torque where that ends, with the largest flux linkage.
const fn check_iron(ratings: &Ratings, largest_wb: f32) -> Result<(), Refused> {
    let Ratings { max_torque_nm, max_power_w, pole_pairs, iron, .. } = *ratings;
    let omega = max_power_w / max_torque_nm * pole_pairs;
    let most = max_torque_nm / (largest_wb * largest_wb);
    within(&[
        Bound("ratings.iron.hysteresis", iron.hysteresis, 0.0, most),
        Bound("ratings.iron.eddy", iron.eddy, 0.0, most / omega),
    ])
}

/// Flux linkage of a checked map without current, at least 0.
const fn rest_wb(flux: &Grid<2>) -> f32 {
    let place = -flux.first_row * flux.inverse_row_step;
    let (row, last) = (place as usize, flux.rows.saturating_sub(2));
    let row = if row < last { row } else { last };
    let (low, high) = (row * flux.columns, (row + 1) * flux.columns);
    if high >= flux.nodes.len() {
        return f32::NAN;
    }
    let ([low, _], [high, _]) = (flux.nodes[low], flux.nodes[high]);
    let rest = low + (high - low) * (place - row as f32);
    if rest > 0.0 { rest } else { 0.0 }
}

const fn check_flux(flux: &Grid<2>, ratings: &Ratings) -> Result<(), Refused> {
    let Grid { first_row, inverse_row_step, rows, first_column, inverse_column_step, columns, nodes: fluxes } =
        *flux;
    let reach = ratings.max_current_a;
    let rows_of = Axis {
        names: ["flux.first_row", "flux.inverse_row_step", "flux.rows"],
        first: (-4.0 * reach, -(1.0 - ROUNDING) * reach),
        last: (-ROUNDING * reach, 4.0 * reach),
    };
    checked!(rows_of.check(first_row, inverse_row_step, rows));
    let columns_of = Axis {
        names: ["flux.first_column", "flux.inverse_column_step", "flux.columns"],
        first: (0.0, 0.0),
        last: ((1.0 - ROUNDING) * reach, 4.0 * reach),
    };
    checked!(columns_of.check(first_column, inverse_column_step, columns));
    nodes("flux.nodes", fluxes, rows.saturating_mul(columns), f32::MIN)
}

const fn check_mtpa(mtpa: &Mtpa, flux: &Grid<2>, ratings: &Ratings) -> Result<(), Refused> {
    let Mtpa { universal, parameters, start, curvature } = mtpa;
    let Curve { first, inverse_step, nodes: values } = *universal;
    let axis = Axis {
        names: ["mtpa.universal.first", "mtpa.universal.inverse_step", "mtpa.universal.nodes"],
        first: (0.0, 0.0),
        last: (1.0 - ROUNDING, 1.0 + ROUNDING),
    };
    checked!(axis.check(first, inverse_step, values.len()));
    checked!(nodes("mtpa.universal.nodes", values, values.len(), 0.0));
    let Grid { first_row, inverse_row_step, rows, first_column, inverse_column_step, columns, nodes: values } =
        *parameters;
    // The same axes as the flux's.
    checked!(near("mtpa.parameters.first_row", first_row, flux.first_row, 0.0));
    checked!(near("mtpa.parameters.inverse_row_step", inverse_row_step, flux.inverse_row_step, 0.0));
    checked!(near("mtpa.parameters.rows", rows as f32, flux.rows as f32, 0.0));
    checked!(near("mtpa.parameters.first_column", first_column, flux.first_column, 0.0));
    checked!(near("mtpa.parameters.inverse_column_step", inverse_column_step, flux.inverse_column_step, 0.0));
    checked!(near("mtpa.parameters.columns", columns as f32, flux.columns as f32, 0.0));
    // Both are divided by.
    checked!(nodes("mtpa.parameters.nodes", values, rows.saturating_mul(columns), f32::MIN_POSITIVE));
    let Curve { first, inverse_step, nodes: values } = *start;
    let axis = Axis {
        names: ["mtpa.start.first", "mtpa.start.inverse_step", "mtpa.start.nodes"],
        first: (0.0, 0.0),
        last: ((1.0 - ROUNDING) * ratings.max_torque_nm, 1.2 * ratings.max_torque_nm),
    };
    checked!(axis.check(first, inverse_step, values.len()));
    checked!(nodes("mtpa.start.nodes", values, values.len(), f32::MIN));
    let Curve { first, inverse_step, nodes: values } = *curvature;
    checked!(near("mtpa.curvature.first", first, start.first, 0.0));
    checked!(near("mtpa.curvature.inverse_step", inverse_step, start.inverse_step, 0.0));
    checked!(near("mtpa.curvature.nodes", values.len() as f32, start.nodes.len() as f32, 0.0));
    nodes("mtpa.curvature.nodes", values, values.len(), f32::MIN)
}

/// Flux linkage at a position of a weakening table's axis.
const fn flux_wb(place: f32, weakening: &Weakening) -> f32 {
    weakening.flux_knee_wb * place / (1.0 - place)
}

/// The widest circle's flux linkage.
const fn largest_wb(weakening: &Weakening) -> f32 {
    flux_wb(weakening.torque.last(), weakening)
}

const fn check_weakening(weakening: &Weakening, ratings: &Ratings) -> Result<(), Refused> {
    let Weakening { currents, torque, flux_knee_wb: knee_wb, share_knee } = weakening;
    let Curve { first, inverse_step, nodes: values } = *torque;
    // The flux that the lowest link leaves at the highest speed is on the table, and a good deal more.
    let least_wb = FRAC_2_PI * ratings.dc_link_min_v / (ratings.max_speed_rad_s * ratings.pole_pairs);
    checked!(within(&[Bound("weakening.flux_knee_wb", *knee_wb, 3e-4 * least_wb, 100.0 * least_wb)]));
    checked!(within(&[Bound("weakening.share_knee", *share_knee, 0.03, 30.0)]));
    let axis = Axis {
        names: ["weakening.torque.first", "weakening.torque.inverse_step", "weakening.torque.nodes"],
        first: (ABOVE_ZERO, least_wb / (least_wb + *knee_wb)),
        last: (1.05 * first, 1.0 - ROUNDING),
    };
    checked!(axis.check(first, inverse_step, values.len()));
    checked!(nodes("weakening.torque.nodes", values, values.len(), 0.0));
    let Grid { first_row, inverse_row_step, rows, first_column, inverse_column_step, columns, nodes: pairs } =
        *currents;
    checked!(near("weakening.currents.first_row", first_row, first, 0.0));
    checked!(near("weakening.currents.inverse_row_step", inverse_row_step, inverse_step, 0.0));
    checked!(near("weakening.currents.rows", rows as f32, values.len() as f32, 0.0));
    let axis = Axis {
        names: [
            "weakening.currents.first_column",
            "weakening.currents.inverse_column_step",
            "weakening.currents.columns",
        ],
        first: (0.0, 0.0),
        last: ((1.0 - ROUNDING) / (1.0 + *share_knee), (1.0 + ROUNDING) / (1.0 + *share_knee)),
    };
    checked!(axis.check(first_column, inverse_column_step, columns));
    nodes("weakening.currents.nodes", pairs, rows.saturating_mul(columns), f32::MIN)
}
