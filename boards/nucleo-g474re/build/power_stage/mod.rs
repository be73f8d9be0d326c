//! The power stage beside the package, `power_stage.toml`, against the machine: whatever the image would refuse, measure wrongly or
//! protect badly is refused here, by key and file. What passes becomes the constants that the image is built with.

mod keys;
mod sensor;
mod stage;

pub use sensor::sensor;
pub use stage::Machine;

use super::{rates, zs9_rates};
use keys::{Keys, ZSource};
use stage::{Bound, CODES, HALF_CODES, Stage, angle, shown};
use std::path::Path;
use tractive::modulation::SwitchLimits;
use tractive_tablegen::InputError;

/// The longest dead time that the ZS9's drive reckons with, in ns.
const ZS9_DEAD_TIME_NS: f64 = 5_000.0;

/// Checks the PMaSynRM's power stage; gives its constant as Rust.
///
/// # Errors
/// The first key that does not suit the board or the machine.
pub fn traction(file: &Path, text: &str, machine: &Machine) -> Result<String, InputError> {
    let stage = Stage::parse(file, text)?;
    let Keys { control_hz, dead_time_ns, min_pulse_ns, z_source, .. } = &stage.keys;
    if z_source.is_some() {
        return Err(stage.refuse("z_source", "is the ZS9's".to_owned()));
    }
    let Some(min_pulse_ns) = *min_pulse_ns else {
        return Err(stage.refuse("min_pulse_ns", "is missing".to_owned()));
    };
    let Some(control_hz) = *control_hz else {
        return Err(stage.refuse("control_hz", "is missing".to_owned()));
    };
    let ratings = &machine.tables.ratings;
    stage.check_control_hz(control_hz, ratings.max_switching_hz)?;
    stage.check_times(stage.longest_dead_time_ns())?;
    let Some(behind) = stage.keys.behind_line_filter else {
        return Err(stage.refuse("behind_line_filter", "is missing".to_owned()));
    };
    let carrier_hz = machine.carrier_share * ratings.max_switching_hz;
    let settings = rates::settings(control_hz, min_pulse_ns, *dead_time_ns, carrier_hz, behind);
    // The longest carrier half of a machine that switches slowly.
    let longest_ticks = settings.devices.longest_half_ticks();
    if longest_ticks > rates::LONGEST_HALF_TICKS {
        let least_hz = f64::from(settings.clock.ticks_per_s) * f64::from(SwitchLimits::LEAST_RANGE)
            / f64::from(2 * (rates::LONGEST_HALF_TICKS - SwitchLimits::LEAST_RANGE));
        return Err(machine.refuse(format!(
            "max_switching_hz: {}: must be at least {}: the timers' 16 bits hold no longer carrier half",
            ratings.max_switching_hz,
            shown(least_hz.ceil()),
        )));
    }
    let half_ns =
        1e9 * f64::from(settings.devices.shortest_half_ticks) / f64::from(settings.clock.ticks_per_s);
    stage.check(&[
        Bound(
            "dead_time_ns",
            f64::from(*dead_time_ns),
            1.0,
            (0.25 * half_ns).floor(),
            "up to a quarter of the shortest carrier half",
        ),
        Bound(
            "min_pulse_ns",
            f64::from(min_pulse_ns),
            stage.real_dead_time_ns() + 1.0,
            (0.5 * half_ns).floor(),
            "more than the dead time, up to half of the shortest carrier half",
        ),
    ])?;
    stage.check_known(control_hz, 1e-3 * half_ns, ratings)?;
    stage.check_sensors(machine, f64::from(ratings.trip_dc_over_v), "the machine's trip_dc_over_v", 1)?;
    settings.check(machine.tables).map_err(|refused| stage.refuse_start(machine, &refused))?;
    let thermal = stage.keys.thermal.as_ref().map(|keys| keys.thermal(ratings.stator_resistance_ohm));
    if let Some(Err(refused)) = thermal.map(|thermal| thermal.check()) {
        return Err(stage.refuse("thermal", refused.to_string()));
    }
    stage.constant(control_hz, min_pulse_ns, thermal)
}

/// Checks the ZS9's power stage; gives its constant as Rust.
///
/// # Errors
/// The first key that does not suit the board or the machine.
pub fn zs9(file: &Path, text: &str, machine: &Machine) -> Result<String, InputError> {
    let stage = Stage::parse(file, text)?;
    let Keys { control_hz, min_pulse_ns, z_source, encoder_zeros_deg, .. } = &stage.keys;
    if control_hz.is_some() {
        let problem = format!("the control of two motors has time for {} Hz alone", zs9_rates::CONTROL_HZ);
        return Err(stage.refuse("control_hz", problem));
    }
    if min_pulse_ns.is_some() {
        return Err(stage.refuse("min_pulse_ns", "the modulator of the nine switches has none".to_owned()));
    }
    let Some(behind) = stage.keys.behind_line_filter else {
        return Err(stage.refuse("behind_line_filter", "is missing".to_owned()));
    };
    let keys = &stage.keys;
    let (counts, as_it_is) =
        ("the ZS9's board reads encoders that count", "the control of two motors takes everything as it is");
    for (key, given, problem) in [
        ("absolute", keys.absolute.is_some(), counts),
        ("biss", keys.biss.is_some(), counts),
        ("resolver", keys.resolver.is_some(), counts),
        ("angle_late_us", keys.angle_late_us.is_some(), as_it_is),
        ("current_filter_us", keys.current_filter_us.is_some(), as_it_is),
        ("device_threshold_v", keys.device_threshold_v.is_some(), as_it_is),
        ("device_slope_mohm", keys.device_slope_mohm.is_some(), as_it_is),
    ] {
        if given {
            return Err(stage.refuse(key, problem.to_owned()));
        }
    }
    if stage.keys.thermal.is_some() {
        return Err(stage.refuse("thermal", "the ZS9 knows no temperatures".to_owned()));
    }
    let Some(ZSource { inductor_range_a, source_range_v, link_ref_v }) = *z_source else {
        return Err(stage.refuse("z_source", "is missing".to_owned()));
    };
    stage.check_times(ZS9_DEAD_TIME_NS)?;
    let settings = zs9_rates::settings(machine.tables, behind);
    let operated = tractive::drive::dual::Settings::operator_ratings(&machine.tables.ratings);
    let capacitor_v = f64::from(settings.limits.capacitor_max_v);
    stage.check_sensors(machine, capacitor_v, "the capacitors' highest voltage", 2)?;
    let inductor_a = f64::from(settings.link.inductor_max_a);
    let source_v = f64::from(operated.dc_link_max_v);
    let [least_v, most_v, _] = tractive::drive::dual::Settings::link_range_v(&operated).map(f64::from);
    stage.check(&[
        stage.current("inductor_range_a", inductor_range_a, inductor_a, "the inductor's highest current"),
        stage.voltage("source_range_v", source_range_v, source_v, "the source's highest voltage"),
        Bound("link_ref_v", link_ref_v, least_v, most_v, "what an operator may ask for with this machine"),
    ])?;
    settings.check(machine.tables).map_err(|refused| stage.refuse_start(machine, &refused))?;
    let zeros: Vec<_> = encoder_zeros_deg.iter().map(|degrees| angle(*degrees)).collect();
    Ok(format!(
        "Zs9Stage {{\n    common: {},\n    encoder_zeros: [{}],\n    \
         inductor_a_per_code: {inductor_range_a:?} / {HALF_CODES:?},\n    \
         source_v_per_code: {source_range_v:?} / {CODES:?},\n    link_ref_v: {link_ref_v:?},\n}}",
        // The modulator of the nine switches has no shortest pulse.
        stage.constant(zs9_rates::CONTROL_HZ, 0, None)?,
        zeros.join(", "),
    ))
}
