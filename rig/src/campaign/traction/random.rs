//! Cases of the PMaSynRM drive from values at random.

use super::cases::{Point, RUNAWAY_FROM_RPM};
use super::faults::{Cause, faults};
use super::{Case, Conditions, Drive, STAGES, Scale, Way};
use crate::bench::Flaws;
use crate::campaign::Action;
use crate::campaign::action::LEAD_S;
use crate::campaign::drawn::{Dimension, Drawn, Run};
use crate::campaign::fault::Named;
use crate::inject::traction::Kind;
use crate::plant::LineFilter;
use crate::run::CLOCK;
use anyhow::{Result, bail};
use tractive::modulation::Mode;

const fn of(name: &'static str, low: f64, high: f64, sound: Option<f64>) -> Dimension {
    Dimension { name, low, high, sound }
}

/// The dimensions, in the order of a case's values.
pub const DIMENSIONS: [Dimension; 20] = [
    of("fault", 0.0, 1.0, None),
    of("action", 0.0, 1.0, None),
    of("speed_rpm", -MOST_RPM, MOST_RPM, None),
    of("torque_share", 0.05, 1.0, None),
    of("at_ms", 5.0, 9.0, None),
    of("acceleration_rpm_s", -3_000.0, 3_000.0, Some(0.0)),
    of("line_v", 1_200.0, 1_750.0, Some(1_500.0)),
    of("inductance_mh", 1.5, 4.0, Some(3.0)),
    of("capacitance_mf", 4.0, 6.0, Some(4.0)),
    of("line_ohm", 0.3, 0.6, Some(0.3)),
    of("flux_scale", 0.9, 1.1, Some(1.0)),
    of("resistance_scale", 0.7, 1.5, Some(1.0)),
    of("noise_a", 0.0, 1.0, Some(0.0)),
    of("adc_bits", 10.0, IDEAL_BITS, Some(IDEAL_BITS)),
    of("current_gain", -0.01, 0.01, Some(0.0)),
    of("udc_gain", -0.01, 0.01, Some(0.0)),
    of("angle_error_deg", -1.0, 1.0, Some(0.0)),
    of("angle_jitter_us", 0.0, 2.0, Some(0.0)),
    of("ripple_v", 0.0, 20.0, Some(0.0)),
    of("dead_time_us", 0.0, 5.0, Some(0.0)),
];

/// The highest speed, in r/min.
const MOST_RPM: f64 = 6_000.0;
/// Number of bits from which on a converter has no steps.
const IDEAL_BITS: f64 = 16.0;
/// Frequency of the line's ripple, in Hz.
const RIPPLE_HZ: f64 = 300.0;
/// Share of the runs without a fault.
const SOUND_SHARE: f64 = 0.3;
/// Speed below which a wrong angle cannot be told from a standing rotor, in r/min.
const SLOWEST_RPM: f64 = 100.0;
/// The region of a run that had no pulses when its fault occurred.
const NO_PULSES: &str = "no pulses";
/// The coordinate of the action from which on there is no torque.
const COASTING_FROM: f64 = 0.9;

/// The fault at a coordinate. A different machine is no fault here, because it is drawn. Temperature sensors and an angle that is missing have
/// cases of their own.
fn fault(coordinate: f64) -> Result<Named<Cause>> {
    let mut list = faults(&Scale::ONE);
    let has_its_own =
        |cause| matches!(cause, Cause::Machine(..) | Cause::Sensor(..) | Cause::Bench(Kind::AngleMissing));
    list.retain(|fault| !has_its_own(fault.cause));
    let above = (coordinate - SOUND_SHARE) / (1.0 - SOUND_SHARE);
    let others = list.len() - 1;
    let index = if above < 0.0 { 0 } else { 1 + ((above * others as f64) as usize).min(others - 1) };
    Ok(list.swap_remove(index))
}

/// A speed at which the fault can occur, in r/min.
fn speed_rpm(drawn_rpm: f64, fault: &Named<Cause>) -> f64 {
    let between = |slowest_rpm: f64| {
        let share = drawn_rpm.abs() / MOST_RPM;
        (slowest_rpm + share * (MOST_RPM - slowest_rpm)).copysign(drawn_rpm)
    };
    match fault.cause {
        _ if fault.needs_rest() => 0.0,
        // The rotor is prescribed to run away forward.
        Cause::Runaway => between(RUNAWAY_FROM_RPM).abs(),
        Cause::Bench(Kind::Angle(_)) => between(SLOWEST_RPM),
        _ => drawn_rpm,
    }
}

/// An acceleration that keeps the speed within its range and, if the angle fails, does not bring it to rest.
fn acceleration_rpm_s(drawn: f64, speed_rpm: f64, at_s: f64, fault: &Named<Cause>) -> f64 {
    let drawn = match fault.cause {
        _ if fault.needs_rest() => return 0.0,
        Cause::Runaway => return 0.0,
        Cause::Bench(Kind::Angle(_)) => drawn.abs().copysign(speed_rpm),
        _ => drawn,
    };
    let (before_s, after_s) = (LEAD_S + at_s, STAGES.end_s - at_s);
    let time_s = if drawn * speed_rpm > 0.0 { after_s } else { before_s };
    // If the angle fails, the speed was never below half of its value then.
    let slower_rpm = match fault.cause {
        Cause::Bench(Kind::Angle(_)) => 0.5 * speed_rpm.abs() / before_s,
        _ => f64::INFINITY,
    };
    let most = ((MOST_RPM - speed_rpm.abs()) / time_s).min(slower_rpm).max(0.0);
    drawn.clamp(-most, most)
}

/// Checks that each value is within its range, or sound.
///
/// # Errors
/// The first value that is neither.
fn check(values: &[f64]) -> Result<()> {
    for (Dimension { name, low, high, sound }, value) in DIMENSIONS.iter().zip(values) {
        if !(*low..=*high).contains(value) && *sound != Some(*value) {
            bail!("{name} {value}: must be from {low} to {high}");
        }
    }
    Ok(())
}

impl Drive {
    /// The case with these values, in the order of [`DIMENSIONS`]; `seed` is the noise's.
    pub fn case(&self, values: &[f64], seed: u64) -> Result<Case> {
        let &[
            fault_at,
            action_at,
            drawn_rpm,
            share,
            at_ms,
            acceleration,
            line_v,
            inductance_mh,
            capacitance_mf,
            line_ohm,
            flux_scale,
            resistance_scale,
            noise_a,
            adc_bits,
            current_gain,
            udc_gain,
            angle_error_deg,
            angle_jitter_us,
            ripple_v,
            dead_time_us,
        ] = values
        else {
            bail!("{} values, not {}", values.len(), DIMENSIONS.len());
        };
        check(values)?;
        let fault = fault(fault_at)?;
        let action = match action_at {
            at if at >= COASTING_FROM => Action::Coasting,
            at if at < 0.5 * COASTING_FROM => Action::Motoring,
            _ => Action::Braking,
        };
        let (speed_rpm, at_s) = (speed_rpm(drawn_rpm, &fault), 1e-3 * at_ms);
        let flaws = Flaws {
            adc_bits: (adc_bits < IDEAL_BITS).then_some(adc_bits as u32),
            adc_full_scale_a: 1.25 * self.machine.folder.parameters.trip_current_a,
            noise_a,
            udc_ripple: (ripple_v > 0.0).then_some((ripple_v, RIPPLE_HZ)),
            current_gain,
            udc_gain,
            angle_error_deg,
            angle_jitter_s: 1e-6 * angle_jitter_us,
            seed,
            ..Flaws::NONE
        };
        let conditions = Conditions {
            line_v: Some(line_v),
            filter: LineFilter {
                inductance_h: 1e-3 * inductance_mh,
                resistance_ohm: line_ohm,
                capacitance_f: 1e-3 * capacitance_mf,
            },
            flux_scale,
            resistance_scale,
            flaws,
            dead_time_ticks: (1e-6 * dead_time_us * f64::from(CLOCK.ticks_per_s)).round() as u32,
            acceleration_rpm_s: acceleration_rpm_s(acceleration, speed_rpm, at_s, &fault),
        };
        let point = Point { speed_rpm, share, fast: false };
        Ok(Case { fault, point, action, at_s, conditions })
    }

    /// Runs the case with these values.
    pub fn run_values(&self, run: usize, values: &[f64], seed: u64) -> Result<Run> {
        let case = self.case(values, seed)?;
        let (outcome, Way { modes, region }) = self.run_watched(&case)?;
        let modes: Vec<_> = modes.into_iter().map(Mode::name).collect();
        let region = if outcome.mode == Mode::Off.name() { NO_PULSES } else { region.name() }.to_owned();
        Ok(Run {
            outcome,
            drawn: Drawn { run, seed, modes: modes.join(">"), region, values: values.to_vec() },
        })
    }
}
