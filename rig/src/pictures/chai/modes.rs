//! The first paper's modes, figures 6 and 7, and every mode's pulses.

use super::super::ink::draw;
use super::super::sheet::{
    Axis, BLACK, BLUE, Colour, GREEN, GREY, ORANGE, Panel, Point, RED, Side, VIOLET, number,
};
use crate::machine::Machine;
use crate::options::usual_min_pulse_us;
use crate::pattern::{LegEdge, Wanted, edges};
use crate::trace::Recording;
use crate::verdict::worst;
use anyhow::Result;
use core::f64::consts::{FRAC_2_PI, TAU};
use tractive::modulation::{Ladder, Mode, index_limit};

const COLOURS: [Colour; 6] = [GREY, BLUE, GREEN, ORANGE, VIOLET, RED];

/// Figure 6: the ratio of the devices' switching frequency to the stator's at full torque, by the mode that the drive was in.
pub fn strategy(recording: &Recording, machine: &Machine) -> Result<String> {
    let most_hz = f64::from(machine.tables.ratings.max_switching_hz);
    let full_nm = worst(recording.rows.iter().map(|row| row.te_ref_nm)).unwrap_or(0.0);
    let last_hz = recording.rows.iter().map(|row| row.f1_hz).fold(0.0, f64::max);
    let (x, y) = (
        Axis::of("stator frequency in Hz", 0.0, last_hz),
        Axis::of("turn-ons of a device in 1/s", 0.0, 1.12 * most_hz),
    );
    let title = "The modes at full torque on the way up";
    let mut panel = Panel::new((0.0, 0.0, 860.0, 400.0), title, x, y);
    panel.dashes([(0.0, most_hz), (last_hz, most_hz)], RED);
    panel.words((last_hz, 1.05 * most_hz), "limit of the devices", Side::Left, RED);
    let modes = Mode::ALL.into_iter().filter(|mode| *mode != Mode::Off);
    for (mode, colour) in modes.zip(COLOURS.into_iter().cycle()) {
        let rate = |f1_hz: f64| match mode.turn_ons() {
            0 => most_hz,
            locked => f64::from(locked) * f1_hz,
        };
        let rows = recording.rows.iter().filter(|row| row.mode == mode && row.te_ref_nm > 0.5 * full_nm);
        let extremes =
            rows.fold((f64::INFINITY, 0.0_f64), |(low, high), row| (low.min(row.f1_hz), high.max(row.f1_hz)));
        let (low, high) = (extremes.0.max(0.0), extremes.1);
        if low < high {
            panel.line([(low, rate(low)), (high, rate(high))], colour, 2.4);
            panel.dashes([(high, 0.0), (high, rate(high))], GREY);
            panel.words((0.5 * (low + high), 0.05 * most_hz), mode.name(), Side::Middle, colour);
        }
    }
    draw((860, 400), &[panel])
}

/// A mode's pulses for a share of six-step, with the control rate that goes with the machine.
pub fn pulses(machine: &Machine, mode: Mode, f1_hz: f64, share: f64) -> Result<Vec<LegEdge>> {
    edges(&wanted(machine, mode, f1_hz, share))
}

/// The same before they are made.
fn wanted(machine: &Machine, mode: Mode, f1_hz: f64, share: f64) -> Wanted {
    let udc_v = machine.folder.parameters.dc_link_nominal_v;
    Wanted {
        mode,
        voltage_v: share * udc_v * FRAC_2_PI,
        udc_v,
        f1_hz,
        cycles: 1,
        dead_time_us: 0.0,
        min_pulse_us: usual_min_pulse_us(machine.folder.parameters.max_switching_hz),
        max_switching_hz: machine.tables.ratings.max_switching_hz,
        control_hz: None,
    }
}

/// A leg's level over the pulse angle in degrees.
pub fn level(edges: &[LegEdge], f1_hz: f64, leg: usize) -> Vec<Point> {
    let mut points: Vec<Point> = Vec::new();
    for (t_s, _, on) in edges.iter().filter(|(_, which, _)| *which == leg) {
        let degrees = 360.0 * f1_hz * t_s;
        points.extend(points.last().map(|last| (degrees, last.1)));
        points.push((degrees, f64::from(u8::from(*on))));
    }
    points.extend(points.last().map(|last| (360.0, last.1)));
    points
}

/// The share of six-step at which a notched mode is drawn, so that its notches have much the same width.
pub fn drawn_share(mode: Mode) -> f64 {
    1.0 - 0.05 * f64::from(mode.turn_ons() - 1)
}

/// Figure 7: the legs' levels of a middle-60° mode, with control at a rate in Hz or at the usual one; the legs' middle 60° are shaded.
pub fn middle60(machine: &Machine, control_hz: Option<u32>, mode: Mode) -> Result<Panel> {
    let (f1_hz, share) = (100.0, drawn_share(mode));
    let edges = edges(&Wanted { control_hz, ..wanted(machine, mode, f1_hz, share) })?;
    let title =
        format!("{}: {} pulses a turn, at {:.0} % of six-step", mode.name(), mode.turn_ons(), 100.0 * share);
    let (x, y) = (Axis::turn("pulse angle in degrees"), Axis::of("", -0.2, 4.3).bare());
    let mut panel = Panel::new((0.0, 0.0, 860.0, 260.0), &title, x, y);
    for (leg, (name, colour)) in [("u", BLUE), ("v", RED), ("w", GREEN)].into_iter().enumerate() {
        let base = 1.5 * (2 - leg) as f64;
        for half in 0..2 {
            let begin = (60.0 + 120.0 * leg as f64 + 180.0 * f64::from(half)).rem_euclid(360.0);
            panel.shade((begin, base - 0.12), (begin + 60.0, base + 1.12), GREY, 0.25);
        }
        panel.line(level(&edges, f1_hz, leg).iter().map(|(x, on)| (*x, base + on)), colour, 1.8);
        panel.words((-7.0, base + 0.5), name, Side::Left, BLACK);
    }
    Ok(panel)
}

/// Figure 7: seven and three pulses.
pub fn figure7(machine: &Machine) -> Result<String> {
    let mut panels = [middle60(machine, None, Mode::Mid7)?, middle60(machine, None, Mode::Mid3)?];
    panels[1].place.1 = 270.0;
    draw((860, 530), &panels)
}

/// Every mode of the paper: the line voltage of a turn beside its fundamental, at a voltage that goes with the frequency.
pub fn every_mode(machine: &Machine) -> Result<String> {
    const AT_HZ: [f64; 6] = [25.0, 50.0, 67.0, 105.0, 122.0, 133.0];
    let base_hz =
        machine.folder.parameters.rated_speed_rpm / 60.0 * f64::from(machine.folder.parameters.pole_pairs);
    let udc_v = machine.folder.parameters.dc_link_nominal_v;
    let mut panels = Vec::new();
    for (k, (mode, f1_hz)) in Ladder::PAPER.modes().zip(AT_HZ).enumerate() {
        let rate = (f1_hz / f64::from(crate::run::CLOCK.ticks_per_s) * 4_294_967_296.0) as f32;
        let limits = tractive::modulation::SwitchLimits::new(
            0,
            0,
            machine.tables.ratings.max_switching_hz,
            &crate::run::CLOCK,
        );
        let share = if mode.is_whole() {
            1.0
        } else {
            (f1_hz / base_hz).min(f64::from(index_limit(mode, rate, &limits)))
        };
        let edges = pulses(machine, mode, f1_hz, share)?;
        let line = line_voltage(&edges, f1_hz, udc_v);
        let carrier = match mode.turn_ons() {
            0 => "free carrier".to_owned(),
            1 => "1 pulse a turn".to_owned(),
            pulses => format!("{pulses} pulses a turn"),
        };
        let title =
            format!("{}, {} Hz: {carrier}, {:.0} % of six-step", mode.name(), number(f1_hz), 100.0 * share);
        let place = (480.0 * (k % 2) as f64, 220.0 * (k / 2) as f64, 480.0, 214.0);
        let axes =
            (Axis::turn("pulse angle in degrees"), Axis::of("u_{uv} in V", -1.15 * udc_v, 1.15 * udc_v));
        let mut panel = Panel::new(place, &title, axes.0, axes.1);
        panel.line(line, BLUE, 1.3);
        let peak_v = 3.0_f64.sqrt() * share * udc_v * FRAC_2_PI;
        let wave = (0..=180)
            .map(|k| (2.0 * f64::from(k), peak_v * (TAU * (f64::from(k) / 180.0 + 1.0 / 12.0)).sin()));
        panel.line(wave, RED, 1.3);
        panels.push(panel);
    }
    draw((960, 660), &panels)
}

/// The voltage between the legs u and v over the pulse angle in degrees.
fn line_voltage(edges: &[LegEdge], f1_hz: f64, udc_v: f64) -> Vec<Point> {
    let (mut on, mut points, mut last) = ([false; 3], Vec::new(), 0.0);
    for (t_s, leg, level) in edges {
        on[*leg] = *level;
        let degrees = 360.0 * f1_hz * t_s;
        let now = udc_v * (f64::from(u8::from(on[0])) - f64::from(u8::from(on[1])));
        if degrees > 0.0 {
            if points.is_empty() {
                points.push((0.0, last));
            }
            points.extend([(degrees, last), (degrees, now)]);
        }
        last = now;
    }
    points.push((360.0, last));
    points
}
