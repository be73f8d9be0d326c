//! The drive under test: its settings, and its tasks.

use super::{Options, PatternsName, Plan};
use crate::bench::LinePlan;
use crate::machine::Machine;
use crate::plant::{DcLinkSettings, LineFilter};
use crate::run::traction::Tasks;
use crate::run::{self, CLOCK, ticks};
use anyhow::Result;
use tractive::control::{ControlLaw, Gains};
use tractive::drive::traction::Settings;
use tractive::modulation::SwitchLimits;
use tractive::operator::{Line, LineTimes};
use tractive::time::{Clock, Instant};
use tractive::wire::Setup;

/// The link's voltage, in V.
pub(super) fn udc_v(options: &Options, machine: &Machine) -> f64 {
    options.udc.unwrap_or(machine.folder.parameters.dc_link_nominal_v)
}

/// The rate of control, in Hz.
pub(super) fn control_hz(options: &Options, machine: &Machine) -> u32 {
    options.own.control_hz.unwrap_or(Clock::control_hz(machine.tables.ratings.max_switching_hz))
}

pub(super) fn clock(options: &Options, machine: &Machine) -> Clock {
    run::clock(control_hz(options, machine))
}

pub(super) fn setup(plan: &Plan, options: &Options, machine: &Machine, over_protocol: bool) -> Setup {
    let uncompensated = options.own.uncompensated;
    let (threshold_mv, slope_10uohm) = options.own.flaws.told_drop().steps();
    Setup {
        control_ticks: clock(options, machine).control_ticks,
        min_pulse_ticks: ticks(options.min_pulse_us(machine.folder.parameters.max_switching_hz)),
        // What the firmware compensates.
        dead_time_ticks: if uncompensated { 0 } else { ticks(options.dead_time_us) },
        pwm_delay_ticks: ticks(options.own.pwm_delay_us),
        line: plan.line.as_ref().map(|plan| times(&plan.link)),
        over_protocol,
        uncompensated,
        behind_line_filter: line_filter(plan, options).is_some_and(|filter| {
            let power_w = machine.folder.parameters.max_power_w * f64::from(options.own.drives);
            filter.needs_damping(power_w, udc_v(options, machine))
        }),
        angle_late_s: options.own.known_late_s(),
        angle_step_rad: angle_step_rad(options, machine),
        current_filter_ticks: options.own.known_filter_ticks(),
        threshold_mv,
        slope_10uohm,
        iron_permille: options.own.known_iron_permille(machine),
        train: plan.train,
    }
}

/// The line filter in front of the link.
fn line_filter(plan: &Plan, options: &Options) -> Option<LineFilter> {
    plan.line.as_ref().map(LinePlan::filter).or(options.own.line)
}

/// Step of the encoder's counts, electrical, in rad; 0 without an encoder.
pub(super) fn angle_step_rad(options: &Options, machine: &Machine) -> f32 {
    let counts = options.own.encoder_lines.map(|lines| lines.saturating_mul(4));
    counts.map_or(0.0, |counts| Settings::step_rad(counts, machine.tables.ratings.pole_pairs))
}

pub(super) fn devices(setup: &Setup, options: &Options, machine: &Machine) -> SwitchLimits {
    let Setup { control_ticks, min_pulse_ticks, dead_time_ticks, .. } = *setup;
    let clock = Clock { control_ticks, ..CLOCK };
    let carrier_hz = PatternsName::of(&options.own, machine).free_carrier_share()
        * machine.tables.ratings.max_switching_hz;
    SwitchLimits::new(min_pulse_ticks, dead_time_ticks, carrier_hz, &clock)
}

pub(super) fn first_half_ticks(setup: &Setup, options: &Options, machine: &Machine) -> u32 {
    devices(setup, options, machine).shortest_half_ticks + setup.pwm_delay_ticks
}

/// The drive that an image with this law and this setup would be, and its operator.
pub(super) fn tasks<'a, L: ControlLaw>(
    law: L,
    setup: &Setup,
    options: &Options,
    machine: &Machine,
) -> Result<Tasks<'a, L>> {
    let gains = Gains::of(setup.uncompensated, setup.behind_line_filter);
    let devices = devices(setup, options, machine);
    let settings = Settings {
        angle_late_s: setup.angle_late_s,
        angle_step_rad: setup.angle_step_rad,
        current_filter_ticks: setup.current_filter_ticks,
        drops: setup.drops(),
        iron_share: setup.iron_share(),
        gains,
        ..Settings::new(clock(options, machine), devices)
    };
    settings.check(machine.tables).map_err(run::refused)?;
    let ratings = &machine.tables.ratings;
    let line = setup.line.map(|times| Line::rated(ratings, times.precharge_s, times.discharge_s));
    let first = first_half_ticks(setup, options, machine);
    let tasks = Tasks::with_law(law, Instant(0), machine.tables, settings, first);
    Ok(tasks.on(PatternsName::of(&options.own, machine).ladder()).operated_on(line).limited_to(setup.train))
}

/// Time constants of a link, as the operator has to know them.
pub(super) fn times(link: &DcLinkSettings) -> LineTimes {
    let seconds = |ohm: f64| (ohm * link.capacitance_f) as f32;
    LineTimes { precharge_s: seconds(link.precharge_ohm), discharge_s: seconds(link.discharge_ohm) }
}
