//! `machine.toml` of an identified machine: the nameplate's keys, and the results.

use super::Outcome;
use crate::folder::{digits, toml};
use core::f64::consts::TAU;
use tractive_tablegen::{FluxMap, Optimum, Parameters, Patterns, SmoothMap};

/// The text. The largest torque is the nameplate's, or the map's within the largest current, whichever is less; likewise the largest power.
pub fn of(outcome: &Outcome, map: &FluxMap, given: &Parameters) -> String {
    let smooth = SmoothMap::new(map);
    let reach_nm = Optimum::of(&smooth, given.pole_pairs, given.max_current_a).most_torque_nm();
    // Below the generator's own rounding.
    let within = digits((1.0 - 1e-6) * reach_nm);
    let max_torque_nm = given.max_torque_nm.min(within);
    let max_power_w =
        given.max_power_w.min(digits((1.0 - 1e-6) * max_torque_nm * given.max_speed_rpm * TAU / 60.0));
    let (resistance, inertia) =
        (digits(outcome.fit.resistance_ohm.max(0.0)), digits(outcome.rotor.inertia_kg_m2));
    let of_zs9 = |key, value| if given.names(key) { value } else { f64::NAN };
    let keys: [(&str, f64, &str); 27] = [
        ("pole_pairs", f64::from(given.pole_pairs), "given"),
        ("stator_resistance_ohm", resistance, "identified"),
        ("max_torque_nm", max_torque_nm, "given, as far as the map gives it"),
        ("max_power_w", max_power_w, "given, as far as the map gives it"),
        ("max_current_a", given.max_current_a, "given"),
        ("max_speed_rpm", given.max_speed_rpm, "given"),
        ("rated_torque_nm", given.rated_torque_nm.min(max_torque_nm), "given"),
        ("rated_speed_rpm", given.rated_speed_rpm, "given"),
        ("dc_link_min_v", given.dc_link_min_v, "given"),
        ("dc_link_nominal_v", given.dc_link_nominal_v, "given"),
        ("dc_link_max_v", given.dc_link_max_v, "given"),
        ("max_switching_hz", given.max_switching_hz, "given"),
        ("min_id_a", given.min_id_a, "given"),
        ("trip_current_a", given.trip_current_a, "given"),
        ("trip_dc_over_v", given.trip_dc_over_v, "given"),
        ("trip_dc_under_v", given.trip_dc_under_v, "given"),
        ("trip_speed_rpm", given.trip_speed_rpm, "given"),
        ("torque_slew_nm_per_s", given.torque_slew_nm_per_s, "given"),
        ("rotor_inertia_kg_m2", inertia, "identified"),
        ("loss_rated_w", given.loss_rated_w, "given"),
        ("loss_quadratic_fraction", given.loss_quadratic_fraction, "given"),
        ("iron_loss_share", given.iron_loss_share, "given"),
        ("zs9_source_v", of_zs9("zs9_source_v", given.zs9_source_v), "given"),
        ("zs9_link_v", of_zs9("zs9_link_v", given.zs9_link_v), "given"),
        ("zs9_inductance_h", of_zs9("zs9_inductance_h", given.zs9_inductance_h), "given"),
        ("zs9_resistance_ohm", of_zs9("zs9_resistance_ohm", given.zs9_resistance_ohm), "given"),
        ("zs9_capacitance_f", of_zs9("zs9_capacitance_f", given.zs9_capacitance_f), "given"),
    ];
    let text = toml(&given.name, "identify", &keys);
    match given.patterns {
        Patterns::Paper => text,
        Patterns::Optimal => text + &format!("{:<40}# given\n", "patterns = \"optimal\""),
    }
}
