//! The idle loop's side of the board: what the operator asks and tells.

use super::hardware;
use super::operator::Operator;
use super::pins;
use super::power_stage::{AdcCode, POWER_STAGE};
use super::registers::Registers;
use super::sampling::Zeros;
use super::switchgear;
use crate::frames::Abc;
use crate::operator::{Commander, Configuration, Feedback, OperatorPort, Request, Status};
use crate::time::Instant;

/// The idle loop's side.
pub struct Idle<'a, C> {
    registers: Registers,
    operator: &'a Operator,
    offsets_a: Abc,
    configuration: Configuration,
    commander: C,
}

impl<'a, C: Commander> Idle<'a, C> {
    /// With the zeros that the start measured.
    pub fn new(
        registers: Registers,
        operator: &'a Operator,
        zeros: Zeros,
        configuration: Configuration,
        commander: C,
    ) -> Self {
        let offset_a = |zero: AdcCode| zero.current_a(AdcCode(POWER_STAGE.zero_code));
        let [a, b, c] = zeros.map(offset_a);
        Self { registers, operator, offsets_a: Abc { a, b, c }, configuration, commander }
    }
}

impl<C: Commander> OperatorPort for Idle<'_, C> {
    fn ask(&mut self, at: Instant) -> (Request, Feedback) {
        let (precharge_closed, main_closed) = switchgear::contacts(&self.registers);
        let feedback = Feedback {
            precharge_closed,
            main_closed,
            driver_ready: pins::drivers_ready(&self.registers),
            enable_input: pins::is_enabled(&self.registers),
            // An incremental encoder cannot tell at standstill; while it turns, the drive looks at its angle.
            sensor_alive: true,
            position_known: self.operator.position_known(),
            offsets_a: self.offsets_a,
            configuration: self.configuration,
            parameters_open: self.commander.parameters_open(),
            hardware: hardware::held_by(&self.registers),
        };
        (self.commander.request(at), feedback)
    }

    /// At once: a slot earlier or later is nothing to a contactor, and the chopper's compare is preloaded.
    fn tell(&mut self, _from: Instant, status: &Status) {
        switchgear::set(&self.registers, &status.switches);
        self.commander.told(status);
    }
}
