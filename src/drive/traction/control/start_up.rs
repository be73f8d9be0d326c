//! The start of a drive whose position sensor only counts: pulses of [`StartUp`] in place of the control law's.

use super::super::Shared;
use super::super::applied::passed;
use super::ControlTask;
use crate::control::ControlLaw;
use crate::frames::{AlphaBeta, six_step_v};
use crate::machine::Machine;
use crate::modulation::{Mode, Reference, index_limit};
use crate::ports::{ControlPort, Sample};
use crate::protection::Fault;
use crate::start_up::{StartUp, StartUpInput, StartUpStep};
use crate::time::Instant;

/// Share of the largest voltage of a carrier that the pulses use.
const USED_SHARE: f32 = 0.95;

/// The law, and the newest carrier boundary that it has seen.
pub(super) struct Starting {
    law: StartUp,
    boundary: Option<Instant>,
}

impl Starting {
    pub(super) const fn new() -> Self {
        Self { law: StartUp::new(), boundary: None }
    }
}

impl<M: Machine, L: ControlLaw> ControlTask<M, L> {
    /// A control period at rest: if the drive is enabled and its sensor counts, a period of the search for the angle. `commands` is `None` if the
    /// drive is not enabled, else `true` if the next boundary uses this period. Returns `true` if the search makes pulses.
    #[cold]
    #[inline(never)]
    pub(super) fn start_up(
        &mut self,
        sample: &Sample,
        commands: Option<bool>,
        shared: &Shared,
        port: &mut impl ControlPort,
    ) -> bool {
        let starts = commands.is_some() && sample.angle.is_none() && self.trip.is_none();
        let Some(turned) = (if starts { port.turned() } else { None }) else {
            self.starting = Starting::new();
            return false;
        };
        let clock = self.settings.clock;
        let now = self.now.before(clock.control_ticks);
        let starting = &mut self.starting;
        starting.law.turn(turned, clock.control_s());
        if let Some(newest) = self.pulses.newest()
            && starting.boundary != Some(newest.at)
        {
            if let Some(currents_a) = self.pulses.currents_a(&shared.loaded) {
                let ended = passed(&self.pulses, starting.boundary, (sample.udc_v, 0), &clock);
                starting.law.observe(self.zeros.without(currents_a).clarke(), ended.volt_seconds);
            }
            starting.boundary = Some(newest.at);
        }
        let mut vector = AlphaBeta::default();
        if commands == Some(true) {
            let devices = &self.settings.devices;
            let shortest_s = clock.seconds(devices.shortest_half_ticks as i32);
            let limit_v = USED_SHARE * index_limit(Mode::Async, 0.0, devices) * six_step_v(sample.udc_v);
            let interval_s = if shortest_s < clock.control_s() { clock.control_s() } else { shortest_s };
            let tables = self.machine.tables();
            let committed = self.pulses.committed_volt_ticks() * (sample.udc_v * clock.tick_s);
            match starting.law.step(&StartUpInput { limit_v, interval_s, committed, tables }) {
                StartUpStep::Wait => return false,
                StartUpStep::Pulse(wanted) => vector = wanted,
                StartUpStep::Found(zero) => {
                    // The drive adds its own to what the sensor then says.
                    port.align(now, zero - self.harmonics.zero());
                    return false;
                }
                StartUpStep::Failed => {
                    self.trip_on((Fault::PositionSensor, 0.0, 1.0), sample, port);
                    return false;
                }
            }
        }
        let voltage_v = crate::frames::sqrt(vector.squared());
        self.reference = Reference { voltage_v, vector, ..self.reference };
        !self.starting.law.is_waiting()
    }
}
