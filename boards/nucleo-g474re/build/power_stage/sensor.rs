//! The position sensor of the image.

use super::super::rates;
use super::keys::{Absolute, Biss, PositionSensor, Resolver};
use super::stage::{Bound, HALF_CODES, Machine, Stage};
use std::path::Path;
use tractive_tablegen::InputError;

/// The highest control rate at which an absolute encoder's frame, 24 µs, and its rest of 20 µs pass within a period, in Hz.
const ABSOLUTE_HZ: u32 = 22_000;

/// Control rates of twice the frequencies that resolvers are made for, in Hz.
const RESOLVER_HZ: [u32; 2] = [4_000, 20_000];

/// The time behind a sample in which the excitation's level is read, in µs.
const LEVEL_US: f64 = 20.0;

/// V at a converter's pin over half its range.
const HALF_RANGE_V: f64 = 1.65;

/// A period that has time for a frame.
fn has_frames(control_hz: u32) -> Bound<'static> {
    Bound("control_hz", f64::from(control_hz), 0.0, f64::from(ABSOLUTE_HZ), "a frame and a rest")
}

/// The type of the position sensor that a stage names, as Rust.
///
/// # Errors
/// A sensor that does not suit the control rate or the machine.
pub fn sensor(file: &Path, text: &str, machine: &Machine) -> Result<String, InputError> {
    let stage = Stage::parse(file, text)?;
    let control_hz = stage.keys.control_hz.unwrap_or(rates::CORE_HZ);
    let kind = match stage.sensor()? {
        PositionSensor::Encoder => "Encoder".to_owned(),
        PositionSensor::Absolute(Absolute { bits, gray }) => {
            stage
                .check(&[Bound("bits", f64::from(bits), 8.0, 24.0, "of one turn"), has_frames(control_hz)])?;
            format!("Absolute<{bits}, {gray}>")
        }
        PositionSensor::Biss(Biss { bits, turns_bits }) => {
            stage.check(&[
                Bound("bits", f64::from(bits), 8.0, 26.0, "of one turn"),
                Bound(
                    "turns_bits",
                    f64::from(turns_bits),
                    0.0,
                    f64::from(32 - bits),
                    "32 with those of one turn",
                ),
                has_frames(control_hz),
            ])?;
            format!("Biss<{bits}, {turns_bits}>")
        }
        PositionSensor::Resolver(Resolver { pole_pairs, amplitude_v, lag_us }) => {
            let period_us = 1e6 / f64::from(control_hz);
            let [least_hz, most_hz] = RESOLVER_HZ.map(f64::from);
            let machine_pairs = f64::from(machine.tables.ratings.pole_pairs);
            stage.check(&[
                Bound(
                    "control_hz",
                    f64::from(control_hz),
                    least_hz,
                    most_hz,
                    "twice the excitation's frequency",
                ),
                Bound("pole_pairs", f64::from(pole_pairs), 1.0, machine_pairs, "the machine's at most"),
                Bound(
                    "amplitude_v",
                    amplitude_v,
                    0.2,
                    0.75 * HALF_RANGE_V,
                    "at the converter's pin, with some room",
                ),
                Bound("lag_us", lag_us, 0.0, 0.5 * period_us - LEVEL_US, "of filter and resolver"),
            ])?;
            let turns = machine_pairs / f64::from(pole_pairs);
            if turns.fract() != 0.0 {
                let problem = format!("{pole_pairs}: must divide the machine's {machine_pairs}");
                return Err(stage.refuse("pole_pairs", problem));
            }
            let amplitude = amplitude_v / HALF_RANGE_V * HALF_CODES;
            let ticks_per_us = 1e-6 * f64::from(rates::clock(control_hz).ticks_per_s);
            let toggle = (0.5 * period_us - lag_us) * ticks_per_us;
            format!("Resolver<{turns}, {amplitude:.0}, {toggle:.0}>")
        }
    };
    Ok(format!("/// The position sensor of the image.\npub type Sensor = {kind};\n"))
}
