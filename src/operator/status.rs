//! The operator's status.

use super::request::bits;
use crate::control::Demand;
use crate::ports::MotorDemand;
use crate::protection::Trip;
use crate::protection::trip_from_words;
use crate::protection::trip_to_words;
use crate::thermal::Temperatures;
use tractive_control::named;

named! {
    /// The state of the drive.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    #[cfg_attr(feature = "defmt", derive(defmt::Format))]
    #[repr(u8)]
    #[non_exhaustive]
    pub enum State {
        /// Waiting for the first measurements and for the configuration's check.
        Init => "init",
        /// Sensors, gate drivers, link and configuration are looked at, gates off, contactors open.
        SelfTest => "self_test",
        /// Healthy, contactors open, gates off. A link that is alive without them may be used at once.
        Ready => "ready",
        /// The link is being charged through the precharge resistor, or the main contactor is closing.
        Precharge => "precharge",
        /// The link is alive, the main contactor closed, gates off.
        Charged => "charged",
        /// Gates pulse, no torque is asked for.
        Enabled => "enabled",
        /// Gates pulse, torque as demanded.
        Running => "running",
        /// Enabled, but the gates are off: the machine turns freely and will be caught.
        Coasting => "coasting",
        /// Torque is ramped to zero, then the gates go off.
        Stopping => "stopping",
        /// Contactors open, then the link's energy goes into the discharge resistor.
        Discharge => "discharge",
        /// Gates off or active short circuit, contactors open, until acknowledged.
        Fault => "fault",
    }
}

impl State {
    /// Its code, its place in [`Self::ALL`].
    pub const fn code(self) -> u8 {
        self as u8
    }

    /// The one with this code; `None` for an unknown number.
    pub fn from_code(code: u32) -> Option<Self> {
        Self::ALL.get(code as usize).copied()
    }
}

named! {
    /// The reason why a command was not followed.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    #[cfg_attr(feature = "defmt", derive(defmt::Format))]
    #[repr(u8)]
    #[non_exhaustive]
    pub enum Refusal {
        /// The self-test has not been passed.
        NotReady => "not_ready",
        /// The drive is in fault: acknowledge first.
        FaultNotAcknowledged => "fault_not_acknowledged",
        /// The fault's cause is still there.
        CauseStillPresent => "cause_still_present",
        /// There is no fault to acknowledge.
        NoFault => "no_fault",
        /// The link's voltage is below what operation needs, or it is still being charged.
        LinkNotCharged => "link_not_charged",
        /// The link is charged already, or is being charged.
        AlreadyCharged => "already_charged",
        /// A torque is demanded at the enabling edge, and it does not say that it may be.
        TorqueNotZero => "torque_not_zero",
        /// Parameters are being written.
        ParametersOpen => "parameters_open",
        /// The enable input is low.
        EnableInputLow => "enable_input_low",
        /// `off` is asked for.
        OffRequested => "off_requested",
        /// The rotor's angle or speed is not known yet.
        PositionUnknown => "position_unknown",
        /// Gates pulse, or the drive is on its way to a stop: stop first.
        NotStopped => "not_stopped",
        /// The link is being discharged.
        Discharging => "discharging",
        /// The machine turns so fast that its EMF would charge the link again.
        MachineTurning => "machine_turning",
        /// This drive has no contactors on its link.
        NoContactors => "no_contactors",
        /// A value of the request is not a finite number; its torque counts as zero, and its previous limits remain.
        RequestNotFinite => "request_not_finite",
        /// A limit lies outside the machine's ratings; the previous limits remain in force.
        LimitOutOfRange => "limit_out_of_range",
        /// The zero of the position sensor cannot be calibrated: the gates do not pulse, or the drive is about to stop.
        NotEnabled => "not_enabled",
    }
}

impl Refusal {
    /// Its code, its place in [`Self::ALL`].
    pub const fn code(self) -> u8 {
        self as u8
    }

    /// The one with this code; `None` for an unknown number.
    pub fn from_code(code: u32) -> Option<Self> {
        Self::ALL.get(code as usize).copied()
    }
}

/// The contactors and the resistors on the link.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Switches {
    /// Precharge relay closed.
    pub precharge: bool,
    /// Main contactor closed.
    pub main: bool,
    /// Discharge resistor on the link.
    pub discharge: bool,
    /// Braking chopper's duty, 0 ..= 1.
    pub chopper: f32,
}

/// The operator's status after each step.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Status<T = f32> {
    /// The state.
    pub state: State,
    /// The fault that is not acknowledged yet.
    pub trip: Option<Trip>,
    /// The newest refusal; it stays until a command is followed.
    pub refusal: Option<Refusal>,
    /// Commands refused so far; wraps.
    pub refusals: u32,
    /// Torque demand after limits, slew and jerk, in N·m; of the ZS9 each motor's demand.
    pub torque_nm: T,
    /// The contactors and resistors that are switched.
    pub switches: Switches,
    /// The temperatures, if the settings contain their sensors. They are not among the status's words; the protocol sends them.
    pub temperatures: Option<Temperatures>,
}

const NONE: u8 = 0xFF;

/// The status of the ZS9's operator.
pub type DualStatus = Status<[MotorDemand; 2]>;

/// The demands of a status, as two words.
pub trait DemandWords: Copy {
    /// As words.
    fn to_words(self) -> [u32; 2];
    /// The inverse.
    fn from_words(words: [u32; 2]) -> Self;
}

impl DemandWords for f32 {
    #[inline]
    fn to_words(self) -> [u32; 2] {
        [self.to_bits(), 0]
    }

    #[inline]
    fn from_words([torque, _]: [u32; 2]) -> Self {
        Self::from_bits(torque)
    }
}

/// Bits in the first word's lowest place that give the kind of the demands: the last bit of a mantissa does not matter to a demand.
impl DemandWords for [MotorDemand; 2] {
    fn to_words(self) -> [u32; 2] {
        self.map(|demand| match demand {
            MotorDemand::Torque(demand) => demand.torque_nm.to_bits() & !1,
            MotorDemand::Speed(speed) => speed.to_bits() | 1,
        })
    }

    fn from_words(words: [u32; 2]) -> Self {
        words.map(|word| match word & 1 {
            0 => MotorDemand::Torque(Demand { torque_nm: f32::from_bits(word), slew_limited: true }),
            _ => MotorDemand::Speed(f32::from_bits(word & !1)),
        })
    }
}

impl<T: DemandWords> Status<T> {
    /// As nine words.
    pub fn to_words(&self) -> [u32; 9] {
        let Self { state, trip, refusal, refusals, torque_nm, switches, temperatures: _ } = *self;
        let Switches { precharge, main, discharge, chopper } = switches;
        let flags = bits([precharge, main, discharge]) as u8;
        let [fault, value, limit, at] = trip_to_words(trip);
        let codes = u32::from_le_bytes([state.code(), refusal.map_or(NONE, Refusal::code), flags, 0]);
        let [first, second] = torque_nm.to_words();
        [codes, refusals, first, second, chopper.to_bits(), fault, value, limit, at]
    }

    /// The inverse of [`Self::to_words`]; `None` for words that are not ours.
    pub fn from_words(words: [u32; 9]) -> Option<Self> {
        let [codes, refusals, first, second, chopper, trip @ ..] = words;
        let [state, refusal, flags, _] = codes.to_le_bytes();
        let refusal = match refusal {
            NONE => None,
            code => Some(Refusal::from_code(code.into())?),
        };
        let flag = |bit: u32| flags >> bit & 1 != 0;
        Some(Self {
            state: State::from_code(state.into())?,
            trip: trip_from_words(trip),
            refusal,
            refusals,
            torque_nm: T::from_words([first, second]),
            switches: Switches {
                precharge: flag(0),
                main: flag(1),
                discharge: flag(2),
                chopper: f32::from_bits(chopper),
            },
            temperatures: None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protection::{Fault, SafeState};
    use crate::time::Instant;

    #[test]
    fn a_status_survives_as_words() {
        let trip = Trip {
            fault: Fault::Contactor,
            value: 1.0,
            limit: 0.0,
            at: Instant(7),
            safe: SafeState::GatesOff,
        };
        for (state, refusal, trip) in
            [(State::Init, None, None), (State::Fault, Some(Refusal::LimitOutOfRange), Some(trip))]
        {
            for switches in [
                Switches { precharge: true, ..Switches::default() },
                Switches { main: true, chopper: 0.25, ..Switches::default() },
                Switches { discharge: true, ..Switches::default() },
            ] {
                let temperatures = None;
                let status =
                    Status { state, trip, refusal, refusals: 3, torque_nm: -20.0, switches, temperatures };
                assert_eq!(Status::from_words(status.to_words()), Some(status));
                let torque_nm = [
                    MotorDemand::Torque(Demand { torque_nm: -20.0, slew_limited: true }),
                    MotorDemand::Speed(104.5),
                ];
                let status =
                    DualStatus { state, trip, refusal, refusals: 3, torque_nm, switches, temperatures };
                assert_eq!(Status::from_words(status.to_words()), Some(status));
            }
        }
        assert_eq!(Status::<f32>::from_words([0xFE; 9]), None);
    }

    /// The kind of a demand replaces the last bit of a mantissa, whether that bit is set or not.
    #[test]
    fn a_demand_keeps_its_kind_whatever_its_last_bit_is() {
        let even = 0x42D1_0000;
        for bits in [even, even | 1] {
            let torque = |bits| Demand { torque_nm: f32::from_bits(bits), slew_limited: true };
            let demands = [MotorDemand::Torque(torque(bits)), MotorDemand::Speed(f32::from_bits(bits))];
            let kept = [MotorDemand::Torque(torque(even)), MotorDemand::Speed(f32::from_bits(even))];
            assert_eq!(<[MotorDemand; 2]>::from_words(demands.to_words()), kept);
        }
    }
}
