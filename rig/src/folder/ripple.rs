//! The current from the pulses at full torque: the operating point's current plus the ripple of its mode.

use super::show::View;
use crate::bound::Operation;
use crate::machine::Machine;
use crate::options::usual_min_pulse_us;
use tractive::modulation::{Mode, index_limit};
use tractive::time::Clock;

/// Least margin of the trip above the highest current at full torque, as a share of it: room for steps and changes of mode.
pub const ROOM: f64 = 0.15;

/// Highest trip that the table generator accepts, as a share of the largest current.
pub const MOST_TRIP: f64 = 4.0;

/// Most carriers in a turn of the voltage: with more of them the ripple is the same, and the rounding of the pulses to ticks adds up to a flux
/// linkage that a drive would remove.
const MOST_CARRIERS: f64 = 200.0;

/// The current at which the drive trips, in A, if the machine's default leaves no room for the ripple: in steady state at full torque, in any mode and
/// with any link voltage in normal operation, the current stays well below it.
pub fn trip_current_a(machine: &Machine) -> Option<f64> {
    let trip_a = (1.0 + ROOM) * highest_a(machine);
    (trip_a > machine.folder.parameters.trip_current_a).then_some(trip_a)
}

/// Highest current of a phase at full torque in steady state, including ripple, in A: at both ends and in the middle of each mode's speed range, with
/// the lowest, nominal and highest link voltage.
fn highest_a(machine: &Machine) -> f64 {
    let view = View::of(machine);
    let parameters = &machine.folder.parameters;
    let links = [parameters.dc_link_min_v, parameters.dc_link_nominal_v, parameters.dc_link_max_v];
    let modes = links.iter().flat_map(|udc_v| view.modes(*udc_v).into_iter().map(move |mode| (*udc_v, mode)));
    let slowest_rpm = 60.0 / f64::from(parameters.pole_pairs) * parameters.max_switching_hz / MOST_CARRIERS;
    let ends = modes.flat_map(|(udc_v, (mode, from, to))| {
        let from = from.max(slowest_rpm).min(to);
        [from, 0.5 * (from + to), to].map(|speed_rpm| (udc_v, mode, speed_rpm))
    });
    ends.filter_map(|(udc_v, mode, speed_rpm)| view.peak_a(mode, speed_rpm, udc_v)).fold(0.0, f64::max)
}

/// The rate of control that the carrier of a machine wants if the usual one is too slow for it, in Hz.
fn more_control_hz(machine: &Machine) -> Option<u32> {
    let max_switching_hz = machine.tables.ratings.max_switching_hz;
    let is_slow = max_switching_hz > Clock::control_hz(max_switching_hz) as f32;
    is_slow.then(|| max_switching_hz.ceil() as u32)
}

impl View<'_> {
    /// Highest current of a phase at full torque in a mode, in A, with a link in V; `None` if the mode has no pulses there.
    pub fn peak_a(&self, mode: Mode, speed_rpm: f64, udc_v: f64) -> Option<f64> {
        let index = index_limit(mode, self.rate(speed_rpm), &self.devices);
        let point = self.point(self.machine.envelope_nm(speed_rpm), speed_rpm, udc_v, index);
        let (id, iq) = (point.current.d.into(), point.current.q.into());
        let at = self.map.at(id, iq);
        let flux_wb = (at.psi_d_wb, at.psi_q_wb);
        let min_pulse_us = usual_min_pulse_us(self.machine.folder.parameters.max_switching_hz);
        let samples = Operation { mode, speed_rpm, udc_v, current_a: (id, iq), flux_wb }.samples(
            min_pulse_us,
            more_control_hz(self.machine),
            self.machine,
        )?;
        Some(samples.current_a.iter().map(|current| current.abs()).fold(0.0, f64::max))
    }
}
